"""Curves of whiskers, point by point, read at nodes of fixed arc length: the profile they amount to."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import RangeError, ShapeError, TooFewError
from vibrissa.loops import njit
from vibrissa.video.kernel.local_quadratic import SMOOTH, local_quadratic
from vibrissa.video.tracking import SPACING, Calibration, labelled, lost_frames

if TYPE_CHECKING:
    import xarray as xr

Values = NDArray[np.float64]

GAP = 1.75  # steps over the median one beyond which points are missing in between
LONGEST = 1e4  # [px] no curve in a frame is longer
TOUCH = 0.02  # [px] nodes so little beyond an end still take it
ALIKE = 0.27  # correlation of the errors of two points of a line that are a pixel apart
EMPTY = 300  # values of the profile per point of the file above which a frame's number cannot be right


class Trace(NamedTuple):
    """A whisker in one frame.

    Attributes
    ----------
    frame, whisker : int
        The frame, and its place among the whiskers.
    x, y : (n,) arrays
        Its points from the base on [px].
    base : (float, float)
        Its base [px].
    sd : (n,) array, optional
        Standard deviation of the points across the line [px].
    """

    frame: int
    whisker: int
    x: Values
    y: Values
    base: tuple[float, float]
    sd: Values | None = None


class Losses(NamedTuple):
    """Why whiskers are lost: for each (whisker, frame) the place of the reason among ``reasons``, the first of none."""

    code: NDArray[np.int8]
    reasons: tuple[str, ...]


NOWHERE = "its line has no node"  # where arc length cannot be counted to it


def profile_of(
    source: str,
    traces: Sequence[Trace],
    frames: int,
    calibration: Calibration,
    *,
    node_spacing: float | None,
    skin: Sequence[tuple[float, float]] | None,
    attrs: Mapping[str, Any],
    losses: Losses | None = None,
) -> xr.Dataset:
    """Profile of whiskers traced point by point.

    Arc length is measured along a local quadratic over 31 pixels and starts, in all frames alike, where the line
    (carried straight on where it begins later) is nearest to the skin point, or to the median of its bases.
    Nodes take the points as traced, straight in between; they are NaN where points are missing, that is where a step
    exceeds 1.75 times the curve's median step, and before the first and after the last point.

    Parameters
    ----------
    source : str
        Name of the file, for errors.
    traces : sequence of Trace
        One per whisker and frame at most.
    frames : int
        Frames of the movie; those without a trace are NaN.
    calibration : Calibration
        Frame rate and pixel size.
    node_spacing : float or None
        Arc length between nodes [m]; 5 pixels if None.
    skin : sequence of (column, row) or None
        Where each whisker leaves the skin [px].
    attrs : mapping
        Further attributes.
    losses : Losses, optional
        Why whiskers have no trace; "not in the file" by default.

    Returns
    -------
    Dataset
        ``profile``. Where the traces have a standard deviation, ``x_sd`` and ``y_sd`` are both that across the line,
        whichever way it runs; else there is none, as other programs do not report it.

    Raises
    ------
    InputError
        If there are no traces, one is a single place or too long, or frames are almost all empty.
    """
    spacing = SPACING if node_spacing is None else node_spacing / calibration.pixel_size
    if not spacing > 0:
        raise RangeError("node_spacing", "must be positive", node_spacing)
    count = 1 + max((trace.whisker for trace in traces), default=-1)
    if not count:
        raise TooFewError(source, "must hold at least one trace")
    if skin is not None and len(skin) != count:
        raise ShapeError("skin", f"must have one point for each of the {count} whiskers", len(skin))
    who, bases = np.array([trace.whisker for trace in traces]), np.array([trace.base for trace in traces])
    origins = [np.median(bases[who == w], axis=0) for w in range(count)] if skin is None else np.array(skin, float)
    curves = [_measured(source, trace, origins[trace.whisker]) for trace in traces]
    reach = np.full(count, -np.inf)
    np.maximum.at(reach, who, [arc[-1] for *_, arc in curves])
    nodes = np.maximum((reach + TOUCH) // spacing + 1, 0).astype(int)
    if count * frames * int(nodes.max()) > EMPTY * sum(trace.x.size for trace in traces) + 10_000_000:
        raise TooFewError(source, "must hold traces in more of its frames", remedy="a frame's number may be damaged")
    kinds = 2 if traces[0].sd is None else 3
    read = np.full((kinds, count, frames, int(nodes.max())), np.nan)
    places: Values = np.arange(read.shape[3]) * np.float64(spacing)
    for (x, y, sd, arc), trace in zip(curves, traces, strict=True):
        read[:, trace.whisker, trace.frame] = _at_arc(x, y, sd, arc, places, TOUCH)[:kinds]
    arc = np.where(np.arange(places.size) < nodes[:, None], places, np.nan)
    start = "median base of the traces" if skin is None else "skin"
    sds = read[2] if kinds == 3 else None
    return labelled_traces(read[0], read[1], arc, calibration, {"arc_length_from": start, **attrs}, sds, losses)


def _measured(source: str, trace: Trace, origin: Values) -> tuple[Values, Values, Values, Values]:
    """Points and standard deviations with NaN where some are missing, and arc length from the origin [px]."""
    step = np.hypot(np.diff(trace.x), np.diff(trace.y))
    if step.size < 1 or not step.sum() > 0 or step.sum() > LONGEST:
        rule = f"must be a line of at most {LONGEST:g} px"
        raise RangeError(f"{source}, frame {trace.frame}", rule, f"{step.size + 1} points over {step.sum():g} px")
    usual = float(np.median(step[step > 0]))
    missing = np.where(step > GAP * usual, np.rint(step / max(usual, 0.25)) - 1, 0).astype(int)
    at = np.arange(trace.x.size) + np.concatenate([[0], np.cumsum(np.maximum(missing, 0))])
    x, y, sd = np.full((3, int(at[-1]) + 1), np.nan)
    x[at], y[at] = trace.x, trace.y
    if trace.sd is not None:
        sd[at] = trace.sd
    reach = round(SMOOTH / usual) if usual < SMOOTH else 0
    return x, y, sd, _arc_from(x, y, float(origin[0]), float(origin[1]), reach)


def labelled_traces(
    x: Values,
    y: Values,
    arc: Values,
    calibration: Calibration,
    attrs: Mapping[str, Any],
    sd: Values | None = None,
    losses: Losses | None = None,
) -> xr.Dataset:
    """Profile of x, y (whisker, time, node) and arc length (whisker, node) [px], with the frames lost.

    Parameters
    ----------
    x, y : (whisker, time, node) arrays
        Places [px]; NaN where not seen. Written over.
    arc : (whisker, node) array
        Arc length [px]. Written over.
    calibration : Calibration
        Frame rate and pixel size.
    attrs : mapping
        Further attributes.
    sd : (whisker, time, node) array, optional
        Standard deviation across the line [px]. Written over.
    losses : Losses, optional
        As of :func:`profile_of`.

    Returns
    -------
    Dataset
        ``profile`` in metres, with the attribute ``lost``.
    """
    gone = np.asarray(np.isnan(x).all(axis=2))
    known = losses or Losses(gone.astype(np.int8), ("", "not in the file"))
    code = np.where(gone & (known.code == 0), len(known.reasons), np.where(gone, known.code, 0)).astype(np.int8)
    lost = lost_frames(code, (*known.reasons, NOWHERE))
    sds = {} if sd is None else {"x_sd": sd.copy(), "y_sd": sd}
    return labelled({**attrs, "lost": json.dumps(lost)}, calibration, x=x, y=y, arc_length=arc, **sds)


@njit(cache=True)
def _course(values: Values, reach: int) -> Values:
    """Smooth course of points, the points where no quadratic can be fitted, straight where they are missing."""
    places = np.arange(values.size)
    course = values
    if reach >= 2:
        smooth, _ = local_quadratic(values, reach)
        course = np.where(np.isfinite(smooth), smooth, values)
    known = np.flatnonzero(np.isfinite(course))
    return np.interp(places, known, course[known])


@njit(cache=True)
def _arc_from(x: Values, y: Values, origin_x: float, origin_y: float, reach: int) -> Values:
    """Arc length of the points of a line from the place nearest to an origin [px].

    Parameters
    ----------
    x, y : (N,) arrays
        Points from the base on [px]; NaN where missing.
    origin_x, origin_y : float
        Where arc length starts. Before the first point the line is carried straight on.
    reach : int
        Points on either side in the local quadratic; none is fitted below 2.
    """
    course_x, course_y = _course(x, reach), _course(y, reach)
    n = x.size
    arc = np.zeros(n)
    for j in range(1, n):
        arc[j] = arc[j - 1] + np.hypot(course_x[j] - course_x[j - 1], course_y[j] - course_y[j - 1])
    end = min(max(reach, 1), n - 1)
    along_x, along_y = course_x[end] - course_x[0], course_y[end] - course_y[0]
    start = (origin_x - course_x[0]) * along_x + (origin_y - course_y[0]) * along_y
    if start <= 0:
        return arc - start / max(np.hypot(along_x, along_y), 1e-9)
    best, foot = np.inf, 0.0
    for j in range(n - 1):
        step_x, step_y = course_x[j + 1] - course_x[j], course_y[j + 1] - course_y[j]
        squared = step_x**2 + step_y**2
        if squared > 0:
            share = ((origin_x - course_x[j]) * step_x + (origin_y - course_y[j]) * step_y) / squared
            share = min(max(share, 0.0), 1.0)
            off = (course_x[j] + share * step_x - origin_x) ** 2 + (course_y[j] + share * step_y - origin_y) ** 2
            if off < best:
                best, foot = off, arc[j] + share * (arc[j + 1] - arc[j])
    return arc - foot


@njit(cache=True)
def _at_arc(
    x: Values, y: Values, sd: Values, arc: Values, places: Values, touch: float
) -> tuple[Values, Values, Values]:
    """Places at arc lengths along a line, and their standard deviation [px]; NaN beyond its ends and in its gaps.

    An end still has the nodes up to ``touch`` beyond it.
    """
    node_x, node_y, node_sd = np.full(places.size, np.nan), np.full(places.size, np.nan), np.full(places.size, np.nan)
    for i in range(places.size):
        s = places[i]
        if s < arc[0] - touch or s > arc[-1] + touch:
            continue
        place = np.interp(s, arc, np.arange(arc.size).astype(np.float64))
        j = min(int(place), arc.size - 2)
        f = place - j
        if f < 1e-9 or f > 1 - 1e-9:
            j = round(place)
            node_x[i], node_y[i], node_sd[i] = x[j], y[j], sd[j]
        else:
            node_x[i], node_y[i] = (1 - f) * x[j] + f * x[j + 1], (1 - f) * y[j] + f * y[j + 1]
            one, other = (1 - f) * sd[j], f * sd[j + 1]
            node_sd[i] = np.sqrt(one**2 + other**2 + 2 * ALIKE * one * other)
    return node_x, node_y, node_sd
