"""A virtual session at the stimulator: what was put into the units comes out, block by block, and again the same."""

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

from vibrissa.figures.canvas import caption_of
from vibrissa.figures.paper import fig8
from vibrissa.netcdf import load, save
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.stimulus.band import Band
from vibrissa.study.neurons import cortex
from vibrissa.study.neurons.cortex import (
    analyse_block,
    command_of,
    gathered,
    population,
    recorded,
    run_cortex,
    stimulated,
)
from vibrissa.study.report.gallery import figure_of
from vibrissa.study.spec.cortex import Cortex

SMALL = Cortex(every=10, n_trials=24)
TINY = Cortex(every=110, n_trials=12)


@pytest.fixture(scope="module")
def results():
    return run_cortex(SMALL)


@pytest.fixture(scope="module")
def units(results):
    return results["units"]


def test_units_are_every_tenth_of_the_papers_with_their_truth(units):
    whole = population(Cortex())
    np.testing.assert_array_equal(units.unit_name, whole.unit_name[::10])
    for name in ("unit_whisker", "unit_session", "true_threshold", "true_slope", "driven_by"):
        np.testing.assert_array_equal(units[name], whole[name][::10])
    assert whole.sizes["unit"] == 170 + 344
    assert population(Cortex(counts="methods")).sizes["unit"] == 143 + 289


def test_driven_units_are_found_and_others_are_not(units):
    driven, idle = (units.driven_by == "envelope").values, ~units.driven_by.isin(["envelope", "carrier"]).values
    found = units.significant.values
    assert driven.sum() >= 12
    assert found[driven].mean() >= 0.9
    assert found[idle].sum() <= 2
    told = units.isel(unit=np.flatnonzero(driven & units.identified.values))
    for name in ("threshold", "slope", "latency"):
        true = told[f"true_{name}"].values
        held = (told[f"{name}_low"].values <= true) & (true <= told[f"{name}_high"].values)
        assert held.mean() >= 0.8, name
    error = told.threshold.values - told.true_threshold.values
    assert np.abs(np.median(error)) < 2e-6
    assert 42e-6 * 0.7 < told.threshold.values.mean() < 42e-6 * 1.3


def test_the_command_has_the_mean_envelope_asked_for_and_delays_of_24_whiskers():
    command = command_of(SMALL)
    assert command.sizes["whisker"] == len(np.unique(command.delay)) == 24
    mean = analytic_envelope(command.command.values)[0].mean(axis=1)
    np.testing.assert_allclose(mean[0], 55e-6, rtol=1e-3)
    np.testing.assert_allclose(mean, 55e-6, rtol=0.02)


def test_captions_name_the_filter_that_the_command_went_through(results, monkeypatch):
    for told in (results["units"].attrs["note"], fig8.compute(results).attrs["caption"]):
        assert command_of(SMALL).attrs["filter"] in told
        assert "causal, once forwards" in told
        assert "backwards" not in told
    monkeypatch.setattr(cortex, "BAND", Band(causal=False))
    command_of.cache_clear()
    told = cortex.note(TINY)
    command_of.cache_clear()
    assert "zero-phase, forwards and backwards" in told
    assert "causal" not in told


def test_a_unit_fires_as_often_as_its_truth_says(results, units):
    k = units.unit_name.values.tolist().index(str(results["spikes"].unit_name.values[0]))
    truth, motion = units.isel(unit=k), results["motion"]
    np.testing.assert_array_equal(motion.point_displacement, command_of(SMALL).command[int(truth.unit_whisker)])
    envelope = analytic_envelope(motion.point_displacement.values)[0]
    above = np.maximum(envelope - float(truth.true_threshold), 0).mean()
    whiskers = 1 + 4 * float(truth.surround_gain)  # the copies of all whiskers have the same mean
    expected = float(truth.true_baseline) + float(truth.true_slope) * above * whiskers
    counted = results["spikes"].sizes["spike"] / (SMALL.n_trials * 10.0)
    assert str(truth.driven_by.values) == "envelope"
    assert counted == pytest.approx(expected, rel=0.15)  # gains of sessions and trials; rests after spikes
    assert results["response"].firing_rate.values.mean() == pytest.approx(counted, rel=1e-3)


def test_blocks_in_any_order_make_the_same_and_no_other_unit_matters():
    whiskers = stimulated(TINY)
    backwards = [analyse_block(TINY, whisker) for whisker in whiskers[::-1]][::-1]
    xr.testing.assert_identical(gathered(TINY, backwards)["units"], run_cortex(TINY)["units"])
    whole = recorded(TINY, np.arange(population(TINY).sizes["unit"]))
    alone = recorded(TINY, np.array([3]))
    np.testing.assert_array_equal(alone.spike_time, whole.spike_time[whole.spike_unit == 3])


def test_a_repetition_gives_equal_bytes(tmp_path):
    texts = []
    for run in range(2):
        command_of.cache_clear(), population.cache_clear()
        for name, data in run_cortex(TINY).items():
            save(data, tmp_path / f"{name}{run}.nc")
        texts.append([path.read_bytes() for path in sorted(tmp_path.glob(f"*{run}.nc"))])
    assert texts[0] == texts[1]
    assert len(texts[0]) >= 4


def test_each_seed_is_of_one_thing():
    places = np.array([0])

    def spikes(**seeds):
        return recorded(Cortex(every=110, n_trials=2, **seeds), places)

    plain = spikes()
    assert plain.spike_time.equals(spikes().spike_time)
    assert not plain.spike_time.equals(spikes(spike_seed=9).spike_time)
    other = Cortex(every=110, population_seed=9)
    assert not population(other).true_latency.equals(population(TINY).true_latency)
    np.testing.assert_array_equal(command_of(other).command, command_of(TINY).command)
    assert not np.array_equal(command_of(Cortex(texture_seed=9)).command, command_of(TINY).command)


def test_figures_8_and_9_are_made_of_what_is_saved(results, tmp_path):
    for name, data in results.items():
        save(data, tmp_path / f"{name}.nc")
    nine = figure_of("9", tmp_path)
    assert "Simulated units" in caption_of(nine)
    assert "chosen because the paper prints none; 24 presentations" in caption_of(nine)
    assert "the fitted threshold-linear curve, seen through the bins" in caption_of(figure_of("8", tmp_path))
    assert "Simulated units" in caption_of(figure_of("9", tmp_path / "units.nc"))
    assert load(tmp_path / "units.nc").attrs["n_whiskers"] == 24


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"every": 0}, ("range", "Cortex.every")),
        ({"n_trials": 0}, ("range", "Cortex.n_trials")),
        ({"mean_envelope": -1.0}, ("range", "Cortex.mean_envelope")),
        ({"spike_seed": -1}, ("range", "Cortex.spike_seed")),
        ({"distance": 0.06}, ("range", "Cortex.distance")),
        ({"grating_length": 0.005}, ("range", "Cortex.grating_length")),
    ],
)
def test_what_cannot_be_is_refused(wrong, message):
    with refusal(*message):
        Cortex(**wrong)
