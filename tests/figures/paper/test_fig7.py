"""Figure 7A–D: effects put in come out, and envelopes belong to the texture's distance, not to time."""

import io

import numpy as np
import pytest
from refusals import refusal
from simulated_sweeps import simulated

from vibrissa.figures.paper import fig7


@pytest.fixture(scope="module")
def told():
    sweeps, series = simulated(animals=2, conditions=2, noise=0.3)
    return sweeps, series, fig7.compute({"sweeps": sweeps}, series.__getitem__)


def test_envelopes_at_two_speeds_agree_by_distance_over_one_texture_only(told):
    data = told[2]
    middle = data.pair_correlogram.sel(offset=0, method="nearest")
    same = data.pair_same_texture.values
    assert same.any()
    assert float(middle[same].mean()) > float(middle[~same].mean()) + 0.1


def test_gain_rises_with_the_base_angle_measured_and_in_the_model(told):
    slope = told[2].effect_slope.sel(subset="all", term="base_angle")
    assert np.all(slope > 0)


def test_model_gain_is_below_the_measured_one_by_the_noise_added(told):
    gain = told[2].sweep_gain
    assert float((gain.sel(source="measured") / gain.sel(source="model")).mean()) == pytest.approx(
        np.sqrt(1 + 0.3**2), rel=0.1
    )


def test_examples_follow_the_series_by_distance(told):
    sweeps, series, data = told
    number = int(data.example[0])
    one, speed = series[number], float(sweeps.scan_speed[number])
    expected = np.interp(data.distance_scanned / speed, one.time, one.envelope[0]) / float(sweeps.length[number])
    np.testing.assert_allclose(data.example_envelope[0], expected)


def test_restriction_takes_only_those_whiskers(told):
    n = told[2].effect_n.sel(source="measured", term="contact")
    assert int(n.sel(subset="all")) == 24
    assert int(n.sel(subset="β and C1")) == 16


def test_figure_is_drawn(told):
    fig7.draw(told[2]).savefig(io.BytesIO())


def test_nothing_accepted_is_refused(told):
    sweeps = told[0].assign(accepted=told[0].accepted & False)
    with refusal("too-few", "sweeps"):
        fig7.compute({"sweeps": sweeps}, told[1].__getitem__)


def test_without_a_texture_neither_the_model_nor_correlograms_take_a_place(told):
    sweeps, series, _ = told
    blind = sweeps.assign(mode_rms_model=np.nan * sweeps.mode_rms_model).assign_coords(texture=0 * sweeps.texture - 1)
    for name in ("resonant_frequency", "resonant_frequency_white"):
        blind[name] = np.nan * blind[name]
    data = fig7.compute({"sweeps": blind}, series.__getitem__)
    caption = data.attrs["caption"]
    assert "nan" not in caption
    assert "B, correlograms: no whisker met" in caption
    assert "Model: no texture is known." in caption
    figure = fig7.draw(data)
    figure.savefig(io.BytesIO())
    titles = [axis.get_title(loc="left") for axis in figure.axes[data.sizes["example"] :]]
    assert [title[0] for title in titles] == list("CDGH")
    assert all(axis.axison and axis.has_data() for axis in figure.axes)
    assert not any("nan" in title for title in titles)
    shown = [text.get_text() for axis in figure.axes if axis.get_legend() for text in axis.get_legend().get_texts()]
    assert shown == ["mode 1", "envelope", "C1", "C2", "β", "the mean"]


def test_one_sweep_is_drawn_and_tells_no_effect(told):
    sweeps, series, _ = told
    alone = sweeps.assign(accepted=sweeps.accepted & (sweeps.sweep == 0))
    alone["resonant_frequency"] = np.nan * alone.resonant_frequency
    alone["resonant_frequency_white"] = 0 * alone.resonant_frequency_white.fillna(0) + 80.0
    data = fig7.compute({"sweeps": alone}, series.__getitem__)
    assert "Measured: too few sweeps to find an effect." in data.attrs["caption"]
    assert "nan" not in data.attrs["caption"]
    assert data.example_frequency.values.tolist() == [80.0]
    fig7.draw(data).savefig(io.BytesIO())
