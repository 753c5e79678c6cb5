"""From WHISK's segments to the profile of whiskers, and back: who is who, where the follicle is."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import FormatError, MissingError, RangeError, TooFewError, UnknownError
from vibrissa.files import written_whole
from vibrissa.quantities import require
from vibrissa.signals.frame_numbers import frame_numbers
from vibrissa.video.foreign.whisk_files import (
    FURTHEST,
    Segment,
    Table,
    Values,
    measured,
    packed_measurements,
    packed_whiskers,
)
from vibrissa.video.linked.traces import Trace, profile_of
from vibrissa.video.tracking import Calibration

if TYPE_CHECKING:
    import xarray as xr

Identity = Literal["measured", "number", "longest"]
Side = Literal["left", "right", "top", "bottom"]
SIDES: dict[str, tuple[int, int]] = {"left": (0, 1), "right": (0, -1), "top": (1, 1), "bottom": (1, -1)}
CLASSIFY = (
    "have lines linked to whiskers (`identity='link'`), classify them (WHISK's classify and reclassify), or choose "
    "identity 'number' or 'longest'"
)


class KnownSegment(NamedTuple):
    """What is known of a segment beside its points: who it is (−1: nobody) and its follicle end [px]."""

    identity: int
    follicle: tuple[float, float]


def known_of(table: Table) -> dict[tuple[int, int], KnownSegment]:
    """Identity and follicle of each segment in the measurements, by frame and number.

    Parameters
    ----------
    table : structured array
        From :func:`vibrissa.video.foreign.whisk_files.read_measurements`.

    Returns
    -------
    dict
        :class:`KnownSegment` by (frame, wid).
    """
    keys = zip(table["frame"].tolist(), table["wid"].tolist(), strict=True)
    rows = zip(table["identity"].tolist(), table["data"][:, 4:6].tolist(), strict=True)
    return {key: KnownSegment(who, (place[0], place[1])) for key, (who, place) in zip(keys, rows, strict=True)}


def profile_from_whisk(
    segments: Sequence[Segment],
    known: Mapping[tuple[int, int], KnownSegment] | None = None,
    *,
    calibration: Calibration,
    identity: Identity = "measured",
    whiskers: Sequence[int] | None = None,
    node_spacing: float | None = None,
    skin: Sequence[tuple[float, float]] | None = None,
    base: Side | None = None,
    source: str = "the traces",
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Profile of the whiskers among WHISK's segments.

    Parameters
    ----------
    segments : sequence of Segment
        From :func:`vibrissa.video.foreign.whisk_files.read_whiskers`.
    known : mapping, optional
        Identity and follicle end of each segment by (frame, wid), see :func:`known_of`.
    calibration : Calibration
        Frame rate and pixel size; WHISK's files know neither.
    identity : {"measured", "number", "longest"}
        Who a segment is: what ``known`` says; its number ``wid`` in the frame; or the one whisker, if it is the
        longest curve of its frame.
    whiskers : sequence of int, optional
        Identities wanted, in the order of the profile; default all from 0 on, ascending.
    node_spacing, skin
        See :func:`vibrissa.video.linked.traces.profile_of`.
    base : {"left", "right", "top", "bottom"}, optional
        Side of the image towards which the base ends lie; default: the end next to the measured follicle.
    source : str
        Name of the file, for errors.
    attrs : mapping, optional
        Further attributes.

    Returns
    -------
    Dataset
        See :func:`vibrissa.video.linked.traces.profile_of`. Attributes ``identity_from`` and ``identities`` (JSON).

    Raises
    ------
    InputError
        If there is neither ``base`` nor a measured follicle, an identity is missing, or two segments of a frame have
        the same.
    """
    if base is not None and base not in SIDES:
        raise UnknownError("base", f"must be one of {', '.join(SIDES)}", repr(base))
    found = _identified(source, segments, known, identity)
    wanted = sorted(set(found) - {-1}) if whiskers is None else list(whiskers)
    if not wanted:
        raise MissingError(source, "must identify segments", "none identified", CLASSIFY)
    if missing := [who for who in wanted if who not in found]:
        raise UnknownError("whiskers", f"must be among the identities {sorted(set(found) - {-1})}", missing)
    traces = []
    for index, who in enumerate(wanted):
        mine = found[who]
        _refuse_doubles(source, mine, who)
        traces += [_from_base(source, one, known, base, index) for one in mine]
    return profile_of(
        source,
        traces,
        1 + max(one.frame for one in segments),
        calibration,
        node_spacing=node_spacing,
        skin=skin,
        attrs={**(attrs or {}), "identity_from": identity, "identities": json.dumps([int(who) for who in wanted])},
    )


def _identified(
    source: str, segments: Sequence[Segment], known: Mapping[tuple[int, int], KnownSegment] | None, identity: Identity
) -> dict[int, list[Segment]]:
    """Segments by their whisker."""
    if identity == "longest":
        return {0: _longest(segments)} if segments else {}
    if identity not in ("measured", "number"):
        raise UnknownError("identity", "must be 'measured', 'number' or 'longest'", repr(identity))
    if identity == "measured" and known is None:
        raise MissingError(source, "must have measurements that identify its segments", remedy=CLASSIFY)
    found: dict[int, list[Segment]] = {}
    for one in segments:
        who = one.wid if known is None or identity == "number" else _of(source, known, one).identity
        found.setdefault(who if who >= 0 else -1, []).append(one)
    return found


def _of(source: str, known: Mapping[tuple[int, int], KnownSegment], one: Segment) -> KnownSegment:
    thing = f"segment {one.wid} in frame {one.frame} of {source}"
    found = known.get((one.frame, one.wid))
    if found is None:
        remedy = "measure the traces again, or give the measurements of these"
        raise MissingError(thing, "must be measured", remedy=remedy)
    if not np.hypot(*found.follicle) < 2 * FURTHEST:
        raise RangeError(thing, "must have its follicle at pixels", found.follicle, "give the base's side instead")
    return found


def _longest(segments: Sequence[Segment]) -> list[Segment]:
    """Longest curve of each frame."""
    frames: dict[int, list[Segment]] = {}
    for one in segments:
        frames.setdefault(one.frame, []).append(one)
    return [max(found, key=_length) for found in frames.values()]


def _length(one: Segment) -> float:
    return float(np.hypot(np.diff(one.x), np.diff(one.y)).sum())


def _refuse_doubles(source: str, segments: Sequence[Segment], who: int) -> None:
    frames, counts = np.unique([one.frame for one in segments], return_counts=True)
    if np.any(counts > 1):
        where = f"{counts.max()} in frame {frames[np.argmax(counts)]}"
        raise FormatError(source, f"must have whisker {who} once in a frame", where, CLASSIFY)


def _from_base(
    source: str, one: Segment, known: Mapping[tuple[int, int], KnownSegment] | None, base: Side | None, whisker: int
) -> Trace:
    """Points in order from the base."""
    follicle = None
    if base is not None:
        axis, sign = SIDES[base]
        along = (one.x, one.y)[axis]
        turned = bool(sign * (along[-1] - along[0]) < 0)
    elif known is not None:
        follicle = _of(source, known, one).follicle
        off = np.hypot(one.x[[0, -1]] - follicle[0], one.y[[0, -1]] - follicle[1])
        turned = bool(off[1] < off[0])
    else:
        rule = "must be given where nothing measures the follicle"
        raise MissingError("base", rule, remedy=f"one of {', '.join(SIDES)}")
    x, y = (values[::-1].copy() if turned else values for values in (one.x, one.y))
    return Trace(one.frame, whisker, x, y, follicle or (x[0], y[0]))


def write_whiskers(profile: xr.Dataset, path: str | Path) -> Path:
    """Write a profile for WHISK: ``.whiskers`` (bwhiskbin1) and ``.measurements`` (measv3) beside it, both or none.

    A segment is a whisker in one frame, its points the nodes with a measured position from the base on, in pixels
    and single precision; nodes not measured (NaN, or straight between skin and base end) are left out, so a gap
    within a whisker is a longer step. Frames with fewer than two such nodes have no segment; their
    numbers are those of the movie, also of a part of it. ``wid`` and identity are
    the whisker's place in the profile. Thickness, score, angle and curvature are NaN: not measured. The follicle is
    where arc length starts: node 0, or the line carried straight on from its first two nodes; the tip is the last
    measured node.

    Parameters
    ----------
    profile : Dataset
        ``x``, ``y`` (whisker, time, node) or (time, node) in the frame of the image, with ``pixel_size``.
    path : path
        File to write, ``.whiskers``.

    Returns
    -------
    Path
        The file of measurements.

    Raises
    ------
    InputError
        If the profile is not of an image, has no measured line, its times give no numbers of frames, or the files
        cannot be written.
    """
    path = Path(path)
    if path.suffix != ".whiskers":
        raise FormatError(str(path), "must end in .whiskers")
    require(profile, "x", "y", "arc_length")
    if profile.attrs.get("frame") != "image" or "pixel_size" not in profile.attrs:
        rule = "must be of an image, with its pixel_size"
        raise MissingError("profile", rule, remedy="give one of vibrissa track")
    segments, starts = _segments(profile)
    if not segments:
        raise TooFewError("profile", "must have a whisker with two measured nodes in a frame")
    beside = path.with_suffix(".measurements")
    with written_whole(path) as traces, written_whole(beside) as measures:
        traces.write_bytes(packed_whiskers(segments))
        measures.write_bytes(packed_measurements(_measures(segments, starts)))
    return beside


def _segments(profile: xr.Dataset) -> tuple[list[Segment], Values]:
    """Segments in the order of frames, and where each whisker starts there (S, 2) [px]."""
    size = profile.attrs["pixel_size"]
    x, y = (_by_whisker(profile, name) / size for name in ("x", "y"))
    placed = np.isfinite(x) & np.isfinite(y)
    sds = [np.isfinite(_by_whisker(profile, name)) for name in ("x_sd", "y_sd") if name in profile]
    seen = placed & np.any(sds, axis=0) if sds else placed
    arc = np.broadcast_to(profile.arc_length.values / size, (x.shape[0], x.shape[2]))
    segments, starts, numbers = [], [], _numbers(profile)
    for frame, w in np.argwhere((seen.sum(axis=2) >= 2).T).tolist():
        at = seen[w, frame]
        unknown = np.full(at.sum(), np.nan)
        segments.append(Segment(numbers[frame], w, x[w, frame, at], y[w, frame, at], unknown, unknown))
        starts.append(_origin(x[w, frame], y[w, frame], arc[w]))
    return segments, np.array(starts)


def _numbers(profile: xr.Dataset) -> list[int]:
    """Numbers of the frames, as far as files of WHISK can hold them."""
    with np.errstate(invalid="ignore"):  # of a rate that is NaN
        numbers = frame_numbers(profile)
    if (numbers < 0).any() or (numbers >= 2**31).any() or (np.diff(numbers) <= 0).any():
        time, rate = profile.time.values, profile.attrs.get("frame_rate")
        found = f"{time[0]:g} to {time[-1]:g} s{'' if rate is None else f' at {rate:g} frames/s'}"
        remedy = "count time from the movie's first frame, with its frame_rate"
        rule = f"must give each frame a number of its own, rising, from 0 to {2**31 - 1}"
        raise RangeError("profile.time", rule, found, remedy)
    return list(numbers.tolist())


def _origin(x: Values, y: Values, arc: Values) -> tuple[float, float]:
    """Where arc length starts on a line (N,) of which two nodes have a position [px]."""
    first, second = np.flatnonzero(np.isfinite(x) & np.isfinite(y))[:2]
    back = arc[first] / max(np.hypot(x[second] - x[first], y[second] - y[first]), 1e-9)
    return x[first] - back * (x[second] - x[first]), y[first] - back * (y[second] - y[first])


def _by_whisker(profile: xr.Dataset, name: str) -> Values:
    """Values of a variable as (whisker, time, node)."""
    values = profile[name] if "whisker" in profile[name].dims else profile[name].expand_dims("whisker")
    array: Array = values.transpose("whisker", "time", "node").values
    return array


def _measures(segments: Sequence[Segment], starts: Values) -> Table:
    """Measurements of segments that start at the skin (S, 2) [px]."""
    data = np.full((len(segments), 8), np.nan)
    data[:, 0] = [_length(one) for one in segments]
    data[:, 4:6] = starts
    data[:, 6:] = [(one.x[-1], one.y[-1]) for one in segments]
    x, y = np.median(data[:, 6:] - starts, axis=0)
    face = np.rint(np.median(starts, axis=0)).astype(int)
    keys = np.array([(one.frame, one.wid, one.wid) for one in segments])
    return measured(keys, data, (int(face[0]), int(face[1])), b"y" if abs(x) > abs(y) else b"x")
