"""Modes under a quasi-static drive, against closed forms, brute force and the laws of motion."""

import numpy as np
import pytest
from drives import piecewise_drive, sampled_drive
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from refusals import refusal
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PPoly

from vibrissa.exact import free_decay
from vibrissa.mechanics.vibration.dynamics import RECOIL, Drive, amplitudes, vibrate
from vibrissa.mechanics.vibration.oscillator import green_function, ring

OMEGA = np.array([770.0, 2180.0])
END = 0.04


def random_drive(seed, terms, count=8):
    """Polynomials of order 1 over the whole record, that jump at random times, two of which coincide."""
    rng = np.random.default_rng(seed)
    time = np.sort(rng.uniform(-0.005, 0.9 * END, count))
    time[3] = time[2]
    scale = (100.0 ** np.arange(terms))[None, None]  # they change over 10 ms
    return Drive(time, rng.normal(size=(2, count, terms)) * scale, rng.normal(size=2))


def brute_force(t, drive, omega, zeta, jump, mode):
    """The modal equation integrated from event to event, with the rule applied at each."""
    state, found = np.zeros(2), np.zeros((2, t.size))
    q = Polynomial([drive.before[mode]])
    for e, start in enumerate(drive.time):
        old, q = q, Polynomial(drive.coefficients[mode, e])
        span = start - drive.time[e - 1] if e else 0.0
        fall = old(span) - q(0.0)
        state += [fall, old.deriv()(span) - q.deriv()(0.0) - RECOIL[jump] * zeta * omega * fall]
        stop = drive.time[e + 1] if e + 1 < drive.time.size else END + 1e-9
        if stop == start:
            continue

        def motion(when, y, q=q, start=start):
            return [y[1], -q.deriv(2)(when - start) - 2 * zeta * omega * y[1] - omega**2 * y[0]]

        path = solve_ivp(motion, (start, stop), state, method="DOP853", dense_output=True, rtol=1e-12, atol=1e-13)
        inside = (t >= start) & (t < stop)
        if inside.any():
            found[:, inside] = path.sol(t[inside])
        state = path.y[:, -1].copy()
    return found


# Exact solutions


@pytest.mark.parametrize("zeta", [0.0, 0.11])
def test_corner_of_the_drive_kicks_and_a_jump_releases(zeta):
    drive = Drive([0.01, 0.02], [[[0.0, 3.0], [0.53, 3.0]]], [0.0])
    t = np.linspace(0, END, 401)
    kick = -3 * green_function(t - 0.01, 770.0, zeta)
    release = np.where(t >= 0.02, free_decay(np.maximum(t - 0.02, 0), -0.5, 0.0, 770.0, zeta), 0)
    np.testing.assert_allclose(amplitudes(t, drive, 770.0, zeta)[0], kick + release, atol=1e-13)


@pytest.mark.parametrize("zeta", [0.0, 0.11, 0.5])
@pytest.mark.parametrize("jump", RECOIL)
@pytest.mark.parametrize(("seed", "terms"), [(0, 1), (2, 4), (4, 12)])
def test_motion_is_that_of_brute_force(seed, terms, jump, zeta):
    drive, t = random_drive(seed, terms), np.linspace(0, END, 301)
    found = vibrate(t, drive, OMEGA, zeta, jump)
    for i in range(2):
        for ours, theirs in zip(found, brute_force(t, drive, OMEGA[i], zeta, jump, i), strict=True):
            np.testing.assert_allclose(ours[i], theirs, atol=1e-8 * np.abs(theirs).max(), rtol=0)


def sine(t, frequency, omega, zeta):
    """Motion under Q = sin νt from rest at t = 0: the steady part and what ends it at zero."""
    gain = frequency**2 / (omega**2 - frequency**2 + 2j * zeta * omega * frequency)
    steady = (gain * np.exp(1j * frequency * t)).imag
    return steady + free_decay(t, -gain.imag, -frequency - (1j * frequency * gain).imag, omega, zeta)


def spline_error(count):
    """Largest error of the motion under a sine known at so many times."""
    knots, t = np.linspace(0, 0.1, count), np.linspace(0, 0.1, 777)
    drive = sampled_drive(knots, np.sin(60 * knots)[None])
    return np.abs(amplitudes(t, drive, 770.0, 0.11)[0] - sine(t, 60.0, 770.0, 0.11)).max()


def test_any_drive_goes_through_a_spline_with_error_of_order_four():
    assert spline_error(401) < 1e-9
    assert np.log2(spline_error(51) / spline_error(101)) == pytest.approx(4, abs=0.4)


@pytest.mark.parametrize(("ratio", "power"), [(1 / 3.9, 21), (1.0, 9), (10.0, 9), (1e3, 9), (1e6, 9)])
def test_drive_much_faster_than_the_mode_costs_no_digits(ratio, power):
    omega, nu = 10.0, 10.0 * ratio
    drive = Drive([0.0], np.append(np.zeros(power), nu**power)[None, None], [0.0])  # Q = (νt)^power, for νt < 1
    t = np.linspace(0.1, 1, 50) / nu
    q, rate = vibrate(t, drive, omega, 0.1)
    path = solve_ivp(
        lambda x, y: [
            y[1],
            -power * (power - 1) * x ** (power - 2) - 2 * 0.1 * omega / nu * y[1] - (omega / nu) ** 2 * y[0],
        ],
        (0, 1),
        [0, 0],
        method="DOP853",
        dense_output=True,
        rtol=1e-13,
        atol=1e-15,
    )
    np.testing.assert_allclose(np.stack([q[0], rate[0] / nu]), path.sol(t * nu), atol=1e-11)


# Laws


@settings(deadline=None, derandomize=True, max_examples=25)
@given(
    seed=st.integers(0, 10**6),
    terms=st.integers(1, 12),
    zeta=st.sampled_from([0.0, 0.11, 0.5]),
    cut=st.lists(st.integers(0, 299), min_size=1, max_size=30, unique=True),
)
def test_motion_does_not_depend_on_the_grid(seed, terms, zeta, cut):
    drive, t, some = random_drive(seed, terms), np.linspace(-0.02, END, 300), np.sort(cut)
    for whole, part in zip(vibrate(t, drive, OMEGA, zeta), vibrate(t[some], drive, OMEGA, zeta), strict=True):
        scale = np.abs(whole).max(axis=1, keepdims=True)
        np.testing.assert_allclose(part / scale, whole[:, some] / scale, atol=1e-12)


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=st.integers(0, 10**6), a=st.floats(-3, 3), b=st.floats(-3, 3), delay=st.floats(-1, 1))
def test_motion_is_linear_in_the_drive_and_moves_with_it(seed, a, b, delay):
    one, two = random_drive(seed, 5), random_drive(seed + 1, 5)
    t = np.linspace(-0.01, END, 200)
    both = Drive(one.time + delay, a * one.coefficients + b * two.coefficients, a * one.before + b * two.before)
    two = Drive(one.time, two.coefficients, two.before)
    separate = a * amplitudes(t, one, OMEGA, 0.11) + b * amplitudes(t, two, OMEGA, 0.11)
    np.testing.assert_allclose(amplitudes(t + delay, both, OMEGA, 0.11), separate, atol=1e-9)  # t + delay rounds


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=st.integers(0, 10**6), jump=st.sampled_from(sorted(RECOIL)))
def test_whole_displacement_is_continuous_and_its_velocity_follows_the_rule(seed, jump):
    drive = random_drive(seed, 4)
    drive = Drive(drive.time + 1e-4 * np.arange(8), drive.coefficients, drive.before)  # none coincide
    before, at = drive.time - 1e-13, drive.time
    q, rate = (
        np.stack(pair) for pair in zip(*(vibrate(t, drive, OMEGA, 0.2, jump) for t in (before, at)), strict=True)
    )
    fall = drive(before) - drive(at)
    np.testing.assert_allclose(q[1] - q[0], fall, atol=1e-8)
    recoil = -RECOIL[jump] * 0.2 * OMEGA[:, None] * fall
    np.testing.assert_allclose(rate[1] - rate[0], drive.rate(before) - drive.rate(at) + recoil, atol=1e-4)


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.5])
def test_energy_goes_where_the_damping_says_while_the_drive_rests(zeta):
    # d/dt(½q̇² + ½ω²q²) = −2ζωq̇²; Simpson's rule of the right-hand side
    drive = Drive([0.0, 0.003], [[[0.0, 3.0, 40.0], [0.5, 0.0, 0.0]]], [0.0])
    t = np.linspace(0.003, 0.02, 4001)
    q, rate = (x[0] for x in vibrate(t, drive, 770.0, zeta))
    energy, lost = (rate**2 + (770.0 * q) ** 2) / 2, 2 * zeta * 770.0 * rate**2
    total = (t[1] - t[0]) / 3 * (lost[0] + lost[-1] + 4 * lost[1:-1:2].sum() + 2 * lost[2:-1:2].sum())
    assert energy[0] - energy[-1] == pytest.approx(total, rel=1e-9, abs=1e-12 * energy[0])
    period = 2 * np.pi / (770.0 * np.sqrt(1 - zeta**2))
    q, rate = (x[0] for x in vibrate([0.004, 0.004 + period], drive, 770.0, zeta))
    energy = (rate**2 + (770.0 * q) ** 2) / 2
    assert energy[1] / energy[0] == pytest.approx(np.exp(-2 * zeta * 770.0 * period), rel=1e-9)


def test_rate_is_the_derivative():
    drive = random_drive(5, 6)
    t = np.linspace(drive.time[-1] + 1e-4, END, 3001)
    q, rate = vibrate(t, drive, OMEGA, 0.11)
    slope = CubicSpline(t, q, axis=1)(t, 1)[:, 5:-5]
    np.testing.assert_allclose(rate[:, 5:-5], slope, atol=1e-6 * np.abs(rate).max())
    slope = CubicSpline(t, drive(t), axis=1)(t, 1)[:, 5:-5]
    np.testing.assert_allclose(drive.rate(t)[:, 5:-5], slope, rtol=1e-8)


def test_drive_is_what_its_polynomials_say_on_any_grid():
    drive = random_drive(6, 7)
    for t in (np.linspace(-0.02, END, 500), np.linspace(-0.02, END, 500) ** 3 * 1e3, drive.time):
        last = np.searchsorted(drive.time, t, side="right") - 1
        expected = [
            [Polynomial(drive.coefficients[i, e])(when - drive.time[e]) if e >= 0 else drive.before[i]
             for e, when in zip(last, t, strict=True)]
            for i in range(2)
        ]  # fmt: skip
        np.testing.assert_allclose(drive(t), expected, rtol=1e-12, atol=1e-12)


def test_drive_follows_piecewise_polynomials_and_their_last_piece_goes_on():
    pieces = PPoly([[1.0, -2.0], [0.5, 3.0], [4.0, 5.0]], [0.0, 1.0, 3.0])
    t = np.array([-1.0, 0.0, 0.5, 1.0, 2.9, 3.5])
    for before, rest in ((None, 4.0), ([9.0], 9.0)):
        np.testing.assert_allclose(piecewise_drive(pieces, before)(t), [np.where(t < 0, rest, pieces(t))])


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=st.integers(0, 10**6))
def test_straight_drive_rings_as_its_steps_and_kicks(seed):
    drive, t = random_drive(seed, 2), np.linspace(-0.01, END, 300)
    ends = np.diff(drive.time, prepend=drive.time[0])
    value, slope = np.moveaxis(drive.coefficients, 2, 0)
    last = np.concatenate([drive.before[:, None], (value + slope * np.append(ends[1:], 0))[:, :-1]], axis=1)
    kick = -np.diff(slope, axis=1, prepend=0)
    expected = ring(t, drive.time, last - value, kick, OMEGA, np.full(2, 0.11))
    np.testing.assert_allclose(amplitudes(t, drive, OMEGA, 0.11), expected, atol=1e-12)


def test_long_record_of_an_undamped_mode_keeps_its_phase():
    t = np.arange(400_000) / 20e3
    q = amplitudes(t, Drive([0.0123], [[[1.0]]], [0.0]), 770.0, 0.0)[0]
    expected = np.where(t >= 0.0123, -np.cos(770.0 * (t - 0.0123)), 0)
    np.testing.assert_allclose(q, expected, atol=2e-11)  # 6000 turns of 1e-16, and ω t rounds at 1e-12


def test_late_record_with_an_event_at_every_sample_loses_nothing_to_the_last_place_of_t():
    t = 1000 + np.arange(5000) / 20e3
    walk = np.cumsum(np.random.default_rng(0).normal(size=(2, t.size)), axis=1)
    drive = sampled_drive(t, walk)
    even = amplitudes(t, drive, OMEGA, 0.11)
    uneven = amplitudes(np.insert(t, 1, t[0] + 1e-5), drive, OMEGA, 0.11)
    np.testing.assert_allclose(even, np.delete(uneven, 1, axis=1), atol=1e-9 * np.abs(even).max())


def test_mode_at_rest_after_a_long_pause_wakes_as_new():
    t = np.arange(200_000) / 20e3
    drive = Drive([0.001, 9.5], [[[1.0, 0.0, 0.0], [1.0, 0.0, 30.0]]], [0.0])
    q = amplitudes(t, drive, 2180.0, 0.4)[0]
    expected = np.where(t >= 0.001, free_decay(np.maximum(t - 0.001, 0), -1.0, 0.0, 2180.0, 0.4), 0)
    envelope = np.exp(-0.4 * 2180.0 * t)
    assert np.all(np.abs(q - expected)[t < 0.38] <= 1e-9 * envelope[t < 0.38])  # down to 1e-144
    assert not np.any((q != 0) & (np.abs(q) < 1e-300))
    alone = amplitudes(t, Drive([9.5], [[[0.0, 0.0, 30.0]]], [0.0]), 2180.0, 0.4)[0]
    np.testing.assert_allclose(q[t > 5], alone[t > 5], atol=1e-15)


# Order of convergence


def ramp_error(duration):
    """Difference between a jump under the ramp-limit rule and a ramp of some duration."""
    t = np.linspace(0.005, END, 200)
    ramp = Drive([0.002 - duration, 0.002], [[[0.0, 1 / duration], [1.0, 0.0]]], [0.0])
    jump = Drive([0.002], [[[1.0]]], [0.0])
    return np.abs(amplitudes(t, ramp, 770.0, 0.2) - amplitudes(t, jump, 770.0, 0.2, "ramp-limit")).max()


def test_ramp_limit_rule_is_the_limit_of_steeper_ramps():
    assert ramp_error(1e-7) < 1e-4
    assert np.log2(ramp_error(2e-5) / ramp_error(1e-5)) == pytest.approx(1, abs=0.05)


# Bad input


@pytest.mark.parametrize(
    ("time", "coefficients", "before", "rule"),
    [
        ([1.0, 0.0], np.zeros((1, 2, 2)), [0.0], ("range", "Drive.time")),
        ([0.0], [[[np.nan]]], [0.0], ("range", "Drive.coefficients")),
        ([0.0], [[[0.0]]], [np.inf], ("range", "Drive.before")),
        ([0.0], np.zeros((1, 2, 2)), [0.0], ("shape", "Drive")),
        ([0.0], np.zeros((1, 1, 0)), [0.0], ("shape", "Drive")),
    ],
)
def test_impossible_drives_are_refused(time, coefficients, before, rule):
    with refusal(*rule):
        Drive(time, coefficients, before)


@pytest.mark.parametrize(
    ("t", "omega", "zeta", "jump", "rule"),
    [
        ([1.0, 0.0], 1.0, 0.1, "continuous", ("range", "times of samples and events")),
        ([0.0, np.nan], 1.0, 0.1, "continuous", ("range", "times of samples and events")),
        ([[0.0]], 1.0, 0.1, "continuous", ("range", "times of samples and events")),
        ([0.0], 0.0, 0.1, "continuous", ("range", "omega")),
        ([0.0], np.nan, 0.1, "continuous", ("range", "omega")),
        ([0.0], [1.0, 2.0], 0.1, "continuous", ("shape", "omega and damping")),
        ([0.0], 1.0, 1.0, "continuous", ("range", "damping")),
        ([0.0], 1.0, -0.1, "continuous", ("range", "damping")),
        ([0.0], 1.0, 0.1, "sudden", ("unknown", "jump")),
    ],
)
def test_impossible_questions_are_refused(t, omega, zeta, jump, rule):
    with refusal(*rule):
        vibrate(t, Drive([0.0], [[[1.0]]], [0.0]), omega, zeta, jump)


@pytest.mark.parametrize("t", [[], [0.5], [0.5, 0.5], [-3.0, -2.0, -1.0]])
def test_short_and_early_grids_are_answered(t):
    q, rate = vibrate(t, Drive([0.0], [[[1.0]]], [0.0]), 2.0, 0.0)
    np.testing.assert_allclose(q, [[-np.cos(2 * x) if x >= 0 else 0 for x in t]], atol=1e-15)
    np.testing.assert_allclose(rate, [[2 * np.sin(2 * x) if x >= 0 else 0 for x in t]], atol=1e-15)


def test_drive_without_events_stays_where_it_is():
    drive = Drive([], np.zeros((1, 0, 2)), [0.7])
    for t in (np.linspace(0, 1, 9), np.array([0.0, 0.3, 1.0])):
        np.testing.assert_array_equal(drive(t), np.full((1, t.size), 0.7))
        np.testing.assert_array_equal(amplitudes(t, drive, 3.0, 0.1), np.zeros((1, t.size)))
