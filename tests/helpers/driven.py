"""Oscillators of known resonance, driven by a known force or by white noise."""

import numpy as np
from scipy.linalg import expm, solve_continuous_lyapunov


def white_driven(count, n_samples, rate, resonance, zeta, rng):
    """(count, T) stationary positions: the exact discretisation of q̈ + 2ζωq̇ + ω²q = ω^{3/2} white noise."""
    omega = 2 * np.pi * resonance
    drift = np.array([[0, 1], [-(omega**2), -2 * zeta * omega]])
    stationary = solve_continuous_lyapunov(drift, -np.diag([0, omega**3]))
    turn = expm(drift / rate)
    kick = np.linalg.cholesky(stationary - turn @ stationary @ turn.T)
    state = np.linalg.cholesky(stationary) @ rng.normal(size=(2, count))
    positions = np.empty((n_samples, count))
    for k in range(n_samples):
        positions[k] = state[0]
        state = turn @ state + kick @ rng.normal(size=(2, count))
    return positions.T


def transfer(frequency, resonance, zeta):
    x = frequency / resonance
    return 1 / (1 - x**2 + 2j * zeta * x)


def driven_by(force, rate, resonance, zeta):
    """Response to one period of a force that repeats itself for ever, so without transient."""
    frequency = np.fft.rfftfreq(force.size, 1 / rate)
    return np.fft.irfft(np.fft.rfft(force) * transfer(frequency, resonance, zeta), force.size)
