"""The same scan again: edges are met when the stage is there, and runs without jitter differ by noise alone."""

import dataclasses

import numpy as np
import pytest
from refusals import refusal
from scipy.optimize import brentq

from vibrissa.figures.paper.parts.fig3_motion import run_correlations
from vibrissa.study.movie.virtual import predicted_motion
from vibrissa.study.spec.settings import read_study
from vibrissa.study.sweeps.jitter import Jitter, run_again
from vibrissa.study.sweeps.repeats import film_repeats

RNG = np.random.default_rng
NONE = Jitter(clock=0, ripple=0, contact=0)


@pytest.fixture(scope="module")
def prediction():
    return predicted_motion(read_study())


@pytest.fixture(scope="module")
def film():
    return dataclasses.replace(read_study().film, n_frames=300)


def test_edges_are_met_when_the_stage_has_travelled_that_far(prediction):
    jitter = Jitter(clock=0.5, ripple=0.01, ripple_frequency=20.0, contact=0)
    again = run_again(prediction, jitter, 2000.0, RNG(5))
    draws = RNG(5)
    start, phase = draws.uniform(-1, 1) * 0.5 / 2000, draws.uniform(0, 2 * np.pi)
    v, f = prediction.scan.speed, 20.0

    def time_at(edge):
        def ahead(t):
            ripple = 0.01 * v / (2 * np.pi * f) * np.sin(2 * np.pi * f * t + phase)
            return v * (t - start) + ripple - edge

        return brentq(ahead, edge / v - 0.01, edge / v + 0.01, xtol=1e-12)

    for edges, old in (
        (again.texture.position, prediction.texture.position),
        (again.texture.end, prediction.texture.end),
    ):
        met = np.array([time_at(edge) for edge in old[:200]])
        assert np.abs(edges[:200] / v - old[:200] / v).max() > 5e-5  # the ripple moves them …
        np.testing.assert_allclose(edges[:200] / v, met, atol=3e-6)  # … to where it should, to its second order


def test_without_jitter_it_is_the_same_scan(prediction):
    again = run_again(prediction, NONE, 2000.0, RNG(1))
    np.testing.assert_array_equal(again.texture.position, prediction.texture.position)
    np.testing.assert_allclose(again.texture.width, prediction.texture.width, rtol=1e-9)
    assert again.posture == prediction.posture


def test_runs_without_jitter_differ_by_the_noise_of_the_tracker_alone(prediction, film):
    repeats = film_repeats(prediction, film, rng=RNG(2), jitter=NONE, n_runs=4, n_repetitions=1)
    true = repeats.run_motion_true.values
    np.testing.assert_allclose(run_correlations(true)[0], 1, rtol=1e-9)
    noise = (repeats.run_motion.values - true).var()
    alike = true.var() / (true.var() + noise)
    with_mean, with_others = run_correlations(repeats.run_motion.values)
    np.testing.assert_allclose(1 - with_mean.mean(), 1 - np.sqrt((1 + 3 * alike) / 4), rtol=0.3)
    assert with_others.mean() < with_mean.mean()


def test_jitter_makes_runs_less_alike_and_a_seed_repeats_them(prediction, film):
    few = {"n_runs": 3, "n_repetitions": 1}
    first, same = (film_repeats(prediction, film, rng=RNG(3), **few) for _ in range(2))
    np.testing.assert_array_equal(first.run_motion, same.run_motion)
    assert (1 - run_correlations(first.run_motion_true.values)[0]).min() > 1e-5


@pytest.mark.parametrize(("name", "value"), [("clock", -1.0), ("contact", np.nan), ("ripple_frequency", 0.0)])
def test_jitter_out_of_range_is_refused(name, value):
    with refusal("range", f"Jitter.{name}", str(value)):
        Jitter(**{name: value})
