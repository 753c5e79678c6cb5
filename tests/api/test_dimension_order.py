"""Datasets whose dimensions or nodes come in another order than the table's: the same data, the same results."""

import numpy as np
import pytest

import vibrissa as vb
from vibrissa.quantities import dataset

WHISKER, SPACE = vb.Whisker(length=0.04, cone_angle=1.5e-3), np.linspace(0.99, 0.32, 60)


@pytest.fixture(scope="module")
def motion():
    return vb.scan(WHISKER, vb.Posture(contact=0.29, base_angle=1.2), vb.random_grating(0.03, rng=1), speed=0.1)


@pytest.fixture(scope="module")
def tracks(motion):
    """As many frames as nodes, so that nothing but the names of the dimensions can show which is which."""
    time = np.arange(60) / 2000
    x, y = (WHISKER.length * one for one in motion.prediction.position(time, SPACE))
    return dataset({"frame": "substrate"}, time=time, arc_length=WHISKER.length * (1 - SPACE), x=x, y=y)


def test_posture_and_modes_of_transposed_tracks(tracks):
    turned = tracks.transpose("node", "time")
    assert turned.x.dims == ("node", "time")
    straight, other = (vb.fit_posture(one, WHISKER) for one in (tracks, turned))
    assert float(other.contact) == float(straight.contact) == pytest.approx(0.29, abs=0.01)
    straight, other = (vb.decompose(one, WHISKER, 0.29) for one in (tracks, turned))
    np.testing.assert_array_equal(other.mode_displacement, straight.mode_displacement)


def test_resonances_of_transposed_modes(motion):
    modal = motion.sample(rate=2000)
    straight, other = (
        vb.fit_resonances(one, motion, guess=[120, 340, 690]) for one in (modal, modal.transpose("time", "mode", ...))
    )
    np.testing.assert_array_equal(other.resonant_frequency, straight.resonant_frequency)


def test_pictures_of_transposed_tracks():
    movie = vb.sample_data("movie.mkv")
    profile = vb.track(movie, frame_rate=2000, pixel_size=95e-6, skin=[(50.5, 57)])
    turned = profile.transpose("node", "time", ...)
    straight, other = (vb.plot_tracks(one, movie, frames=[0]) for one in (profile, turned))
    drawn = [line.get_xydata() for axes in straight.axes for line in axes.lines]
    assert drawn
    again = [line.get_xydata() for axes in other.axes for line in axes.lines]
    np.testing.assert_array_equal(np.concatenate(again), np.concatenate(drawn))


def test_nodes_at_the_border_of_a_shadow_are_left_out_from_either_end(tracks):
    """Where the last nodes before the tip are seen by fits and starts, also those that the border draws go."""
    lost = np.random.default_rng(1).random((60, 3)) < 0.3
    fading = tracks.copy(deep=True)
    for name in ("x", "y"):
        fading[name].values[:, -3:][lost] = np.nan
    seen = [
        np.isfinite(vb.decompose(one, WHISKER, 0.29).displacement).any("time").sum().item()
        for one in (fading, fading.isel(node=slice(None, None, -1)))
    ]
    assert seen == [53, 53]
