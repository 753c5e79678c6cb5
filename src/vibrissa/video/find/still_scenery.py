"""What stays where it is while whiskers sweep: mean or median of one part of a movie after another."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, islice
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Frames = NDArray[Any]
Single = NDArray[np.float32]

MEDIAN_OF = 61  # frames, evenly over a part of the movie, that its scenery is made of at least
SPAN = 2048  # frames of a part: light drifts, and things are moved


def even_sample(frames: Iterable[Frames], least: int = MEDIAN_OF) -> list[tuple[int, Frames]]:
    """An even sample of frames whose number is not known before.

    Parameters
    ----------
    frames : iterable of (height, width) arrays
        The frames.
    least : int
        From this to twice this number are taken; all of fewer.

    Returns
    -------
    list of (int, (height, width) array)
        Their numbers, from 0, and copies of them.
    """
    sample: list[tuple[int, Frames]] = []
    every = 1
    for k, frame in enumerate(frames):
        if k % every == 0:
            sample.append((k, frame.copy()))
        # each time it is full, every other one is left out
        if len(sample) == 2 * least:
            sample, every = sample[::2], 2 * every
    return sample


def sceneries(blocks: Iterable[Frames], kind: Literal["mean", "median"], span: int = SPAN) -> Iterator[Single]:
    """The scenery of each ``span`` frames of a movie.

    Parameters
    ----------
    blocks : iterable of (T, height, width) arrays
        The movie.
    kind : {"mean", "median"}
        What is taken over time; the median is not moved by a frame that is black or torn.
    span : int
        Frames of a part. The rest, if less than half of this, has the scenery of the part before.

    Yields
    ------
    (height, width) array
        Grey levels.
    """
    frames = chain.from_iterable(blocks)
    first = True
    while True:
        counted = _Counted(islice(frames, span))
        sample = even_sample(counted)
        if not sample or (not first and counted.number < span / 2):
            return
        over_time = np.mean if kind == "mean" else np.median
        yield np.asarray(over_time(np.stack([frame for _, frame in sample]), axis=0), np.float32)
        first = False


class _Counted:
    """Frames passed on, and their number."""

    def __init__(self, frames: Iterable[Frames]) -> None:
        self._frames, self.number = frames, 0

    def __iter__(self) -> Iterator[Frames]:
        for frame in self._frames:
            self.number += 1
            yield frame
