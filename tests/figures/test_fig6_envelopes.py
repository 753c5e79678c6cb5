"""Figure 6C–D over sweeps."""

import io

import numpy as np
import pytest
from simulated_sweeps import simulated

from vibrissa.errors import InputError
from vibrissa.figures import fig6_envelopes
from vibrissa.mechanics.comparison import compare_sweeps
from vibrissa.texture.surface import random_grating


@pytest.fixture(scope="module")
def study():
    sweeps, series = simulated(animals=1, conditions=2, noise=1.0)
    rng = np.random.default_rng(8)
    pseudo = [random_grating(0.25, rng=rng) for _ in range(24)]
    return {"sweeps": sweeps, "comparison": compare_sweeps(sweeps, series.__getitem__, pseudo)}, series


@pytest.fixture(scope="module")
def data(study):
    return fig6_envelopes.compute(study[0], study[1].__getitem__)


def test_noise_as_large_as_the_signal_lowers_the_correlation_but_not_to_chance(data):
    rho = data.correlation.sel(mode=1)
    assert 0.3 < float(rho.mean()) < 0.9
    assert float(rho.mean()) > float(data.chance_mean.sel(mode=1).mean()) + 0.1
    able = data.pseudo_count >= 19
    assert int(able.sum()) >= 6
    assert float((data.pseudo_p.sel(mode=1)[able] <= 0.05).mean()) > 0.6


def test_lag_is_near_zero_where_there_is_none(data):
    assert float(np.abs(data.best_lag.sel(mode=1)).median()) < 5e-3


def test_examples_are_of_one_whisker_and_texture_and_scaled_to_the_measurement(study, data):
    sweeps = study[0]["sweeps"].sel(sweep=data.example)
    assert len(np.unique(sweeps.whisker_name)) == len(np.unique(sweeps.texture)) == 1
    assert np.all(np.diff(data.example_correlation) >= 0)
    whole = [study[1][int(i)].envelope.values[0].mean() for i in data.example]
    np.testing.assert_allclose(data.example_predicted.mean("distance_scanned"), whole, rtol=0.3)


def test_caption_tells_both_tests(data):
    assert "by Pearson" in data.attrs["caption"]
    assert "by 24 new gratings" in data.attrs["caption"]


def test_figure_is_drawn_and_every_panel_of_it_is_filled(data):
    figure = fig6_envelopes.draw(data)
    figure.savefig(io.BytesIO())
    assert len(figure.axes) == data.sizes["example"] + 2
    assert all(axis.axison and axis.has_data() for axis in figure.axes)
    lowest = {round(axis.get_position().x0, 1): axis.get_position().y0 for axis in figure.axes}  # of each column
    assert np.ptp(list(lowest.values())) < 0.05


def test_sweeps_without_prediction_are_refused(study):
    sweeps, told = study[0]["sweeps"], study[0]["comparison"]
    with pytest.raises(InputError, match="prediction"):
        fig6_envelopes.compute({"sweeps": sweeps, "comparison": told * np.nan}, study[1].__getitem__)
