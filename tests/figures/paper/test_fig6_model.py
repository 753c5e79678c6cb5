"""Figure 6A–B: over λ only the jump collapses, and only in the linear form; the ramps answer to v."""

import io

import numpy as np
import pytest

from vibrissa.figures.paper import fig6_model
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.gap import excursion_at_jump
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)
SCAN = Scan(speed=0.1, damping=0.11)
KAPPA = 22.783829  # κ₁ at this contact


@pytest.fixture(scope="module")
def data():
    return fig6_model.compute(POSTURE, WHISKER, SCAN, rng=np.random.default_rng(1), n_textures=3)


def over_width(data, form):
    return (data.jump_response.sel(form=form, mode=1) / data.gap).transpose("gap", "time").values


def test_linear_jumps_collapse_over_the_width(data):
    found = over_width(data, "linear")
    np.testing.assert_allclose(found, found[[0]] * np.ones((3, 1)), atol=1e-9 * np.abs(found).max())
    assert float(data.collapse_spread.sel(form="linear", signal="jump alone")) < 1e-9


def test_exact_jumps_do_not_collapse(data):
    exact, linear = over_width(data, "exact"), over_width(data, "linear")
    after = data.time.values > 1e-4
    ratio = np.array([0.897, 0.813, 0.722])  # of the jumps, three digits
    scale = np.abs(linear).max()
    np.testing.assert_allclose(exact[:, after], ratio[:, None] * linear[:, after], atol=6e-4 * scale)
    assert float(data.collapse_spread.sel(form="exact", signal="jump alone")) > 0.2


def test_the_first_ramp_kicks_every_gap_alike(data):
    omega = KAPPA / WHISKER.timescale
    ringing = omega * np.sqrt(1 - SCAN.damping**2)
    for width in data.gap.values:
        one = data.sel(form="linear", gap=width, mode=1)
        since = data.time.values + excursion_at_jump(POSTURE, width / WHISKER.length) * WHISKER.length / SCAN.speed
        ramp = (since > 0) & (since < width / SCAN.speed)
        kick = 0.10030 * SCAN.speed / WHISKER.length  # −c₁ v: no λ in it
        expected = kick * np.exp(-SCAN.damping * omega * since) * np.sin(ringing * since) / ringing
        found = (one.mode_amplitude - one.jump_response).values
        np.testing.assert_allclose(found[ramp], expected[ramp], atol=1e-4 * np.abs(expected[ramp]).max())
        np.testing.assert_allclose(data.attrs["ramp_kick"], kick / omega, rtol=1e-4)


def test_whole_responses_do_not_collapse_in_either_form(data):
    spread = data.collapse_spread
    assert np.all(spread.sel(signal=["q + Q", "ramps alone"]) > 0.2)
    assert np.all(spread.sel(signal=["moment, vibration", "displacement at s = 0.9"]) > 0.1)
    peak = data.peak_over_width.sel(signal="ramps alone").values
    assert np.all(np.diff(peak, axis=-1) < 0)  # over λ it falls: it does not grow with λ
    assert "in the linear form only (22 % exact, 0 % linear)" in data.attrs["caption"]


def test_displacement_near_the_base_starts_at_the_edge_and_is_that_of_the_modes(data):
    before = data.edge_time.values <= 0
    assert np.abs(data.node_displacement.values[..., before]).max() < 1e-12  # nothing moves before the edge is met
    width = data.gap.values[:, None] / WHISKER.length
    np.testing.assert_allclose(data.node_response.values, data.node_displacement.values / width)
    peak = np.abs(data.node_displacement).max("edge_time") * WHISKER.length / data.gap
    found = data.peak_over_width.sel(signal="displacement at s = 0.9")
    np.testing.assert_allclose(peak.transpose(*found.dims), found, rtol=1e-3)  # on another grid of times
    assert np.hypot(data.attrs["node_x"], data.attrs["node_y"]) < WHISKER.length


def test_spreads_are_those_of_the_peaks_drawn(data):
    peak = np.abs(data.mode_displacement.sel(mode=1)).max("time") * WHISKER.length / data.gap
    np.testing.assert_allclose(data.peak_over_width.sel(signal="q + Q"), peak, rtol=1e-12)
    expected = (peak.max("gap") - peak.min("gap")) / peak.mean("gap")
    np.testing.assert_allclose(data.collapse_spread.sel(signal="q + Q"), expected, rtol=1e-12)


def test_gain_hardly_depends_on_speed_for_the_telegraph_alone(data):
    for form in data.form.values:
        rms = data.gain_displacement.sel(form=form)
        ratio = rms.sel(speed=0.2) / rms.sel(speed=0.1)
        np.testing.assert_allclose(ratio.sel(reading="telegraph"), 1, atol=0.15)
        assert 0.35 < float(ratio.sel(reading="widths")) < 0.6


def test_linear_gain_lies_above_the_exact_one(data):
    for name in ("gain_displacement", "gain_vibration"):
        assert np.all(data[name].sel(form="linear") > data[name].sel(form="exact"))
        assert np.all(data[name + "_se"] > 0)


def test_drawing_labels_every_axis(data):
    figure = fig6_model.draw(data)
    figure.savefig(io.BytesIO())  # a warning would be an error
    letters = [title[0] for axis in figure.axes if (title := axis.get_title(loc="left"))[1:3] == "  "]
    assert sorted(letters) == list("ABFGH")
    assert all(axis.get_xlabel() for axis in figure.axes)
