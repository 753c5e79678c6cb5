"""Linked lines as a profile: nodes of every whisker, how sure its name is in every frame, and why it is lost."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.errors import TooFewError
from vibrissa.quantities import dataset
from vibrissa.video.link.identities import REASONS, SURE
from vibrissa.video.link.whisker_linking import Linking
from vibrissa.video.linked.traces import Losses, Trace, profile_of
from vibrissa.video.tracking import Calibration

if TYPE_CHECKING:
    import xarray as xr


def profile_from_linking(
    linking: Linking,
    calibration: Calibration,
    *,
    source: str,
    node_spacing: float | None = None,
    skin: Sequence[tuple[float, float]] | None = None,
    least_probability: float = SURE,
    first: Sequence[int] = (),
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Profile of the whiskers that segments were linked to.

    The pieces of a whisker in a frame are joined. Lines that two whiskers share are left out for both.

    Parameters
    ----------
    linking : Linking
        Of the segments.
    calibration : Calibration
        Frame rate and pixel size.
    source : str
        Name of the movie or file, for errors.
    node_spacing, skin
        See :func:`vibrissa.video.linked.traces.profile_of`.
    least_probability : float
        Segments less probable are left out.
    first : sequence of int
        Whiskers of the linking that come first, in this order, as far as they are seen; the others follow in the order
        of their pads.
    attrs : mapping, optional
        Further attributes.

    Returns
    -------
    Dataset
        ``profile``, with ``x_sd`` and ``y_sd``, both across the line, where the segments have ``position_sd``, and with
        ``whisker_probability`` (whisker, time): that the line is that whisker's, NaN where it is lost. Attributes:
        ``identities`` (JSON), the numbers of the whiskers in the linking; ``identity_probability`` (JSON), the mean
        probability of each; ``lost`` with the reasons of the linking.

    Raises
    ------
    InputError
        If no whisker has a line, or as :func:`vibrissa.video.linked.traces.profile_of`.
    """
    identity, frames = linking.identity(), linking.pieces.frames
    whisker, sure = identity.segment_whisker.values, identity.segment_probability.values
    use = (whisker >= 0) & (sure >= least_probability) & (identity.segment_other.values < 0)
    found = np.unique(whisker[use])
    if not found.size:
        raise TooFewError(source, "must show whiskers that can be linked over its frames", "none found")
    front = [one for one in first if one in found]
    kept = [*front, *np.setdiff1d(found, front).tolist()]
    place = np.full(linking.whiskers, -1)
    place[kept] = np.arange(len(kept))
    traces = [_trace(linking, group, int(place[whisker[group[0]]])) for group in _by_frame(linking, whisker, use)]
    noted = {
        "identity_from": "link",
        "identities": json.dumps(kept),
        "identity_probability": json.dumps(np.round(identity.identity_probability.values[kept], 4).tolist()),
    }
    losses = Losses(identity.lost_reason.values[kept].astype(np.int8), REASONS)
    profile = profile_of(
        source,
        traces,
        frames,
        calibration,
        node_spacing=node_spacing,
        skin=skin,
        attrs={**(attrs or {}), **noted},
        losses=losses,
    )
    seen = np.isfinite(profile.x.values).any(axis=2)
    chance = np.where(seen, identity.whisker_probability.values[kept], np.nan)
    named = {"whisker": profile.whisker.values, "time": profile.time.values}
    return profile.merge(dataset(**named, whisker_probability=chance), combine_attrs="override")


def _by_frame(linking: Linking, whisker: Integers, use: np.ndarray) -> list[Integers]:
    """Segments that are used, in groups of one whisker in one frame, from the base on."""
    order = np.lexsort((linking.lines.reach[:, 0], linking.pieces.frame, whisker))
    order = order[use[order]]
    key = whisker[order] * linking.pieces.frames + linking.pieces.frame[order]
    return np.split(order, np.flatnonzero(np.diff(key)) + 1)


def _trace(linking: Linking, group: Integers, whisker: int) -> Trace:
    """Pieces of one whisker in one frame, from the base on."""
    pieces, parts = linking.pieces, []
    for s in group:
        points = np.arange(pieces.start[s], pieces.stop[s])
        parts.append(points[::-1] if linking.lines.turned[s] else points)
    points = np.concatenate(parts)
    x, y, sd = pieces.column[points], pieces.row[points], pieces.sd[points]
    known = sd if np.isfinite(pieces.sd).any() else None
    return Trace(int(pieces.frame[group[0]]), whisker, x, y, (float(x[0]), float(y[0])), known)
