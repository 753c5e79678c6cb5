"""Acceptance: from the motion of one whisker on 24 whiskers to the share of units it drives, and at what threshold."""

import numpy as np
import populations
import pytest
import xarray as xr

from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.coupling.nulls import circular_correlogram
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.neural.coupling.response import spike_counts
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.simulated.population import draw_population, record_population
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.stats import wilson_interval
from vibrissa.stimulus.array import replay_command
from vibrissa.stimulus.band import Band
from vibrissa.stimulus.waveform import PointMotion

RATE = 2000.0  # [Hz]
BETWEEN = 10 / 24  # [s] from one whisker to the next
MEAN_ENVELOPE = 55e-6  # [m] as in `populations`: filtering takes some of it away


def replayed(rng, delays="even"):
    """Command of 24 whiskers from 10 s of ringing."""
    motion = PointMotion(displacement=populations.ringing(rng, duration=10.2, rate=RATE)[1], sampling_rate=RATE)
    band = Band(norm="mag")
    plain = replay_command([motion], sampling_rate=RATE, band=band)
    found = float(analytic_envelope(plain.command.values[0])[0].mean())
    return replay_command([motion], sampling_rate=RATE, band=band, scale=MEAN_ENVELOPE / found, delays=delays)


def without_carriers(truth, spare):
    """Put units of another draw that nothing locks to the carrier in place of those that are; names stay."""
    chosen = np.arange(truth.sizes["unit"])
    for quality in ("SU", "MU"):
        locked = (truth.driven_by == "carrier") & (truth.unit_quality == quality)
        fit = (~spare.driven_by.isin(["envelope", "carrier"])) & (spare.unit_quality == quality)
        chosen[locked] = truth.sizes["unit"] + np.flatnonzero(fit)[: int(locked.sum())]
    both = xr.concat([truth, spare], "unit", combine_attrs="override")
    return both.isel(unit=chosen).assign(unit_name=truth.unit_name)


def neighbours(truth, rng):
    """The units that the envelope drives, each now driven by one of the four nearest whiskers instead."""
    units = truth.isel(unit=np.flatnonzero(truth.driven_by == "envelope"))
    n = units.sizes["unit"]
    driving = (units.unit_whisker + rng.choice([-2, -1, 1, 2], n)) % truth.attrs["n_whiskers"]
    return units.assign(
        driven_by=("unit", np.repeat("other whisker", n)),
        driving_whisker=driving,
        surround_gain=xr.zeros_like(units.surround_gain),
    )


def recorded(truth, command, n_trials, rng):
    return record_population(truth, command.time.values, command.command.values, n_trials, rng=rng)


def moved(command, whisker):
    return dataset(time=command.time.values, point_displacement=command.command.values[whisker])


def analysed(spikes, command, n_resamples=400):
    """Units against the motion of their own whisker, p-values adjusted over the units of each whisker."""
    how = EnvelopeAnalysis(delays=tuple(command.delay.values[1:].tolist()), n_resamples=n_resamples)
    n_trials, tables = spikes.attrs["n_trials"], []
    for whisker in np.unique(spikes.unit_whisker).tolist():
        index = np.flatnonzero(spikes.unit_whisker == whisker)
        own = spikes.isel(spike=np.flatnonzero(np.isin(spikes.spike_unit, index)))
        unit, names = np.searchsorted(index, own.spike_unit.values), spikes.unit_name.values[index].tolist()
        table = spike_table(own.spike_time.values, unit, names, trial=own.spike_trial.values)
        table.attrs["n_trials"] = n_trials
        tables.append(analyse_units(table, moved(command, whisker), n_trials, how).assign_coords(unit=index))
    return xr.concat(tables, "unit", combine_attrs="override", join="exact").sortby("unit").drop_vars("unit")


def peaks(spikes, command):
    """Lag at which each unit's rate is most like the envelope of its own whisker, anywhere in the loop [bins]."""
    return np.array([_peak(spikes, command, k) for k in range(spikes.sizes["unit"])])


def _peak(spikes, command, k):
    shown = Presentation.of(moved(command, int(spikes.unit_whisker[k])))
    own = spikes.isel(spike=np.flatnonzero(spikes.spike_unit == k))
    counts = spike_counts(own, n_trials=spikes.attrs["n_trials"], start=0.0, n_bins=1000, bin_width=0.01)
    r = circular_correlogram(counts.mean(0), shown.rate_valid, shown.binned(), shown.envelope_valid)
    return np.nanargmax(r)


def off(found, truth, command):
    """How far each peak is from the delay between the two whiskers and the latency [bins]."""
    delay = command.delay.values
    between = delay[truth.driving_whisker.values] - delay[truth.unit_whisker.values] + truth.true_latency.values
    return (found - between / 0.01 + 500) % 1000 - 500


@pytest.fixture(scope="module")
def command():
    return replayed(np.random.default_rng(1))


@pytest.fixture(scope="module")
def truth():
    first, second = (draw_population(rng=np.random.default_rng(seed)) for seed in (2, 3))
    return without_carriers(first, second)


def largest_correlation(copies):
    return np.abs(np.corrcoef(copies.command.values)[np.triu_indices(24, 1)]).max()


def test_24_evenly_shifted_copies_are_uncorrelated(command):
    np.testing.assert_allclose(np.sort(command.delay), BETWEEN * np.arange(24), atol=1 / RATE)
    assert largest_correlation(command) < 0.1
    np.testing.assert_allclose(command.largest_correlation, largest_correlation(command), rtol=1e-6)
    assert command.attrs["correlation_note"] == ""


def test_where_even_delays_meet_a_peak_it_is_told_and_least_ones_avoid_it():
    even = replayed(np.random.default_rng(13))  # as one such motion in twenty
    assert largest_correlation(even) > 0.1
    assert "not below 0.1" in even.attrs["correlation_note"]
    assert largest_correlation(replayed(np.random.default_rng(13), "least")) < 0.05


@pytest.mark.parametrize("seed", range(5))
def test_copies_with_searched_delays_are_uncorrelated(seed):
    assert largest_correlation(replayed(np.random.default_rng(seed), "least")) < 0.05


def test_units_of_a_neighbouring_whisker_peak_at_its_delay_and_are_not_called_driven(command, truth):
    units = neighbours(truth, np.random.default_rng(4))
    units = units.isel(unit=np.flatnonzero((units.true_slope > 5e4) & (units.true_threshold < 60e-6))[:30])
    spikes = recorded(units, command, 40, np.random.default_rng(5))
    assert np.abs(off(peaks(spikes, command), units, command)).max() <= 2
    assert not analysed(spikes, command).significant.any()


def test_units_of_their_own_whisker_peak_at_their_latency(command, truth):
    sure = (truth.driven_by == "envelope") & (truth.true_slope > 5e4) & (truth.true_threshold < 60e-6)
    units = truth.isel(unit=np.flatnonzero(sure)[:10])
    spikes = recorded(units, command, 40, np.random.default_rng(6))
    assert np.abs(off(peaks(spikes, command), units, command)).max() <= 2


def test_driven_share_and_mean_threshold_of_some_units_come_out(command, truth):
    units = truth.isel(unit=np.flatnonzero(truth.unit_session == 0))  # of one session: few whiskers
    assert 30 <= units.sizes["unit"] <= 40
    spikes = recorded(units, command, 60, np.random.default_rng(7))
    found = analysed(spikes, command, n_resamples=100)
    driven = (units.driven_by == "envelope").values
    low, high = wilson_interval(int(driven.sum()), driven.size)
    assert low <= found.significant.values.mean() <= high
    assert (found.significant.values & ~driven).sum() <= 1
    told = found.identified.values & driven
    assert told.sum() >= 0.6 * driven.sum()  # six of nine: intervals over the stimulus too are wider
    error = found.threshold.values[told] - units.true_threshold.values[told]
    assert abs(error.mean()) < 2 * found.threshold.values[told].std(ddof=1) / np.sqrt(told.sum())


def test_what_takes_the_place_of_carrier_units_is_idle_too(truth):
    plain = draw_population(rng=np.random.default_rng(2))
    assert not np.any(truth.driven_by == "carrier")
    assert np.array_equal(truth.driven_by == "envelope", plain.driven_by == "envelope")
    assert np.array_equal(truth.unit_quality, plain.unit_quality)
    assert np.array_equal(truth.unit_name, plain.unit_name)
