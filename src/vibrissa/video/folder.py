"""A movie as a folder of numbered images (PNG, TIFF, JPEG or BMP), one for each frame."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from vibrissa.errors import InputError
from vibrissa.video import container, tiff
from vibrissa.video.about import Movie, empty_block
from vibrissa.video.grey import Frames

KINDS = {".png": "PNG", ".tif": "TIFF", ".tiff": "TIFF", ".jpg": "JPEG", ".jpeg": "JPEG", ".bmp": "BMP"}


def describe(path: Path) -> Movie:
    """Describe a folder of images by its first one.

    Raises
    ------
    InputError
        If there are no images, images of several types, names that are not one series of numbers without a gap,
        or the first image is no grey image.
    """
    images = _numbered(path)
    first = _image_kind(images[0])
    return replace(first, path=path, frame_count=len(images), frame_count_is_estimate=False)


def read_blocks(path: Path, frames: int) -> Iterator[Frames]:
    """Read the images in the order of their numbers, in blocks of (T, height, width).

    Raises
    ------
    InputError
        As :func:`describe`; also if an image is cut off or damaged, or of another size or type than the first.
    """
    movie, images = describe(path), _numbered(path)
    for start in range(0, len(images), frames):
        names = images[start : start + frames]
        block = empty_block(movie, len(names))
        for slot, name in zip(block, names, strict=True):
            slot[:] = _image(name, movie)
        yield block


def _numbered(path: Path) -> list[Path]:
    """Images of a folder in the order of their numbers: the last digits of each name. Other files are left alone."""
    images = [one for one in path.iterdir() if one.suffix.lower() in KINDS and not one.name.startswith(".")]
    if not images:
        raise InputError(str(path), "must hold PNG, TIFF, JPEG or BMP images")
    kinds = sorted({KINDS[one.suffix.lower()] for one in images})
    if len(kinds) > 1:
        raise InputError(str(path), "must hold images of one type", " and ".join(kinds))
    parts = [_number(one) for one in images]
    if len(series := sorted({(before, after) for before, _, after in parts})) > 1:
        found = " and ".join(f"{before}…{after}" for before, after in series[:3])
        raise InputError(str(path), "must hold one series of images", found, "a folder for each")
    order = sorted(zip((number for _, number, _ in parts), images, strict=True))
    for (number, one), (following, other) in pairwise(order):
        if following == number:
            raise InputError(str(path), "must have each number once", f"{one.name} and {other.name}")
        if following > number + 1:
            rule = "must be numbered without a gap"
            raise InputError(str(path), rule, f"{other.name} after {one.name}", "a missing frame shifts time")
    return [one for _, one in order]


def _number(image: Path) -> tuple[str, int, str]:
    """Name before the number, the number, and what follows it."""
    found = re.fullmatch(r"(.*?)(\d{1,18})(\D*)", image.stem, re.ASCII | re.DOTALL)
    if found is None:
        raise InputError(str(image), "must have a number in its name, by which frames are put in order")
    return found[1], int(found[2]), found[3]


def _image_kind(image: Path) -> Movie:
    return tiff.describe(image) if image.suffix.lower() in tiff.SUFFIXES else container.describe(image)


def _image(image: Path, movie: Movie) -> Frames:
    reader = tiff if image.suffix.lower() in tiff.SUFFIXES else container
    (frames, *more) = (frame for block in reader.read_blocks(image, 1) for frame in block)
    if more:
        raise InputError(str(image), "must hold one frame", f"{len(more) + 1}")
    if (frames.shape, frames.dtype) != ((movie.height, movie.width), movie.dtype):
        found = f"{frames.shape[1]}×{frames.shape[0]} {frames.dtype} after {movie.width}×{movie.height} {movie.dtype}"
        raise InputError(str(image), "must be of the size and type of the first image", found)
    return np.asarray(frames)
