"""What the page draws is what `scan` computes, whatever was set before."""

import json
import re

import numpy as np
import pytest
from page_messages import unpacked
from refusals import refusal

from vibrissa.exact import cone_kappa
from vibrissa.mechanics.scan.relief_prediction import predict_relief
from vibrissa.mechanics.scan.sampled import scanned, scanned_relief
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.neural.coding.sensitivity import d_prime, roc_area
from vibrissa.page.answer.answers import answer, notes
from vibrissa.page.answer.contrast import discrimination, expected_counts
from vibrissa.page.answer.frames import packed, sketched
from vibrissa.page.panel.state import read_state
from vibrissa.page.session import MODES, PageSession, made_surface
from vibrissa.page.shaft_table import NODE
from vibrissa.page.signals import RATE, TRIALS, _spectrogram, live_arrays
from vibrissa.signals.envelope import analytic_envelope

SHORT = {"a.length": 0.01, "b.length": 0.01}
CLOSE = {"rtol": 2e-6, "atol": 0}  # float32 of what the other way computes in float64


def session():
    return PageSession(lambda key: pytest.fail("no file was dropped"))


def anew(state):
    """The same scan by the way of `vibrissa scan`, no table kept."""
    surface = made_surface(state.texture("a"))
    if hasattr(surface, "width"):
        made = predict(state.whisker, state.posture, surface, state.scan, n_modes=MODES)
        return scanned(made, RATE, nodes=[NODE])
    made = predict_relief(state.whisker, state.posture, surface, state.scan, n_modes=MODES)
    return scanned_relief(made, RATE, nodes=[NODE])


def agree(arrays, data, length):
    n, span = data.sizes["time"], np.abs(length * data.mode_displacement.values).max()
    assert n <= arrays["modes"].shape[1] <= 1.03 * n  # the page goes on for up to 3 %
    drawn = {name: arrays[name][..., :n] for name in ("modes", "envelopes", "excursion", "curvature", "moment")}
    np.testing.assert_allclose(drawn["modes"], length * data.mode_displacement, rtol=2e-6, atol=1e-6 * span)
    ended = analytic_envelope(drawn["modes"])[0]  # of the record that ends where scan's does
    np.testing.assert_allclose(ended, data.envelope, rtol=2e-6, atol=1e-6 * span)
    # that of a longer record differs a little near its end
    np.testing.assert_allclose(drawn["envelopes"], data.envelope, rtol=2e-6, atol=1e-3 * span)
    np.testing.assert_allclose(analytic_envelope(arrays["modes"])[0], arrays["envelopes"], rtol=2e-6, atol=1e-6 * span)
    np.testing.assert_allclose(drawn["excursion"], length * data.excursion, rtol=2e-6, atol=1e-10)
    np.testing.assert_allclose(drawn["curvature"], data.base_curvature, **CLOSE)
    np.testing.assert_allclose(drawn["moment"], data.base_moment, **CLOSE)
    moved, drawn = data.displacement.values[:, 0], arrays["displacement"][:n]
    np.testing.assert_allclose(drawn - drawn[0], moved - moved[0], rtol=2e-6, atol=1e-6 * np.ptp(moved))
    assert abs(arrays["displacement"].mean()) < 1e-6 * np.ptp(moved)


def test_tables_kept_from_one_move_to_the_next_change_nothing():
    tried = session()
    moves = [{}, {"speed": 0.15}, {"damping": 0.02}, {"youngs_modulus": 3e9}, {"friction": 0.2}, {"friction": 0.4}]
    for move in moves:
        state = read_state({**SHORT, **move})
        agree(live_arrays(tried.predict(state), state.unit), anew(state), state.whisker.length)


@pytest.mark.parametrize("kind", ["widths", "periodic", "wave"])
def test_every_kind_of_texture_is_drawn_as_scan_computes_it(kind):
    small = {"a.kind": kind, "a.length": 0.005, "a.rms": 1e-6, "a.amplitude": 5e-6}
    state = read_state({**small, "hold": "contact", "contact": 0.35, "base_angle": 1.0})
    agree(live_arrays(session().predict(state), state.unit), anew(state), state.whisker.length)


def test_profiles_of_one_surface_serve_the_next():
    tried, small = (
        session(),
        {"a.kind": "rough", "a.length": 0.005, "hold": "contact", "contact": 0.35, "base_angle": 1.0},
    )
    for seed, rms in ((1, 1e-6), (2, 2e-6)):
        state = read_state({**small, "a.seed": seed, "a.rms": rms})
        made = tried.predict(state)
    agree(live_arrays(made, state.unit), anew(state), state.whisker.length)


def test_the_shaft_is_clamped_at_the_base_and_stands_on_the_ground():
    state = read_state(SHORT)
    prediction = session().predict(state)
    arrays = live_arrays(prediction, state.unit)
    np.testing.assert_allclose(arrays["shaft_x"][:, -1], 0, atol=1e-9)
    np.testing.assert_allclose(arrays["shaft_y"][:, -1], 0, atol=1e-9)
    contact = np.argmin(np.abs(arrays["shaft"] - prediction.posture.contact))
    assert arrays["shaft_y"][0, contact] == pytest.approx(-state.number("height"), abs=1e-8)


def test_resonances_are_those_of_the_pinned_cone():
    state = read_state({**SHORT, "whisker": "C1", "height": 0.01})
    arrays = live_arrays(session().predict(state), state.unit)
    contact = float(arrays["resonance"][0, 40])
    expected = cone_kappa(contact, 3) / (2 * np.pi * state.whisker.timescale)
    np.testing.assert_allclose(arrays["resonance"][1:, 40], expected, rtol=1e-5)


def test_firing_is_the_hinge_of_the_envelope_and_spikes_come_at_its_rate():
    state = read_state({**SHORT, "threshold": 2e-6, "slope": 2e7, "baseline": 50})
    arrays = live_arrays(session().predict(state), state.unit)
    late = round(state.unit.latency * RATE)
    hinge = 50 + 2e7 * np.maximum(arrays["drive"] - 2e-6, 0)
    np.testing.assert_allclose(arrays["firing"][late:], hinge[:-late], rtol=1e-3)
    expected = TRIALS * arrays["firing"].mean() * len(hinge) / RATE
    assert abs(arrays["spikes"].shape[1] - expected) < 5 * np.sqrt(expected)


@pytest.mark.parametrize("n", [300, 5000, 7001])
def test_spectra_are_those_of_scipy(n):
    """The page does not import scipy.signal, which takes 20 MB."""
    from scipy.signal import spectrogram

    moved, half, hop = 1e-6 * np.random.default_rng(0).normal(size=n).cumsum(), min(256, n - 1), max(1, n // 160)
    mirrored = np.pad(moved, half, mode="reflect")
    frequency, time, power = spectrogram(mirrored, RATE, window="hann", nperseg=2 * half, noverlap=2 * half - hop)
    kept, found = frequency <= 400, _spectrogram(moved, 400.0)
    expected = 10 * np.log10(np.maximum(power[kept] * 1e12, 1e-9))
    np.testing.assert_allclose(found["spectrogram"], expected, atol=1e-9)
    axes = [[0, frequency[kept][-1]], time[[0, -1]] - half / RATE]
    np.testing.assert_allclose(found["spectrogram_axes"], axes, atol=1e-12)


def test_a_line_stands_in_the_spectrogram_at_the_resonance():
    # one gap and next to no damping: after it the whisker rings freely
    state = read_state({"a.kind": "periodic", "a.length": 0.01, "a.period": 0.01, "a.duty": 0.05, "damping": 0.005})
    prediction = session().predict(state)
    arrays = live_arrays(prediction, state.unit)
    power = arrays["spectrogram"][:, -3]
    frequency = np.linspace(*arrays["spectrogram_axes"][0], len(power))
    assert frequency[np.argmax(power)] == pytest.approx(prediction.omega[0] / (2 * np.pi), abs=float(frequency[1]))


def test_a_scan_that_lasts_too_long_is_refused():
    with refusal("range", "scan"):
        session().predict(read_state({"speed": 0.01, "a.length": 0.2}))


def test_the_free_end_is_told_of():
    told = notes(session().predict(read_state(SHORT)))
    assert re.fullmatch(r"the free end is [\d.]+ mm long and prevents (\d+) of \1 jumps", told[1])
    assert "bridges the gap" in told[2]


def test_a_sketch_has_every_peak_where_it_was():
    values = np.random.default_rng(0).normal(size=(2, 10_007)).astype("f4")
    values[0, 10_000] = 9
    few = sketched(values, 1000)
    assert few.shape[0] == 2
    assert 900 < few.shape[1] <= 1002
    stretch = 2 * values.shape[1] / few.shape[1]
    for line, short in zip(values, few, strict=True):
        assert short.max() == line.max()
        assert short.min() == line.min()
        assert short.argmax() / 2 * stretch == pytest.approx(line.argmax(), abs=1.1 * stretch)
    k = np.arange(10_007, dtype="f4")
    np.testing.assert_array_equal(np.diff(sketched(k, 1000)[:-2]) > 0, True)  # in the order in which they come
    assert sketched(k, 20_000) is k


def test_a_long_message_is_a_sketch_but_for_what_is_heard_and_where_the_contact_is():
    state = {"a.length": 0.2}
    facts, told = unpacked(answer(session(), json.dumps({"id": 1, "want": "live", "state": state})))
    known = read_state(state)
    arrays = live_arrays(session().predict(known), known.unit)
    for name in ("excursion", "displacement", "spectrogram", "shaft_x"):
        np.testing.assert_array_equal(told[name], arrays[name])
    for name in ("modes", "envelopes", "moment", "firing"):
        assert told[name].shape[-1] < 4100 < arrays[name].shape[-1]
        np.testing.assert_array_equal(told[name].max(axis=-1), arrays[name].max(axis=-1))
    np.testing.assert_allclose(facts["rms"], arrays["modes"].std(axis=1), rtol=1e-5)
    np.testing.assert_allclose(facts["curvature_by_moment"] * arrays["moment"], arrays["curvature"], rtol=1e-5)


def test_a_message_is_read_back_as_it_was_packed():
    arrays = {"one": np.arange(6, dtype="<f4").reshape(2, 3), "none": np.zeros((2, 0), "<f4")}
    facts, back = unpacked(packed({"id": 3, "name": "ζ"}, arrays))
    assert facts == {"id": 3, "name": "ζ"}
    for name in arrays:
        np.testing.assert_array_equal(back[name], arrays[name])


# Two textures


def test_d_prime_is_that_of_simulated_trials():
    misses = []
    for seed in range(50):
        rng = np.random.default_rng(seed)
        first, second = rng.gamma(4, 1.0, (2, 40))  # mean counts of 4 a bin
        second = first + 0.25 * (second - first)
        weights = (first - second) / (first + second)
        values = [rng.poisson(mean, (1000, 40)) @ weights for mean in (first, second)]
        found = d_prime(roc_area(*values))
        misses.append((found - discrimination(first, second)) / np.sqrt(2 / 1000 * (1 + found**2 / 8)))
    assert abs(np.mean(misses)) < 4 / np.sqrt(50)
    assert np.std(misses) < 1.4


def test_d_prime_of_one_count_is_the_difference_over_the_spread():
    assert discrimination(np.array([9.0]), np.array([16.0])) == pytest.approx(7 / np.sqrt(12.5))


def test_equal_or_silent_textures_cannot_be_told_apart():
    assert discrimination(np.array([3.0, 4.0]), np.array([3.0, 4.0])) == 0
    assert discrimination(np.zeros(3), np.zeros(3)) == 0


def test_expected_counts_are_the_area_under_the_rate():
    time = np.arange(0, 0.1, 1e-4)
    counts = expected_counts(time, 1000 * time, 0.0999)
    np.testing.assert_allclose(counts, 1000 * 0.01 * (np.arange(9) + 0.5) * 0.01, rtol=1e-9)


def test_a_texture_is_not_told_from_itself_but_from_another():
    told = []
    for seed in (1, 2):
        ask = '{"id": 1, "want": "contrast", "state": {"b.seed": %d, "a.length": 0.02, "b.length": 0.02}}' % seed  # noqa: UP031
        told.append(unpacked(answer(session(), ask))[0])
    assert told[0]["by_course"] == told[0]["by_count"] == 0
    assert told[1]["by_course"] > told[1]["by_count"] > 0
