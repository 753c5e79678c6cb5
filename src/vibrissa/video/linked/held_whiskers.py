"""A look at a movie: which of its first frames is good, which whiskers it shows, and whether they keep their place."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import chain, islice
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrissa.arrays import Mask
from vibrissa.errors import TooFewError
from vibrissa.video.find.finding import FoundWhisker, Side, common_base, find_whiskers, from_side
from vibrissa.video.find.movie_segments import LineSearch, find_segments
from vibrissa.video.find.still_scenery import even_sample
from vibrissa.video.profile.turning import Region

Frames = NDArray[Any]

LOOKED_AT = 12  # frames, evenly over the movie, at least
FIRST = 32  # frames among which the first good one is sought
STRANGE = 4.0  # difference of a frame to the median one over the usual difference, above which it is bad
DARKENING = 0.1  # share of the range of grey levels by which the mean of a bad frame is off at least
HELD = 3.0  # distance from its place [px] within which a whisker is held
INNER, THERE = 0.6, 0.7  # share of its line from the base that is looked at, and that must be there
OFTEN = 0.8  # share of the frames


class Look(NamedTuple):
    """What is seen of a movie.

    Attributes
    ----------
    first : int
        First good frame, counted from the first of the blocks.
    base : {"left", "right", "top", "bottom"} or None
        Side of the bases; None if no whisker is seen there.
    found : list of FoundWhisker
        Whiskers of that frame.
    held : list of bool
        Whether each keeps its place over the movie.
    """

    first: int
    base: Side | None
    found: list[FoundWhisker]
    held: list[bool]


def look(
    blocks: Callable[[], Iterable[Frames]],
    *,
    polarity: Literal["dark", "bright"] = "dark",
    base: Side | None = None,
    region: Region | None = None,
) -> Look:
    """Look at some frames of a movie.

    A whisker is held if in four of five frames a line runs within 3 px of most of its inner part in the first good
    frame: a whisker that is dragged moves by less, one that whisks by more.

    Parameters
    ----------
    blocks : callable
        Gives the blocks of the movie from the start.
    polarity, base, region
        As of :func:`vibrissa.video.find.finding.find_whiskers`.

    Returns
    -------
    Look

    Raises
    ------
    InputError
        If there is no frame.
    """
    sample = [frame for _, frame in even_sample(chain.from_iterable(blocks()), LOOKED_AT)]
    if not sample:
        raise TooFewError("blocks", "must hold at least one frame")
    typical = np.median(np.stack(sample), axis=0).astype(np.float32)
    usual = np.median([_difference(frame, typical) for frame in sample])
    least = DARKENING * float(np.ptp(typical))

    def good(frame: Frames) -> bool:
        return _difference(frame, typical) <= max(STRANGE * usual, least)

    early = islice(chain.from_iterable(blocks()), FIRST)
    first, image = next(((k, frame) for k, frame in enumerate(early) if good(frame)), (0, sample[0]))
    found = find_whiskers(image, polarity=polarity, base=base, region=region)
    side = base or common_base(found)
    if side is None:
        return Look(first, None, [], [])
    found = from_side(found, side)
    return Look(first, side, found, _held([frame for frame in sample if good(frame)], found, polarity))


def _difference(frame: Frames, typical: NDArray[np.float32]) -> float:
    """Mean magnitude of the difference of two frames [grey levels]."""
    return float(np.abs(frame - typical).mean())


def _held(sample: list[Frames], found: list[FoundWhisker], polarity: Literal["dark", "bright"]) -> list[bool]:
    """Whether each whisker is at its place in most frames."""
    lines = find_segments(np.stack(sample), LineSearch(polarity=polarity))
    points = np.stack([lines.column.values, lines.row.values], axis=1)
    frame = np.repeat(lines.segment_frame.values, np.diff(np.append(lines.segment_start.values, len(points))))
    there = np.zeros((len(found), len(sample)), bool)
    for k in np.unique(frame):
        tree = cKDTree(points[frame == k])
        there[:, k] = [_is_there(one, tree) for one in found]
    return [bool(one.mean() >= OFTEN) for one in there]


def _is_there(whisker: FoundWhisker, tree: cKDTree) -> bool:
    """Whether lines run along most of the inner part of a whisker."""
    axis = 0 if whisker.base in ("left", "right") else 1
    sign = 1 if whisker.base in ("left", "top") else -1
    order = np.argsort(sign * whisker.line[:, axis], kind="stable")
    inner = whisker.line[order[: max(round(INNER * len(order)), 1)]]
    near: Mask = tree.query(inner)[0] <= HELD
    return bool(near.mean() >= THERE)
