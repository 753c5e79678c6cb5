"""What places a line in a column, against lines drawn here and against the Cramér–Rao bound."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from vibrissa.video.following import read
from vibrissa.video.search import Search

HEIGHT, WIDTH, NOISE, SEEDS = 80, 240, 3.0, 60
INNER = slice(10, WIDTH - 10)
NO_BACKGROUND = np.zeros((0, 0), np.float32)
FLAT = np.full((HEIGHT, WIDTH), 180, np.float32)
ROWS = 36.0 + np.linspace(0, 8, WIDTH)  # all phases of the pixel grid


def sigma_of(width: float) -> float:
    return width / np.sqrt(8 * np.log(2))


def line(width: float) -> np.ndarray:
    """A Gaussian line of unit peak and full width ``width`` at half maximum, integrated over the pixels."""
    sigma, off = sigma_of(width), np.arange(HEIGHT)[:, None] - ROWS
    return (ndtr((off + 0.5) / sigma) - ndtr((off - 0.5) / sigma)) * sigma * np.sqrt(2 * np.pi)


def bound(contrast: float, width: float) -> float:
    """Cramér–Rao bound of the row: noise over the root of the sum of squared derivatives, mean over phases [px]."""
    sigma, off = sigma_of(width), np.arange(HEIGHT)[:, None] - ROWS
    edge = [np.exp(-0.5 * ((off + d) / sigma) ** 2) for d in (-0.5, 0.5)]
    # whole grey levels add 1/12 to the variance
    return float(np.hypot(NOISE, 12**-0.5) / contrast / np.sqrt(np.mean(((edge[1] - edge[0]) ** 2).sum(axis=0))))


def errors(contrast: float, width: float, estimator: str, background: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Error and standard deviation told, (seed, column) [px]; the search begins up to half a pixel aside."""
    clean = FLAT - contrast * line(width)
    search = Search(estimator=estimator, threshold=2.5)
    off, told = np.empty((2, SEEDS, WIDTH))
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        image = np.rint(clean + NOISE * rng.standard_normal(clean.shape)).astype(np.uint8)
        row, told[seed], _ = read(image, background, search, ROWS + rng.uniform(-0.5, 0.5), 4)
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
