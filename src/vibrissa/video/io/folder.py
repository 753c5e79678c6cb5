"""A movie as a folder of numbered images (PNG, TIFF, JPEG or BMP), one for each frame."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from vibrissa.errors import FormatError, ShapeError, TooFewError
from vibrissa.video.io import container, tiff
from vibrissa.video.io.about import Movie, Opened, empty_block, opened_runs
from vibrissa.video.io.frame_times import FrameTimes, numbered
from vibrissa.video.io.grey import Frames

KINDS = {".png": "PNG", ".tif": "TIFF", ".tiff": "TIFF", ".jpg": "JPEG", ".jpeg": "JPEG", ".bmp": "BMP"}


@contextmanager
def opened(path: Path) -> Iterator[Opened]:
    """Open a folder of images, described by its first one and read in the order of their numbers.

    Parameters
    ----------
    path : Path
        The folder.

    Yields
    ------
    Opened
        The movie.

    Raises
    ------
    InputError
        If there are no images, images of several types, names that are not one series of numbers, or the first image
        is no grey image; also if one is cut off or damaged, or of another size or type than the first.
    """
    images, _ = _numbered(path)
    with _opened(images[0]) as (first, _):
        movie = replace(first, path=path, frame_count=len(images), frame_count_is_estimate=False)
    yield opened_runs(movie, lambda start, stop: _block(images[start:stop], movie))


def frame_numbers(path: Path) -> FrameTimes:
    """Places of the frames on an even time axis, by the numbers of the images.

    Parameters
    ----------
    path : Path
        The folder.

    Returns
    -------
    FrameTimes
        A number that is left out is a missing frame.

    Raises
    ------
    InputError
        If the names are not one series of numbers.
    """
    return numbered(np.array(_numbered(path)[1], np.int64))


def _numbered(path: Path) -> tuple[list[Path], list[int]]:
    """Images of a folder in the order of their numbers, the last digits of each name; other files are left alone."""
    images = [one for one in path.iterdir() if one.suffix.lower() in KINDS and not one.name.startswith(".")]
    if not images:
        raise FormatError(str(path), "must hold PNG, TIFF, JPEG or BMP images")
    kinds = sorted({KINDS[one.suffix.lower()] for one in images})
    if len(kinds) > 1:
        raise FormatError(str(path), "must hold images of one type", " and ".join(kinds))
    parts = [_number(one) for one in images]
    if len(series := sorted({(before, after) for before, _, after in parts})) > 1:
        found = " and ".join(f"{before}…{after}" for before, after in series[:3])
        raise TooFewError(str(path), "must hold one series of images", found, "a folder for each")
    order = sorted(zip((number for _, number, _ in parts), images, strict=True))
    for (number, one), (following, other) in pairwise(order):
        if following == number:
            raise FormatError(str(path), "must have each number once", f"{one.name} and {other.name}")
    return [one for _, one in order], [number for number, _ in order]


def _number(image: Path) -> tuple[str, int, str]:
    """Name before the number, the number, and what follows it."""
    found = re.fullmatch(r"(.*?)(\d{1,18})(\D*)", image.stem, re.ASCII | re.DOTALL)
    if found is None:
        raise FormatError(str(image), "must have a number in its name, by which frames are put in order")
    return found[1], int(found[2]), found[3]


def _opened(image: Path) -> AbstractContextManager[Opened]:
    return (tiff if image.suffix.lower() in tiff.SUFFIXES else container).opened(image)


def _block(images: list[Path], movie: Movie) -> Frames:
    block = empty_block(movie, len(images))
    for slot, image in zip(block, images, strict=True):
        with _opened(image) as (this, blocks):
            if this.colour and not movie.colour:
                raise FormatError(str(image), "must be grey, as the first image is", "colours")
            (frame, *more) = (frame for one in blocks(1) for frame in one)
        if more:
            raise TooFewError(str(image), "must hold one frame", f"{len(more) + 1}")
        if (frame.shape, frame.dtype) != (slot.shape, slot.dtype):
            size = "×".join(map(str, reversed(frame.shape)))
            found = f"{size} {frame.dtype} after {movie.width}×{movie.height} {movie.dtype}"
            raise ShapeError(str(image), "must be of the size and type of the first image", found)
        slot[:] = frame
    return block
