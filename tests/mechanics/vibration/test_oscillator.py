"""One mode set ringing by events, against closed forms and brute force."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.integrate import quad, solve_ivp

from vibrissa.exact import free_decay
from vibrissa.mechanics.vibration.oscillator import green_function, ring

OMEGA, ZETA = np.array([770.0, 2180.0]), np.array([0.11, 0.02])


def random_events(seed, count=9):
    rng = np.random.default_rng(seed)
    event = np.sort(rng.uniform(-0.01, 0.04, count))
    return event, rng.normal(size=(2, count)), 500 * rng.normal(size=(2, count))


def superposed(t, event, jump, kick):
    """Every event's free decay by itself, added."""
    total = np.zeros((2, t.size))
    for i in range(2):
        for when, q0, v0 in zip(event, jump[i], kick[i], strict=True):
            total[i] += np.where(t >= when, free_decay(np.maximum(t - when, 0), q0, v0, OMEGA[i], ZETA[i]), 0)
    return total


def test_green_function_is_the_answer_to_a_unit_impulse():
    t = np.linspace(-0.01, 0.05, 301)
    expected = np.where(t >= 0, free_decay(np.maximum(t, 0), 0.0, 1.0, 770.0, 0.11), 0)
    np.testing.assert_allclose(green_function(t, 770.0, 0.11), expected, atol=1e-18)


@settings(deadline=None, derandomize=True, max_examples=20)
@given(omega=st.floats(10, 5000), zeta=st.floats(0.02, 0.9))
def test_area_under_the_green_function_is_the_compliance(omega, zeta):
    end = 40 / (zeta * omega)
    area = quad(lambda t: float(green_function(np.array(t), omega, zeta)), 0, end, limit=2000, epsabs=0, epsrel=1e-9)[0]
    assert area == pytest.approx(1 / omega**2, rel=1e-7)


@pytest.mark.parametrize("seed", range(4))
def test_ringing_is_the_sum_of_free_decays(seed):
    t = np.linspace(-0.005, 0.05, 400)  # begins after some of the events
    event, jump, kick = random_events(seed)
    np.testing.assert_allclose(ring(t, event, jump, kick, OMEGA, ZETA), superposed(t, event, jump, kick), atol=1e-12)


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=st.integers(0, 10**6), cut=st.lists(st.integers(0, 299), min_size=1, max_size=20, unique=True))
def test_motion_does_not_depend_on_the_grid(seed, cut):
    t = np.linspace(-0.02, 0.06, 300)
    event, jump, kick = random_events(seed)
    some = np.sort(cut)
    whole = ring(t, event, jump, kick, OMEGA, ZETA)
    np.testing.assert_allclose(ring(t[some], event, jump, kick, OMEGA, ZETA), whole[:, some], atol=1e-12)


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=st.integers(0, 10**6), a=st.floats(-3, 3), b=st.floats(-3, 3), delay=st.floats(-1, 1))
def test_motion_is_linear_in_the_events_and_moves_with_them(seed, a, b, delay):
    t = np.linspace(-0.01, 0.06, 200)
    event, jump, kick = random_events(seed)
    _, jump2, kick2 = random_events(seed + 1)
    one, two = ring(t, event, jump, kick, OMEGA, ZETA), ring(t, event, jump2, kick2, OMEGA, ZETA)
    both = ring(t + delay, event + delay, a * jump + b * jump2, a * kick + b * kick2, OMEGA, ZETA)
    np.testing.assert_allclose(both, a * one + b * two, atol=1e-9)  # t + delay rounds at 1e-16 s × 5000/s × 100


def test_ramps_of_force_agree_with_brute_force():
    # q̈ + 2ζωq̇ + ω²q = −ÿ for y of straight pieces: each corner kicks by minus its change of slope
    corner, slope = np.array([0.002, 0.005, 0.0071, 0.012]), np.array([3.0, -5.0, 4.0, -2.0])
    t = np.linspace(0, 0.03, 200)
    found = ring(t, corner, np.zeros((2, 4)), -np.tile(slope, (2, 1)), OMEGA, ZETA)
    for i in range(2):

        def motion(when, y, i=i):  # in z = q + y, which feels y but not its second derivative
            ground = np.sum(slope * np.maximum(when - corner, 0))
            rate = np.sum(slope * (when > corner))
            return [y[1], -2 * ZETA[i] * OMEGA[i] * (y[1] - rate) - OMEGA[i] ** 2 * (y[0] - ground)]

        z, state = [], [0.0, 0.0]
        for a, b in zip([0, *corner], [*corner, t[-1]], strict=True):  # restart at each corner
            inside = t[(t >= a) & (t < b + (b == t[-1]))]
            sol = solve_ivp(motion, (a, b), state, method="DOP853", dense_output=True, rtol=1e-12, atol=1e-15)
            state = sol.y[:, -1]
            z.append(sol.sol(inside)[0])
        ground = (slope * np.maximum(t[:, None] - corner, 0)).sum(1)
        np.testing.assert_allclose(found[i], np.concatenate(z) - ground, atol=1e-8 * np.abs(found[i]).max())


def test_energy_between_events_goes_where_the_damping_says():
    # d/dt(½q̇² + ½ω²q²) = −2ζωq̇², with q̇ from the motion's own derivative
    event, jump, kick = random_events(3)
    t = np.linspace(0.041, 0.06, 4001)  # after the last event
    q = ring(t, event, jump, kick, OMEGA, ZETA)
    step = t[1] - t[0]
    v = (q[:, :-4] - 8 * q[:, 1:-3] + 8 * q[:, 3:-1] - q[:, 4:]) / (12 * step)
    energy = v**2 / 2 + (OMEGA[:, None] * q[:, 2:-2]) ** 2 / 2
    lost = 2 * ZETA * OMEGA * np.sum(v[:, :-1] ** 2 + v[:, 1:] ** 2, axis=1) / 2 * step
    np.testing.assert_allclose(energy[:, 0] - energy[:, -1], lost, rtol=1e-5)


@pytest.mark.parametrize(("t", "event"), [([0.0, 2.0, 1.0], [0.0, 1.0]), ([0.0, 1.0], [1.0, 0.0])])
def test_time_that_runs_backwards_is_refused(t, event):
    with refusal("range", "times of samples and events"):
        ring(np.array(t), np.array(event), np.ones((1, 2)), np.zeros((1, 2)), np.ones(1), np.zeros(1))


def test_undamped_modes_ring_for_ever_at_their_own_amplitude():
    event, jump, kick = np.array([0.0]), np.array([[0.3]]), np.array([[40.0]])
    t = np.linspace(0, 50, 7)
    q = ring(t, event, jump, kick, np.array([200.0]), np.zeros(1))
    np.testing.assert_allclose(q[0], free_decay(t, 0.3, 40.0, 200.0, 0.0), atol=1e-12)


def test_nothing_moves_before_the_first_event_and_an_event_at_a_sample_acts_there():
    q = ring(np.array([0.0, 1.0, 2.0]), np.array([1.0]), np.array([[0.5]]), np.zeros((1, 1)), np.ones(1), np.zeros(1))
    np.testing.assert_allclose(q, [[0, 0.5, 0.5 * np.cos(1)]], atol=1e-15)


@pytest.mark.parametrize(
    ("omega", "zeta", "rule"),
    [(0.0, 0.1, ("range", "omega")), (1.0, 1.0, ("range", "damping")), (1.0, -0.1, ("range", "damping"))],
)
def test_oscillators_out_of_range_are_refused(omega, zeta, rule):
    with refusal(*rule):
        ring(np.zeros(1), np.zeros(1), np.zeros((1, 1)), np.zeros((1, 1)), np.array([omega]), np.array([zeta]))
