"""First-order low-pass of a signal."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from vibrissa.arrays import Array
from vibrissa.signals.even_times import even_rate


def low_pass(time: Array, signal: Array, timescale: float) -> Array:
    """First-order low-pass of a signal that is straight between its samples; at rest before the first one.

    Parameters
    ----------
    time, signal : (T,) arrays
        Even grid [s], and values.
    timescale : float
        Time constant [s].

    Returns
    -------
    (T,) array
        y with timescale·y' + y = x and y = 0 at the start; in the unit of the signal.

    Raises
    ------
    InputError
        If the grid is not even.
    """
    h = 1 / even_rate(time, least=2)
    a = np.exp(-h / timescale)
    share = timescale * (1 - a) / h
    start = -(1 - share) * signal[0]  # takes the step to the first sample away
    return lfilter([1 - share, share - a], [1, -a], signal, zi=[start])[0]
