"""Frames as one NumPy array on disk (``.npy``), read without loading it whole."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tokenize import TokenError
from typing import cast

import numpy as np

from vibrissa.errors import InputError
from vibrissa.video.about import Movie
from vibrissa.video.grey import Frames

SUFFIXES = frozenset({".npy"})


def describe(path: Path) -> Movie:
    """Describe an array (T, height, width) of uint8 or uint16.

    Raises
    ------
    InputError
        If it is no NumPy file, is cut off, or is no such array.
    """
    frames = _mapped(path)
    count, height, width = frames.shape
    bits = 8 * frames.dtype.itemsize
    return Movie(path=path, width=width, height=height, bits=bits, codec="npy", frame_count=count)


def read_blocks(path: Path, frames: int) -> Iterator[Frames]:
    """Read the array in blocks of (T, height, width), in native byte order.

    Raises
    ------
    InputError
        As :func:`describe`.
    """
    mapped = _mapped(path)
    native = mapped.dtype.newbyteorder("=")
    for start in range(0, len(mapped), frames):
        yield cast(Frames, np.array(mapped[start : start + frames], native, order="C"))


def _mapped(path: Path) -> Frames:
    try:
        mapped: Frames = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, OSError, EOFError, SyntaxError, TokenError, TypeError, OverflowError) as error:
        raise InputError(str(path), f"must be a whole NumPy array ({error})") from error
    if (
        not isinstance(mapped, np.ndarray)
        or mapped.ndim != 3
        or mapped.dtype.newbyteorder("=") not in (np.uint8, np.uint16)
    ):
        found = f"{getattr(mapped, 'dtype', type(mapped).__name__)} {getattr(mapped, 'shape', '')}"
        raise InputError(str(path), "must be frames (T, height, width) of uint8 or uint16", found)
    if not mapped.size:
        raise InputError(str(path), "must have at least one frame", mapped.shape)
    return mapped
