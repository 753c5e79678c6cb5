"""A posture that changes while the texture is met: beside one at rest, direct integration, and modes that mix."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from refusals import refusal
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from vibrissa.api.motion import Motion
from vibrissa.exact import cone_kappa, cone_modes, shaft_quadrature
from vibrissa.mechanics.scan.free_end import free_end_lines
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.gap import coupling, excursion_at_jump, unit_response
from vibrissa.mechanics.statics.profile import Posture, flat_curve
from vibrissa.mechanics.vibration.dynamics import Drive
from vibrissa.mechanics.whisking.active_whisking import predict_slow, remarks, slow_signals
from vibrissa.mechanics.whisking.drifting_oscillator import drift
from vibrissa.mechanics.whisking.panels import fit
from vibrissa.mechanics.whisking.path_table import mode_mixing
from vibrissa.mechanics.whisking.posture_path import PosturePath
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)
SEVERAL = Gaps(position=np.array([1e-3, 1.9e-3, 2.6e-3, 3.4e-3]), width=np.array([0.6e-3, 0.2e-3, 0.5e-3, 1e-3]))
SPREAD = Gaps(position=np.array([3e-3, 9e-3, 15e-3, 21e-3]), width=np.full(4, 0.6e-3))
NARROW = Gaps(position=np.array([1e-3]), width=np.array([0.1e-3]))
ONE = Gaps(position=np.array([1e-3]), width=np.array([0.6e-3]))


def scan(speed=0.12, damping=0.11, jump="continuous", response="linear"):
    return Scan(speed=speed, damping=damping, jump=jump, response=response)


def whisking(contact=(0.25, 0.33), angle=(1.1, 1.1), duration=0.25, samples=21):
    """Sweep contact and angle once there and back."""
    t = np.linspace(0, duration, samples)
    swing = (1 - np.cos(2 * np.pi * t / duration)) / 2
    return PosturePath(
        time=t,
        contact=contact[0] + (contact[1] - contact[0]) * swing,
        base_angle=angle[0] + (angle[1] - angle[0]) * swing,
    )


@cache
def whisked():
    return predict_slow(WHISKER, whisking(), SPREAD, scan(), n_modes=3)


@pytest.mark.parametrize("form", ["linear", "exact"])
@pytest.mark.parametrize("rule", ["continuous", "ramp-limit", "paper2014"])
def test_posture_at_rest_is_the_ordinary_prediction(form, rule):
    path = PosturePath(time=np.linspace(0, 0.06, 5), contact=np.full(5, 0.29), base_angle=np.full(5, 1.2))
    asked = scan(jump=rule, response=form)
    slow = predict_slow(WHISKER, path, SEVERAL, asked, n_modes=4)
    known = predict(WHISKER, Posture(contact=0.29, base_angle=1.2), SEVERAL, asked, n_modes=4)
    t = np.linspace(0, 0.06, 900)
    for name in ("amplitudes", "mode_displacement"):
        expected = getattr(known, name)(t)
        np.testing.assert_allclose(getattr(slow, name)(t), expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(slow.excursion(t), known.events.excursion(t), atol=1e-13)
    np.testing.assert_allclose(slow.omega(t)[:, 7], known.omega, rtol=1e-12)
    assert slow.condition.frequency_rate.values.max() < 1e-12
    assert remarks(slow, t)[1:] == free_end_lines(slow.free_end)


@pytest.mark.parametrize(("stop", "jumps"), [(0.0084, 0), (0.0105, 1), (0.0236, 3)])
def test_gap_that_the_path_ends_in_is_met_as_by_a_posture_at_rest(stop, jumps):
    """Up to its end a path is like one at rest: before the first jump, after it, and in the third gap."""
    path = PosturePath(time=np.linspace(0, stop, 5), contact=np.full(5, 0.29), base_angle=np.full(5, 1.2))
    slow = predict_slow(WHISKER, path, SEVERAL, scan(), n_modes=3)
    known = predict(WHISKER, Posture(contact=0.29, base_angle=1.2), SEVERAL, scan(), n_modes=3)
    t = np.linspace(0, stop, 400)
    expected = known.mode_displacement(t)
    np.testing.assert_allclose(slow.mode_displacement(t), expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(slow.excursion(t), known.events.excursion(t), atol=1e-13)
    assert slow.free_end["jump_count"] == jumps
    assert slow.free_end["free_end_length"] == pytest.approx(0.04 * (0.29 - 0.05))
    assert not np.isfinite(slow.advance.meetings.back[-1])


def test_height_held_gives_the_contact_that_stands_under_it():
    t = np.linspace(0, 0.1, 11)
    angle = 1.1 + 0.05 * np.sin(60 * t)
    path = PosturePath(time=t, base_distance=np.full(11, 0.45), base_angle=angle)
    slow = predict_slow(WHISKER, path, ONE, scan(speed=0.3), n_modes=1)
    expected = [Posture.at_height(0.45, one).contact for one in angle]
    np.testing.assert_allclose(slow.contact(t), expected, rtol=1e-8)
    np.testing.assert_allclose(slow.kappa(t)[0], [cone_kappa(one, 1)[0] for one in expected], rtol=1e-7)


def test_contact_and_angle_may_both_change():
    path = whisking(contact=(0.288, 0.292), angle=(1.12, 1.14))
    slow = predict_slow(WHISKER, path, NARROW, scan(response="exact"), n_modes=1)
    assert slow.table.error < 1e-7
    t = np.array([0.03, 0.11, 0.2])
    known = [predict(WHISKER, path.at(one), NARROW, scan(response="exact"), n_modes=1) for one in t]
    np.testing.assert_allclose(slow.c(t).T, [one.c for one in known], rtol=1e-6)
    jump = [-np.diff(one.response(np.concatenate(one.events.gaps)))[:1, 0] / 0.0025 for one in known]
    np.testing.assert_allclose(slow.gain(t).T, jump, rtol=1e-5)


def distance(posture):
    curve = flat_curve(posture)
    return posture.contact * curve.x[-1]


def test_edges_are_met_where_the_base_has_moved_them():
    slow, met = whisked(), whisked().advance.meetings
    rest = distance(slow.path.at(0.0))
    for j, (start, jump, back) in enumerate(zip(met.start, met.jump, met.back, strict=True)):
        for t, place in ((start, 0.0), (back, SPREAD.width[j])):
            ground = 0.12 * t - 0.04 * (distance(slow.path.at(t)) - rest)
            assert ground == pytest.approx(SPREAD.position[j] + place, abs=1e-10)
        ground = 0.12 * jump - 0.04 * (distance(slow.path.at(jump)) - rest)
        deepest = excursion_at_jump(slow.path.at(jump), SPREAD.width[j] / 0.04)
        assert (ground - SPREAD.position[j]) / 0.04 == pytest.approx(deepest, abs=3e-9)
    resting = SPREAD.position / 0.12
    assert np.abs(met.start - resting).max() > 5e-3  # the posture's motion matters


@cache
def direct(n_modes=3, samples=101):
    """Integrate the equation of motion along the same path, with κ, c and D of postures solved one by one."""
    slow, met = whisked(), whisked().advance.meetings
    t = np.linspace(0, 0.25, samples)
    postures = [slow.path.at(one) for one in t]
    omega = CubicSpline(t, [cone_kappa(one.contact, n_modes) / WHISKER.timescale for one in postures])
    c = CubicSpline(t, [coupling(unit_response(one), n_modes) for one in postures])
    place = CubicSpline(t, [0.12 * when / 0.04 - distance(one) for when, one in zip(t, postures, strict=True)])
    state, out, grid = np.zeros(2 * n_modes), [], []
    for j, (start, jump, back) in enumerate(zip(met.start, met.jump, met.back, strict=True)):
        after = met.start[j + 1] if j + 1 < len(met.start) else 0.25
        for low, high, edge in ((start, jump, start), (jump, back, back), (back, after, None)):

            def motion(when, z, edge=edge):  # z = q + Q; velocity and displacement are continuous where Q jumps
                d, rate = (0.0, 0.0) if edge is None else (place(when) - place(edge), place(when, 1))
                q = z[:n_modes] - c(when) * d
                q_rate = z[n_modes:] - c(when, 1) * d - c(when) * rate
                return np.concatenate([z[n_modes:], -2 * 0.11 * omega(when) * q_rate - omega(when) ** 2 * q])

            times = np.linspace(low, high, 12)
            z = solve_ivp(motion, (low, high), state, "DOP853", times, rtol=1e-10, atol=1e-14).y
            state = z[:, -1]
            grid.append(times[1:-1])
            out.append(z[:n_modes, 1:-1])
    return np.concatenate(grid), np.concatenate(out, axis=1)


def test_displacement_is_that_of_direct_integration():
    t, z = direct()
    found = whisked().mode_displacement(t)
    for i in range(3):
        np.testing.assert_allclose(found[i], z[i], atol=1e-7 * np.abs(z[i]).max())


def test_panels_converge_at_the_order_of_their_polynomials():
    """Degree 5 of ω: order 6 or more, while panels are no longer than the knots of the path lie apart."""
    path = PosturePath(time=np.array([0, 0.25]), contact=np.array([0.22, 0.4]), base_angle=np.array([1.1, 1.1]))
    t, found = np.linspace(0, 0.25, 2000), {}
    for panel in (0.25, 0.125, 2e-3):
        found[panel] = predict_slow(WHISKER, path, ONE, scan(damping=0.02, speed=0.2), n_modes=1, panel=panel)
    finest = found[2e-3].mode_displacement(t)
    error = [np.abs(found[panel].mode_displacement(t) - finest).max() for panel in (0.25, 0.125)]
    assert error[0] < 1e-2 * np.abs(finest).max()
    assert np.log2(error[0] / error[1]) > 5.5


def test_ringing_follows_the_resonance_of_the_moments_contact():
    t = np.linspace(0, 1, 11)
    path = PosturePath(time=t, contact=np.linspace(0.25, 0.35, 11), base_angle=np.full(11, 1.1))
    slow = predict_slow(WHISKER, path, ONE, scan(damping=1e-3), n_modes=1)
    fine = np.linspace(slow.advance.meetings.back[0], 1, 100_001)
    q = slow.amplitudes(fine)[0]
    up = np.flatnonzero((q[:-1] < 0) & (q[1:] >= 0))
    zero = fine[up] - q[up] * np.diff(fine)[0] / (q[up + 1] - q[up])
    middle = (zero[1:] + zero[:-1]) / 2
    local = [cone_kappa(0.25 + 0.1 * when, 1)[0] / WHISKER.timescale for when in middle]
    np.testing.assert_allclose(2 * np.pi / np.diff(zero), local, rtol=2e-5)
    assert local[-1] > 1.35 * local[0]
    crest = np.array([np.abs(q[a:b]).max() for a, b in pairwise(up)])
    decay = np.exp(-1e-3 * np.concatenate([[0], np.cumsum(np.diff(middle) * (np.array(local)[1:] + local[:-1]) / 2)]))
    kept = crest / decay * np.sqrt(local)
    np.testing.assert_allclose(kept, kept[0], rtol=2e-3)  # amplitude as ω^−1/2


def test_mixing_is_the_overlap_of_a_mode_with_the_change_of_another():
    contact, step, n = 0.29, 1e-4, 4
    s, weights = shaft_quadrature(contact, 400)
    now, near, far = (cone_modes(cone_kappa(one, n), one, s) for one in contact - step * np.arange(3))
    change = (3 * now - 4 * near + far) / (2 * step)  # one-sided: a contact nearer the base has no mode here
    overlap = (now * weights * s**2) @ change.T
    np.testing.assert_allclose(mode_mixing(contact, n), overlap, atol=2e-4 * np.abs(overlap).max())


@cache
def mixed(rate, n_modes=3):
    """Ringing of mode 1 alone at ε = 0.25, which then moves at a rate [1/s], with the terms that the model leaves out.

    z = Σ z_i V_i(s; ε(t)) obeys (d/dt + ε̇A)² z + ω² z = 0, A_ji = ∫ s² V_j ∂V_i/∂ε ds.
    """
    duration = 0.1 / rate
    grid = np.linspace(0.25, 0.35, 41)
    kappa = CubicSpline(grid, [cone_kappa(one, n_modes) for one in grid])
    overlap = CubicSpline(grid, [mode_mixing(one, n_modes) for one in grid])

    def contact(t):  # from rest to rest
        x = t / duration
        return 0.25 + 0.1 * (x - np.sin(2 * np.pi * x) / (2 * np.pi))

    def speed(t):
        return 0.1 / duration * (1 - np.cos(2 * np.pi * t / duration))

    def motion(t, state):
        z, p = state.reshape(2, -1)
        turn = speed(t) * overlap(contact(t))
        return np.concatenate([p - turn @ z, -turn @ p - (kappa(contact(t)) / WHISKER.timescale) ** 2 * z])

    t = np.linspace(0, duration, 4001)
    start = np.eye(2 * n_modes)[0]
    whole = solve_ivp(motion, (0, duration), start, "DOP853", t, rtol=1e-10, atol=1e-12).y[:n_modes]
    borders = np.linspace(0, duration, 101)
    frequency = fit(lambda when: kappa(contact(when)).T / WHISKER.timescale, borders, 6)
    quasi_static = Drive(borders[:-1], np.zeros((n_modes, 100, 1)), start[:n_modes])
    kept = drift(t, quasi_static, frequency, 0.0)[0]
    moving = speed(t) * np.abs(overlap(contact(t))[:, 1, 0])
    omega = kappa(contact(t)) / WHISKER.timescale
    told = (2 * moving * omega[:, 0] / (omega[:, 1] ** 2 - omega[:, 0] ** 2)).max()
    return np.abs(whole[1]).max(), told, np.abs(kept[1]).max()


def test_what_is_left_out_grows_as_the_condition_says():
    rates = (0.5, 2.0, 8.0)
    error, told = np.array([mixed(rate)[:2] for rate in rates]).T
    assert all(mixed(rate)[2] == 0 for rate in rates)  # the model keeps the modes apart
    np.testing.assert_allclose(error, told, rtol=0.15)
    np.testing.assert_allclose(error[1:] / error[:-1], 4, rtol=0.2)


def test_condition_is_the_rate_of_change_per_radian():
    slow = whisked()
    t = slow.condition.time.values[40]
    step = 1e-4
    before, now, after = (slow.path.at(one) for one in (t - step, t, t + step))
    omega = cone_kappa(now.contact, 1)[0] / WHISKER.timescale
    change = np.log(cone_kappa(after.contact, 1)[0] / cone_kappa(before.contact, 1)[0]) / (2 * step)
    assert slow.condition.frequency_rate.values[40] == pytest.approx(abs(change) / omega, rel=1e-4)
    gains = [coupling(unit_response(one), 1)[0] for one in (before, now, after)]
    gain = np.log(gains[2] / gains[0]) / (2 * step)
    assert slow.condition.ring_down_change.values[40] == pytest.approx(
        max(abs(change), abs(gain)) / (0.11 * omega), rel=1e-4
    )
    np.testing.assert_allclose(slow.gain(np.array([t]))[:, 0], slow.c(np.array([t]))[:, 0], rtol=1e-9)


def test_swifter_whisking_is_remarked_on_then_refused():
    asked = scan(speed=4.0)
    still = predict_slow(WHISKER, whisking(duration=0.5), ONE, asked, n_modes=2)
    assert remarks(still, np.linspace(0, 0.5, 501))[1:] == free_end_lines(still.free_end)
    lines = remarks(predict_slow(WHISKER, whisking(duration=0.05), ONE, asked, n_modes=2), np.linspace(0, 0.05, 501))
    assert any("frequency drifts" in line and " at 0.0" in line for line in lines)
    with refusal("range", "posture path", value="0.28 at 0.001 s"):
        predict_slow(WHISKER, whisking(duration=0.004), ONE, scan(speed=10.0), n_modes=2)


def straight(contact, angle, duration=0.5):
    t = np.linspace(0, duration, 11)
    return PosturePath(time=t, contact=np.linspace(*contact, 11), base_angle=np.linspace(*angle, 11))


@pytest.mark.parametrize(
    ("path", "speed", "says"),
    [
        (straight((0.29, 0.29), (1.2, 1.0), 0.05), 0.01, ("format", "contact at 2.84e-05 s")),
        (
            straight((0.12, 0.04), (0.8, 0.8)),
            0.3,
            ("range", "contact at 0.4377 s"),
        ),
        (straight((0.10, 0.10), (1.3, 1.45)), 0.3, ("range", "posture at 0.1875 s")),
    ],
)
def test_way_that_the_whisker_cannot_go_is_refused_with_its_time(path, speed, says):
    with refusal(*says):
        predict_slow(WHISKER, path, ONE, scan(speed=speed), n_modes=1)


def test_what_is_no_path_is_refused():
    t = np.linspace(0, 1, 5)
    with refusal("conflict", "PosturePath"):
        PosturePath(time=t, base_angle=np.full(5, 1.0))
    with refusal("shape", "PosturePath", value="sizes 5, 4, 5"):
        PosturePath(time=t, base_angle=np.full(4, 1.0), contact=np.full(5, 0.3))
    with refusal("range", "PosturePath.time", value="0.75 s after 1 s"):
        PosturePath(time=t[::-1], base_angle=np.full(5, 1.0), contact=np.full(5, 0.3))
    with refusal("range", "posture at 0.75 s"):
        PosturePath(time=t, base_angle=np.full(5, 1.0), contact=np.array([0.3, 0.3, 0.3, 1.2, 0.3]))
    with refusal("range", "posture at 0.5 s"):
        PosturePath(time=t, base_angle=np.full(5, 1.0), base_distance=np.array([0.4, 0.5, 0.9, 0.4, 0.4]))
    late = PosturePath(time=t + 1, base_angle=np.full(5, 1.0), contact=np.full(5, 0.29))
    with refusal("range", "first gap"):
        predict_slow(WHISKER, late, ONE, scan(), n_modes=1)
    with refusal("range", "times"):
        whisked().amplitudes(np.array([0.0, 0.3]))


@pytest.mark.parametrize(("start", "stop"), [(-0.1, 0.05), (-0.02, 0.5), (0.1, 0.4), (0, 0.3)])
@pytest.mark.parametrize("rate", [1000, 4000, 10000])
def test_samples_at_round_rates_end_with_the_path(start, stop, rate):
    ends = np.array([start, stop])
    path = PosturePath(time=ends, contact=np.full(2, 0.29), base_angle=np.full(2, 1.2))
    late = Gaps(position=np.array([0.2 * stop - 2e-3]), width=np.array([0.3e-3]))
    motion = Motion(predict_slow(WHISKER, path, late, scan(speed=0.2), n_modes=1))
    t = motion.sample(rate).time.values
    assert (t[0], t.size) == (start, round((stop - start) * rate) + 1)
    assert t[-1] == pytest.approx(stop, abs=1e-12)
    assert t[-1] <= stop
    between = motion.sample(0.9987 * rate).time.values
    assert stop - 1.01 / rate < between[-1] < stop


def test_load_and_curvature_are_whole():
    slow, known = whisked(), Posture(contact=0.25, base_angle=1.1)
    before = np.array([0.0])
    curve = flat_curve(known)
    assert slow.base_curvature(before)[0] * 0.04 == pytest.approx(curve.slope[-1], rel=1e-6)
    load = curve.load * 0.25**2 * np.cos(known.friction_angle)
    assert slow.contact_load(before)[0] == pytest.approx(load, rel=1e-6)


def test_signals_carry_the_posture_of_the_moment():
    t = np.linspace(0, 0.25, 501)
    data = slow_signals(whisked(), t)
    np.testing.assert_array_equal(data.mode_displacement, whisked().mode_displacement(t))
    np.testing.assert_allclose(data.moment_contact[[0, 250, 500]], [0.25, 0.33, 0.25], atol=1e-9)
    np.testing.assert_allclose(data.moment_frequency[:, 250], cone_kappa(0.33, 3) / (2 * np.pi * WHISKER.timescale))
    np.testing.assert_array_equal(data.contact_advance, whisked().travel(t))
