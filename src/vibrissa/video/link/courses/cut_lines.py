"""Lines cut where they go over from one whisker to another, and pieces of one whisker put together."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.courses.course import courses_of
from vibrissa.video.link.courses.going_on import goes_on
from vibrissa.video.link.courses.whose_points import whose_points
from vibrissa.video.link.whisker_linking import Linking

if TYPE_CHECKING:
    import xarray as xr

LEAST = 10  # points of a piece of a line
CERTAIN = 0.85  # mean probability of a whisker's names from which on lines are cut by its course
BESIDE = 0.3  # share of a piece that may run beside another one of its whisker, if they are one line


class Cut(NamedTuple):
    """Lines made of parts of others.

    Attributes
    ----------
    points : (P,) array of int
        Points of all lines, one line after the other.
    first : (S,) array of int
        Place of the first point of each line there.
    source : (S,) array of int
        Segment that most of it comes from.
    """

    points: Integers
    first: Integers
    source: Integers


def cut_lines(linking: Linking) -> Cut:
    """Cut lines by the courses of linked whiskers.

    Parameters
    ----------
    linking : Linking
        The movie.

    Returns
    -------
    Cut
        Lines by frames; pieces of less than 10 points that were cut off are left out.
    """
    pieces = linking.placed
    owner, whisker = pieces.owner, _whiskers(linking)
    # runs of points of one line and one whisker
    change = (np.diff(owner) != 0) | (np.diff(whisker) != 0)
    bounds = np.concatenate([[0], np.flatnonzero(change) + 1, [owner.size]])
    runs: dict[tuple[int, int], list[Integers]] = {}
    for number, (a, b) in enumerate(pairwise(bounds)):
        name = int(whisker[a]) if whisker[a] >= 0 else -1 - number
        runs.setdefault((int(pieces.frame[owner[a]]), name), []).append(np.arange(a, b))
    where = np.stack([pieces.column, pieces.row], axis=1)
    frames = sorted(runs, key=lambda key: key[0])
    # a line that was not cut stays, however few points it has
    least = np.minimum(pieces.stop - pieces.start, LEAST)
    every = (line for key in frames for line in _together(runs[key], where))
    lines = [line for line in every if line.size and line.size >= least[owner[line[0]]]]
    sizes = [line.size for line in lines]
    source = [int(np.bincount(owner[line] - owner[line].min()).argmax() + owner[line].min()) for line in lines]
    return Cut(np.concatenate(lines), np.cumsum([0, *sizes[:-1]]), np.array(source))


def _whiskers(linking: Linking) -> Integers:
    """Whisker of each point, numbered over all pads; −1 for none."""
    pieces, out, number = linking.placed, np.full(linking.pieces.column.size, -1), 0
    for n, (pad, names) in enumerate(zip(linking.pads, linking.names(), strict=True)):
        along, across = pad.polar(pieces.column, pieces.row)
        courses = courses_of(linking.solutions[n], linking.lines, along, across, pieces.start, pieces.stop)
        named = np.isfinite(names.chance)
        certain = np.where(named, names.chance, 0).sum(axis=1) >= CERTAIN * named.sum(axis=1)
        courses = courses._replace(known=courses.known & certain[:, None])
        some = linking.lines.pad == n
        found = whose_points(courses, pad, pieces.frame, pieces.start, pieces.stop, along, across, some)
        out[found >= 0] = found[found >= 0] + number
        number += len(courses.place)
    return out


def _together(runs: list[Integers], where: Array) -> list[Integers]:
    """Runs of points of one whisker and frame as one line, and those beside it or off it as separate lines."""
    if len(runs) == 1:
        return runs
    runs = sorted(runs, key=lambda run: -run.size)
    way = where[runs[0][-1]] - where[runs[0][0]]
    # each run from its end nearer to the beginning of the longest
    runs = [run if (where[run[-1]] - where[run[0]]) @ way >= 0 else run[::-1] for run in runs]
    one, alone = runs[:1], []
    for run in runs[1:]:
        at = sum(_middle(other, where, way) <= _middle(run, where, way) for other in one)
        ends = [*zip(one[:at][-1:], [run], strict=False), *zip([run], one[at:][:1], strict=False)]
        fits = _common(run, one, where, way) <= BESIDE and all(
            goes_on(where[a], where[_beyond(a, b, where, way)]) for a, b in ends
        )
        one.insert(at, run) if fits else alone.append(run)
    line = one[0]
    for run in one[1:]:
        line = np.concatenate([line, _beyond(line, run, where, way)])
    return [line, *alone]


def _middle(run: Integers, where: Array, way: Array) -> float:
    """Twice the place of the middle of a run along a way."""
    return float((where[run[0]] + where[run[-1]]) @ way)


def _common(run: Integers, others: list[Integers], where: Array, way: Array) -> float:
    """Share of a run, along a way, beside which others run."""
    low, high = where[run[0]] @ way, where[run[-1]] @ way
    common = sum(max(min(high, where[one[-1]] @ way) - max(low, where[one[0]] @ way), 0.0) for one in others)
    return float(common / max(high - low, 1e-9))


def _beyond(former: Integers, later: Integers, where: Array, way: Array) -> Integers:
    """Points of a run beyond the end of a former one, if it begins beside it."""
    beyond = where[later] @ way > where[former[-1]] @ way
    return later[np.argmax(beyond) :] if beyond.any() else later[:0]


def cut_segments(segments: xr.Dataset, cut: Cut) -> xr.Dataset:
    """Segments after a cut.

    Parameters
    ----------
    segments : Dataset
        ``segments``, those that were linked.
    cut : Cut
        Of :func:`cut_lines`.

    Returns
    -------
    Dataset
        The same points, without those of short pieces; of variables of segments only frame and first point.
    """
    others = [name for name, values in segments.variables.items() if "segment" in values.dims]
    frame, first = (segments[name] for name in ("segment_frame", "segment_start"))
    return (
        segments.isel(point=cut.points)
        .drop_vars(others)
        .assign(
            segment_frame=("segment", frame.values[cut.source], frame.attrs),
            segment_start=("segment", cut.first.astype(first.dtype), first.attrs),
        )
    )
