"""What places a line in a column, against lines drawn here and against the Cramér–Rao bound."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refusal
from scipy.special import ndtr

from vibrissa.video.follow.reading import Reader
from vibrissa.video.follow.search import Search
from vibrissa.video.kernel.estimator_table import ESTIMATORS, code_of

HEIGHT, WIDTH, NOISE, SEEDS = 80, 240, 3.0, 60
INNER = slice(10, WIDTH - 10)
NO_BACKGROUND = np.zeros((0, 0), np.float32)
FLAT = np.full((HEIGHT, WIDTH), 180, np.float32)
ROWS = 36.0 + np.linspace(0, 8, WIDTH)  # all phases of the pixel grid


def sigma_of(width: float) -> float:
    return width / np.sqrt(8 * np.log(2))


def line(width: float, apart: float = 0.0) -> np.ndarray:
    """A Gaussian line of unit peak and full width ``width`` at half maximum, integrated over the pixels."""
    sigma, off = sigma_of(width), np.arange(HEIGHT)[:, None] - ROWS - apart
    return (ndtr((off + 0.5) / sigma) - ndtr((off - 0.5) / sigma)) * sigma * np.sqrt(2 * np.pi)


def bound(contrast: float, width: float) -> float:
    """Cramér–Rao bound of the row: noise over the root of the sum of squared derivatives, mean over phases [px]."""
    sigma, off = sigma_of(width), np.arange(HEIGHT)[:, None] - ROWS
    edge = [np.exp(-0.5 * ((off + d) / sigma) ** 2) for d in (-0.5, 0.5)]
    # whole grey levels add 1/12 to the variance
    return float(np.hypot(NOISE, 12**-0.5) / contrast / np.sqrt(np.mean(((edge[1] - edge[0]) ** 2).sum(axis=0))))


def errors(
    contrast: float, width: float, estimator: str, background: np.ndarray, neighbour: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Error and reported standard deviation, (seed, column) [px]; the search begins up to half a pixel aside.

    A neighbour of 0.7 of the contrast runs that many rows below the line.
    """
    clean = FLAT - contrast * line(width)
    if neighbour:
        clean -= 0.7 * contrast * line(width, neighbour)
    search = Search(estimator=estimator, threshold=2.5)
    off, told = np.empty((2, SEEDS, WIDTH))
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        image = np.rint(clean + NOISE * rng.standard_normal(clean.shape)).astype(np.uint8)
        row, told[seed], _ = Reader(image, background, search).read(ROWS + rng.uniform(-0.5, 0.5), 4)
        off[seed] = row - ROWS
    return off[:, INNER], told[:, INNER]


@pytest.mark.parametrize("background", [NO_BACKGROUND, FLAT], ids=["space", "image"])
@pytest.mark.parametrize("width", [1.5, 1.77, 2.3])
@pytest.mark.parametrize("contrast", [45.0, 75.0, 110.0])
def test_matched_profile_is_near_the_bound(contrast, width, background):
    off, told = errors(contrast, width, "matched", background)
    assert not np.isnan(off).any()
    assert np.median(off.std(axis=0)) < 1.3 * bound(contrast, width)
    assert abs(off.mean()) < 0.01
    assert np.quantile(np.abs(off), 0.95) < 0.15
    assert np.median(np.sqrt(np.mean(off**2, axis=0)) / told.mean(axis=0)) == pytest.approx(1, abs=0.12)


@pytest.mark.parametrize("background", [NO_BACKGROUND, FLAT], ids=["space", "image"])
@pytest.mark.parametrize("contrast", [15.0, 25.0])
def test_faint_lines_are_near_the_bound_too(contrast, background):
    for width in (1.5, 2.3):
        off, _ = errors(contrast, width, "matched", background)
        assert np.isnan(off).mean() < 0.02
        # scatter of the bulk: at a contrast of five times the noise a few columns are read on a bump of the noise
        low, high = np.nanquantile(off, [0.1587, 0.8413], axis=0)
        assert np.median((high - low) / 2) < 1.3 * bound(contrast, width)


@pytest.mark.parametrize("contrast", [45.0, 75.0, 110.0])
def test_barycentre_scatters_as_five_equal_weights_do(contrast):
    for width in (1.5, 2.3):
        off, told = errors(contrast, width, "barycentre", NO_BACKGROUND)
        total = contrast * sigma_of(width) * np.sqrt(2 * np.pi)
        assert np.median(off.std(axis=0)) == pytest.approx(np.hypot(NOISE, 12**-0.5) * np.sqrt(10) / total, rel=0.15)
        assert abs(off.mean()) < 0.01
        assert np.median(off.std(axis=0) / told.mean(axis=0)) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_every_estimator_is_unbiased_and_reports_its_scatter(estimator):
    for width in (1.5, 1.77, 2.3):
        off, told = errors(75.0, width, estimator, NO_BACKGROUND)
        assert not np.isnan(off).any()
        assert abs(off.mean()) < 0.003
        scatter = np.median(off.std(axis=0))
        # a little below the bound where an estimator is drawn to the pixels' middles
        assert 0.95 < scatter / bound(75.0, width) < 2.0
        assert np.median(off.std(axis=0) / told.mean(axis=0)) == pytest.approx(1, abs=0.1)


def test_every_estimator_has_a_branch_of_the_kernel_and_is_described():
    rows = {name: tuple(errors(75.0, 1.77, name, NO_BACKGROUND)[0][0]) for name in ESTIMATORS}
    assert len(set(rows.values())) == len(ESTIMATORS)  # no name is read by another's branch
    assert [code_of(name) for name in ESTIMATORS] == list(range(len(ESTIMATORS)))
    page = Path(__file__).parents[3].joinpath("docs/movies.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in page for name in ESTIMATORS)


def test_an_unknown_estimator_is_refused_by_the_names_in_the_table():
    with refusal("unknown", "estimator") as error:
        Search(estimator="median")
    assert error.value.quantity == "estimator"
    assert all(name in error.value.rule for name in ESTIMATORS)


@pytest.mark.parametrize("width", [1.5, 1.77])
def test_three_point_peak_is_near_the_bound_on_narrow_lines(width):
    """By propagation of the noise: 1.05 to 1.17 times the bound, less what the pixels' middles draw."""
    off, _ = errors(110.0, width, "three-point", NO_BACKGROUND)
    assert np.median(off.std(axis=0)) < 1.1 * bound(110.0, width)


def test_three_point_peak_is_not_drawn_to_a_neighbour_at_four_pixels():
    off = {name: errors(75.0, 1.77, name, FLAT, neighbour=4.0)[0] for name in ESTIMATORS}
    assert abs(off["three-point"].mean()) < 0.003
    assert off["matched"].mean() > 0.03
    assert off["barycentre"].mean() > 0.04
    rms = {name: np.sqrt(np.mean(one**2)) for name, one in off.items()}
    assert rms["three-point"] < 0.8 * rms["matched"] < rms["barycentre"]
