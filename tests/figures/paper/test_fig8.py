"""Figure 8: a unit that follows its envelope is seen to, and chance is where it belongs."""

import io

import numpy as np
import pytest
import xarray as xr

from vibrissa.figures.paper import fig8
from vibrissa.neural.coupling.envelope_coupling import bin_means
from vibrissa.neural.coupling.response import spike_counts
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes
from vibrissa.neural.simulated.wandering import unrelated_feature
from vibrissa.quantities import dataset

UNIT = ThresholdLinearUnit(threshold=40e-6, slope=2.5e5, baseline=5.0, latency=0.01)


def study(unit=UNIT, n_bins=1000, **attrs):
    time = np.arange(0, n_bins * 0.01, 1e-3)
    envelope = unrelated_feature(time, mean=55e-6, timescale=0.06, rng=np.random.default_rng(1))
    spikes = simulate_spikes(unit, time, envelope, 60, rng=np.random.default_rng(2)).assign_attrs(attrs)
    bins = {"start": 0.0, "n_bins": n_bins, "bin_width": 0.01}
    rate = spike_counts(spikes, n_trials=60, **bins).mean(0) / 0.01
    response = dataset(
        {"bin_width": 0.01, "n_trials": 60},
        bin=0.01 * np.arange(n_bins),
        firing_rate=rate,
        bin_envelope=bin_means(time, envelope, **bins),
    )
    return {"spikes": spikes, "response": response}


@pytest.fixture(scope="module")
def data():
    return fig8.compute(study())


def test_correlogram_peaks_at_the_latency_far_above_chance(data):
    assert data.attrs["lag"] == 1
    peak = int(np.argmax(data.correlogram.values))
    np.testing.assert_allclose(data.correlogram_lag[peak], 0.01)
    np.testing.assert_allclose(data.correlogram[peak], data.attrs["correlation"])
    assert 0.02 < data.attrs["chance"] < 0.4 < data.attrs["correlation"]


def test_classes_of_the_envelope_lie_on_the_hinge(data):
    expected = 5 + 2.5e5 * np.maximum(data.level_envelope - 40e-6, 0)
    far = np.abs(data.level_envelope - 40e-6) > 15e-6  # at the corner, averages over bins round it off
    np.testing.assert_allclose(data.level_rate[far], expected[far], rtol=0.15)  # 4 standard errors of some 250 spikes
    assert data.sizes["level"] == 12


def test_chance_is_exceeded_by_few_units_that_answer_nothing():
    quiet = ThresholdLinearUnit(slope=0.0)
    found = fig8.compute(study(quiet)).attrs
    assert found["correlation"] < 1.5 * found["chance"]


def test_hinge_and_motion_are_drawn_where_they_are_known(data):
    given = study()
    given["unit"] = xr.Dataset({name: getattr(UNIT, name) for name in ("threshold", "slope", "latency", "baseline")})
    given["motion"] = dataset(time=np.arange(4.0), point_displacement=np.zeros(4))
    told = fig8.compute(given)
    assert "threshold 40 µm, slope 0.25 AP/s/µm, latency 10.0 ms" in told.attrs["caption"]
    assert told.sizes["time"] == 4
    assert "threshold" not in data.attrs
    fig8.draw(told).savefig(io.BytesIO())


def test_a_threshold_that_is_not_identified_is_neither_printed_nor_drawn():
    given = study()
    given["unit"] = xr.Dataset({name: getattr(UNIT, name) for name in fig8.HINGE} | {"identified": False})
    found = fig8.compute(given)
    assert "Threshold: not identified." in found.attrs["caption"]
    assert "threshold 40" not in found.attrs["caption"]
    [panel] = [axis for axis in fig8.draw(found).axes if axis.get_title(loc="left").startswith("D")]
    assert fig8.FITTED not in [line.get_color() for line in panel.lines]
    given["unit"].attrs["fit"] = "paper2014"  # whose fit has no intervals
    assert "threshold 40 µm" in fig8.compute(given).attrs["caption"]


def test_simulated_units_are_called_so_and_recorded_ones_by_their_source(data):
    assert data.attrs["caption"].startswith("Figure 8. One simulated unit, 60 presentations")
    recorded = fig8.compute(study(source="rat7.csv"))
    assert recorded.attrs["caption"].startswith("Figure 8. One unit of rat7.csv")
    assert "A  One unit" in [axis.get_title(loc="left") for axis in fig8.draw(recorded).axes]


@pytest.mark.parametrize(
    ("unit", "n_bins"), [(UNIT, 4), (UNIT, 30), (ThresholdLinearUnit(slope=0.0, baseline=0.0), 100)]
)
def test_short_records_and_silent_units_are_drawn_without_chance(unit, n_bins):
    data = fig8.compute(study(unit, n_bins))
    assert np.isnan(data.attrs["chance"])
    assert "too few bins" in data.attrs["caption"]
    fig8.draw(data).savefig(io.BytesIO())


def test_the_texture_that_drove_the_unit_is_shown_and_its_absence_said(data):
    given, time = study(), np.arange(0, 10, 1e-3)
    given["prediction"] = dataset(time=time, point_displacement=1e-5 * np.sin(time))
    given["apparatus"] = dataset({"speed": 0.1}, trough_start=[0.0, 0.1], trough_width=[1e-3, 1e-3])
    found = fig8.compute(given)
    np.testing.assert_array_equal(found.trough_start, [0.0, 0.1])
    start, stop = found.attrs["zoom"]
    assert start <= found.bin.values[np.argmax(found.bin_envelope.values)] <= stop <= start + fig8.ZOOM + 1e-9
    assert "with the texture as it passes" in found.attrs["caption"]
    assert "the texture behind the stimulus is not in these results" in data.attrs["caption"]
    fig8.draw(found).savefig(io.BytesIO())


def test_the_envelope_is_scaled_to_come_nearest_to_the_rate(data):
    best = ((data.firing_rate - data.scaled_envelope) ** 2).sum()
    for factor in (0.99, 1.01):
        assert ((data.firing_rate - factor * data.scaled_envelope) ** 2).sum() > best


def test_several_units_are_shown_with_the_envelopes_of_their_own_whiskers(data):
    envelope = np.abs(np.random.default_rng(0).normal(4e-5, 1e-5, (4, 300)))
    examples = dataset(
        {"bin_width": 0.01, "n_trials": 40},
        example_unit=["a", "b", "c", "d"],
        bin=0.01 * np.arange(300),
        example_rate=2e5 * envelope * np.arange(1, 5)[:, None],
        example_bin_envelope=envelope,
        example_quality=["SU", "SU", "MU", "MU"],
        example_session=[3, 3, 3, 3],
    )
    found = fig8.compute(study() | {"unit_examples": examples})
    np.testing.assert_allclose(found.together_scaled, found.together_rate)  # rates in proportion to the envelope
    assert "2 SU and 2 MU of one session (40 presentations)" in found.attrs["caption"]
    assert "C, several units: none is given" in data.attrs["caption"]
    fig8.draw(found).savefig(io.BytesIO())


def test_drawing_labels_every_axis(data):
    figure = fig8.draw(data)
    figure.savefig(io.BytesIO())
    assert sorted(title for axis in figure.axes if (title := axis.get_title(loc="left")[:1])) == list("AABDE")
    assert all(axis.get_ylabel() for axis in figure.axes)
