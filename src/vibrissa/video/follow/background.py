"""The image without the whiskers: given, taken from a movie, or the mean of the tracked movie itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, ShapeError, TooFewError, UnknownError
from vibrissa.video.io.movie import read_blocks

Image = NDArray[Any]
Movie = Callable[[], Iterable[Image]]

LINE_WIDTH = 2.0  # full width of a whisker at half its contrast [px]
SURVIVES = 0.3  # share of the frames in one place above which a whisker remains in their mean
SAMPLED = 7  # every seventh pixel of either direction measures the light
DARK = 0.05  # share of the brightest pixel below which one says nothing of the light: a face, an arm


OF_THE_MOVIE = ("space", "mean", "median")  # backgrounds that are no file


def reference(background: str | Path | Image, movie: Movie) -> tuple[Image | None, str]:
    """The image that is taken as background, and what it is called in the attribute ``background``.

    Parameters
    ----------
    background : str, path or (height, width) array
        "space": none, the background is estimated in every frame; "mean": the mean of the movie itself, as in
        [Boubenec2014]_; an image; or the path of an image or of a movie without whiskers, whose mean is taken.
    movie : callable
        Gives the blocks of the tracked movie from the start.

    Returns
    -------
    (height, width) array or None, str
        Grey levels; "space", "mean", "image", "image: name" or "movie: name".

    Raises
    ------
    InputError
        If it is none of these, or a file that cannot be read.
    """
    if isinstance(background, np.ndarray):
        return background, "image"
    if background == "space":
        return None, "space"
    if background == "mean":
        return _mean(movie())[0], "mean"
    path = Path(background)
    if not path.is_file():
        rule = "must be 'space', 'mean', 'median' where lines are linked, or an image or movie without the whiskers"
        raise UnknownError("background", rule, repr(str(background)), "no such file")
    image, count = _mean(read_blocks(path))
    return image, f"{'image' if count == 1 else 'movie'}: {path.name}"


def _mean(blocks: Iterable[Image]) -> tuple[NDArray[np.float32], int]:
    """Mean over frames, and their number."""
    total: Any = 0.0
    count = 0
    for block in blocks:
        total = total + block.sum(axis=0, dtype=np.float64)
        count += len(block)
    if not count:
        raise TooFewError("blocks", "must hold at least one frame")
    return np.asarray(total / count, np.float32), count


def refuse_still(x: Array, y: Array, arc: Array) -> None:
    """Refuse the movie's mean as background where a whisker stayed in one place for long.

    In a mean over frames a whisker keeps the share of its contrast that it was there; above ``SURVIVES`` its
    rest after subtraction is displaced.

    Parameters
    ----------
    x, y : (whisker, T, node) arrays
        Tracked places [px]; NaN where not seen.
    arc : (whisker, node) array
        Arc length [px].

    Raises
    ------
    InputError
        If a node of a whisker was within one line's width for more than that share of its frames.
    """
    for w in range(len(x)):
        share = np.array([_longest_stay(*places) for places in zip(x[w].T, y[w].T, strict=True)])
        still = np.flatnonzero(share > SURVIVES)
        if still.size:
            worst = still[np.argmax(share[still])]
            raise TooFewError(
                "background 'mean'",
                f"must not hold the whiskers: whisker {w} is in one place",
                f"{share[worst]:.0%} of the frames, {arc[w, worst]:.0f} pixels from its base end",
                "give an image without it, or 'space'; or leave its still part out of the region",
            )


def _longest_stay(x: Array, y: Array) -> float:
    """Largest share of the frames in which a node is within ``LINE_WIDTH`` along the direction it moves most in."""
    places = np.stack([x, y])[:, ~np.isnan(y)]
    if not places.size:
        return 0.0
    widest = places[np.argmax(np.ptp(places, axis=1))]
    order = np.sort(widest)
    within = np.searchsorted(order, order + LINE_WIDTH, side="right") - np.arange(order.size)
    return float(within.max() / order.size)


def levelled(movie: Movie, image: Image, finer: bool) -> tuple[Movie, NDArray[np.float32]]:
    """The movie in the light of a reference image, and that image in the same unit.

    Light that drifts leaves a share of the reference's own pattern behind; so each frame is divided by the median of
    its ratio to the image. Light that changes in one part of the image alone is not followed.

    Parameters
    ----------
    movie : callable
        Gives the blocks of the movie from the start, (T, height, width) arrays of uint8 or uint16.
    image : (height, width) array
        The reference [grey levels].
    finer : bool
        Whether 8-bit frames become 16-bit ones of 1/128 grey level, so that nothing is lost to rounding.

    Returns
    -------
    movie : callable
        Gives the blocks of the movie in that light from the start.
    image : (height, width) array
        The reference in the unit of these blocks.

    Raises
    ------
    InputError
        If the movie is empty or the image of another shape.
    """
    first = next(iter(movie()), None)
    if first is None:
        raise TooFewError("blocks", "must hold at least one frame")
    if image.shape != first.shape[1:]:
        raise ShapeError("background", f"must have the frames' shape {first.shape[1:]}", image.shape)
    fine = 128.0 if finer and first.dtype == np.uint8 else 1.0
    kind = np.uint16 if finer else first.dtype.type
    return lambda: _in_light_of(image, movie(), fine, kind), np.asarray(image * fine, np.float32)


def _in_light_of(image: Image, blocks: Iterable[Image], fine: float, kind: type[np.integer[Any]]) -> Iterator[Image]:
    grid = (slice(None, None, SAMPLED), slice(None, None, SAMPLED))
    sample = np.asarray(image[grid], float)
    lit = sample > DARK * sample.max()
    for block in blocks:
        out = np.empty(block.shape, kind)
        for i, frame in enumerate(block):
            ratio = np.median(frame[grid][lit] / sample[lit])
            if not ratio > 0:
                raise RangeError("background", "must be of a scene as bright as the movie's", f"ratio {ratio:.3g}")
            out[i] = np.clip(np.rint(frame * np.float32(fine / ratio)), 0, np.iinfo(kind).max)
        yield out
