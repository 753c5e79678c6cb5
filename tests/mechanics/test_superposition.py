"""A whole texture: what the contact does, and what the whisker answers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from vibrissa.errors import InputError
from vibrissa.mechanics.gap import excursion_at_jump
from vibrissa.mechanics.oscillator import green_function
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.sampled import predicted_signals
from vibrissa.mechanics.superposition import Scan, predict, trough_events
from vibrissa.texture.surface import Troughs
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.29, base_angle=1.2)
RULES = {"continuous": 0.0, "ramp-limit": 2.0, "paper2014": 1.0}  # q̇(0⁺) = −rule·ζωΔq (MODEL.md, "Dynamics")


def troughs(position, width):
    return Troughs(position=np.array(position), width=np.array(width))


ONE = troughs([1e-3], [0.6e-3])
SEVERAL = troughs([1e-3, 1.9e-3, 2.6e-3, 3.4e-3], [0.6e-3, 0.2e-3, 0.5e-3, 1e-3])


def scan(jump="continuous", speed=0.12, damping=0.11, response="linear"):
    return Scan(speed=speed, damping=damping, jump=jump, response=response)


def test_excursion_is_a_lopsided_sawtooth():
    events = trough_events(ONE, WHISKER, POSTURE, 0.12)
    t1, t2, t3 = events.time
    jump = excursion_at_jump(POSTURE, 0.015)
    rate = 0.12 / 0.04
    np.testing.assert_allclose([t1, t2, t3], [1e-3 / 0.12, 1e-3 / 0.12 + jump / rate, 1.6e-3 / 0.12], rtol=1e-6)
    assert t2 - t1 < 0.1 * (t3 - t1)  # t₂ comes early
    beside = np.array([t1 - 1e-9, t2 - 1e-9, t2 + 1e-9, t3 - 1e-9, t3 + 1e-9, 1.0])
    expected = [0, jump, jump - 0.015, 0, 0, 0]
    np.testing.assert_allclose(events.excursion(beside), expected, atol=2 * rate * 1e-9)
    middle = np.array([t1 + 0.4 * (t2 - t1), t1 + 0.6 * (t2 - t1), 0.6 * t2 + 0.4 * t3, 0.4 * t2 + 0.6 * t3])
    d = events.excursion(middle)
    np.testing.assert_allclose([(d[1] - d[0]) / (middle[1] - middle[0]), (d[3] - d[2]) / (middle[3] - middle[2])], rate)


@settings(deadline=None, derandomize=True, max_examples=8)
@given(seed=st.integers(0, 10**6), speed=st.floats(0.01, 0.5))
def test_contact_is_back_on_every_land(seed, speed):
    edge = np.cumsum(np.random.default_rng(seed).uniform(5e-5, 1e-3, 40))
    texture = troughs(edge[0::2], edge[1::2] - edge[0::2])
    d = trough_events(texture, WHISKER, POSTURE, speed).excursion
    lands = np.concatenate([[edge[0] / 2], (edge[1:-1:2] + edge[2::2]) / 2, [edge[-1] + 1e-3]]) / speed
    np.testing.assert_allclose(d(lands), 0, atol=1e-14)
    gaps = (edge[0::2, None] + np.linspace(0.01, 0.99, 21) * (edge[1::2] - edge[0::2])[:, None]) / speed
    inside = d(gaps.ravel()).reshape(gaps.shape)
    assert np.all(inside > -(edge[1::2] - edge[0::2])[:, None] / WHISKER.length)
    assert np.all(inside[:, -1] < 0)  # nearly back, from below


@pytest.mark.parametrize("rule", RULES)
def test_answer_to_one_gap_is_the_printed_closed_form(rule):
    # Eq. 12: −c v G(t − t₁) and +c v G(t − t₃); Eq. 13: +cλ e^{−ζωt}[cos + …] from t₂
    prediction = predict(WHISKER, POSTURE, ONE, scan(rule), n_modes=3)
    t1, t2, t3 = prediction.events.time
    t = np.linspace(0, 0.06, 900)
    q = prediction.amplitudes(t)
    rate, width = 0.12 / 0.04, 0.015
    for i, (omega, c) in enumerate(zip(prediction.omega, prediction.c, strict=True)):
        decay, big_omega = 0.11 * omega, omega * np.sqrt(1 - 0.11**2)
        since = np.maximum(t - t2, 0)
        sine = (1 - RULES[rule]) * decay / big_omega
        fall = np.exp(-decay * since) * (np.cos(big_omega * since) + sine * np.sin(big_omega * since))
        ramps = green_function(t - t3, omega, 0.11) - green_function(t - t1, omega, 0.11)
        expected = c * rate * ramps + c * width * np.where(t >= t2, fall, 0)
        np.testing.assert_allclose(q[i], expected, atol=1e-12)


@pytest.mark.parametrize("rule", RULES)
def test_displacement_is_continuous_at_the_jump_and_velocity_obeys_its_rule(rule):
    prediction = predict(WHISKER, POSTURE, ONE, scan(rule), n_modes=3)
    t2 = prediction.events.time[1]
    h = 1e-7 * np.arange(1, 4)
    signals = predicted_signals(prediction, np.concatenate([t2 - h[::-1], t2 + h]))
    q, total = signals.mode_amplitude.values, signals.mode_displacement.values

    def at_jump(values):  # parabola through three points, to the jump
        return 3 * values[:, 0] - 3 * values[:, 1] + values[:, 2]

    np.testing.assert_allclose(at_jump(total[:, 3:]), at_jump(total[:, 2::-1]), atol=1e-14)
    delta = at_jump(q[:, 3:]) - at_jump(q[:, 2::-1])
    np.testing.assert_allclose(delta, prediction.c * 0.015, rtol=1e-9)  # −∫s²ΔU V with ΔU = −λŪ

    def speed(values, sign):  # from the same parabola
        return sign * (-2.5 * values[:, 0] + 4 * values[:, 1] - 1.5 * values[:, 2]) / 1e-7

    after, before = speed(q[:, 3:], 1), speed(q[:, 2::-1], -1)
    np.testing.assert_allclose(
        after - before,
        -RULES[rule] * 0.11 * prediction.omega * delta,
        atol=2e-5 * np.abs(prediction.omega * delta).max(),
    )


def test_points_of_the_shaft_do_not_jump_but_for_the_modes_left_out():
    s = np.linspace(0.3, 1, 40)
    step = []
    for count in (12, 24):
        prediction = predict(WHISKER, POSTURE, ONE, scan(), n_modes=count)
        t2 = prediction.events.time[1]
        r = prediction.displacement(np.array([t2 - 1e-9, t2 + 1e-9]), s)
        step.append(np.abs(r[1] - r[0]).max() / (0.015 * np.abs(prediction.response.unit.displacement(s)).max()))
    assert step[0] <= 0.01
    assert step[1] <= 0.0025


@pytest.mark.parametrize("rule", ["continuous", "ramp-limit"])
def test_jump_is_the_limit_of_ever_steeper_ramps(rule):
    """Brute force on ramps of duration τ; the vibration's own damping, or the whole motion's, during the fall."""
    prediction = predict(WHISKER, POSTURE, ONE, scan(rule), n_modes=1)
    (t1, t2, t3), c, omega = prediction.events.time, prediction.c[0], prediction.omega[0]
    rate, width, end = 0.12 / 0.04, 0.015, 0.03
    error = []
    for tau in (8e-6, 4e-6, 2e-6):

        def slope(when, t2=t2, tau=tau):
            return rate * (t1 <= when < t3) - width / tau * (t2 <= when < t2 + tau)

        def motion(when, z, t2=t2, tau=tau):  # z = q + c d; z̈ = −2ζω(q̇ or ż) − ω²q
            falls = t2 <= when < t2 + tau
            carried = rate if rule == "continuous" and falls else slope(when)
            # "continuous": while it falls, damping acts on ż; else on the vibration, as Eq. 6 has it
            return [
                z[1],
                -2 * 0.11 * omega * (z[1] - c * (carried if t1 <= when < t3 else 0)) - omega**2 * (z[0] - c * z[2]),
                slope(when),
            ]

        state = [0.0, 0.0, 0.0]
        for a, b in ((t1, t2), (t2, t2 + tau), (t2 + tau, t3), (t3, end)):
            shrink = 1e-12  # stay inside the piece
            state = solve_ivp(motion, (a + shrink, b - shrink), state, method="DOP853", rtol=1e-11, atol=1e-15).y[:, -1]
        found = float(prediction.amplitudes(np.array([end]))[0, 0])
        error.append(abs(state[0] - c * state[2] - found) / (abs(c) * width))
    np.testing.assert_allclose(np.log2(np.divide(error[:-1], error[1:])), 1, atol=0.2)
    assert error[-1] < 5e-3


def test_rules_coincide_without_damping():
    t = np.linspace(0, 0.06, 300)
    one, *rest = [predict(WHISKER, POSTURE, SEVERAL, scan(rule, damping=0.0)).amplitudes(t) for rule in RULES]
    for other in rest:
        np.testing.assert_allclose(other, one, atol=1e-15)


def test_texture_is_the_sum_of_its_gaps():
    t, s = np.linspace(0, 0.06, 200), np.linspace(0.3, 1, 7)
    whole = predict(WHISKER, POSTURE, SEVERAL, scan()).displacement(t, s)
    each = [
        predict(WHISKER, POSTURE, troughs([x], [w]), scan()).displacement(t, s)
        for x, w in zip(SEVERAL.position, SEVERAL.width, strict=True)
    ]
    np.testing.assert_allclose(whole, sum(each), atol=1e-9 * np.abs(whole).max())  # d₂'s table


@settings(deadline=None, derandomize=True, max_examples=4)
@given(shift=st.floats(0, 0.05), speed=st.floats(0.03, 0.4))
def test_moving_the_texture_delays_the_answer(shift, speed):
    moved = Troughs(position=SEVERAL.position + shift, width=SEVERAL.width)
    t = np.linspace(0, 0.1, 150)
    here = predict(WHISKER, POSTURE, SEVERAL, scan(speed=speed), n_modes=3).amplitudes(t)
    there = predict(WHISKER, POSTURE, moved, scan(speed=speed), n_modes=3).amplitudes(t + shift / speed)
    np.testing.assert_allclose(there, here, atol=1e-11)


@settings(deadline=None, derandomize=True, max_examples=4)
@given(scale=st.floats(0.2, 5))
def test_whisker_texture_and_speed_scale_together(scale):
    # lengths × a at a fixed cone angle: k × a, so the same adimensional motion at times × a
    t = np.linspace(0, 0.06, 150)
    big = Whisker(length=0.04 * scale, cone_angle=1.5e-3)
    larger = Troughs(position=SEVERAL.position * scale, width=SEVERAL.width * scale)
    one = predict(WHISKER, POSTURE, SEVERAL, scan(), n_modes=3).amplitudes(t)
    other = predict(big, POSTURE, larger, scan(), n_modes=3).amplitudes(t * scale)
    np.testing.assert_allclose(other, one, atol=1e-11)


def test_signals_do_not_depend_on_the_sampling():
    prediction = predict(WHISKER, POSTURE, SEVERAL, scan(), n_modes=3)
    fine = predicted_signals(prediction, np.arange(4000) / 5e4)
    coarse = predicted_signals(prediction, np.arange(0, 4000, 25) / 5e4)
    for name in ("excursion", "mode_amplitude", "mode_displacement", "base_curvature"):
        np.testing.assert_allclose(coarse[name], fine[name].isel(time=slice(None, None, 25)), atol=1e-12)


def test_movie_shows_vibration_and_excursion_together():
    prediction = predict(WHISKER, POSTURE, SEVERAL, scan(), n_modes=3)
    signals = predicted_signals(prediction, np.linspace(0, 0.06, 100))
    expected = signals.mode_amplitude.values + prediction.c[:, None] * signals.excursion.values
    np.testing.assert_allclose(signals.mode_displacement, expected, atol=1e-17)
    np.testing.assert_allclose(signals.resonant_frequency * 2 * np.pi * WHISKER.timescale, signals.kappa)


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: scan(speed=0.0), "Scan.speed"),
        (lambda: scan(speed=np.inf), "Scan.speed"),
        (lambda: scan(damping=1.0), "Scan.damping"),
        (lambda: scan(damping=np.nan), "Scan.damping"),
        (lambda: scan("smooth"), "Scan.jump"),
        (
            lambda: predict(Whisker(length=0.04, cone_angle=1.5e-3, tip=0.3), POSTURE, ONE, scan()),
            "beyond the whisker's tip",
        ),
        (lambda: predict(WHISKER, Posture(contact=0.1, base_angle=1.45), ONE, scan()), "fold"),
    ],
)
def test_impossible_scans_are_refused(call, rule):
    with pytest.raises(InputError, match=rule):
        call()
