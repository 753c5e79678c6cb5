"""The profile of what was corrected: its names, and the part of the movie that was tracked."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.errors import TooFewError
from vibrissa.quantities.identity import SURE
from vibrissa.video.correct.opening import OpenedTracks, calibration_of, kept_whiskers
from vibrissa.video.linked.linked_profile import profile_from_linking
from vibrissa.video.profile.missing_frames import without_frames

if TYPE_CHECKING:
    import xarray as xr

# attributes of the profile before
KEPT = (
    "tracking", "segments", "background", "polarity", "region", "drop_frames", "marks", "movie", "movie_frames",
    "movie_remarks",
)  # fmt: skip


def corrected_profile(opened: OpenedTracks) -> xr.Dataset:
    """Profile of the whiskers after all edits, nodes as far apart as before.

    Parameters
    ----------
    opened : OpenedTracks
        With its edits.

    Returns
    -------
    Dataset
        ``profile``, with the number of ``edits`` as an attribute.

    Raises
    ------
    InputError
        If no whisker is left in the frames that were tracked.
    """
    before, correction = opened.profile, opened.correction
    spacing = np.diff(before.arc_length.values, axis=-1)
    kept: dict[str, Any] = {name: before.attrs[name] for name in KEPT if name in before.attrs}
    profile = profile_from_linking(
        correction.renamed(),
        calibration_of(before, "profile"),
        source=opened.movie.name,
        node_spacing=float(np.nanmedian(spacing)) if np.isfinite(spacing).any() else None,
        least_probability=float(before.attrs.get("least_probability", SURE)),
        first=kept_whiskers(before, opened.numbers),
        attrs=kept | {"source": opened.movie.name, "edits": len(correction.edits)},
    )
    if "movie_remarks" in before.attrs:
        of_movie = json.loads(before.attrs["movie_remarks"])
        lines = [*json.loads(profile.attrs.get("remarks", "[]")), *of_movie]
        profile.attrs["remarks"] = json.dumps(lines, ensure_ascii=False)
    if "names" in before.attrs or correction.labels:
        profile.attrs["names"] = json.dumps(_names(opened, profile), ensure_ascii=False)
    if "first_frame" in before.attrs:
        profile = _part(profile, *(int(before.attrs[name]) for name in ("first_frame", "last_frame")))
    return profile if opened.missing is None else without_frames(profile, opened.missing)


def _names(opened: OpenedTracks, profile: xr.Dataset) -> list[str]:
    """Names of the whiskers of a profile: those that marks or edits gave, the others by their number."""
    given = opened.correction.labels
    return [given.get(n, f"whisker {k}") for k, n in enumerate(json.loads(profile.attrs["identities"]))]


def _part(profile: xr.Dataset, first: int, last: int) -> xr.Dataset:
    """A profile of some of its frames; runs of ``lost`` count from the first of these."""
    part = profile.isel(time=slice(first, last + 1))
    if not np.isfinite(part.x.values).any():
        rule = f"must show whiskers in frames {first} to {last}, which were tracked"
        raise TooFewError(profile.attrs["source"], rule, "none found", "give the lines of these frames")
    lost = [
        [[max(a, first) - first, min(b, last) - first, why] for a, b, why in runs if a <= last and b >= first]
        for runs in json.loads(profile.attrs["lost"])
    ]
    return part.assign_attrs(lost=json.dumps(lost), first_frame=first, last_frame=last)
