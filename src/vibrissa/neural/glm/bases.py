"""Smooth shapes over lags: raised cosines, even, or stretched: fine at short lags and coarse at long ones."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, TooFewError


def raised_cosines(lags: Array, count: int, *, stretch: float | None = None) -> Array:
    """Raised cosines over lags, as in [Pillow2008]_.

    Half the sum of 1 and a cosine of one period, four spacings wide, centred evenly over lag, or over
    ln(lag + stretch). Inside the range they sum to 2, near its ends to 1.5 at least: a constant is nearly within
    reach.

    Parameters
    ----------
    lags : (K,) array
        Lags [s], ascending; the first and last centre are at the first and last of them.
    count : int
        Number of shapes, at least 2 and at most K.
    stretch : float, optional
        Lag below which the spacing is about even [s]; without it, it is even throughout.

    Returns
    -------
    (K, count) array
        Each column between 0 and 1.

    Raises
    ------
    InputError
        If lags do not ascend, the number does not fit, or the stretch is not positive.
    """
    lags = np.asarray(lags, float)
    if lags.ndim != 1 or lags.size < 2 or not (np.diff(lags) > 0).all():
        raise TooFewError("lags", "must be at least two that ascend (s)", lags)
    if not 2 <= count <= lags.size:
        raise RangeError("number of shapes", f"must lie between 2 and the {lags.size} lags", count)
    if stretch is not None and not (stretch > 0 and lags[0] >= 0):
        raise RangeError("stretch", "must be positive (s), over lags from 0", stretch)
    place = lags if stretch is None else np.log(lags + stretch)
    centres = np.linspace(place[0], place[-1], count)
    spacing = centres[1] - centres[0]
    phase = np.clip((place[:, None] - centres) * np.pi / (2 * spacing), -np.pi, np.pi)
    return (1 + np.cos(phase)) / 2


def lagged(signal: Array, shapes: Array, *, first: int = 0) -> Array:
    """Signal at lags, weighted by shapes: Σ_j shape(j) · signal(k − first − j).

    Parameters
    ----------
    signal : (..., K) array
        In even bins; taken as 0 before the first.
    shapes : (J, C) array
        Weights of the lags first, first + 1, … [bins].
    first : int
        Shortest lag [bins]; 1 for a unit's own past, which must not hold the present.

    Returns
    -------
    (..., K, C) array
        In the unit of the signal.
    """
    n_lags, count = shapes.shape
    length = signal.shape[-1]
    size = 1 << int(np.ceil(np.log2(length + n_lags + first)))
    wide = np.zeros((first + n_lags, count))
    wide[first:] = shapes
    product = np.fft.rfft(signal, size)[..., None] * np.fft.rfft(wide, size, axis=0)
    return np.fft.irfft(product, size, axis=-2)[..., :length, :]
