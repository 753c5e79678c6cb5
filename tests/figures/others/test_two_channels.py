"""Two channels: the moment tells the shape, the envelope the texture; shares and separation by hand."""

import io

import numpy as np
import pytest
import two_channels

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import Whisker


@pytest.fixture(scope="module")
def data():
    posture, whisker = Posture(contact=0.29, base_angle=1.2), Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)
    scan, rng = Scan(speed=0.1, damping=0.11), np.random.default_rng(1)
    return two_channels.compute(posture, whisker, scan, rng=rng, n_textures=4)


def test_each_channel_tells_its_own_cause(data):
    share = data.share_told
    for channel, cause in zip(two_channels.CHANNELS, two_channels.CAUSES, strict=True):
        own = share.sel(channel=channel, cause=cause)
        other = share.sel(channel=channel).drop_sel(cause=cause)
        assert np.all(own > 0.3)
        assert np.all(other < 0.2)
    assert np.all(data.separation > 0.4)
    assert data.attrs["separation_low"] < data.attrs["separation_mean"] < data.attrs["separation_high"]


def test_moment_is_that_of_the_shape_and_the_envelope_that_of_the_texture(data):
    slow = [np.corrcoef(a, b)[0, 1] for a, b in zip(data.slow_moment, data.slow_moment_alone, strict=True)]
    fast = [np.corrcoef(a, b)[0, 1] for a, b in zip(data.fast_envelope, data.fast_envelope_alone, strict=True)]
    assert min(slow) > 0.9
    assert min(fast) > 0.6
    assert abs(np.corrcoef(data.fast_envelope[0], data.fast_envelope[2])[0, 1]) < 0.3  # one shape, two textures


def synthetic(mix):
    """Channels that are their causes, mixed by a (2, 2) matrix: rows channels, columns causes."""
    rng = np.random.default_rng(2)
    shapes, textures = rng.normal(size=(2, 5000)), rng.normal(size=(6, 5000))
    causes = np.broadcast_to(shapes[:, None], (2, 6, 5000)), np.broadcast_to(textures, (2, 6, 5000))
    told = tuple(row[0] * causes[0] + row[1] * causes[1] for row in np.asarray(mix))
    return two_channels.shares(told, (shapes, textures))


@pytest.mark.parametrize(
    ("mix", "share", "separation"),
    [
        ([[2, 0], [0, -3]], [[1, 0], [0, 1]], 1),
        ([[0, 1], [1, 0]], [[0, 1], [1, 0]], -1),
        ([[1, 1], [1, 1]], [[0.5, 0.5], [0.5, 0.5]], 0),
        ([[2, 1], [0, 1]], [[0.8, 0.2], [0, 1]], 0.8),
    ],
)
def test_separation_worked_by_hand(mix, share, separation):
    found = synthetic(mix)
    assert found.shape == (6, 2, 2)
    np.testing.assert_allclose(found.mean(axis=0), share, atol=0.03)
    np.testing.assert_allclose(two_channels.separation(found), separation, atol=0.05)


def test_drawing_labels_every_axis(data):
    figure = two_channels.draw(data)
    figure.savefig(io.BytesIO())  # a warning would be an error
    assert len(figure.axes) == 5
    for axis in figure.axes:
        assert axis.get_ylabel()
        assert axis.get_title(loc="left")
