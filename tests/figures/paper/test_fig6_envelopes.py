"""Figure 6C–D over sweeps."""

import io
import re

import numpy as np
import pytest
from refusals import refusal
from simulated_sweeps import simulated

from vibrissa.figures.paper import fig6_envelopes
from vibrissa.figures.paper.parts.examples import alike
from vibrissa.mechanics.across.comparison import compare_sweeps
from vibrissa.study.paper.paper_numbers import compare
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
    able = data.pseudo_count >= 20
    assert int(able.sum()) >= 6
    assert float((data.pseudo_p.sel(mode=1)[able] < 0.05).mean()) > 0.6


def test_lag_is_near_zero_where_there_is_none(data):
    assert np.nanmedian(np.abs(data.best_lag.sel(mode=1))) < 5e-3


@pytest.mark.parametrize(
    ("animals", "conditions", "shared", "owners"),
    [
        (1, 3, "one whisker, one texture", 1),
        (2, 2, "whiskers of one name in several animals, one texture", 2),
        (1, 2, "several whiskers, one texture", 3),
    ],
)
def test_examples_share_a_texture_and_the_whisker_where_it_has_three(animals, conditions, shared, owners):
    sweeps, _ = simulated(animals=animals, conditions=conditions)
    places, words = alike(sweeps, sweeps.accepted.values)
    some = sweeps.isel(sweep=places)
    assert words == shared
    assert len(places) >= 3
    assert len(np.unique(some.texture)) == 1
    assert len(set(zip(some.animal.values.tolist(), some.whisker_name.values.tolist(), strict=True))) == owners


def test_examples_are_scaled_to_the_measurement_and_have_their_texture(study, data):
    sweeps = study[0]["sweeps"].sel(sweep=data.example)
    assert np.all(np.diff(data.example_correlation) >= 0)
    whole = [study[1][int(i)].envelope.values[0].mean() for i in data.example] / sweeps.length.values
    np.testing.assert_allclose(data.example_predicted.mean("distance_scanned"), whole, rtol=0.3)
    start = np.array([0.0, 0.02, 0.9])
    known = {i: one.assign(trough_start=("trough", start), trough_width=("trough", np.full(3, 1e-3)))
             for i, one in study[1].items()}  # fmt: skip
    textured = fig6_envelopes.compute(study[0], known.__getitem__)
    np.testing.assert_array_equal(textured.trough_start, [0.02])  # the one in the distance shown
    assert fig6_envelopes.draw(textured).axes[3].get_xlabel() == "distance scanned [mm]"


def test_caption_tells_both_tests(data):
    assert "p < 0.05" in data.attrs["caption"]
    assert "by Pearson" in data.attrs["caption"]
    assert "by new gratings (the least p of 24 new gratings is 0.04; at least 20 are needed" in data.attrs["caption"]


def test_nineteen_gratings_cannot_reach_the_level_and_the_report_says_as_the_caption(study):
    """Even where every sweep beats all of its gratings: p = 1/20, which is not below 0.05."""
    sweeps, told = study[0]["sweeps"], study[0]["comparison"]
    few = told.assign(pseudo_p=told.pseudo_p * 0 + 1 / 20, pseudo_count=told.pseudo_count * 0 + 19)
    few.attrs = told.attrs
    caption = fig6_envelopes.compute({"sweeps": sweeps, "comparison": few}, study[1].__getitem__).attrs["caption"]
    assert "by new gratings it cannot reach that: the least p of 19 new gratings is 0.05" in caption
    rows = {row.paper.id: row for row in compare({"sweeps": sweeps, "comparison": few})}
    assert "new gratings, at most 19, cannot reach that level" in rows["significant_1"].why
    rows = {row.paper.id: row for row in compare({"sweeps": sweeps, "comparison": told})}
    caption = fig6_envelopes.compute({"sweeps": sweeps, "comparison": told}, study[1].__getitem__).attrs["caption"]
    for mode in (1, 2):
        passed, of = re.search(r"(\d+) of (\d+) against the predictions", rows[f"significant_{mode}"].why).groups()
        assert f", {passed}/{of} by new gratings" in caption.split(f"Mode {mode}:")[1]


def test_figure_is_drawn_and_every_panel_of_it_is_filled(data):
    figure = fig6_envelopes.draw(data)
    figure.savefig(io.BytesIO())
    assert len(figure.axes) == data.sizes["example"] + 2
    assert all(axis.axison and axis.has_data() for axis in figure.axes)
    lowest = {round(axis.get_position().x0, 1): axis.get_position().y0 for axis in figure.axes}  # of each column
    assert np.ptp(list(lowest.values())) < 0.05


def test_sweeps_without_prediction_are_refused(study):
    sweeps, told = study[0]["sweeps"], study[0]["comparison"]
    with refusal("too-few", "sweeps"):
        fig6_envelopes.compute({"sweeps": sweeps, "comparison": told * np.nan}, study[1].__getitem__)
