"""Curves traced by other programs, read at nodes of fixed arc length: the profile they amount to."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.quantities import dataset
from vibrissa.video.centreline import SMOOTH, local_quadratic
from vibrissa.video.tracking import SPACING, Calibration

if TYPE_CHECKING:
    import xarray as xr

Values = NDArray[np.float64]

GAP = 1.75  # steps over the median one beyond which points are missing in between
LONGEST = 1e4  # [px] no curve in a frame is longer
TOUCH = 0.02  # [px] nodes so little beyond an end still take it
EMPTY = 300  # values of the profile per point of the file above which a frame's number cannot be right


class Trace(NamedTuple):
    """A whisker in one frame: its frame, its place among the whiskers, its points from the base on, its base [px]."""

    frame: int
    whisker: int
    x: Values
    y: Values
    base: tuple[float, float]


def profile_of(
    source: str,
    traces: Sequence[Trace],
    frames: int,
    calibration: Calibration,
    *,
    node_spacing: float | None,
    skin: Sequence[tuple[float, float]] | None,
    attrs: Mapping[str, Any],
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
        What else the attributes say.

    Returns
    -------
    Dataset
        ``profile`` without ``y_sd``: other programs do not tell it.

    Raises
    ------
    InputError
        If there are no traces, one is a single place or too long, or frames are almost all empty.
    """
    spacing = SPACING if node_spacing is None else node_spacing / calibration.pixel_size
    if not spacing > 0:
        raise InputError("node_spacing", "must be positive", node_spacing)
    count = 1 + max((trace.whisker for trace in traces), default=-1)
    if not count:
        raise InputError(source, "must hold at least one trace")
    if skin is not None and len(skin) != count:
        raise InputError("skin", f"must have one point for each of the {count} whiskers", len(skin))
    origins = _median_bases(traces, count) if skin is None else np.array(skin, float)
    curves = [_measured(source, trace, origins[trace.whisker]) for trace in traces]
    reach = [
        max(curve[3][-1] for curve, one in zip(curves, traces, strict=True) if one.whisker == w) for w in range(count)
    ]
    nodes = np.maximum((np.array(reach) + TOUCH) // spacing + 1, 0).astype(int)
    _refuse_empty(source, count * frames * int(nodes.max()), sum(trace.x.size for trace in traces))
    x, y = np.full((2, count, frames, int(nodes.max())), np.nan)
    for (line_x, line_y, _, arc), trace in zip(curves, traces, strict=True):
        place = trace.whisker, trace.frame
        x[place], y[place] = at_arc(line_x, line_y, arc, np.arange(x.shape[2]) * spacing, TOUCH)
    arc = np.where(np.arange(x.shape[2]) < nodes[:, None], np.arange(x.shape[2]) * spacing, np.nan)
    told = {"arc_length_from": "median base of the traces" if skin is None else "skin", **attrs}
    return labelled(x, y, arc, calibration, told)


def _median_bases(traces: Sequence[Trace], count: int) -> Values:
    """Median base of each whisker (count, 2) [px]."""
    ends: list[list[tuple[float, float]]] = [[] for _ in range(count)]
    for trace in traces:
        ends[trace.whisker].append(trace.base)
    return np.array([np.median(one, axis=0) for one in ends])


def _measured(source: str, trace: Trace, origin: Values) -> tuple[Values, Values, Values, Values]:
    """Points with NaN where some are missing, steps between them and arc length from the origin [px]."""
    step = np.hypot(np.diff(trace.x), np.diff(trace.y))
    if step.size < 1 or not step.sum() > 0 or step.sum() > LONGEST:
        rule = f"must be a line of at most {LONGEST:g} px"
        raise InputError(f"{source}, frame {trace.frame}", rule, f"{step.size + 1} points over {step.sum():g} px")
    usual = float(np.median(step[step > 0]))
    missing = np.where(step > GAP * usual, np.rint(step / max(usual, 0.25)) - 1, 0).astype(int)
    at = np.arange(trace.x.size) + np.concatenate([[0], np.cumsum(np.maximum(missing, 0))])
    x, y = np.full((2, int(at[-1]) + 1), np.nan)
    x[at], y[at] = trace.x, trace.y
    return (
        x,
        y,
        step,
        arc_from(x, y, float(origin[0]), float(origin[1]), round(SMOOTH / usual) if usual < SMOOTH else 0),
    )


def _refuse_empty(source: str, values: int, points: int) -> None:
    if values > EMPTY * points + 10_000_000:
        raise InputError(source, "must hold traces in more of its frames", remedy="a frame's number may be damaged")


def labelled(x: Values, y: Values, arc: Values, calibration: Calibration, attrs: Mapping[str, Any]) -> xr.Dataset:
    """Profile of x, y (whisker, time, node) and arc length (whisker, node) [px], with the frames lost."""
    size = calibration.pixel_size
    told = {"frame": "image", "frame_rate": calibration.frame_rate, "pixel_size": size, **attrs}
    return dataset(
        {**told, "lost": json.dumps([_runs(np.isnan(one).all(axis=1)) for one in x])},
        lead=("whisker",),
        whisker=np.arange(x.shape[0]),
        time=np.arange(x.shape[1]) / calibration.frame_rate,
        node=np.arange(x.shape[2]),
        x=x * size,
        y=y * size,
        arc_length=arc * size,
    )


def _runs(lost: NDArray[np.bool_]) -> list[list[Any]]:
    edges = np.flatnonzero(np.diff(lost, prepend=False, append=False))
    return [[int(a), int(b) - 1, "not in the file"] for a, b in edges.reshape(-1, 2)]


@njit(cache=True)
def _course(values, reach):  # type: ignore[no-untyped-def]
    """Smooth course of points, the points where no quadratic can be fitted, straight where they are missing."""
    places = np.arange(values.size)
    course = values
    if reach >= 2:
        smooth, _ = local_quadratic(values, reach)
        course = np.where(np.isfinite(smooth), smooth, values)
    known = np.flatnonzero(np.isfinite(course))
    return np.interp(places, known, course[known])


@njit(cache=True)
def arc_from(x, y, origin_x, origin_y, reach):  # type: ignore[no-untyped-def]
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
def at_arc(x, y, arc, places, touch):  # type: ignore[no-untyped-def]
    """Places at arc lengths along a line [px]; NaN beyond its ends (by more than ``touch``) and in its gaps."""
    node_x, node_y = np.full(places.size, np.nan), np.full(places.size, np.nan)
    for i in range(places.size):
        s = places[i]
        if s < arc[0] - touch or s > arc[-1] + touch:
            continue
        place = np.interp(s, arc, np.arange(arc.size).astype(np.float64))
        j = min(int(place), arc.size - 2)
        f = place - j
        if f < 1e-9 or f > 1 - 1e-9:
            j = round(place)
            node_x[i], node_y[i] = x[j], y[j]
        else:
            node_x[i], node_y[i] = (1 - f) * x[j] + f * x[j + 1], (1 - f) * y[j] + f * y[j + 1]
    return node_x, node_y
