"""A few seeds of ``benchmarks/tracking_truth.py``: its yardsticks hold, and the claims of docs/validation-movies.md."""

import dataclasses
import importlib
from pathlib import Path

import numpy as np
import pytest

SEEDS = 3


@pytest.fixture(scope="module")
def bench():
    """Give the benchmark as a module."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
        yield importlib.import_module("tracking_truth")


def cell(bench, name, **changed):
    (found,) = (one for one in bench.cells() if one.file == name)
    return dataclasses.replace(found, **changed)


def scores(bench, name, estimator):
    """Means over a few seeds."""
    scenes = [bench.film(cell(bench, name), seed) for seed in range(SEEDS)]
    found = [bench.score(scene, *bench.found_by(scene, estimator)) for scene in scenes]
    return {key: np.mean([one[key] for one in found]) for key in found[0]}


def test_truth_is_where_a_movie_without_noise_is_darkest(bench):
    scene = bench.film(cell(bench, "speed_3", noise=0.0), 0)
    pixel = np.rint(scene.truth[0]).astype(int)[..., None] + np.arange(-8, 9)
    frame, column = np.arange(len(scene.frames))[:, None, None], bench.COLUMNS[:, None]
    dark = 184.0 - scene.frames[frame, pixel, column]
    centre = (dark * pixel).sum(axis=-1) / dark.sum(axis=-1)
    error = (centre - scene.truth[0])[:, bench.INNER]
    # whole grey levels on 17 pixels scatter the barycentre by 0.29 √408 / 144 = 0.04 px
    assert abs(error.mean()) < 0.002
    assert error.std() < 0.05


def test_the_bound_is_its_closed_form_for_a_level_line_at_rest(bench):
    still = cell(bench, "contrast_45", speed=0.0)
    rows = np.broadcast_to(np.linspace(200, 201, bench.COLUMNS.size), (1, bench.FRAMES, 8, bench.COLUMNS.size))
    scene = bench.Scene(np.empty(0), rows, np.full(bench.COLUMNS.size, 45.0), still)
    width = still.blur / np.sqrt(8 * np.log(2))
    expected = np.sqrt(9 + 1 / 12) / 45 * np.sqrt(2 * width / np.sqrt(np.pi))
    found = bench.bound(scene, 0)
    np.testing.assert_allclose(found, expected, rtol=0.04)  # a line on a pixel's edge is a little better placed
    assert np.mean(found**-2.0) ** -0.5 == pytest.approx(expected, rel=0.001)  # over all phases


def test_an_unknown_level_costs_nothing_and_an_unknown_tilt_little(bench):
    movies = importlib.import_module("tracking_movies")
    u, width = np.arange(-7, 8) - 0.3, 1.8 / np.sqrt(8 * np.log(2))
    bell = np.exp(-(u**2) / (2 * width**2))
    level, tilt = np.ones(u.size), u + 0.3
    known = movies.unexplained(u * bell, [bell])
    design = np.stack([bell, level, tilt], axis=1)
    _, rest, _, _ = np.linalg.lstsq(design, u * bell, rcond=None)
    assert movies.unexplained(u * bell, [bell, level, tilt]) == pytest.approx(float(rest[0]))
    assert np.sqrt(known / movies.unexplained(u * bell, [bell, level])) == pytest.approx(1, abs=0.002)
    assert np.sqrt(known / float(rest[0])) < 1.05


def test_a_score_counts_what_is_lost_what_hops_and_what_is_off(bench):
    scene = bench.film(cell(bench, "contrast_75"), 0)
    found = scene.truth + 0.02
    inner = found[..., bench.INNER]  # a view
    inner[:, :, : inner.shape[2] // 5] = np.nan
    inner[:, :, -(inner.shape[2] // 5) :] += 5
    score = bench.score(scene, found, np.full(found.shape, 0.005))
    assert score["lost"] == pytest.approx(0.2, abs=0.003)
    assert score["hopped"] == pytest.approx(0.25, abs=0.003)
    assert score["bias"] == pytest.approx(0.02)
    assert score["p95"] == pytest.approx(0.02)
    assert score["sd"] == pytest.approx(0, abs=1e-9)
    assert score["inside"] == 0


@pytest.mark.parametrize("name", ["contrast_110", "contrast_45", "contrast_24", "speed_3", "whiskers_5_apart"])
def test_the_default_is_within_a_third_of_the_bound(bench, name):
    score = scores(bench, name, "matched")
    assert score["ratio"] < 1.3
    assert score["lost"] < 0.005
    assert score["hopped"] == 0
    assert abs(score["bias"]) < 0.01
    assert score["inside"] == pytest.approx(0.95, abs=0.02)


def test_the_barycentre_on_a_shaft_whose_contrast_falls_to_45(bench):
    score = scores(bench, "contrast_110_to_45", "barycentre")
    assert score["sd"] < 0.07
    assert abs(score["bias"]) < 0.01
    assert score["p95"] < 0.15
    assert score["lost"] == 0
