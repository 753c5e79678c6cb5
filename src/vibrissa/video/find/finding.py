"""Whiskers found in one image without seeds: long thin lines, a seed on a clear stretch of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from vibrissa.arrays import Mask
from vibrissa.errors import ShapeError, TooFewError, UnknownError
from vibrissa.video.find.movie_segments import SMALLEST, LineSearch, find_segments

Rows = NDArray[np.float64]
Side = Literal["left", "right", "top", "bottom"]

JOIN, STRAIGHT = 45.0, 12.0  # largest gap [px] and bend at either end [°] between two parts of one whisker
TOUCHING, LEAVING = 8.0, 18  # gap without a direction; points from which the direction of an end is taken
SHORTEST, FUR = 40.0, 0.3  # length of a whisker at least [px], and of the longest one
COILED = 0.7  # chord over length below which a line is a curl of fur
SMOOTH = 6.0  # standard deviation of the points over which depth is averaged
ALONE = 15.0  # distance to other lines from which on a seed is sure [px]
STEEPEST = 63.0  # angle against the columns up to which a line can be read column by column [°]


class FoundWhisker(NamedTuple):
    """A whisker found in an image.

    Attributes
    ----------
    seed : (column, row)
        A point on its clearest stretch, away from other whiskers [px].
    length : float
        Visible length [px].
    contrast : float
        Median depth along it [grey levels].
    base : {"left", "right", "top", "bottom"}
        Side on which its base is guessed to be: where the line is stronger, as a whisker tapers.
    line : (n, 2) array
        Columns and rows along it [px].
    """

    seed: tuple[float, float]
    length: float
    contrast: float
    base: Side
    line: Rows


def find_whiskers(
    image: NDArray[np.generic],
    *,
    polarity: Literal["dark", "bright"] = "dark",
    base: Side | None = None,
    region: tuple[int, int, int, int] | None = None,
) -> list[FoundWhisker]:
    """Find whiskers in one image: lines of at least 40 px, and 0.3 of the longest one, as fur is shorter.

    Parameters
    ----------
    image : (height, width) array
        Grey levels.
    polarity : {"dark", "bright"}
        Whether whiskers are darker or brighter than the background.
    base : {"left", "right", "top", "bottom"}, optional
        Side on which the bases are; only lines that run from it, within 63°, are given. Guessed if not given, for
        each line.
    region : (first column, first row, last column, last row), optional
        Where seeds may be [px]; the whole image by default.

    Returns
    -------
    list of FoundWhisker
        The longest first; empty if there is none.

    Raises
    ------
    InputError
        If the image is no array of two dimensions, at least 32 pixels each, or a choice is none of those.
    """
    _check(image, polarity, base)
    lines = [line for line in _joined(_lines(image, polarity)) if not _is_coiled(line)]
    if base is not None:
        lines = [line for line in lines if _runs_from(line, base)]
    if region is not None:
        lines = [line for line in lines if _inside(line, region).any()]
    # fur is shorter than whiskers
    least = max(SHORTEST, FUR * max(map(_length, lines), default=0.0))
    lines = [line for line in lines if _length(line) >= least]
    found = []
    for line in lines:
        seed = _seed(line, [other for other in lines if other is not line], region)
        found.append(
            FoundWhisker(seed, _length(line), float(np.nanmedian(line[:, 2])), base or _base(line), line[:, 1::-1])
        )
    return sorted(found, key=lambda one: -one.length)


def common_base(found: Sequence[FoundWhisker]) -> Side | None:
    """Side on which most of the visible length has its base, weighted by length; None if nothing was found.

    Parameters
    ----------
    found : sequence of FoundWhisker
        Whiskers of one image.

    Returns
    -------
    {"left", "right", "top", "bottom"} or None
    """
    sides = {one.base: sum(other.length for other in found if other.base == one.base) for one in found}
    return max(sides, key=lambda side: sides[side], default=None)


def find_seeds(
    image: NDArray[np.generic],
    *,
    polarity: Literal["dark", "bright"] = "dark",
    base: Side | None = None,
    region: tuple[int, int, int, int] | None = None,
) -> tuple[Side, list[FoundWhisker]]:
    """Side of the bases, guessed if not given, and the whiskers that run from it, in the order of their seeds there.

    Parameters
    ----------
    image, polarity, base, region
        As in :func:`find_whiskers`.

    Returns
    -------
    base : {"left", "right", "top", "bottom"}
        Side of the bases.
    found : list of FoundWhisker
        From the top down, or from left to right where the base is at the top or bottom.

    Raises
    ------
    InputError
        If no whisker is found, or as :func:`find_whiskers`.
    """
    found = find_whiskers(image, polarity=polarity, base=base, region=region)
    side = base or common_base(found)
    if side is None:
        remedy = "give their seeds, or say whether they are dark or bright"
        raise TooFewError("whiskers", "must be seen in the first frame to be found", remedy=remedy)
    return side, from_side(found, side)


def from_side(found: Sequence[FoundWhisker], side: Side) -> list[FoundWhisker]:
    """Whiskers that run from one side of the image, in the order of their seeds there.

    Parameters
    ----------
    found : sequence of FoundWhisker
        Whiskers of one image.
    side : {"left", "right", "top", "bottom"}
        Side of the bases.

    Returns
    -------
    list of FoundWhisker
        From the top down, or from left to right where the base is at the top or bottom.
    """
    across = 1 if side in ("left", "right") else 0
    fit = [one for one in found if _runs_from(one.line[:, ::-1], side)]
    return sorted(fit, key=lambda one: one.seed[across])


def _check(image: NDArray[np.generic], polarity: str, base: str | None) -> None:
    if image.ndim != 2 or min(image.shape) < SMALLEST:
        raise ShapeError("image", f"must be (height, width), at least {SMALLEST} pixels each", image.shape)
    if polarity not in ("dark", "bright"):
        raise UnknownError("polarity", "must be 'dark' or 'bright'", repr(polarity))
    if base not in (None, "left", "right", "top", "bottom"):
        raise UnknownError("base", "must be 'left', 'right', 'top' or 'bottom'", repr(base))


def _lines(image: NDArray[np.generic], polarity: Literal["dark", "bright"]) -> list[Rows]:
    """Row, column and depth along all lines (n, 3); parts of whiskers too."""
    found = find_segments(image[None], LineSearch(polarity=polarity))
    points = np.stack([found[name].values for name in ("row", "column", "line_contrast")], axis=1).astype(float)
    return np.split(points, found.segment_start.values[1:]) if found.sizes["segment"] else []


def _is_coiled(line: Rows) -> bool:
    return bool(np.hypot(*(line[-1, :2] - line[0, :2])) < COILED * _length(line))


def _length(line: Rows) -> float:
    return float(np.hypot(*np.diff(line[:, :2], axis=0).T).sum())


def _joined(lines: list[Rows]) -> list[Rows]:
    """Parts of one whisker, one behind the other in one direction, made one; the nearest first."""
    while True:
        pairs = [
            (gap, i, j, one, other)
            for i in range(len(lines))
            for j in range(i)
            for one in (lines[i], lines[i][::-1])
            for other in (lines[j], lines[j][::-1])
            if (gap := _gap(one, other)) < JOIN
        ]
        if not pairs:
            return lines
        _, i, j, one, other = min(pairs, key=lambda pair: pair[0])
        lines = [line for k, line in enumerate(lines) if k not in (i, j)] + [np.concatenate([one, other])]


def _gap(one: Rows, other: Rows) -> float:
    """Distance from the end of one line to the beginning of another that continues in its direction, else infinite."""
    n = LEAVING
    across = other[0, :2] - one[-1, :2]
    gap = float(np.hypot(*across))
    before, after = one[-1, :2] - one[-n:, :2][0], other[:n, :2][-1] - other[0, :2]
    if gap < TOUCHING:
        across = before  # too near to have a direction
    cosines = [way @ across / (np.hypot(*way) * np.hypot(*across)) for way in (before, after)]
    return gap if np.degrees(np.arccos(np.clip(cosines, -1, 1))).max() < STRAIGHT else np.inf


def _runs_from(line: Rows, base: Side) -> bool:
    """Whether a line can be read column by column from that side (row by row from the top or the bottom)."""
    down, right = np.abs(line[-1, :2] - line[0, :2])  # row, column
    along, across = (right, down) if base in ("left", "right") else (down, right)
    return bool(np.degrees(np.arctan2(across, along)) < STEEPEST)


def _base(line: Rows) -> Side:
    """Side of the stronger end of a line, its outer thirds compared."""
    third = max(len(line) // 3, 1)
    first = np.nanmedian(line[:third, 2]) > np.nanmedian(line[-third:, 2])
    down, right = (line[-1, :2] - line[0, :2]) * (1 if first else -1)
    if abs(right) >= abs(down):
        return "left" if right > 0 else "right"
    return "top" if down > 0 else "bottom"


def _inside(line: Rows, region: tuple[int, int, int, int]) -> Mask:
    row, column = line[:, 0], line[:, 1]
    return (column >= region[0]) & (column <= region[2]) & (row >= region[1]) & (row <= region[3])


def _carried_on(line: Rows) -> Rows:
    """Rows and columns of a line with ``JOIN`` px straight on at both ends: its own part may end at a crossing."""
    places, n = line[:, :2], min(LEAVING, len(line)) - 1
    steps = np.arange(1.0, JOIN)[:, None]
    ways = places[0] - places[n], places[-1] - places[-1 - n]
    ends = [end + steps * way / np.hypot(*way) for end, way in zip(places[[0, -1]], ways, strict=True)]
    return np.concatenate([places, *ends])


def _seed(line: Rows, others: Sequence[Rows], region: tuple[int, int, int, int] | None) -> tuple[float, float]:
    """Clearest point of a line that is away from its ends and from other lines, as far as there is one."""
    clearness = gaussian_filter1d(line[:, 2], SMOOTH, mode="constant")  # ends have half
    for other in others:
        apart = np.hypot(*(line[:, None, :2] - _carried_on(other)[None]).transpose(2, 0, 1)).min(axis=1)
        clearness *= np.clip(apart / ALONE, 0.05, 1)
    if region is not None:
        clearness = np.where(_inside(line, region), clearness, -np.inf)
    row, column = line[int(clearness.argmax()), :2]
    return float(round(column)), float(round(row))
