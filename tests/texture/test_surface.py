"""Random gratings: their statistics, and the textures that are refused."""

import numpy as np
import pytest
from scipy.stats import expon, kstest, truncnorm

from vibrissa.errors import InputError
from vibrissa.texture.surface import WIDTH_SD, Troughs, random_grating

READINGS = ["telegraph", "widths"]


def features(texture):
    """Widths of gaps, and of the lands between them."""
    return texture.width, texture.position[1:] - (texture.position + texture.width)[:-1]


@pytest.mark.parametrize("reading", READINGS)
def test_mean_period_is_as_asked(reading):
    texture = random_grating(9.0, rng=np.random.default_rng(1), reading=reading)
    # 15 000 periods: standard error 0.5 % for exponential widths; cutting Gaussians off at 35 µm adds 0.4 %
    assert np.diff(texture.position).mean() == pytest.approx(0.6e-3, rel=0.015)
    assert texture.position.size == pytest.approx(15000, rel=0.015)


@pytest.mark.parametrize("reading", READINGS)
def test_no_feature_is_narrower_than_the_smallest(reading):
    texture = random_grating(3.0, rng=np.random.default_rng(2), reading=reading)
    for widths in features(texture):
        assert widths.min() >= 35e-6 * (1 - 1e-9)  # edges are sums


@pytest.mark.parametrize("seed", [3, 4])
def test_edges_of_the_telegraph_have_no_memory(seed):
    texture = random_grating(3.0, rng=np.random.default_rng(seed))
    gaps, lands = features(texture)
    for widths in (gaps, lands):
        assert kstest(widths, expon(35e-6, 0.265e-3).cdf).pvalue > 1e-3
    assert abs(np.corrcoef(gaps[1:], lands)[0, 1]) < 4 / np.sqrt(lands.size)


@pytest.mark.parametrize("seed", [3, 4])
def test_widths_are_gaussian_above_the_smallest(seed):
    texture = random_grating(3.0, rng=np.random.default_rng(seed), reading="widths")
    gaussian = truncnorm((35e-6 - 0.3e-3) / WIDTH_SD, np.inf, 0.3e-3, WIDTH_SD)
    for widths in features(texture):
        assert kstest(widths, gaussian.cdf).pvalue > 1e-3


@pytest.mark.parametrize("reading", READINGS)
def test_one_seed_makes_one_grating(reading):
    one, same, other = (random_grating(0.05, rng=np.random.default_rng(s), reading=reading) for s in (7, 7, 8))
    np.testing.assert_array_equal(one.position, same.position)
    np.testing.assert_array_equal(one.width, same.width)
    assert one.position[0] != other.position[0]


@pytest.mark.parametrize("reading", READINGS)
@pytest.mark.parametrize("length", [0.7e-3, 0.02, 0.5])
def test_grating_starts_with_a_land_and_fills_its_length(reading, length):
    rng = np.random.default_rng(11)
    for _ in range(20):
        try:
            texture = random_grating(length, rng=rng, reading=reading)
        except InputError:  # so short that no gap may end inside
            assert length < 1e-3
            continue
        assert texture.position[0] > 0
        end = texture.position[-1] + texture.width[-1]
        assert end < length
        assert length < 1e-3 or length - end < 6e-3  # the next land and gap did not fit: 20 mean features


def test_twice_the_period_with_the_same_draws():
    one, two = (
        random_grating(0.1 * k, rng=np.random.default_rng(5), mean_period=0.6e-3 * k, smallest=35e-6 * k)
        for k in (1, 2)
    )
    shared = min(one.position.size, two.position.size)
    np.testing.assert_allclose(two.position[:shared], 2 * one.position[:shared], rtol=1e-12)


def troughs(position, width, depth=35e-6):
    return Troughs(position=np.array(position, float), width=np.array(width, float), depth=depth)


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: troughs([], []), "at least one gap"),
        (lambda: troughs([0.0, 1e-3], [5e-4]), "one width for each"),
        (lambda: troughs([[0.0]], [[5e-4]]), "one width for each"),
        (lambda: troughs([0.0, 1e-3], [1.1e-3, 1e-3]), "do not overlap"),
        (lambda: troughs([0.0, 1e-3], [1e-3, 1e-3]), "do not overlap"),
        (lambda: troughs([1e-3, 0.0], [1e-4, 1e-4]), "ascending"),
        (lambda: troughs([np.nan], [1e-3]), "finite positions"),
        (lambda: troughs([0.0], [np.nan]), "positive widths"),
        (lambda: troughs([0.0], [np.inf]), "positive widths"),
        (lambda: troughs([0.0], [-1e-3]), "positive widths"),
        (lambda: troughs([0.0], [0.0]), "positive widths"),
        (lambda: troughs([0.0], [1e-3], depth=0.0), "positive depth"),
        (lambda: troughs([0.0], [1e-3], depth=np.nan), "positive depth"),
        (lambda: random_grating(1.0, rng=np.random.default_rng(0), reading="morse"), "reading must be"),
        (lambda: random_grating(5e-4, rng=np.random.default_rng(0)), "length > mean_period"),
        (lambda: random_grating(np.nan, rng=np.random.default_rng(0)), "length > mean_period"),
        (lambda: random_grating(1.0, rng=np.random.default_rng(0), smallest=0.4e-3), "smallest feature"),
        (lambda: random_grating(1.0, rng=np.random.default_rng(0), smallest=-1e-6), "smallest feature"),
        (lambda: random_grating(1.0, rng=np.random.default_rng(0), mean_period=np.nan), "smallest feature"),
    ],
)
def test_impossible_textures_are_refused(call, rule):
    with pytest.raises(InputError, match=rule):
        call()


def test_overlapping_gaps_are_named_by_number_and_place():
    with pytest.raises(InputError, match=r"gap 3 at 0\.002 m"):
        troughs([0.0, 1e-3, 2e-3], [5e-4, 1.5e-3, 5e-4])
