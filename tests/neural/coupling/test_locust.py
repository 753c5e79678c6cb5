"""Auditory receptors of a locust through the whole analysis: one presentation of 10 s, so no trials to draw from."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from test_real_spikes import locust

from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.coupling.envelope_coupling import envelope_coupling
from vibrissa.neural.coupling.nulls import BinnedRecord
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.neural.coupling.response import spike_counts
from vibrissa.neural.coupling.threshold_linear import Hinge, HingeGrid
from vibrissa.neural.coupling.tuning import ENDS, forward_fit, poisson_deviance, predicted
from vibrissa.neural.io.tables.trials import cut_into_trials, trials_at
from vibrissa.quantities import dataset

LATENCIES = (0.004, 0.010)  # [s], about what is found between −20 and 30 ms, so that the grid is fine
CARRIER = 2500.0  # [Hz], in the header of both files
DURATION = 10.0  # [s]
BLOCK = 0.5  # [s], a hundred times the receptor's intervals and longer than the amplitude is like itself
HOW = EnvelopeAnalysis(bin_width=0.001)  # the amplitude changes within milliseconds


@dataclass(frozen=True, kw_only=True)
class Receptor:
    """Counts of one receptor in bins of 1 ms, and the amplitude it heard, as it is on file and in decibels."""

    spikes: object
    tone: object
    amplitude: Presentation  # [unit of the file, largest 1]
    decibels: Presentation  # [dB above the quietest moment]
    counts: np.ndarray


@cache
def receptor(k):
    """Receptor 1 or 2. The file has the amplitude alone: the tone it modulated is made again for the analysis."""
    spikes, time, amplitude = locust(k)
    cut = cut_into_trials(spikes, trials_at([0.0], DURATION))
    tone = dataset(time=time, point_displacement=amplitude * np.sin(2 * np.pi * CARRIER * time))
    shown = replace(Presentation.of(tone, bin_width=HOW.bin_width), envelope=amplitude)
    return Receptor(
        spikes=cut,
        tone=tone,
        amplitude=shown,
        decibels=replace(shown, envelope=20 * np.log10(amplitude / amplitude.min())),
        counts=spike_counts(cut, n_trials=1, start=0.0, n_bins=len(shown.edges) - 1, bin_width=HOW.bin_width),
    )


def coupled(counts, shown):
    """Coupling of the counts with an envelope, against all circular shifts."""
    valid = {"rate_valid": shown.rate_valid, "envelope_valid": shown.envelope_valid}
    record = BinnedRecord(rates=counts / HOW.bin_width, envelope=shown.binned(), **valid)
    return envelope_coupling(record, HOW.chance(), lags=HOW.lags)


@cache
def fitted(k, scale):
    """Hinge of most likelihood, its grid, and the counts in the bins that count; scale: amplitude or decibels."""
    one = receptor(k)
    drive = replace(getattr(one, scale).drive(), latencies=LATENCIES)
    grid = HingeGrid.of(drive, n_thresholds=30, n_latencies=13)
    counts = one.counts[0, drive.valid].astype(float)
    return grid, counts, forward_fit(grid, counts, HOW.bin_width)


def explained(drive, counts, fit):
    """Share of the Poisson deviance of a steady rate that the hinge takes away."""
    steady = poisson_deviance(counts, np.full(counts.size, counts.mean()))
    return 1 - poisson_deviance(counts, HOW.bin_width * predicted(drive, fit)) / steady


def blocks(drive):
    """Block of each bin that counts, and their number."""
    block = np.floor(drive.edges[:-1][drive.valid] / BLOCK + 1e-6).astype(int)
    return block - block.min(), int(np.ptp(block)) + 1


def unseen(k, scale):
    """Share of the deviance explained in every other block by the fit to the blocks between; mean of both ways."""
    grid, counts, _ = fitted(k, scale)
    block, shares = blocks(grid.drive)[0], []
    for half in (0, 1):
        used = [block % 2 == side for side in (half, 1 - half)]
        drives = [masked(grid.drive, bins) for bins in used]
        learnt = HingeGrid(
            drive=drives[0], thresholds=grid.thresholds, latencies=grid.latencies, hinges=grid.hinges[..., used[0]]
        )
        shares.append(explained(drives[1], counts[used[1]], forward_fit(learnt, counts[used[0]], HOW.bin_width)))
    return float(np.mean(shares))


def masked(drive, bins):
    """BinnedDrive in some of the bins that count."""
    valid = drive.valid.copy()
    valid[valid] = bins
    return replace(drive, valid=valid)


@cache
def intervals(k, scale, n_resamples=60):
    """95 % intervals of a hinge, blocks of the record drawn in place of trials.

    A block keeps its own piece of the stimulus, so that what is drawn is which sounds were heard as well as what the
    receptor made of them. Centred on the fit and widened by √(n/(n − 1)), as the package does with trials.
    """
    grid, counts, fit = fitted(k, scale)
    block, n = blocks(grid.drive)
    rng = np.random.default_rng([5, k])
    rate = predicted(grid.drive, fit)
    weights = 1 / np.maximum(rate, 0.05 * rate.mean())
    drawn = np.vstack([np.ones((1, n), int), rng.multinomial(n, np.full(n, 1 / n), n_resamples)])
    found = np.hstack([grid.best(counts[None] / HOW.bin_width, weights * times[block]) for times in drawn])
    samples = np.sqrt(n / (n - 1)) * (found[:, 1:] - found[:, :1]) + np.array(fit)[:, None]
    low, high = np.quantile(samples, ENDS, axis=1)
    return Hinge(*low.tolist()), Hinge(*high.tolist())


def test_tone_made_again_has_the_amplitude_on_file():
    for k, error in ((1, 1e-3), (2, 5e-3)):
        found = Presentation.of(receptor(k).tone, bin_width=HOW.bin_width)
        inner = slice(100, -100)
        difference = (found.envelope - receptor(k).amplitude.envelope)[inner]
        assert np.sqrt(np.mean(difference**2)) < error  # of 0.12, its standard deviation


def test_stimulus_does_not_repeat_so_no_trials_can_be_cut():
    for k in (1, 2):
        level = receptor(k).decibels.binned()
        power = np.abs(np.fft.rfft(level - level.mean(), 2 * level.size)) ** 2
        own = np.fft.irfft(power)[: level.size // 2 + 1]
        assert np.abs(own[100:]).max() < 0.15 * own[0]  # any shift from 0.1 to 5 s


@pytest.mark.parametrize("k", [1, 2])
def test_analysis_finds_the_coupling_and_says_that_one_trial_gives_no_interval(k):
    one = receptor(k)
    found = analyse_units(one.spikes, one.tone, 1, HOW).isel(unit=0)
    assert found.significant.item()
    assert found.p_value.item() < 2e-4  # no shift does as well
    assert found.adjusted_p_value.item() < 1e-10
    assert found.envelope_correlation.item() > 0.25
    assert 0.004 <= found.envelope_lag.item() <= 0.009
    assert 0.005 < found.latency.item() < 0.009
    assert found.slope.item() > 0
    assert np.isnan([found.slope_low.item(), found.threshold_high.item(), found.noise_ceiling.item()]).all()
    assert not found.identified.item()
    assert found.reason.item().startswith("one trial")


@pytest.mark.parametrize("k", [1, 2])
def test_what_the_other_receptor_heard_does_not_couple(k):
    own, other = receptor(k), receptor(3 - k)
    assert coupled(own.counts, own.decibels).tail_p_value[0] < 1e-10
    assert coupled(own.counts, other.decibels).p_value[0] > 0.01
    backwards = replace(own.decibels, envelope=own.decibels.envelope[::-1])
    assert coupled(own.counts, backwards).p_value[0] > 0.01


@pytest.mark.parametrize("k", [1, 2])
def test_spikes_follow_the_sound_though_they_might_precede_it(k):
    one, ahead = receptor(k), 0.02
    drive = one.decibels.drive()
    early = replace(drive, time=drive.time - ahead, valid=drive.valid & (drive.edges[1:] < DURATION - ahead))
    counts = one.counts[0, early.valid].astype(float)
    searched = HingeGrid.of(replace(early, latencies=(0.0, 0.05)), n_thresholds=10, n_latencies=51)
    fit = forward_fit(searched, counts, HOW.bin_width)
    assert 0.005 < fit.latency - ahead < 0.009  # of −20 to 30 ms


@pytest.mark.parametrize("k", [1, 2])
def test_rate_rises_with_the_level_above_a_threshold(k):
    _, _, fit = fitted(k, "decibels")
    low, high = intervals(k, "decibels")
    assert low.slope > 0
    assert 0.005 < low.latency < fit.latency < high.latency < 0.009
    assert high.latency - low.latency < 0.002
    assert 5 < low.threshold < fit.threshold < high.threshold < 30


@pytest.mark.parametrize("k", [1, 2])
def test_hinge_predicts_blocks_it_was_not_fitted_to(k):
    grid, counts, fit = fitted(k, "decibels")
    assert 0.1 < unseen(k, "decibels") <= explained(grid.drive, counts, fit) + 0.01
