"""Frames as one NumPy array on disk (``.npy``), read without loading it whole."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import cast

import numpy as np

from vibrissa.binary import read_npy
from vibrissa.errors import FormatError, TooFewError
from vibrissa.video.io.about import Movie, Opened, opened_runs
from vibrissa.video.io.grey import Frames

SUFFIXES = frozenset({".npy"})


@contextmanager
def opened(path: Path) -> Iterator[Opened]:
    """Open an array (T, height, width) of uint8 or uint16; its blocks are in native byte order.

    Parameters
    ----------
    path : Path
        The file.

    Yields
    ------
    Opened
        The movie.

    Raises
    ------
    InputError
        If it is no NumPy file, is cut off, or is no such array.
    """
    mapped = _mapped(path)
    count, height, width = mapped.shape
    movie = Movie(path=path, width=width, height=height, bits=8 * mapped.dtype.itemsize, codec="npy", frame_count=count)
    yield opened_runs(movie, lambda start, stop: cast(Frames, np.array(mapped[start:stop], movie.dtype, order="C")))


def _mapped(path: Path) -> Frames:
    mapped: Frames = read_npy(path)
    if mapped.ndim != 3 or mapped.dtype.newbyteorder("=") not in (np.uint8, np.uint16):
        found = f"{mapped.dtype} {mapped.shape}"
        rule = "must be frames (T, height, width) of uint8 or uint16"
        raise FormatError(str(path), rule, found, _remedy(mapped))
    if not mapped.size:
        raise TooFewError(str(path), "must have at least one frame", mapped.shape)
    return mapped


def _remedy(frames: Frames) -> str:
    """How an array becomes frames: of colours the mean, of fractions the grey levels."""
    if frames.ndim == 4 and frames.shape[-1] in (3, 4):
        return "of colours save the mean: frames[..., :3].mean(-1).astype('uint8')"
    if frames.ndim == 3 and frames.dtype.kind == "f":
        return "of grey levels from 0 to 1 save (255 * frames).round().astype('uint8')"
    return ""
