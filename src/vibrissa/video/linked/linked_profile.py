"""Linked lines as a profile: nodes of every whisker, how sure its name is in every frame, and why it is lost."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import ShapeError, TooFewError
from vibrissa.head_pose import HeadPose, with_head
from vibrissa.quantities import dataset
from vibrissa.quantities.identity import SURE
from vibrissa.video.link.identities import REASONS, SHARED, TORN, UNSURE
from vibrissa.video.link.pad.pieces import Pieces
from vibrissa.video.link.pad.placing import in_head
from vibrissa.video.link.whisker_linking import Linking
from vibrissa.video.linked.traces import Losses, Trace, profile_of
from vibrissa.video.tracking import Calibration

if TYPE_CHECKING:
    import xarray as xr

NO_HEAD = "the head is not known"


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
    node_spacing
        See :func:`vibrissa.video.linked.traces.profile_of`.
    skin : sequence of (column, row), optional
        Where whiskers leave the skin [px], as of :func:`skin_of`.
    least_probability : float
        Segments less probable are left out, from 0 to 1; 0.7 if not given.
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
        ``identities`` (JSON), the numbers of the whiskers in the linking; ``lost`` with its reasons; ``remarks``
        (JSON), where there are any.

    Raises
    ------
    InputError
        If no whisker has a line, or as :func:`vibrissa.video.linked.traces.profile_of`.
    """
    identity, frames = linking.identity(), linking.pieces.frames
    whisker, sure = identity.segment_whisker.values, identity.segment_probability.values
    use, head, motion = _used(linking, identity, least_probability), linking.head, linking.motion
    found = np.unique(whisker[use])
    if not found.size:
        rule = f"must show whiskers whose names are at least {least_probability:g} sure"
        raise TooFewError(source, rule, "none found", "a lower probability, marks, or a part of the image")
    front = [one for one in first if one in found]
    kept = [*front, *np.setdiff1d(found, front).tolist()]
    place = np.full(linking.whiskers, -1)
    place[kept] = np.arange(len(kept))
    pieces, groups = in_head(linking.pieces, motion), _by_frame(linking, whisker, use)
    traces = [_trace(linking, pieces, group, int(place[whisker[group[0]]])) for group in groups]
    noted = {"identity_from": "link", "identities": json.dumps(kept), "least_probability": least_probability}
    if remarks := [*_unsure(whisker, sure, kept, least_probability), *_of_the_head(head, motion)]:
        noted["remarks"] = json.dumps(remarks)
    losses = _losses(_reasons(identity, least_probability)[kept], head)
    profile = profile_of(
        source,
        traces,
        frames,
        calibration,
        node_spacing=node_spacing,
        skin=None if skin is None else skin_of(traces, len(kept), skin),
        attrs={**(attrs or {}), **noted},
        losses=losses,
    )
    if motion is not None:
        profile = _in_image(profile, motion)
    if head is not None:
        profile = with_head(profile, head)
    seen, chance = np.isfinite(profile.x.values).any(axis=2), np.full((len(kept), frames), np.nan)
    np.fmax.at(chance, (place[whisker[use]], linking.pieces.frame[use]), sure[use])
    chance[~seen] = np.nan
    named = {"whisker": profile.whisker.values, "time": profile.time.values}
    return profile.merge(dataset(**named, whisker_probability=chance), combine_attrs="override")


def whiskers_seen(linking: Linking, least_probability: float) -> Integers:
    """Whiskers of a linking that a profile has without marks, in its order.

    Parameters
    ----------
    linking : Linking
        Of the segments.
    least_probability : float
        As of :func:`profile_from_linking`.

    Returns
    -------
    (n,) array of int
        Their numbers in the linking.
    """
    identity = linking.identity()
    return np.unique(identity.segment_whisker.values[_used(linking, identity, least_probability)])


def _used(linking: Linking, identity: xr.Dataset, least: float) -> Mask:
    """Segments that a profile keeps."""
    probable = (identity.segment_whisker.values >= 0) & (identity.segment_probability.values >= least)
    use = probable & (identity.segment_other.values < 0)
    return np.asarray(use if linking.head is None else use & linking.head.known[linking.pieces.frame])


def skin_of(traces: Sequence[Trace], whiskers: int, skin: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Where each whisker begins.

    Parameters
    ----------
    traces : sequence of Trace
        Of all whiskers.
    whiskers : int
        Their number.
    skin : sequence of (column, row)
        Places at which some of them leave the skin [px].

    Returns
    -------
    list of (column, row)
        Of each whisker: its place of ``skin``, so that all are as near to the whiskers' median bases as possible; its
        median base where it has none.

    Raises
    ------
    InputError
        If there are more places than whiskers.
    """
    if len(skin) > whiskers:
        raise ShapeError("skin", f"must have one point for each of the {whiskers} whiskers at most", len(skin))
    who, bases = np.array([one.whisker for one in traces]), np.array([one.base for one in traces])
    home = np.array([np.median(bases[who == w], axis=0) for w in range(whiskers)])
    off = np.hypot(*(home[:, None] - np.array(skin, float)[None]).transpose(2, 0, 1))
    places = [(float(x), float(y)) for x, y in home]
    for w, k in zip(*linear_sum_assignment(off), strict=True):
        places[w] = (float(skin[k][0]), float(skin[k][1]))
    return places


def _reasons(identity: xr.Dataset, least: float) -> NDArray[np.int8]:
    """Why whiskers (whisker, frame) are lost; lines of two whiskers, or of less than this probability, are left out."""
    code, chance = identity.lost_reason.values.astype(np.int8), identity.whisker_probability.values
    main = identity.whisker_segment.values
    code = np.where((main >= 0) & (identity.segment_other.values[main] >= 0), SHARED, code)
    unsure = np.isin(code, (0, UNSURE, TORN)) & np.isfinite(chance)
    return np.where(unsure, np.where(chance >= least, 0, np.where(code > 0, code, UNSURE)), code).astype(np.int8)


def _losses(code: NDArray[np.int8], head: HeadPose | None) -> Losses:
    """Why whiskers (whisker, frame) are lost."""
    if head is None:
        return Losses(code, REASONS)
    return Losses(np.where(head.known, code, len(REASONS)).astype(np.int8), (*REASONS, NO_HEAD))


def _unsure(whisker: Integers, sure: Array, kept: Sequence[int], least: float) -> list[str]:
    """Say which whiskers have names, but none that is sure enough for the profile, and how sure these are."""
    missing = np.setdiff1d(whisker[whisker >= 0], kept)
    if not missing.size:
        return []
    most = ", ".join(f"{np.floor(100 * sure[whisker == one].max()) / 100:.2f}" for one in missing)
    which, its = ("whisker has", "its lines") if missing.size == 1 else ("whiskers have", "lines of each")
    low = f"{its} would be kept with a `least_probability` of {most} or less"
    wrong = "in rendered movies a third of such names is wrong"
    return [f"{missing.size} more {which} no name that is {least:g} sure: {low}; {wrong}"]


def _of_the_head(head: HeadPose | None, motion: HeadPose | None) -> list[str]:
    """Say in how many frames the head is not known, or that it moves though it is not given."""
    if head is None and motion is not None:
        far, turn = np.hypot(np.std(motion.column), np.std(motion.row)), np.std(motion.angle)
        return [
            f"the lines show that the head moves (SD {far:.0f} px) and turns (SD {turn:.0f}°): whiskers are linked in "
            "coordinates that move with it; angles are those in the image unless the head is given"
        ]
    if head is None or head.known.all():
        return []
    return [f"the head is known in {head.known.sum()} of {head.known.size} frames; in the others whiskers are lost"]


def _in_image(profile: xr.Dataset, head: HeadPose) -> xr.Dataset:
    """A profile in head coordinates in the image."""
    size, frame = float(profile.attrs["pixel_size"]), np.arange(len(head.column))[:, None]
    x, y = head.to_image(frame, profile.x.values / size, profile.y.values / size)
    return profile.assign(x=profile.x.copy(data=x * size), y=profile.y.copy(data=y * size))


def _by_frame(linking: Linking, whisker: Integers, use: np.ndarray) -> list[Integers]:
    """Segments that are used, in groups of one whisker in one frame, from the base on."""
    order = np.lexsort((linking.lines.reach[:, 0], linking.pieces.frame, whisker))
    order = order[use[order]]
    key = whisker[order] * linking.pieces.frames + linking.pieces.frame[order]
    return np.split(order, np.flatnonzero(np.diff(key)) + 1)


def _trace(linking: Linking, pieces: Pieces, group: Integers, whisker: int) -> Trace:
    """Pieces of one whisker in one frame, from the base on."""
    parts = []
    for s in group:
        points = np.arange(pieces.start[s], pieces.stop[s])
        parts.append(points[::-1] if linking.lines.turned[s] else points)
    points = np.concatenate(parts)
    x, y, sd = pieces.column[points], pieces.row[points], pieces.sd[points]
    known = sd if np.isfinite(pieces.sd).any() else None
    return Trace(int(pieces.frame[group[0]]), whisker, x, y, (float(x[0]), float(y[0])), known)
