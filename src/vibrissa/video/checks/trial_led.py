"""The frame in which a lamp in view lights, which is the trial's time zero."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.errors import FormatError, RangeError, TooFewError, UnknownError
from vibrissa.signals.frame_numbers import frame_numbers

if TYPE_CHECKING:
    import xarray as xr

Image = NDArray[Any]
Region = tuple[int, int, int, int]

CELL = 8  # side of the squares in which a lamp is sought [px]
SURE = 6.0  # step over the scatter of the grey level about two constants
FEWEST = 3  # frames before the step and from it on


def led_frame(blocks: Iterable[Image], region: Region | None = None) -> int:
    """First frame in which a lamp is lit by half or more: its grey level steps up once and stays.

    Parameters
    ----------
    blocks : iterable of (T, height, width) arrays of uint8 or uint16
        The movie.
    region : (first column, first row, last column, last row), optional
        Pixels in which the lamp is, both ends included [px]; by default it is sought in all, as the square of 8 pixels
        with the clearest step.

    Returns
    -------
    int
        The frame. A frame lit in part of its exposure counts from half of the step on, so that the lamp lights within
        half a frame of the frame's start.

    Raises
    ------
    InputError
        If no step exceeds six times the scatter of the grey level, some frame after it is dark again, or fewer
        than three frames are on either side of it.
    """
    course = _course(blocks, region)
    if len(course) < 2 * FEWEST:
        raise TooFewError("blocks", f"must hold at least {2 * FEWEST} frames to find a lamp's step", len(course))
    where, place = (_clearest(course), "anywhere in the image") if region is None else (0, f"in the region {region}")
    grey = course[:, where]
    frame, step, scatter = _step(grey)
    if not step > SURE * max(scatter, 1e-12):
        remedy = "give the lamp's region, or time zero from elsewhere"
        found = f"at best a step of {step:.1f} grey levels at a scatter of {scatter:.1f}"
        raise FormatError("lamp", f"must light up once {place}", found, remedy)
    half = (grey[:frame].mean() + grey[frame:].mean()) / 2
    first = int(np.flatnonzero(grey >= half)[0])
    if first < FEWEST or len(grey) - first < FEWEST:
        raise RangeError("lamp", f"must light {FEWEST} frames or more from either end of the movie", f"frame {first}")
    if np.any(grey[first:] < half):
        dark = first + int(np.flatnonzero(grey[first:] < half)[0])
        raise RangeError("lamp", "must stay lit", f"it lights in frame {first} and is dark in frame {dark}")
    return first


def with_led(profile: xr.Dataset, frame: int) -> xr.Dataset:
    """The profile with attributes ``led_frame``, from the movie's first, and ``led_time`` [s]; its own time stays.

    Parameters
    ----------
    profile : Dataset
        Tracked in the same movie.
    frame : int
        From :func:`led_frame`, of the frames that were tracked.

    Returns
    -------
    Dataset
        The profile with both attributes.

    Raises
    ------
    InputError
        If the frame is not one of the profile's.
    """
    if not 0 <= frame < profile.sizes["time"]:
        raise UnknownError("led_frame", f"must be one of the {profile.sizes['time']} frames", frame)
    return profile.assign_attrs(led_frame=int(frame_numbers(profile)[frame]), led_time=float(profile.time[frame]))


def _course(blocks: Iterable[Image], region: Region | None) -> Array:
    """Mean grey level (T, K) of the region, or of every square of ``CELL`` pixels."""
    parts = []
    for block in blocks:
        if region is None:
            rows, columns = (size // CELL for size in block.shape[1:])
            if not (rows and columns):
                raise RangeError("blocks", f"must be of {CELL} × {CELL} pixels at least", block.shape[1:])
            cells = block[:, : rows * CELL, : columns * CELL].reshape(len(block), rows, CELL, columns, CELL)
            parts.append(cells.mean(axis=(2, 4)).reshape(len(block), -1))
        else:
            column, row, last_column, last_row = region
            if not (0 <= column <= last_column < block.shape[2] and 0 <= row <= last_row < block.shape[1]):
                shape = f"{block.shape[2]} × {block.shape[1]}"
                raise RangeError("region of the lamp", f"must lie in the image of {shape} pixels", region)
            parts.append(block[:, row : last_row + 1, column : last_column + 1].mean(axis=(1, 2))[:, None])
    return np.concatenate(parts) if parts else np.empty((0, 1))


def _step(grey: Array) -> tuple[int, float, float]:
    """Frame, height and scatter of the step up that fits best: two constants, by least squares."""
    n = len(grey)
    count = np.arange(1, n)
    total = np.cumsum(grey)[:-1]
    before, after = total / count, (grey.sum() - total) / (n - count)
    # what a step at each frame explains of the variance: the between-groups sum of squares
    gain = np.where(after > before, count * (n - count) / n * (after - before) ** 2, 0.0)
    at = int(np.argmax(gain))
    frame = at + 1
    left = grey - np.where(np.arange(n) < frame, before[at], after[at])
    # a frame lit in part of its exposure is no noise
    left = np.delete(left, [frame - 1, frame])
    return frame, float(after[at] - before[at]), float(np.sqrt(np.mean(left**2)))


def _clearest(course: Array) -> int:
    """The square whose step explains most, over what it leaves."""
    clear = [step / max(scatter, 1e-2) for _, step, scatter in map(_step, course.T)]
    return int(np.argmax(clear))
