"""Envelope and phase of a ringing signal (Eq. 17)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fft, ifft

from vibrissa.arrays import Array
from vibrissa.errors import TooFewError

MIRRORED = 2048  # samples at either end, as far as there are as many


def analytic_envelope(signal: Array) -> tuple[Array, Array]:
    """Envelope and phase by the analytic signal.

    Eq. (17) of [Boubenec2014]_: q(t) = A(t) cos(ωt + φ(t)). The mean is taken away first, and the signal is
    mirrored at both ends, so that the transform meets no step there.

    Parameters
    ----------
    signal : (..., T) array
        Ringing signal on an even grid, any unit; at least 4 samples, without NaN.

    Returns
    -------
    envelope, phase : (..., T) arrays
        A ≥ 0 in the unit of the signal; ωt + φ in (−π, π] [rad].

    Raises
    ------
    InputError
        If the signal is too short or has samples that were not measured.

    Examples
    --------
    >>> t = np.arange(0, 0.5, 1e-3)
    >>> beat = 1 + 0.5 * np.cos(2 * np.pi * 5 * t)
    >>> envelope, _ = analytic_envelope(beat * np.cos(2 * np.pi * 100 * t))
    >>> bool(np.abs(envelope - beat)[50:-50].max() < 0.01)
    True
    """
    if signal.shape[-1] < 4:
        raise TooFewError("signal", "must have at least 4 samples", signal.shape[-1])
    if not np.all(np.isfinite(signal)):
        raise TooFewError("signal", "must have no NaN", remedy="cut it to where it was measured")
    centred = signal - signal.mean(axis=-1, keepdims=True)
    pad = min(signal.shape[-1] - 1, MIRRORED)
    mirrored = np.pad(centred, [(0, 0)] * (signal.ndim - 1) + [(pad, pad)], mode="reflect")
    analytic = analytic_signal(mirrored)[..., pad:-pad]
    return np.abs(analytic), np.angle(analytic)


def analytic_signal(signal: Array) -> NDArray[np.complex128]:
    """Analytic signal, without negative frequencies: that of ``scipy.signal.hilbert``, whose import takes a second.

    Parameters
    ----------
    signal : (..., T) array
        On an even grid, taken as periodic.

    Returns
    -------
    (..., T) array
        Complex; its real part is the signal.
    """
    count = signal.shape[-1]
    weight = np.zeros(count)
    weight[1 : (count + 1) // 2] = 2
    weight[[0, count // 2] if count % 2 == 0 else [0]] = 1
    return np.asarray(ifft(fft(signal, axis=-1) * weight, axis=-1))
