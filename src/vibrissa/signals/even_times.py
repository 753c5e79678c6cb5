"""Times that must be even: one rule for all signals."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, TooFewError

UNEVEN = 1e-2  # [of an interval] largest deviation of a time: stamps may be rounded


def even_rate(time: Array, source: str = "", least: int = 4) -> float:
    """Sampling rate [Hz] of times [s] that must be even to a hundredth of an interval.

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
    step = (time[-1] - time[0]) / (len(time) - 1)
    if not step > 0:
        raise RangeError(name, "must ascend", f"{time[0]:.6g} s to {time[-1]:.6g} s")
    off = np.abs(time - time[0] - step * np.arange(len(time))) > UNEVEN * step
    if off.any():
        where = f"sample {np.argmax(off)} at {time[np.argmax(off)]:.6g} s out of step"
        raise RangeError(name, "must be even", where, "interpolate where frames were lost")
    return float(1 / step)
