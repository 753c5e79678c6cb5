"""Oscillators whose frequency drifts: held against Airy functions, DOP853, the adiabatic law and the engine at rest."""

import numpy as np
import pytest
from drives import piecewise_drive, sampled_drive
from refusals import refusal
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PPoly
from scipy.special import airy

from vibrissa.mechanics.vibration.dynamics import Drive, vibrate
from vibrissa.mechanics.whisking.drifting_oscillator import drift

OMEGA = 800.0  # rad/s, as mode 1


def fitted(function, borders, degree):
    """Give a function as a polynomial on every panel, through Chebyshev nodes, as (M, E, n) powers from its start."""
    z = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    spans = np.diff(borders)
    t = borders[:-1, None] + spans[:, None] * (1 + z) / 2
    powers = ((1 + z) / 2)[:, None] ** np.arange(degree + 1)
    c = np.linalg.solve(powers, function(t).T).T / spans[:, None] ** np.arange(degree + 1)
    return c[None]


def kicked(borders, c):
    """Build the drive that does nothing but let q jump to 1 at the start."""
    return Drive(borders[:-1], np.zeros((1, len(borders) - 1, 1)), np.ones(1)), Drive(borders[:-1], c, np.zeros(1))


def test_stiffness_linear_in_time_rings_as_airy_functions():
    # q̈ + (a + bt) q = 0 is Airy's equation in x = −(a + bt) b^(−2/3)
    a, b = OMEGA**2, OMEGA**3 / 20
    borders = np.linspace(0, 0.1, 201)
    drive, frequency = kicked(borders, fitted(lambda t: np.sqrt(a + b * t), borders, 7))
    t = np.linspace(0, 0.1, 500)
    q, rate = drift(t, drive, frequency, 0.0)

    def basis(when):
        ai, aip, bi, bip = airy(-(a + b * when) * b ** (-2 / 3))
        return np.array([ai, bi]), np.array([aip, bip]) * -(b ** (1 / 3))

    start = np.stack([values[:, 0] for values in basis(np.zeros(1))])
    weights = np.linalg.solve(start, [1.0, 0.0])
    np.testing.assert_allclose(q[0], weights @ basis(t)[0], atol=1e-10)
    np.testing.assert_allclose(rate[0], weights @ basis(t)[1], atol=1e-10 * 2 * OMEGA)


def ramp(t):
    return OMEGA * (1 + 0.25 * np.tanh((t - 0.1) / 0.03))


def test_action_is_conserved_and_amplitude_falls_as_the_root_of_frequency():
    borders = np.linspace(0, 0.2, 401)
    drive, frequency = kicked(borders, fitted(ramp, borders, 7))
    t = np.array([0.01, 0.19])
    q, rate = drift(t, drive, frequency, 0.0)
    omega = ramp(t)
    action = (rate[0] ** 2 + (omega * q[0]) ** 2) / (2 * omega)
    slowness = np.max(np.abs(np.gradient(ramp(borders), borders)) / ramp(borders) ** 2)
    assert slowness < 0.02
    assert omega[1] > 1.6 * omega[0]
    np.testing.assert_allclose(action[1], action[0], rtol=slowness**2)


def direct(t, omega, zeta, quasi_static):
    """Integrate z̈ + 2ζω(ż − Q̇) + ω²(z − Q) = 0 for z = q + Q and give q, z at rest before."""

    def motion(when, state):
        w, (value, rate) = omega(when), quasi_static(when)
        return [state[1], -2 * zeta * w * (state[1] - rate) - w**2 * (state[0] - value)]

    z = solve_ivp(
        motion, (t[0], t[-1]), [quasi_static(t[0])[0], 0.0], "DOP853", t, rtol=1e-12, atol=1e-15, max_step=2e-4
    ).y[0]
    return z - quasi_static(t)[0]


def smooth(when):
    return np.sin(300 * when) * np.exp(when), (300 * np.cos(300 * when) + np.sin(300 * when)) * np.exp(when)


@pytest.mark.parametrize("degree", [2, 3, 4])
def test_error_falls_with_the_panel_as_the_degree_of_frequency_says(degree):
    t = np.linspace(0, 0.2, 300)
    truth, error = direct(t, ramp, 0.11, smooth), []
    for panels in (8, 16, 32):
        coarse, borders = np.linspace(0, 0.2, panels + 1), np.linspace(0, 0.2, 481)
        rough = PPoly(fitted(ramp, coarse, degree)[0].T[::-1], coarse)
        frequency = Drive(borders[:-1], fitted(rough, borders, degree), np.zeros(1))
        quasi_static = Drive(borders[:-1], fitted(lambda x: smooth(x)[0], borders, 9), np.zeros(1))
        error.append(np.abs(drift(t, quasi_static, frequency, 0.11)[0][0] - truth).max())
    order = np.log2(error[0] / error[2]) / 2
    assert order > degree + 0.5
    assert error[-1] < 1e-2


@pytest.mark.parametrize("rule", ["continuous", "ramp-limit", "paper2014"])
def test_constant_frequency_is_the_exact_engine(rule):
    rng = np.random.default_rng(3)
    time = np.sort(rng.uniform(0, 0.1, 20))
    drive = Drive(time, rng.normal(size=(2, 20, 4)) * 300.0 ** np.arange(4), np.array([0.3, -1]))
    omega = np.array([OMEGA, 3 * OMEGA])
    frequency = Drive(time, np.broadcast_to(omega[:, None, None], (2, 20, 1)), np.zeros(2))
    t = np.linspace(time[0], 0.12, 400)
    for found, known in zip(drift(t, drive, frequency, 0.1, rule), vibrate(t, drive, omega, 0.1, rule), strict=True):
        np.testing.assert_allclose(found, known, atol=1e-10 * np.abs(known).max())


def test_what_is_no_drifting_oscillator_is_refused():
    borders = np.linspace(0, 0.1, 5)
    drive, frequency = kicked(borders, np.full((1, 4, 1), OMEGA))
    with refusal("range", "times"):
        drift(np.array([-0.1, 0.0]), drive, frequency, 0.1)
    with refusal("range", "frequency"):
        drift(borders, drive, Drive(borders[:-1], -frequency.coefficients, np.zeros(1)), 0.1)
    with refusal("shape", "frequency"):
        drift(borders, drive, Drive(borders[:-1] + 1e-3, frequency.coefficients, np.zeros(1)), 0.1)
    with refusal("range", "damping"):
        drift(borders, drive, frequency, 1.0)


def test_spline_of_samples_drives_as_it_reads():
    t = np.linspace(0, 0.2, 2001)
    drive = sampled_drive(t, 1 - np.cos(300 * t)[None])
    frequency = piecewise_drive(CubicSpline(t, ramp(t)))
    truth = direct(t, ramp, 0.11, lambda x: (1 - np.cos(300 * x), 300 * np.sin(300 * x)))
    np.testing.assert_allclose(drift(t, drive, frequency, 0.11)[0][0], truth, atol=1e-6)
