"""Demodulation index: pure envelope, pure phase and mixes come out calibrated; noise feigns nothing."""

from functools import cache

import numpy as np
import pytest
from demodulator import Demodulator
from populations import ringing
from refusals import refusal

from vibrissa.neural.coding.demodulation import DemodulationAnalysis, demodulation
from vibrissa.neural.coding.phase_parts import of_pairs
from vibrissa.neural.io.tables.spikes import join_units
from vibrissa.neural.simulated.virtual import PhaseUnit, ThresholdLinearUnit, simulate_spikes
from vibrissa.neural.simulated.wandering import SlowState, unrelated_feature
from vibrissa.quantities import dataset
from vibrissa.signals.coherence import band_coherence
from vibrissa.signals.envelope import analytic_envelope

TRIALS, LATENCY, DEPTH = 40, 0.012, 0.35
MIXES = np.linspace(0, np.pi / 2, 7)  # share of the envelope cos², of the phase sin²


@cache
def stimulus(seed, duration=6.0):
    time, motion = ringing(np.random.default_rng(seed), duration=duration)
    return time, motion, *analytic_envelope(motion)


class Mix:
    """Rate of a mean of 20 Hz, with an envelope's and a phase's part of known variance."""

    def __init__(self, share, depth=DEPTH):
        self.share, self.depth = share, depth

    def rate(self, time, displacement):
        envelope, phase = analytic_envelope(displacement)
        a = np.interp(time - LATENCY, time, (envelope - envelope.mean()) / envelope.std())
        wave = np.sqrt(2) * np.cos(np.interp(time - LATENCY, time, np.unwrap(phase)))
        return np.maximum(20 * (1 + self.depth * (np.cos(self.share) * a + np.sin(self.share) * wave)), 0)


def told(seed, units, *, trials=TRIALS, state=None, lopsided=0.0, how=None, duration=6.0):
    """Results of units given as (unit, what drives it) on one stimulus."""
    time, motion, envelope, phase = stimulus(seed, duration)
    drives = {"motion": motion, "envelope": envelope, "phase": phase}
    tables = {}
    for k, (name, (unit, drive)) in enumerate(units.items()):
        rng = np.random.default_rng([seed, k + 1])  # [seed, 0] is the generator of the stimulus itself
        gain = state.draw(trials, time[-1] - time[0], rng=rng) if state else None
        tables[name] = simulate_spikes(unit, time, drives[drive], trials, rng=rng, gain=gain)
    shown = dataset(time=time, point_displacement=motion + lopsided * envelope)
    return demodulation(join_units(tables), shown, trials, how)


@cache
def mixed():
    """Seven mixes, eight recordings of each: 56 units."""
    return [told(seed, {f"m{k}": (Mix(share), "motion") for k, share in enumerate(MIXES)}) for seed in range(8)]


def of_mixes(name):
    return np.array([found[name].values for found in mixed()])


@cache
def without_noise(seed):
    """Index of the rates themselves: the same for so many spikes that noise is gone."""
    time, motion, _, _ = stimulus(seed)
    keep = (time >= 1.05) & (time < 5.95)
    a, phi = (np.interp(time - LATENCY, time, one) for one in (stimulus(seed)[2], np.unwrap(stimulus(seed)[3])))
    columns = [np.ones(time.size), a, *(np.maximum(a - q, 0) for q in np.quantile(a, (0.25, 0.5, 0.75)))]
    wave = [np.cos(phi), np.sin(phi), a * np.cos(phi), a * np.sin(phi), np.cos(2 * phi), np.sin(2 * phi)]
    design = np.array(columns + wave).T[keep]
    truth = []
    for share in MIXES:
        b = np.linalg.lstsq(design, Mix(share).rate(time, motion)[keep], rcond=None)[0]
        slow, fast = (design[:, :5] @ b[:5]).var(), (design[:, 5:] @ b[5:]).var()
        truth.append((slow - fast) / (slow + fast))
    return truth


def test_index_is_calibrated_and_monotonic():
    index = of_mixes("demodulation_index")
    np.testing.assert_allclose(index.mean(0), np.cos(2 * MIXES), atol=0.06)  # closed form for an even phase
    assert (np.diff(index.mean(0)) < 0).all()
    assert np.mean(np.diff(index, axis=1) < 0) > 0.95  # of single recordings
    assert (np.abs(index) <= 1).all()


def test_intervals_hold_the_index():
    truth = np.array([without_noise(seed) for seed in range(8)])
    low, high = of_mixes("demodulation_index_low"), of_mixes("demodulation_index_high")
    assert np.mean((low <= truth) & (truth <= high)) >= 0.88


@pytest.mark.parametrize("trials", [5, 40])
@pytest.mark.parametrize("depth", [0.0, 0.05, 0.35])
def test_intervals_hold_modulations_that_are_absent_weak_or_plain(depth, trials):
    # 50 units: of 95 % held, more than seven that are not held are met once in 150 times
    found = [
        told(seed, {f"n{k}": (Mix(np.pi / 4, depth=depth), "motion") for k in range(10)}, trials=trials)
        for seed in range(5)
    ]
    size = depth * np.sqrt(0.5)
    for name, true in {"envelope_modulation": size, "phase_modulation": size, "vector_strength": size / 2**0.5}.items():
        low, high = (np.concatenate([one[f"{name}_{end}"].values for one in found]) for end in ("low", "high"))
        assert np.sum((true < low) | (true > high)) <= 7
        assert np.isfinite(low).all()


def test_both_modulations_come_out_in_their_own_unit():
    np.testing.assert_allclose(of_mixes("envelope_modulation").mean(0), DEPTH * np.cos(MIXES), atol=0.02)
    np.testing.assert_allclose(of_mixes("phase_modulation").mean(0), DEPTH * np.sin(MIXES), atol=0.02)


def test_pure_units_are_called_by_what_they_follow():
    called = of_mixes("demodulated")
    assert set(called[:, 0]) == {"envelope"}
    assert set(called[:, -1]) == {"phase"}
    assert set(called[:, 2:5].ravel()) == {"both"}


@cache
def named():
    units = {
        "hinge": (ThresholdLinearUnit(), "envelope"),
        "phase": (PhaseUnit(baseline=10.0, depth=0.8), "phase"),
        "weak": (PhaseUnit(baseline=10.0, depth=0.2), "phase"),
        "rectified": (Demodulator(smoothing=0.002, latency=0.01), "motion"),
    }
    return [told(seed, units) for seed in range(6)]


def test_vector_strength_is_half_the_depth():
    strength = np.array([found.vector_strength.values for found in named()])
    np.testing.assert_allclose(strength[:, 1].mean(), 0.4, atol=0.015)
    np.testing.assert_allclose(strength[:, 2].mean(), 0.1, atol=0.02)
    assert abs(strength[:, 0].mean()) < 0.03  # while all spikes of the hinge feign some:
    plain = np.array([found.vector_strength_plain.values for found in named()])
    assert plain[:, 0].mean() > 0.015
    phase = np.array([found.locking_phase.values[1] for found in named()])
    np.testing.assert_allclose(np.abs(np.angle(np.exp(1j * phase))), 0, atol=0.25)  # a bin's turn of phase: 0.44


def test_coherence_tells_the_same_two_apart():
    envelope, carrier = (
        np.array([found[f"{name}_coherence"].values for found in named()]).mean(0) for name in ("envelope", "carrier")
    )
    assert envelope[0] > 0.3 > 0.1 > carrier[0]
    assert carrier[1] > 0.2 > 0.1 > abs(envelope[1])


def test_a_rectifier_that_hardly_smooths_follows_twice_the_carrier():
    found = named()[0]
    assert found.demodulated.values[3] == "both"
    assert found.phase_modulation.values[3] > 0.2
    assert abs(found.vector_strength.values[3]) < 0.05  # at the carrier itself it does not lock


def test_noise_follows_nothing():
    called = [told(seed, {f"n{k}": (Mix(0, depth=0.0), "motion") for k in range(10)}) for seed in range(5)]
    verdicts = np.concatenate([found.demodulated.values for found in called])
    assert np.mean(verdicts == "cannot tell") >= 0.9
    assert "neither" in called[0].reason.values[0]


def test_another_feature_of_the_stimulus_feigns_nothing():
    """Units locked to something slow, in every trial alike."""
    called = []
    for seed in range(5):
        time, motion, *_ = stimulus(seed)
        rng = np.random.default_rng([seed, 99])
        tables = {}
        for k in range(10):
            feature = unrelated_feature(time, mean=55e-6, timescale=0.05, rng=rng)
            tables[f"n{k}"] = simulate_spikes(ThresholdLinearUnit(), time, feature, TRIALS, rng=rng)
        found = demodulation(join_units(tables), dataset(time=time, point_displacement=motion), TRIALS)
        called.append(found.demodulated.values)
    assert np.mean(np.concatenate(called) == "cannot tell") >= 0.9


def test_wandering_excitability_feigns_nothing():
    units = {f"n{k}": (Mix(0, depth=0.0), "motion") for k in range(10)}
    found = told(1, units, state=SlowState(depth=0.5, trial_sd=0.3))
    assert np.mean(found.demodulated.values == "cannot tell") >= 0.9


def test_slow_motion_under_the_carrier_cannot_tell_until_its_band_is_given():
    units = {"phase": (PhaseUnit(baseline=10.0, depth=0.8), "phase"), "hinge": (ThresholdLinearUnit(), "envelope")}
    for lopsided in (0.5, 2.0):
        found = told(0, units, lopsided=lopsided)
        assert found.phase_likeness.item() > 0.6
        assert (found.demodulated.values == "cannot tell").all()
        assert "band" in found.reason.values[0]
        banded = told(0, units, lopsided=lopsided, how=DemodulationAnalysis(band=(45, 100)))
        np.testing.assert_allclose(banded.demodulation_index.values, [-1, 1], atol=0.05 if lopsided < 1 else 0.15)


def test_few_spikes_are_not_told():
    found = told(0, {"few": (PhaseUnit(baseline=0.2), "phase")}, trials=8)
    assert found.reason.item().startswith("too few spikes")
    assert np.isnan(found.demodulation_index.item())


def test_mean_over_pairs_is_the_double_sum():
    z = np.random.default_rng(0).normal(size=(9, 3)) + 1j * np.random.default_rng(1).normal(size=(9, 3))
    double = np.mean([np.vdot(z[i], z[j]).real for i in range(9) for j in range(9) if i != j])
    assert of_pairs(z) == pytest.approx(double)


@cache
def alone():
    """The seven mixes, presented once for 30 s; two stimuli, three recordings of each: 42 units."""
    units = {f"m{k}.{copy}": (Mix(share), "motion") for k, share in enumerate(MIXES) for copy in range(3)}
    return [told(seed, units, trials=1, duration=30.0) for seed in (20, 21)]


def test_one_presentation_gives_the_index_by_blocks():
    truth = np.repeat(np.cos(2 * MIXES), 3)
    index, low, high = (np.array([one["demodulation_index" + end] for one in alone()]) for end in ("", "_low", "_high"))
    np.testing.assert_allclose(index.mean(0).reshape(-1, 3).mean(1), truth[::3], atol=0.08)
    held = (low <= truth + 1e-9) & (truth <= high + 1e-9)
    assert 0.88 <= held.mean() <= 1
    verdict = np.array([one.demodulated.values for one in alone()])
    assert (verdict[:, :3] == "envelope").all()
    assert (verdict[:, -3:] == "phase").all()
    assert min(one.n_blocks.min().item() for one in alone()) >= 12


def test_one_presentation_calls_no_unit_of_steady_or_unrelated_rate():
    steady = {f"s{k}": (Mix(0.0, depth=0.0), "motion") for k in range(20)}
    time = stimulus(22, 30.0)[0]
    rng, tables = np.random.default_rng(22), {}
    for k in range(20):
        feature = unrelated_feature(time, mean=55e-6, timescale=0.05, rng=rng)
        tables[f"o{k}"] = simulate_spikes(ThresholdLinearUnit(), time, feature, 1, rng=rng)
    shown = dataset(time=time, point_displacement=stimulus(22, 30.0)[1])
    found = [told(22, steady, trials=1, duration=30.0), demodulation(join_units(tables), shown, 1)]
    assert np.mean([one.demodulated.values != "cannot tell" for one in found]) <= 0.1


def test_coherence_is_the_closed_form_and_unbiased():
    """White signal y = x + noise: 1/(1 + noise) at every frequency; 0 for unrelated signals."""
    related, unrelated = [], []
    for seed in range(50):
        x, noise = np.random.default_rng(seed).normal(size=(2, 6000))
        related.append(band_coherence(x + 1.5 * noise, x, 1000.0, 0.25, (4, 496)))
        unrelated.append(band_coherence(noise, x, 1000.0, 0.25, (4, 496)))
    assert np.isnan(band_coherence(noise, x, 1000.0, 0.25, (501, 600)))
    np.testing.assert_allclose(np.mean(related), 1 / 3.25, atol=0.012)
    np.testing.assert_allclose(np.mean(unrelated), 0, atol=0.002)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"trials": 1, "how": DemodulationAnalysis(window=(0.0, 1.15))}, ("too-few", "blocks of the stimulus")),
        ({"how": DemodulationAnalysis(bin_width=0.01)}, ("range", "bin width")),
    ],
)
def test_bad_input_is_told_in_one_line(change, match):
    with refusal(*match) as error:
        told(0, {"u": (ThresholdLinearUnit(), "envelope")}, **change)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("wrong", [{"bin_width": 0.0}, {"skip": -1.0}])
def test_settings_are_checked(wrong):
    with refusal("range"):
        DemodulationAnalysis(**wrong)


def test_coherence_of_what_does_not_fit_is_refused():
    with refusal("shape", "signals"):
        band_coherence(np.zeros(100), np.zeros(99), 100.0, 0.1, (0, 50))
    with refusal("range", "segment"):
        band_coherence(np.zeros(100), np.zeros(100), 100.0, 0.9, (0, 50))
