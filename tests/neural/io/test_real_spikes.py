"""Spikes of real neurons: a rat's thalamus, units of an NWB file, a locust's ear."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from vibrissa.neural.coupling.envelope_coupling import bin_means
from vibrissa.neural.coupling.response import bin_edges, psth
from vibrissa.neural.io.formats.nwb import read_nwb, read_nwb_trials
from vibrissa.neural.io.formats.nwb_writer import Session, write_nwb
from vibrissa.neural.io.tables.spike_csv import read_spikes, write_csv
from vibrissa.neural.io.tables.spikes import of_unit, spike_table
from vibrissa.neural.io.tables.trials import cut_into_trials, trials_at
from vibrissa.neural.sorting.observed import within_trials
from vibrissa.neural.sorting.quality import unit_quality

DATA = Path(__file__).parents[3] / ".." / "shared" / "data" / "spikes"


def real(name):
    path = DATA / name
    if not path.is_file():
        pytest.skip(f"real data {name} is not here")
    return path


# A unit of the rat's ventral posteromedial thalamus: 50 trials of 3 s, one whisker deflected at 8 Hz from 0.5 to 2.5 s
# (Temereanca 2008). The file tells in how many trials the unit fired in each millisecond.

TRIALS, GAP = 50, 5.0


@pytest.fixture
def thalamus():
    """Spikes on the session's clock: which trials fired in a millisecond is not told, so they take turns."""
    counts = np.loadtxt(real("rat-vpm-whisker-thaldata.csv"), delimiter=",").astype(int)
    trial = np.arange(counts.sum()) % TRIALS
    time = np.repeat((np.arange(3000) + 0.5) / 1000, counts)
    return spike_table(trial * GAP + time, np.zeros(time.size, int), ["VPM"]), counts


def test_rates_before_during_and_after_the_deflections(thalamus, tmp_path):
    write_csv(thalamus[0], tmp_path / "vpm.csv")
    spikes = read_spikes(tmp_path / "vpm.csv")
    onsets = 0.5 + GAP * np.arange(TRIALS)
    cut = cut_into_trials(spikes, trials_at(onsets, 2.0), (-0.5, 2.5))  # what fires between stimuli belongs
    assert cut.attrs["spikes_outside"] == 0
    found = psth(cut, [-0.5, 0, 2, 2.5])
    np.testing.assert_allclose(found.firing_rate[0], [11.4, 25.29, 9.68], atol=1e-9)
    assert found.spike_count.sum() == 3056


def test_rate_follows_the_whisker_at_8_hz(thalamus):
    spikes, counts = thalamus
    cut = cut_into_trials(spikes, trials_at(GAP * np.arange(TRIALS), 3.0))
    rate = psth(cut, bin_edges(0, 3, 0.001)).firing_rate.values[0]
    np.testing.assert_allclose(rate, counts / TRIALS / 0.001)
    during = rate[500:2500] - rate[500:2500].mean()
    power = np.abs(np.fft.rfft(during)) ** 2
    frequency = np.fft.rfftfreq(2000, 0.001)
    assert frequency[power.argmax()] == 8
    assert power[frequency == 8] > 10 * np.median(power)


def test_rate_of_the_session_is_not_that_of_the_stimulus(thalamus):
    cut = cut_into_trials(thalamus[0], trials_at(0.5 + GAP * np.arange(TRIALS), 2.0))
    start = GAP * np.arange(TRIALS)
    session = unit_quality(within_trials(thalamus[0], start, start + 3.0))  # the 3 s of each trial alone are on file
    assert cut.sizes["spike"] / (TRIALS * 2.0) == pytest.approx(25.29)
    assert session.unit_rate.item() == pytest.approx(3056 / 150)


# An example file of pynapple: three units, ids with holes, no names


def test_units_of_a_real_file():
    pytest.importorskip("pynwb")
    spikes = read_nwb(real("A8604-211122.nwb"))
    assert spikes.unit_id.values.tolist() == [6, 191, 206]
    assert np.bincount(spikes.spike_unit).tolist() == [11020, 4690, 5644]
    trials = read_nwb_trials(real("A8604-211122.nwb"), table="epochs")
    assert trials.trial_stop.values.tolist() == [1087.5289]
    cut = cut_into_trials(spikes, trials)
    assert cut.attrs["spikes_outside"] == 0
    quality = unit_quality(spikes, 1087.5289)
    np.testing.assert_allclose(quality.unit_rate, np.array([11020, 4690, 5644]) / 1087.5289)
    short = [np.mean(np.diff(of_unit(spikes, one).spike_time) < 1e-3) for one in ("6", "191", "206")]
    np.testing.assert_allclose(quality.refractory_violations, short)


def test_real_file_goes_there_and_back(tmp_path):
    pytest.importorskip("pynwb")
    spikes = read_nwb(real("A8604-211122.nwb"))
    about = {"identifier": "A8604-211122", "description": "awake", "subject": "A8604", "age": "P90D"}
    start = datetime(2022, 4, 5, 3, 7, 59, tzinfo=UTC)
    write_nwb(spikes, tmp_path / "a.nwb", Session(start=start, species="Mus musculus", sex="U", **about))
    assert read_nwb(tmp_path / "a.nwb").equals(spikes)
    write_csv(spikes, tmp_path / "a.csv")
    assert read_spikes(tmp_path / "a.csv").equals(spikes.drop_vars("unit_id"))


def test_spikes_are_those_in_the_bare_file():
    pytest.importorskip("pynwb")
    h5py = pytest.importorskip("h5py")
    spikes = read_nwb(real("A8604-211122.nwb"))
    with h5py.File(real("A8604-211122.nwb")) as file:
        flat, end = file["units/spike_times"][:], file["units/spike_times_index"][:]
    for k, times in enumerate(np.split(flat, end[:-1])):
        np.testing.assert_array_equal(spikes.spike_time[spikes.spike_unit == k], times)


# Auditory receptors of a locust, driven by the amplitude of a tone (in the package nitime)


def locust(k):
    """Spikes, and the amplitude of the tone with its times [s]."""
    data = Path(pytest.importorskip("nitime").__file__).parent / "data"
    time = 1e-6 * np.loadtxt(data / f"grasshopper_spike_times{k}.txt")
    stimulus = np.loadtxt(data / f"grasshopper_stimulus{k}.txt")
    return spike_table(time, np.zeros(time.size, int), ["receptor"]), 1e-6 * stimulus[:, 0], stimulus[:, 1]


@pytest.mark.parametrize(("k", "number"), [(1, 929), (2, 868)])
def test_locust_receptor_is_a_single_unit_of_high_rate(k, number):
    spikes, _, _ = locust(k)
    found = unit_quality(spikes, 10.0)
    assert found.unit_rate.item() == pytest.approx(number / 10)
    assert found.refractory_violations.item() == 0
    assert found.kept.item()


@pytest.mark.parametrize("k", [1, 2])
def test_locust_receptor_demodulates_the_tone_some_milliseconds_late(k):
    spikes, time, amplitude = locust(k)
    cut = cut_into_trials(spikes, trials_at([0.0], 10.0))
    rate = psth(cut, bin_edges(0, 10, 0.002)).firing_rate.values[0]
    envelope = bin_means(time, amplitude, start=0.0, n_bins=5000, bin_width=0.002)
    lags = np.arange(-20, 21)
    r = np.array([np.corrcoef(rate[20:-20], envelope[20 - lag : 4980 - lag])[0, 1] for lag in lags])
    assert 4 <= 2 * lags[r.argmax()] <= 10  # [ms]: from the sound to the recorded spike
    assert r.max() > 0.2
    assert np.abs(r[lags < 0]).max() < 0.1  # nothing before its cause
