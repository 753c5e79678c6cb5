"""Jitter of the tip lowers the correlation of envelopes, but that of repeated motion first and further."""

import numpy as np
import pytest

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.study.sweeps.phase_jitter import jittered, reached
from vibrissa.texture.surface import Gaps, random_grating
from vibrissa.whisker import Whisker


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(5)
    whisker, scan = Whisker(length=0.04, cone_angle=1.5e-3), Scan(speed=0.1, damping=0.11)
    postures = Posture(contact=0.2, base_angle=1.0), Posture(contact=0.29, base_angle=1.2)
    each = [predict(whisker, posture, random_grating(0.17, rng=rng), scan) for posture in postures]
    time = 0.1 + np.arange(1500) / 1000
    return jittered(each, time, rng=rng, jitters=(0.0, 50e-6, 200e-6, 800e-6), jitter_times=(0.1, 0.5))


def test_steady_tip_repeats_the_prediction(data):
    np.testing.assert_allclose(data.jittered_correlation[:, 0], 1, atol=1e-9)
    np.testing.assert_allclose(data.jittered_repeat[:, 0], 1, atol=1e-9)


def test_correlation_falls_with_jitter(data):
    falls = np.diff(data.jittered_correlation.values[1])
    assert np.all(falls < 0)


def test_jitter_that_lets_runs_repeat_at_the_papers_096_leaves_the_prediction_above_its_025(data):
    repeats = data.jittered_repeat.values >= 0.94
    assert repeats[:, 1].all()
    assert data.jittered_correlation.values[repeats].min() > 0.9


def test_jitter_beyond_the_order_of_the_edges_is_not_measured():
    rng = np.random.default_rng(6)
    texture, scan = random_grating(0.17, rng=rng), Scan(speed=0.1, damping=0.11)
    one = predict(Whisker(length=0.04, cone_angle=1.5e-3), Posture(contact=0.2, base_angle=1.0), texture, scan)
    told = jittered([one], np.arange(1000) / 1000, rng=rng, jitters=(0.0, 5e-3), jitter_times=(0.1,))
    assert np.isnan(told.jittered_correlation[0, 1])


def test_value_is_reached_between_the_jitters_around_it_or_nowhere():
    curves = dataset(
        jitter_time=[0.1, 0.5], jitter=[0.0, 1.0, 2.0], jittered_correlation=[[1.0, 0.5, 0.0], [1.0, 0.9, 0.8]]
    )
    np.testing.assert_allclose(reached(curves, 0.25), [1.5, np.nan])


def test_gaps_that_jitter_makes_too_wide_for_the_posture_are_not_measured():
    """A grating whose widest gap the posture can just cross: what wanders meets a wider one."""
    rng = np.random.default_rng(6)
    whisker, scan = Whisker(length=0.04, cone_angle=1.5e-3), Scan(speed=0.1, damping=0.11)
    posture, texture = Posture(contact=0.12, base_angle=1.4), random_grating(0.17, rng=rng)
    least, most = 0.2, 20.0  # bisect for the factor on the widths at which it cannot be crossed any more
    for _ in range(12):
        middle = (least * most) ** 0.5
        try:
            widest = np.array([middle * texture.width.max()])
            predict(whisker, posture, Gaps(position=np.array([1e-3]), width=widest), scan, n_modes=1)
            least = middle
        except (InputError, ConvergenceError):
            most = middle
    scale = 0.97 * least
    just = Gaps(position=scale * texture.position, width=scale * texture.width)
    one = predict(whisker, posture, just, scan)
    told = jittered([one], np.arange(1000) / 1000, rng=rng, jitters=(0.0, 400e-6), jitter_times=(0.1,))
    assert float(told.jittered_correlation[0, 0]) == pytest.approx(1)
    assert np.isnan(told.jittered_correlation[0, 1])
