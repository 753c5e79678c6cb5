"""Times that must be even: one rule for all signals."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, TooFewError
from vibrissa.rounded_times import FINEST, Misfit, last_digit, repeated_by_rounding

UNEVEN = 1e-2  # [of an interval] largest deviation of a time that is not rounded
_ROUNDED = 0.3  # [of an interval] largest of one that is: by a half and more a lost sample would be taken for rounding
_DIGITS = 12  # of a rate that has more decimals
_ROUNDING = 1e-9  # [of an interval] by which a time on the grid may seem to lie off it


def even_rate(time: Array, source: str = "", least: int = 4) -> float:
    """Sampling rate [Hz] of times [s] that must be even, to a hundredth of an interval or to their last digit.

    Parameters
    ----------
    time : (T,) array
        [s].
    source : str
        Where they are from, for messages.
    least : int
        Samples that there must be.

    Returns
    -------
    float
        [Hz].

    Raises
    ------
    InputError
        If they are too few, not finite, not ascending or uneven.
    """
    name = f"{source}: time" if source else "time"
    if len(time) < least:
        raise TooFewError(name, f"must have at least {least} samples", len(time))
    if not np.all(np.isfinite(time)):
        raise RangeError(name, "must be finite", f"NaN at sample {np.argmin(np.isfinite(time))}")
    if not time[-1] > time[0]:
        raise RangeError(name, "must ascend", f"{time[0]:.6g} s to {time[-1]:.6g} s")
    if misfit := misfit_of(time):
        where = f"sample {misfit.sample} at {time[misfit.sample]:.6g} s, {misfit.found}"
        raise RangeError(name, "must be even", where, misfit.remedy)
    span = float(time[-1] - time[0])
    rate = (len(time) - 1) / span
    # within the rounding of both ends, so that it does not depend on the clock's zero
    return plain_rate(rate, rate * 2 * float(np.spacing(np.abs(time).max())) / span)


def plain_rate(rate: float, unsure: float) -> float:
    """The rate of the fewest decimals near one.

    Parameters
    ----------
    rate : float
        As measured [Hz].
    unsure : float
        By how much it may be off [Hz].

    Returns
    -------
    float
        [Hz]; to twelve digits where none of up to eight decimals is as near.

    Examples
    --------
    >>> plain_rate(29999.9986, 0.005), plain_rate(24414.0625, 1e-9)
    (30000.0, 24414.0625)
    """
    shorter = (round(rate, places) for places in range(FINEST))
    return next((one for one in shorter if abs(one - rate) <= unsure), float(f"{rate:.{_DIGITS}g}"))


def misfit_of(time: Array) -> Misfit | None:
    """The time that lies worst off an even grid; None where all keep to one.

    A time may be off by a hundredth of the mean interval, or, where all are rounded to some decimal, by one unit of it,
    up to three tenths of the interval; and intervals accordingly, so that none is twice as long as the others.

    Parameters
    ----------
    time : (T,) array
        Finite, the last above the first [s].

    Returns
    -------
    Misfit or None
        The worst.
    """
    step = (time[-1] - time[0]) / (len(time) - 1)
    off = np.abs((time - time[0]) / step - np.arange(len(time)))
    apart = np.diff(time) / step
    digit = last_digit(time)
    rounding = min(digit / step, _ROUNDED)
    unequal = np.abs(apart - 1) > max(2 * UNEVEN, 1.5 * rounding)  # the errors of both ends and of the mean
    if not unequal.any() and not (off > max(UNEVEN, rounding) + _ROUNDING).any():
        return None
    usual = float(np.median(apart))
    if rounded := repeated_by_rounding(time):
        return rounded
    if apart.min() <= 0:
        return Misfit(int(np.argmin(apart)) + 1, "not after the one before", "sort the samples, each once")
    if apart.max() > 1.5 * usual:
        found = f"{apart.max() * step:.4g} s after the one before, others {usual * step:.4g} s"
        return Misfit(int(np.argmax(apart)) + 1, found, "interpolate where samples were lost")
    worst = int(np.argmax(off))
    return Misfit(worst, f"{off[worst]:.2g} of an interval out of step", "resample it to even times")


def whole_steps(duration: float, rate: float) -> int:
    """Whole steps of a rate within a time; one that ends with it counts, however its time was rounded.

    Parameters
    ----------
    duration : float
        [s].
    rate : float
        Steps per second [Hz].

    Returns
    -------
    int
        Their number.

    Examples
    --------
    >>> whole_steps(0.05 - -0.1, 4000), whole_steps(0.3 - 0.1, 1000)
    (600, 200)
    """
    return int(duration * rate + _ROUNDING)
