"""One long presentation: blocks of the stimulus are the draws of kernels and surround maps."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from populations import ringing
from refusals import refusal
from scipy.special import kl_div
from test_locust import receptor

from vibrissa.neural.coupling.stimulus_blocks import even_starts
from vibrissa.neural.glm.bases import raised_cosines
from vibrissa.neural.glm.kernel_columns import Columns, KernelAnalysis, unit_design
from vibrissa.neural.glm.poisson import poisson_regression
from vibrissa.neural.glm.poisson_model import whisker_kernels
from vibrissa.neural.glm.surround import surround_map
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.stimuli import labelled_stimulus, with_channels
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope

SECONDS, RATE, GROUPS, UNITS = 25.0, 30.0, 5, 20
HOW = KernelAnalysis(reach=0.03, shapes=4, past=0.05, level=0.01)
PAST = np.array([-2, -0.8, -0.3, -0.1])  # of ln(rate), in the bins after a spike
SHARE = np.array([0.2, 0.0, -0.1])  # height of the kernels, in ln(rate) per SD of the envelope
NAMES = ("C1", "C2", "C3")
SLOPES, THRESHOLD, LATENCY = np.array([0.5e6, 0, 0.2e6]), 42.3e-6, 0.012  # [1/(s m)], [m], [s]


@cache
def stimulus(seed, seconds=SECONDS):
    """Three whiskers that move apart from each other."""
    rng = np.random.default_rng([seed, 9])
    motions = [ringing(rng, duration=seconds) for _ in NAMES]
    return dataset(whisker=np.array(NAMES), time=motions[0][0], command=np.array([one for _, one in motions]))


def rolled(seed, share):
    """The stimulus, shifted circularly by a share of its length."""
    own = stimulus(seed)
    return own.assign(command=own.command.roll(time=round(share * own.sizes["time"])))


def kernel():
    """Coefficients of a bump at 12 ms."""
    lags = HOW.lags()[0]
    shapes = raised_cosines(lags, HOW.shapes)
    return np.linalg.lstsq(shapes, np.exp(-0.5 * ((lags - 0.012) / 0.008) ** 2), rcond=None)[0]


def table(counts):
    """Spikes in the middle of their bins, of counts (unit, bin)."""
    unit, column = (np.repeat(one, counts[counts > 0].astype(int)) for one in np.nonzero(counts))
    time = (column + 0.5) * HOW.bin_width
    return spike_table(time, unit, [f"u{k}" for k in range(len(counts))], trial=0 * unit)


@cache
def driven(seed):
    """Spikes of units of known kernels to one presentation, and the spread of the envelopes."""
    columns = Columns.of(stimulus(seed), HOW)
    drive, rng = np.zeros(len(columns.valid)), np.random.default_rng(seed)
    drive[columns.valid] = columns.shared[:, 1:] @ np.outer(SHARE, kernel()).ravel()
    counts = np.zeros((UNITS, len(drive)))
    for k in range(len(drive)):
        before = counts[:, max(k - len(PAST), 0) : k][:, ::-1]
        counts[:, k] = rng.poisson(HOW.bin_width * RATE * np.exp(drive[k] + before @ PAST[: before.shape[1]]))
    return table(counts), columns.spread


@cache
def found(seed):
    return whisker_kernels(driven(seed)[0], stimulus(seed), 1, HOW)


def test_intervals_of_kernels_hold_the_truth():
    held, effects = [], []
    for seed in range(GROUPS):  # 100 units
        truth = np.outer(SHARE, raised_cosines(HOW.lags()[0], HOW.shapes) @ kernel()) / driven(seed)[1]
        one = found(seed)
        held.append((one.whisker_kernel_low <= truth) & (truth <= one.whisker_kernel_high))
        whole = truth.sum(1)
        effects.append((one.whisker_effect_low <= whole) & (whole <= one.whisker_effect_high))
    assert 0.9 <= np.mean(held) <= 0.98
    assert 0.9 <= np.mean(effects) <= 0.98
    assert np.concatenate([found(seed).whisker_matters.values[:, 0] for seed in range(GROUPS)]).mean() > 0.95


def test_a_rolled_stimulus_is_not_called():
    called = []
    for seed in range(GROUPS):
        for k in range(4):
            spikes = driven(seed)[0]
            some = spikes.isel(spike=np.isin(spikes.spike_unit.values % 4, k))
            one = whisker_kernels(some, rolled(seed, 0.2 + 0.2 * k), 1, HOW)
            called.append(one.whisker_matters.values[k::4])
    assert np.concatenate(called).mean() <= 0.01


def test_blocks_foresee_blocks_and_give_bits_for_each_spike():
    one = found(0)
    assert (one.deviance_explained > 0.03).all()
    assert (one.n_blocks >= 12).all()
    steady = table(np.random.default_rng(0).poisson(RATE * HOW.bin_width, (5, round(SECONDS / HOW.bin_width))))
    none = whisker_kernels(steady, stimulus(0), 1, HOW)
    assert (none.kernel_gain < 0.01).all()
    assert np.isfinite(none.kernel_gain).all()


def heard(k, how):
    """Columns of the sound of a locust's receptor, and its counts."""
    one = receptor(k)
    sound = labelled_stimulus(one.amplitude.time, one.amplitude.envelope, "a.u.", envelope=True)
    counts = one.counts.reshape(1, -1, round(how.bin_width / 0.001)).sum(2).astype(float)
    return sound, Columns.of(with_channels(sound), how), counts


def by_statsmodels(rows, counts):
    sm = pytest.importorskip("statsmodels.api")
    offset = np.full(len(rows), np.log(HOW.bin_width))
    return sm.GLM(counts, rows, family=sm.families.Poisson(), offset=offset)


@pytest.mark.parametrize("k", [1, 2])
def test_covariance_by_blocks_is_the_clustered_one_of_statsmodels_for_a_locust(k):
    how = KernelAnalysis(penalty=0.0)
    _, columns, counts = heard(k, how)
    design = replace(unit_design(columns, counts, how), starts=even_starts(len(columns.shared), 20))
    used, n = counts[:, columns.valid], design.n_draws
    fit = poisson_regression(design, used, how.bin_width)
    rows = np.hstack([design.shared, design.own[0]])
    block = np.repeat(np.arange(n), np.diff(np.append(design.starts, len(rows))))
    asked = {"cov_type": "cluster", "cov_kwds": {"groups": block, "use_correction": False}}
    theirs = by_statsmodels(rows, used[0]).fit(tol=1e-13, **asked)
    np.testing.assert_allclose(fit.coefficients, theirs.params, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(fit.draw_covariance * (n - 1) / n, theirs.cov_params(), rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize("k", [1, 2])
def test_unseen_blocks_of_a_locust_are_foreseen_as_by_statsmodels(k):
    how = KernelAnalysis(penalty=0.0, past=0.0)
    sound, columns, counts = heard(k, how)
    one = whisker_kernels(receptor(k).spikes, sound, 1, how).isel(unit=0)
    used, n = counts[0, columns.valid], int(one.n_blocks)
    fold = np.repeat(np.arange(n) % 5, np.diff(np.append(np.arange(n) * used.size // n, used.size)))
    left, steady = 0.0, 0.0
    for j in range(5):
        seen, rest = fold != j, fold == j
        params = by_statsmodels(columns.shared[seen], used[seen]).fit(tol=1e-13).params
        left += kl_div(used[rest], how.bin_width * np.exp(columns.shared[rest] @ params)).sum()
        steady += kl_div(used[rest], used[seen].mean()).sum()
    assert one.deviance_explained.item() == pytest.approx(1 - left / steady, abs=1e-6)
    assert one.kernel_gain.item() == pytest.approx((steady - left) / used.sum() / np.log(2), abs=1e-6)
    assert one.whisker_matters.item()
    half = sound.assign(stimulus_envelope=sound.stimulus_envelope.roll(time=sound.sizes["time"] // 2))
    assert not whisker_kernels(receptor(k).spikes, half, 1, how).whisker_matters.item()


@cache
def summed(seed):
    """Spikes of units that add hinges of three whiskers, one presentation."""
    command = stimulus(seed)
    _time, late = command.time.values, round(LATENCY * 2000)
    hinges = [np.maximum(np.roll(analytic_envelope(one)[0], late) - THRESHOLD, 0) for one in command.command.values]
    rate = 8.0 + SLOPES @ np.array(hinges)
    rng, fine = np.random.default_rng([seed, 2]), 0.01
    counts = rng.poisson(rate.reshape(-1, 20).mean(1) * fine, (UNITS, round(SECONDS / fine)))
    unit, column = (np.repeat(one, counts[counts > 0]) for one in np.nonzero(counts))
    return spike_table((column + 0.5) * fine, unit, [f"u{k}" for k in range(UNITS)], trial=0 * unit)


@cache
def mapped(seed):
    return surround_map(summed(seed), stimulus(seed), 1)


def test_intervals_of_weights_hold_the_truth():
    low, high = (
        np.concatenate([mapped(k)[f"surround_weight_{end}"] for k in range(GROUPS)]) for end in ("low", "high")
    )
    assert 0.9 <= ((low < SLOPES) & (high > SLOPES)).mean() <= 0.98
    verdict = np.concatenate([mapped(k).surround_verdict.values for k in range(GROUPS)])
    assert (verdict[:, 0] == "drives").mean() > 0.95
    assert np.isin(verdict[:, 1], ["drives", "suppresses"]).mean() <= 0.05


@cache
def slow():
    """Envelopes of 30 s that stay like themselves for seconds."""
    time = 0.005 * np.arange(6000)
    kernel = np.exp(-0.5 * (np.arange(-800, 801) / 200) ** 2)
    drawn = [np.convolve(one, kernel, "same") for one in np.random.default_rng(3).normal(size=(2, 6000))]
    return labelled_stimulus(time, np.array(drawn) + 60, "a.u.", envelope=True, lead={"whisker": ["a", "b"]})


@pytest.mark.parametrize(("analysed", "trials"), [(whisker_kernels, 10), (surround_map, 8)])
def test_too_short_a_presentation_is_refused_with_the_blocks_it_has(analysed, trials):
    spikes = table(np.random.default_rng(0).poisson(0.1, (1, 6000)))
    with refusal("too-few", "blocks of the stimulus") as caught:
        analysed(spikes, slow(), 1)
    text = str(caught.value)
    assert f"must be at least 12 where trials are fewer than {trials}, got " in text
    assert 0 < int(text.split("got ")[1].split()[0]) < 12
    assert text.endswith(f"s after the skip, or {trials} times")
    seconds = float(text.split("present it for ")[1].split()[0])
    assert 30 < seconds < 150
