"""Envelope and phase of a ringing signal (Eq. 17)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import hilbert

from vibrissa.errors import InputError

Array = NDArray[np.float64]

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
        raise InputError("signal", "must have at least 4 samples", signal.shape[-1])
    if not np.all(np.isfinite(signal)):
        raise InputError("signal", "must have no NaN", remedy="cut it to where it was measured")
    centred = signal - signal.mean(axis=-1, keepdims=True)
    pad = min(signal.shape[-1] - 1, MIRRORED)
    mirrored = np.pad(centred, [(0, 0)] * (signal.ndim - 1) + [(pad, pad)], mode="reflect")
    analytic = hilbert(mirrored, axis=-1)[..., pad:-pad]
    return np.abs(analytic), np.angle(analytic)
