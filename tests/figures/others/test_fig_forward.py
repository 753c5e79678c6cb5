"""The figure of the forward chain says what its caption says."""

import forward_figure as figure
import numpy as np
import pytest

from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.simulated.driven import draw_driven, fire

TIME = np.arange(0, 3.0, 1 / 4000)


@pytest.fixture(scope="module")
def fired():
    slow = 1 + 0.6 * np.sin(2 * np.pi * 1.3 * TIME) + 0.3 * np.sin(2 * np.pi * 3.1 * TIME)
    units = draw_driven(6, rng=np.random.default_rng(1))
    spikes = fire(units, TIME, 60e-6 * slow * np.sin(2 * np.pi * 120 * TIME), 200, seed=2)
    spikes = spikes.assign_attrs(distance=5e-3, motion_scale=2.5)
    return spikes, analyse_units(spikes, spikes, 200, EnvelopeAnalysis(skip=0.1, level=0.1))  # few independent shifts


@pytest.fixture(scope="module")
def data(fired):
    return figure.compute(*fired, shown=(0.5, 1.5))


def test_units_found_go_by_their_names(fired, data):
    spikes, found = fired
    assert figure.compute(spikes, found.isel(unit=slice(None, None, -1)), shown=(0.5, 1.5)).identical(data)


def test_the_rate_found_is_the_rate_given(data):
    assert data.sizes["bin"] == 100
    z = (data.firing_rate - data.expected_rate) / np.sqrt(data.expected_rate / (200 * figure.BIN))
    assert float((z**2).mean()) < 1.5
    assert np.corrcoef(data.firing_rate, data.expected_rate)[0, 1] > 0.9


def test_the_unit_drawn_is_the_steepest_that_is_identified(data):
    steepest = data.true_slope.values[data.identified.values].max()
    k = int(np.flatnonzero(data.true_slope.values == steepest)[0])
    assert data.attrs["unit_threshold"] == data.true_threshold.values[k]
    assert ((data.spike_time >= 0.5) & (data.spike_time < 1.5)).all()


def test_the_caption_tells_the_figure_s_own_numbers(data):
    caption = data.attrs["caption"]
    assert f"of the {int(data.identified.sum())} of 6 units" in caption
    assert "5 mm from the base, scaled by 2.5" in caption
    assert f"{100 * data.attrs['held']:.0f} % of the intervals hold" in caption
    assert data.attrs["held"] > 0.7


def test_it_is_drawn(data):
    assert len(figure.draw(data).axes) == 5
