"""Times that repeat as they are rounded to a decimal that is coarser than the sampling interval: no doubled samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError

FINEST = 9  # decimals of a second that a clock writes
COARSE = 1.1  # [of an interval] unit of the last decimal above which rounding, not a sample stored twice, repeats times
OFF = 1e-2  # [of that unit] by which a rounded time may be off beyond it
FEWEST = 6  # repeats from which on their spacing shows that they are regular, as those by rounding are
REGULAR = 0.9  # share of their spacings that must be alike; samples that were lost change a few


class Misfit(NamedTuple):
    """A time that keeps to no even grid.

    Attributes
    ----------
    sample : int
        Which, from 0.
    found : str
        How it lies, in words.
    remedy : str
        What to do.
    """

    sample: int
    found: str
    remedy: str


def repeated_by_rounding(time: Array) -> Misfit | None:
    """The first time that repeats the one before since times are rounded; None if none does, or samples are doubled.

    Even times that are rounded to a unit r times their interval repeat at even spacings, every r / (r − 1) samples;
    up to r = 1.1 samples that a recorder stores twice at such spacings look the same, and so do samples that are all
    stored as often.

    Parameters
    ----------
    time : (T,) array
        [s].

    Returns
    -------
    Misfit or None
        With the interval of the samples as found, where none were lost.
    """
    if len(time) < 2 or not np.isfinite(time).all():
        return None
    apart = np.diff(time)
    if (apart < 0).any() or (apart == 0).sum() < 2 or not apart.any() or not (digit := last_digit(time)):
        return None
    near = apart[apart < 1.5 * digit]  # where no sample was lost
    step = float(near.mean())
    if 2 * near.size < apart.size or not 0 < step < digit or not (_regular(apart) or _within(time, digit)):
        return None
    found = f"the time of the one before: times are rounded to {digit:g} s, at intervals of {step:.2g} s"
    doubled = ", or, if its value is doubled too, leave the sample out" * (digit <= COARSE * step or _alike(apart))
    return Misfit(int(np.argmax(apart == 0)) + 1, found, f"write times with more decimals{doubled}")


def refuse_rounded(time: Array, name: str) -> None:
    """Refuse times that repeat since they are rounded; doubled samples are left to be refused by other rules.

    Parameters
    ----------
    time : (T,) array
        [s].
    name : str
        Of the times, for the message.

    Raises
    ------
    InputError
        Names the unit to which they are rounded.
    """
    if rounded := repeated_by_rounding(time):
        where = f"sample {rounded.sample} at {time[rounded.sample]:.6g} s, {rounded.found}"
        raise RangeError(name, "must ascend", where, rounded.remedy)


def _regular(apart: Array) -> bool:
    """Whether intervals of 0 come at even spacings, from each to the next but one: halves may round either way."""
    places = np.flatnonzero(apart == 0)
    if places.size < FEWEST:
        return False
    spacing = places[2:] - places[:-2]
    return bool((np.abs(spacing - np.median(spacing)) <= 1).mean() >= REGULAR)


def _alike(apart: Array) -> bool:
    """Whether every time is there as often as every other."""
    often = np.diff(np.flatnonzero(np.concatenate([[True], apart > 0, [True]])))
    return bool(often.min() == often.max())


def _within(time: Array, digit: float) -> bool:
    """Whether times lie within their last digit of an even grid from the first to the last, of a finer step."""
    step = (time[-1] - time[0]) / (len(time) - 1)
    off = np.abs(time - time[0] - step * np.arange(len(time)))
    return bool(digit > COARSE * step and (off <= digit * (1 + OFF)).all())


def last_digit(time: Array) -> float:
    """Unit of the last decimal that times are written with.

    Parameters
    ----------
    time : (T,) array
        [s].

    Returns
    -------
    float
        [s]; 0 where they have more decimals than a clock gives.
    """
    exact = 4 * np.spacing(np.abs(time).max())
    units = (10.0**-digits for digits in range(FINEST + 1))
    return next((unit for unit in units if np.abs(time - unit * np.round(time / unit)).max() <= exact), 0.0)
