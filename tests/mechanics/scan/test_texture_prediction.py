"""A whole texture: what the contact does, and what the whisker answers."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.contact.gap_events import trough_events
from vibrissa.mechanics.quasi_static.response import Piece, quasi_static
from vibrissa.mechanics.scan.sampled import predicted_signals
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.edge_contact import hold, on_the_flat
from vibrissa.mechanics.statics.gap import excursion_at_jump, jump_table
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.vibration.oscillator import green_function
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.29, base_angle=1.2)
RULES = {"continuous": 0.0, "ramp-limit": 2.0, "paper2014": 1.0}  # q̇(0⁺) = −rule·ζωΔq (MODEL.md, "Dynamics")


def troughs(position, width):
    return Gaps(position=np.array(position), width=np.array(width))


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
    moved = Gaps(position=SEVERAL.position + shift, width=SEVERAL.width)
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
    larger = Gaps(position=SEVERAL.position * scale, width=SEVERAL.width * scale)
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


# The exact response


@cache
def tables(form="exact"):
    """Made once, for gaps of 6 µm to 1 mm."""
    jumps = jump_table(POSTURE, np.array([1.5e-4, 0.026]))
    return {"response": quasi_static(POSTURE, (-0.0255, 1.3e-3), form=form, n_modes=3), "jumps": jumps}


def exact(texture, jump="continuous", speed=0.12, damping=0.11):
    return predict(WHISKER, POSTURE, texture, scan(jump, speed, damping, "exact"), n_modes=3, **tables())


def linear(texture, speed=0.12):
    return predict(WHISKER, POSTURE, texture, scan(speed=speed), n_modes=3, **tables("linear"))


@cache
def amplitude_of_held_profiles():
    """Q_i(d) as a spline of order 9 through profiles held one by one, with quadrature of its own."""
    contact, flat, kappa = 0.29, on_the_flat(POSTURE), cone_kappa(0.29, 3)
    node, weight = np.polynomial.legendre.leggauss(60)
    excursions, rows = np.linspace(-0.0152, 8e-4, 61), []
    for d in excursions.tolist():
        held, row = hold(flat, d), np.zeros(3)
        for low, high in ((contact, max(contact, held.contact)), (max(contact, held.contact), 1.0)):
            s = (low + high) / 2 + (high - low) / 2 * node
            shift, angle = np.subtract(held.position(s), flat.position(s)), flat.angle(s)
            u = np.cos(angle) * shift[1] - np.sin(angle) * shift[0]
            row += cone_modes(kappa, contact, s) @ ((high - low) / 2 * weight * s**2 * u)
        rows.append(row)
    return make_interp_spline(excursions, np.array(rows), k=9)


@pytest.mark.parametrize("rule", RULES)
def test_exact_answer_is_that_of_brute_force(rule):
    texture, t, speed = troughs(SEVERAL.position[:3], SEVERAL.width[:3]), np.linspace(0, 0.05, 500), 0.12
    prediction, amplitude = exact(texture, rule, speed), amplitude_of_held_profiles()
    slope, bend = amplitude.derivative(), amplitude.derivative(2)
    rest, rate, omega = amplitude(0.0), speed / 0.04, prediction.omega
    legs = [(0.0, 0.0, 0.0)]  # start, d there, rate of d
    for (t1, t2, t3), width in zip(prediction.events.time.reshape(-1, 3), texture.width / 0.04, strict=True):
        legs += [(t1, 0.0, rate), (t2, rate * (t2 - t1) - width, rate), (t3, 0.0, 0.0)]
    state, found, before = np.zeros(6), np.zeros((3, t.size)), (rest, 0.0)
    for (start, d, v), stop in zip(legs, [*(leg[0] for leg in legs[1:]), t[-1] + 1e-9], strict=True):
        fall = before[0] - amplitude(d)
        state[:3] += fall
        state[3:] += before[1] - slope(d) * v - RULES[rule] * 0.11 * omega * fall

        def motion(when, y, start=start, d=d, v=v):
            force = -bend(d + v * (when - start)) * v**2
            return np.concatenate([y[3:], force - 2 * 0.11 * omega * y[3:] - omega**2 * y[:3]])

        path = solve_ivp(motion, (start, stop), state, method="DOP853", dense_output=True, rtol=1e-11, atol=1e-14)
        inside = (t >= start) & (t < stop)
        if inside.any():
            found[:, inside] = path.sol(t[inside])[:3]
        state, end = path.y[:, -1].copy(), d + v * (stop - start)
        before = amplitude(end), slope(end) * v
    np.testing.assert_allclose(prediction.amplitudes(t), found, atol=1e-8 * np.abs(found).max())


@pytest.mark.parametrize("rule", RULES)
def test_exact_motion_is_continuous_at_every_event(rule):
    """Whole displacement at t₁, t₂ and t₃; whole velocity where the contact does not jump, or by the rule."""
    prediction = exact(SEVERAL, rule)
    event = prediction.drive.time  # with the borders between pieces
    beside = np.stack([np.nextafter(event, -np.inf), event], axis=1).ravel()
    q, q_rate = prediction.vibration(beside)
    total, velocity = q + prediction.mode_drive(beside), q_rate + prediction.mode_drive.rate(beside)
    size = np.abs(total).max(axis=1, keepdims=True)
    assert np.all(np.abs(total[:, 1::2] - total[:, 0::2]) < 1e-9 * size.max())
    delta = q[:, 1::2] - q[:, 0::2]
    expected = -RULES[rule] * 0.11 * prediction.omega[:, None] * delta
    error = np.abs(velocity[:, 1::2] - velocity[:, 0::2] - expected)
    assert np.all(error < 1e-6 * np.abs(velocity).max(axis=1, keepdims=True))
    jumps = np.isin(event, prediction.events.time[1::3])
    assert len(event) > 12
    assert np.abs(delta[:, jumps]).min() > 1e4 * np.abs(delta[:, ~jumps]).max()


def test_narrow_gaps_are_linear_and_what_is_left_falls_with_the_width():
    # slower as they are narrower, so that the vibration has the same time to answer
    t, error = np.linspace(0, 0.05, 400), []
    for scale in (1 / 4, 1 / 8, 1 / 16, 1 / 32):
        texture, speed = Gaps(position=SEVERAL.position * scale, width=SEVERAL.width * scale), 0.12 * scale
        one = exact(texture, speed=speed).amplitudes(t)
        other = linear(texture, speed).amplitudes(t)
        error.append(np.abs(one - other).max(axis=1) / np.abs(other).max(axis=1))
    order = np.log2(np.divide(error[:-1], error[1:]))
    np.testing.assert_allclose(order, 1, atol=0.15)
    np.testing.assert_allclose(order[-1], 1, atol=0.04)


def test_exact_answers_to_gaps_add_up_too():
    # d visits one gap at a time, and the vibration is linear in Q
    t, s = np.linspace(0, 0.06, 200), np.linspace(0.2, 1, 9)
    whole = exact(SEVERAL)
    each = [exact(troughs([x], [w])) for x, w in zip(SEVERAL.position, SEVERAL.width, strict=True)]
    # the shape near the contact to the error of its table, made at each gap's d = 0 too
    for motion, share in ((lambda one: one.amplitudes(t), 1e-8), (lambda one: one.displacement(t, s), 1e-6)):
        expected = sum(motion(one) for one in each)
        np.testing.assert_allclose(motion(whole), expected, rtol=0, atol=share * np.abs(expected).max())


def test_exact_answer_does_not_grow_with_the_gap_as_the_linear_one():
    wide = exact(troughs([1e-3], [1e-3]))
    beside = np.stack([np.nextafter(wide.events.time[1], 0), wide.events.time[1]])
    jump = [np.diff(one.amplitudes(beside), axis=1)[:, 0] for one in (wide, linear(wide.texture))]
    np.testing.assert_allclose(jump[0] / jump[1], [0.722, 0.412, -0.169], atol=6e-4)  # MODEL.md, "A gap"


def test_where_the_polynomials_are_cut_does_not_matter():
    t = np.linspace(0, 0.06, 300)
    wide = quasi_static(POSTURE, (-0.031, 2e-3), n_modes=3)
    one = exact(SEVERAL)
    other = predict(
        WHISKER, POSTURE, SEVERAL, scan(response="exact"), n_modes=3, response=wide, jumps=tables()["jumps"]
    )
    assert len(one.drive.time) != len(SEVERAL.width) * 3
    assert not np.array_equal(one.drive.time, other.drive.time)
    for ask in (lambda p: p.amplitudes(t), lambda p: p.mode_drive(t), lambda p: p.vibration(t)[1]):
        np.testing.assert_allclose(ask(other), ask(one), atol=1e-8 * np.abs(ask(one)).max())


def halves(piece):
    middle = (piece.low + piece.high) / 2
    for low, high in ((piece.low, middle), (middle, piece.high)):
        z = np.cos(np.pi * (np.arange(12) + 0.5) / 12)
        values = piece.taylor((low + high) / 2 + (high - low) / 2 * z)[..., 0]
        yield Piece(low, high, np.polynomial.chebyshev.chebfit(z, values.T, 11).T)


def test_borders_passed_on_either_ramp_leave_no_trace():
    t, whole = np.linspace(0, 0.06, 300), exact(SEVERAL)
    pieces = tuple(half for piece in whole.response.pieces for half in halves(piece))
    assert sum(0 < piece.high < 1.2e-3 for piece in pieces) > 0  # one on the way up, too
    cut = replace(whole, response=replace(whole.response, pieces=pieces))
    assert len(cut.drive.time) > len(whole.drive.time)
    for ask in (lambda p: p.amplitudes(t), lambda p: p.mode_drive(t), lambda p: p.vibration(t)[1]):
        np.testing.assert_allclose(ask(cut), ask(whole), rtol=0, atol=1e-9 * np.abs(ask(whole)).max())


def test_drive_follows_the_response_along_the_sawtooth():
    prediction = exact(SEVERAL)
    t = np.linspace(0, 0.05, 997)
    expected = prediction.response(prediction.events.excursion(t))
    size = np.abs(expected).max(axis=1, keepdims=True)
    assert np.all(np.abs(prediction.drive(t) - expected) < 1e-9 * size)
    rate = prediction.response.taylor(prediction.events.excursion(t))[..., 1] * 3.0
    moving = np.searchsorted(prediction.events.time, t, side="right") % 3 != 0  # not on a land
    error = np.abs(prediction.drive.rate(t) - rate * moving)
    assert np.all(error < 1e-6 * np.abs(rate).max(axis=1, keepdims=True))


@pytest.mark.parametrize("form", ["exact", "linear"])
def test_predictions_share_a_response(form):
    t = np.linspace(0, 0.05, 100)
    first = predict(WHISKER, POSTURE, SEVERAL, scan(response=form), n_modes=3)
    again = predict(WHISKER, POSTURE, SEVERAL, scan(response=form), n_modes=3, response=first.response)
    assert again.response is first.response
    np.testing.assert_array_equal(again.amplitudes(t), first.amplitudes(t))
    for speed in (0.05, 0.07, 0.13):  # the same gaps reach as far at any speed
        predict(WHISKER, POSTURE, SEVERAL, scan(speed=speed, response=form), n_modes=3, response=first.response)


@pytest.mark.parametrize("form", ["exact", "linear"])
def test_position_is_the_displacement_along_the_normal(form):
    prediction = exact(SEVERAL) if form == "exact" else linear(SEVERAL)
    t, s = np.linspace(0, 0.04, 40), np.linspace(0.1, 1, 300)
    flat = on_the_flat(POSTURE)
    angle, (x0, y0), (x, y) = flat.angle(s), flat.position(s), prediction.position(t, s)
    along_normal = np.cos(angle) * (y - y0) - np.sin(angle) * (x - x0)
    r = prediction.displacement(t, s)
    np.testing.assert_allclose(along_normal, r, atol=1e-12)
    np.testing.assert_allclose(x[0], x0, atol=1e-12)  # before the first gap
    np.testing.assert_allclose([x[:, -1], y[:, -1]], 0, atol=1e-9)  # the base
    free = s < 0.28
    for values in (x, y, r):  # the end beyond the contact is straight
        assert np.abs(np.diff(values[:, free], 2, axis=1)).max() < 1e-9


@pytest.mark.parametrize("form", ["exact", "linear"])
def test_shaft_stretches_to_second_order_only(form):
    t, s, stretch = np.linspace(0, 0.04, 80), np.linspace(0.2, 1, 800), []
    for scale in (1 / 4, 1 / 8, 1 / 16):
        texture = Gaps(position=SEVERAL.position * scale, width=SEVERAL.width * scale)
        x, y = (exact if form == "exact" else linear)(texture, speed=0.12 * scale).position(t, s)
        stretch.append(np.abs(np.hypot(np.diff(x), np.diff(y)) / np.diff(s) - 1).max())
    np.testing.assert_allclose(np.log2(np.divide(stretch[:-1], stretch[1:])), 2, atol=0.35)


@pytest.mark.parametrize(
    ("other", "rule"),
    [
        ({"texture": troughs([1e-3], [1.1e-3])}, "reach as far"),
        ({"posture": Posture(contact=0.3, base_angle=1.2)}, "the same posture"),
        ({"scan": scan()}, "the same posture, form"),
        ({"n_modes": 4}, "form and modes"),
    ],
)
def test_response_of_another_prediction_is_refused(other, rule):
    asked = {"posture": POSTURE, "texture": ONE, "scan": scan(response="exact"), "n_modes": 3} | other
    posture, texture, how = asked.pop("posture"), asked.pop("texture"), asked.pop("scan")
    with refusal("conflict", "response") as caught:
        predict(WHISKER, posture, texture, how, **asked, response=tables()["response"])
    assert rule in str(caught.value)


@pytest.mark.parametrize("width", [8e-3, 0.03])
@pytest.mark.parametrize("posture", [POSTURE, Posture(contact=0.15, base_angle=1.4)])
@pytest.mark.parametrize("form", ["exact", "linear"])
def test_gap_too_wide_for_the_posture_is_told_in_one_line(posture, width, form):
    with refusal("range", "gap_width") as caught:
        predict(WHISKER, posture, troughs([1e-3], [width]), scan(response=form), n_modes=3)
    beyond_base = "must lie between 0 and the base's distance" in caught.value.rule
    assert beyond_base == (width == 0.03)
    assert caught.value.remedy.startswith("" if beyond_base else "narrow the gap")
    assert float(caught.value.value.removesuffix(" L")) == pytest.approx(width / WHISKER.length, rel=1e-3)
    assert "L" in (caught.value.rule if beyond_base else caught.value.value)


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: scan(speed=0.0), ("range", "Scan.speed")),
        (lambda: scan(speed=-0.1), ("range", "Scan.speed")),
        (lambda: scan(speed=np.nan), ("range", "Scan.speed")),
        (lambda: scan(damping=-1e-9), ("range", "Scan.damping")),
        (lambda: scan(damping=1.5), ("range", "Scan.damping")),
        (lambda: scan(response="cubic"), ("unknown", "Scan.response")),
        (lambda: troughs([], []), ("too-few", "texture")),
        (lambda: troughs([1e-3, np.nan], [1e-4, 1e-4]), ("range", "texture")),
        (lambda: troughs([1e-3, 2e-3], [1e-4, np.nan]), ("range", "texture")),
        (lambda: troughs([1e-3, 2e-3], [1e-4, 0.0]), ("range", "texture")),
        (lambda: troughs([1e-3, 1.05e-3], [1e-4, 1e-4]), ("range", "texture")),
        (lambda: troughs([2e-3, 1e-3], [1e-4, 1e-4]), ("range", "texture")),
        (
            lambda: predict(WHISKER, Posture(contact=0.1, base_angle=1.45), ONE, scan(response="exact")),
            ("range", "gap_width"),
        ),
        (lambda: scan(speed=np.inf), ("range", "Scan.speed")),
        (lambda: scan(damping=1.0), ("range", "Scan.damping")),
        (lambda: scan(damping=np.nan), ("range", "Scan.damping")),
        (lambda: scan("smooth"), ("unknown", "Scan.jump")),
        (
            lambda: predict(Whisker(length=0.04, cone_angle=1.5e-3, tip=0.3), POSTURE, ONE, scan()),
            ("range", "Posture.contact"),
        ),
        (lambda: predict(WHISKER, Posture(contact=0.1, base_angle=1.45), ONE, scan()), ("range", "gap_width")),
    ],
)
def test_impossible_scans_are_refused(call, rule):
    with refusal(*rule):
        call()


@pytest.mark.parametrize(
    ("position", "width", "message"),
    [
        (
            [1e-3, 5.0],
            [3e-4, 3e-4],
            ("range", "texture"),
        ),
        ([1e-6, 1e-3], [5e-9, 3e-4], ("range", "texture")),
    ],
)
def test_positions_in_a_wrong_unit_are_refused_at_once(position, width, message):
    texture = Gaps(position=np.array(position), width=np.array(width))
    whisker = Whisker(length=0.04, cone_angle=1.5e-3)
    with refusal(*message):
        predict(whisker, Posture(contact=0.29, base_angle=1.2), texture, Scan(speed=0.1, damping=0.11))
