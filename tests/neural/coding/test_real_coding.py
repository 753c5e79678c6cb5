"""Coding of real neurons: a rat's thalamus, units of a mouse, a locust's ear; and what cannot be asked of them."""

import numpy as np
import pytest
from refusals import refusal
from scipy.special import kl_div
from test_locust import CARRIER, receptor
from test_real_spikes import real

from vibrissa.neural.coding.demodulation import DemodulationAnalysis, demodulation
from vibrissa.neural.coding.drive_choice import DriveAnalysis, compare_drives
from vibrissa.neural.coding.information import count_information, spike_information
from vibrissa.neural.glm.bases import lagged, raised_cosines
from vibrissa.neural.glm.poisson import poisson_regression
from vibrissa.neural.glm.trial_design import TrialDesign
from vibrissa.neural.io.formats.nwb import read_nwb

WIDTH = 0.001
DELAY = {1: 6, 2: 7}  # [ms] from the sound to the spike of each receptor


# Thalamus: the file tells in how many of 50 trials the unit fired in each millisecond, so trials cannot be left out;
# the 16 deflections of each trial can.


def test_a_thalamic_spike_tells_more_than_one_bit_of_the_deflection_s_phase():
    counts = np.loadtxt(real("rat-vpm-whisker-thaldata.csv"), delimiter=",").astype(int)
    cycles = counts[500:2500].reshape(16, 125)[4:]  # the first four, while it adapts, are left out
    found = spike_information(cycles)
    assert found.corrected == pytest.approx(1.19, abs=0.01)
    assert found.extrapolated == pytest.approx(found.corrected, abs=0.02)
    assert 1.1 < found.low < found.high < 1.27
    shuffled = np.array([np.random.default_rng(k).permutation(one) for k, one in enumerate(cycles)])
    none = spike_information(shuffled)
    assert none.low < 0 < none.high


# Mouse: no stimulus on file, so no whisker and no envelope can be asked for; the units' own past can.


@pytest.mark.parametrize(("unit", "rest", "recovered"), [(0, 0.1, 1.8), (1, 0.5, 5.0), (2, 0.3, 0.6)])
def test_units_of_a_mouse_rest_after_a_spike_and_recover(unit, rest, recovered):
    pytest.importorskip("pynwb")
    spikes = read_nwb(real("A8604-211122.nwb"))
    time = spikes.spike_time.values[spikes.spike_unit.values == unit]
    first, n = np.floor(time.min()), 30  # pieces of 10 s
    counts = np.histogram(time, first + WIDTH * np.arange(n * 10000 + 1))[0].astype(float)
    shapes = raised_cosines(WIDTH * np.arange(1, 61), 7, stretch=0.002)
    own = lagged(counts, shapes, first=1).reshape(n, 10000, 7)
    design = TrialDesign(shared=np.ones((10000, 1)), own=own)
    fit = poisson_regression(design, counts.reshape(n, -1), WIDTH, penalty=np.r_[0.0, np.full(7, 0.1)])
    factor = np.exp(shapes @ fit.coefficients[1:])
    assert factor[0] < rest  # a millisecond after a spike
    assert factor[3:10].max() > recovered
    intervals = np.diff(time)
    short, later = np.mean(intervals < 0.001), np.mean((intervals > 0.004) & (intervals < 0.005))
    assert short < rest * later  # the intervals themselves say so


# Locust: the amplitude of a tone is on file, presented once.


@pytest.mark.parametrize("k", [1, 2])
def test_a_receptor_tells_about_a_bit_a_spike_of_the_amplitude(k):
    one = receptor(k)
    use = np.arange(1000, one.counts.shape[1] - 20)
    amplitude = one.amplitude.binned()[use - DELAY[k]]
    eighth = np.argsort(np.argsort(amplitude)) * 8 // amplitude.size
    counts = one.counts[:, use]
    found = count_information(counts, eighth)
    assert found.plain - found.corrected < 0.01 * found.plain  # 9,000 bins in 8 classes: little bias
    assert np.isnan(found.low)  # one presentation
    assert found.corrected / counts.mean() == pytest.approx({1: 0.78, 2: 0.68}[k], abs=0.01)
    turned = count_information(counts, np.roll(eighth, 4000))
    assert abs(turned.corrected) < 0.02 * found.corrected


def test_receptors_follow_the_amplitude_not_its_rise_and_one_carrier_cannot_tell_it_from_the_speed():
    how = DriveAnalysis(bin_width=WIDTH, smoothing=0.005, latest=0.012)
    for k in (1, 2):
        one = receptor(k)
        found = compare_drives([one.spikes], [one.tone], [1], how)
        assert found.best_drive.item() == "cannot tell"
        assert "envelope from speed" in found.reason.item()
        low = dict(zip(found.drive.values.tolist(), found.drive_loss_low.values[0], strict=True))
        assert low["rise"] > 0
        assert low["smoothed"] > 0
        assert found.drive_gain.sel(drive="envelope").item() > 0.65  # [bit] for each spike
        assert found.drive_latency.sel(drive="envelope").item() == pytest.approx(1e-3 * DELAY[k], abs=5e-4)
    assert found.carrier_frequency.item() == pytest.approx(CARRIER, rel=0.01)
    assert found.drive_likeness.sel(drive="speed").item() > 0.99


@pytest.mark.parametrize("k", [1, 2])
def test_a_receptor_s_own_past_foretells_its_spikes_beyond_the_sound(k):
    one = receptor(k)
    counts, level = one.counts[0].astype(float), one.decibels.binned()
    use = np.arange(1000, counts.size - 20)
    shapes = raised_cosines(WIDTH * np.arange(21), 8)
    sound = lagged((level - level.mean()) / level.std(), shapes)[use]
    past = lagged(counts, raised_cosines(WIDTH * np.arange(1, 31), 6, stretch=0.002), first=1)[use]
    shared = np.column_stack([np.ones(use.size), sound])
    share = {}
    for name, own in (("sound", past[:, :0]), ("both", past)):
        learnt, unseen = (slice(0, use.size // 2), slice(use.size // 2, None))
        design = TrialDesign(shared=shared[learnt], own=own[None, learnt])
        lam = np.r_[0.0, np.ones(8), np.full(own.shape[1], 0.1)]
        fit = poisson_regression(design, counts[None, use[learnt]], WIDTH, penalty=lam)
        expected = WIDTH * np.exp(TrialDesign(shared=shared[unseen], own=own[None, unseen]).log_rate(fit.coefficients))
        y = counts[None, use[unseen]]
        share[name] = 1 - kl_div(y, expected).sum() / kl_div(y, counts[use[learnt]].mean()).sum()
    assert share["sound"] > 0.05
    assert share["both"] > share["sound"] + 0.1


def test_bins_of_a_millisecond_hold_no_phase_of_a_tone_of_2500_hz():
    with refusal("range", "bin width"):
        demodulation(receptor(1).spikes, receptor(1).tone, 1, DemodulationAnalysis(bin_width=WIDTH))
