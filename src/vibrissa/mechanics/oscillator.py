"""The damped oscillator of one mode, set ringing by events (Eqs. 3, 4 and 7)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vibrissa.errors import InputError

Array = NDArray[np.float64]


def green_function(t: Array, omega: float, zeta: float) -> Array:
    """Displacement of a damped oscillator after a unit impulse.

    Eq. (7) of [Boubenec2014]_: G = exp(−ζωt) sin(Ωt)/Ω, with Ω = ω√(1 − ζ²).

    Parameters
    ----------
    t : (T,) array
        Time since the impulse [s]; G = 0 before it.
    omega, zeta : float
        Resonant angular frequency ω [rad/s], damping ratio ζ below 1.

    Returns
    -------
    (T,) array
        Displacement per unit of velocity given at t = 0 [s].
    """
    t = np.maximum(t, 0.0)
    big_omega = omega * np.sqrt(1 - zeta**2)
    return np.exp(-zeta * omega * t) * np.sin(big_omega * t) / big_omega


def ring(t: Array, event: Array, jump: Array, kick: Array, omega: Array, zeta: Array) -> Array:
    """Exact motion of several modes that events set ringing, on any ascending grid.

    Eq. (3) of [Boubenec2014]_, q̈ + 2ζωq̇ + ω²q = 0, holds between events; Eq. (4) of [Boubenec2014]_ has its
    driving force f here as steps of q and q̇. One pass, linear in events and samples.

    Parameters
    ----------
    t : (T,) array
        Times asked for [s], ascending.
    event : (E,) array
        Times of the events [s], ascending; an event at a sample acts before it.
    jump, kick : (M, E) arrays
        Steps of q and of q̇ at each event, for each mode.
    omega, zeta : (M,) arrays
        Resonant angular frequencies [rad/s] and damping ratios.

    Returns
    -------
    (M, T) array
        q, 0 before the first event.

    Raises
    ------
    InputError
        If ω ≤ 0, ζ is outside [0, 1), or times do not ascend.
    """
    if np.any(np.diff(t) < 0) or np.any(np.diff(event) < 0):
        raise InputError("times of samples and events", "must ascend")
    if not np.all(omega > 0):
        raise InputError("omega", "must be positive", omega.min())
    if not np.all((zeta >= 0) & (zeta < 1)):
        raise InputError("damping", "must lie in [0, 1)", zeta)
    return _ring(t, event, jump, kick, omega, zeta)


@njit(cache=True)
def _ring(t, event, jump, kick, omega, zeta):  # type: ignore[no-untyped-def]
    # q + i(q̇ + ζωq)/Ω turns as exp(−(ζω + iΩ)t): its real part is the free decay.
    n_modes = omega.size
    q = np.zeros((n_modes, t.size))
    for i in range(n_modes):
        decay = zeta[i] * omega[i]
        big_omega = omega[i] * np.sqrt(1 - zeta[i] ** 2)
        pole = -(decay + 1j * big_omega)
        state = 0j
        now = t[0]
        e = 0
        for j in range(t.size):
            while e < event.size and event[e] <= t[j]:
                state = state * np.exp(pole * (event[e] - now)) if state != 0 else 0j
                state += jump[i, e] + 1j * (kick[i, e] + decay * jump[i, e]) / big_omega
                now = event[e]
                e += 1
            state = state * np.exp(pole * (t[j] - now))
            now = t[j]
            q[i, j] = state.real
    return q
