"""Gaps and gratings: their statistics, their symmetries, and the textures that are refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refusal
from scipy.stats import expon, kstest, truncnorm

from vibrissa.errors import InputError
from vibrissa.texture.surface import DEPTH, WIDTH_SD, Gaps, periodic_grating, random_grating

READINGS = ["telegraph", "widths"]
LAWS = {  # of the width of one feature
    "telegraph": expon(35e-6, 0.265e-3),
    "widths": truncnorm((35e-6 - 0.3e-3) / WIDTH_SD, np.inf, 0.3e-3, WIDTH_SD),
}


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
def test_mean_period_over_many_gratings_is_that_of_its_law(reading):
    periods, seeds = 100, 400
    gratings = [random_grating(0.12, rng=np.random.default_rng(seed), reading=reading) for seed in range(seeds)]
    # the first 100 of some 200 periods, whose number no end of the grating has chosen
    mean = np.mean([grating.position[periods] - grating.position[0] for grating in gratings]) / periods
    law = LAWS[reading]
    standard_error = np.sqrt(2 * law.var() / (periods * seeds))
    assert abs(mean - 2 * law.mean()) < 3 * standard_error
    assert 2 * law.mean() == pytest.approx({"telegraph": 0.6e-3, "widths": 0.6024e-3}[reading], abs=5e-8)  # as told


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
        assert kstest(widths, LAWS["telegraph"].cdf).pvalue > 1e-3
    assert abs(np.corrcoef(gaps[1:], lands)[0, 1]) < 4 / np.sqrt(lands.size)


@pytest.mark.parametrize("seed", [3, 4])
def test_widths_are_gaussian_above_the_smallest(seed):
    texture = random_grating(3.0, rng=np.random.default_rng(seed), reading="widths")
    for widths in features(texture):
        assert kstest(widths, LAWS["widths"].cdf).pvalue > 1e-3


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


@given(
    st.sampled_from(READINGS), st.integers(0, 2**32), st.floats(0.05, 1), st.floats(1e-4, 5e-3), st.floats(0.01, 0.99)
)
def test_any_random_grating_has_features_of_the_smallest_width_or_more(reading, seed, length, period, share):
    smallest = share * period / 2
    rng = np.random.default_rng(seed)
    texture = random_grating(length, rng=rng, reading=reading, mean_period=period, smallest=smallest)
    rounding = 4 * np.spacing(length)  # edges are sums
    for widths in (*features(texture), texture.position[:1]):
        assert np.all(widths >= smallest - rounding)
    assert texture.end[-1] < length
    assert texture.depth == DEPTH == 35e-6


# periodic gratings


def test_periodic_grating_worked_by_hand():
    texture = periodic_grating(3.5, period=1.0, width=0.25)
    np.testing.assert_array_equal(texture.position, [0.75, 1.75, 2.75])
    np.testing.assert_array_equal(texture.width, [0.25] * 3)
    assert texture.depth == DEPTH


@given(st.integers(1, 500), st.floats(1e-5, 1e-2), st.floats(0.01, 0.99))
def test_length_of_n_periods_has_n_gaps(n, period, share):
    texture = periodic_grating(n * period, period=period, width=share * period, depth=1e-5)
    assert texture.position.size == n
    assert texture.end[-1] == pytest.approx(n * period)
    assert texture.depth == 1e-5
    np.testing.assert_allclose(np.diff(texture.position), period, rtol=1e-9)


def test_gaps_are_half_the_period_unless_told():
    one, same = periodic_grating(0.01, period=6e-4), periodic_grating(0.01, period=6e-4, width=3e-4)
    np.testing.assert_array_equal(one.position, same.position)
    np.testing.assert_array_equal(one.width, same.width)


# scanned the other way, and drawn


def troughs(position, width, depth=35e-6):
    return Gaps(position=np.array(position, float), width=np.array(width, float), depth=depth)


TEXTURES = st.builds(  # lands and widths of whole 2^-20 m, so that sums are exact
    lambda first, lands, widths: troughs(
        (first + np.cumsum(np.add(lands, [0, *widths[:-1]]))) / 2**20, np.array(widths) / 2**20
    ),
    st.integers(0, 1000),
    st.lists(st.integers(1, 1000), min_size=7, max_size=7),
    st.lists(st.integers(1, 1000), min_size=7, max_size=7),
)


def test_scan_the_other_way_worked_by_hand():
    texture = troughs([1.0, 4.0], [0.5, 2.0], depth=0.1).reversed(8.0)
    np.testing.assert_array_equal(texture.position, [2.0, 6.5])
    np.testing.assert_array_equal(texture.width, [2.0, 0.5])
    assert texture.depth == 0.1


@given(TEXTURES, st.integers(0, 1000))
def test_the_other_way_twice_is_the_texture_itself(texture, beyond):
    length = texture.end[-1] + beyond / 2**20
    again = texture.reversed(length).reversed(length)
    np.testing.assert_array_equal(again.position, texture.position)
    np.testing.assert_array_equal(again.width, texture.width)


@given(st.integers(0, 2**32))
def test_the_other_way_twice_is_the_texture_itself_up_to_rounding(seed):
    texture = random_grating(0.05, rng=np.random.default_rng(seed))
    texture = troughs(texture.position - texture.position[0], texture.width)  # a gap at x = 0 is the hardest
    length = texture.end[-1]
    again = texture.reversed(length).reversed(length)
    np.testing.assert_allclose(again.position, texture.position, rtol=0, atol=4 * np.spacing(length))


@given(TEXTURES, st.integers(-10, 15000))
def test_the_other_way_mirrors_the_height(texture, place):
    x = (place + 0.5) / 2**20  # between edges: at an edge the half-open gap changes sides
    length = texture.end[-1]
    assert texture.reversed(length).height(x) == texture.height(length - x)


def test_height_is_down_from_the_first_edge_up_to_the_other():
    texture = troughs([1.0, 4.0], [0.5, 2.0], depth=0.1)
    x = [-np.inf, -1, np.nextafter(1, 0), 1, 1.25, np.nextafter(1.5, 0), 1.5, 3, 4, 5.9, 6, np.inf]
    np.testing.assert_array_equal(texture.height(x), np.array([0, 0, 0, -1, -1, -1, 0, 0, -1, -1, 0, 0]) * 0.1)
    assert texture.height(4.5).shape == ()
    assert texture.height(np.zeros((2, 3))).shape == (2, 3)
    assert np.isnan(texture.height(np.nan))


@given(TEXTURES)
def test_gaps_take_their_share_of_the_height(texture):
    x = (np.arange(0, round(texture.end[-1] * 2**20)) + 0.5) / 2**20
    assert texture.height(x).sum() == pytest.approx(-texture.depth * texture.width.sum() * 2**20)


# what is refused


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: troughs([], []), ("too-few", "texture")),
        (lambda: troughs([0.0, 1e-3], [5e-4]), ("shape", "texture")),
        (lambda: troughs([[0.0]], [[5e-4]]), ("shape", "texture")),
        (lambda: troughs([0.0, 1e-3], [1.1e-3, 1e-3]), ("range", "texture")),
        (lambda: troughs([0.0, 1e-3], [1e-3, 1e-3]), ("range", "texture")),
        (lambda: troughs([1e-3, 0.0], [1e-4, 1e-4]), ("range", "texture")),
        (lambda: troughs([np.nan], [1e-3]), ("range", "texture")),
        (lambda: troughs([0.0], [np.nan]), ("range", "texture")),
        (lambda: troughs([0.0], [np.inf]), ("range", "texture")),
        (lambda: troughs([0.0], [-1e-3]), ("range", "texture")),
        (lambda: troughs([0.0], [0.0]), ("range", "texture")),
        (lambda: troughs([0.0], [1e-3], depth=0.0), ("range", "texture")),
        (lambda: troughs([0.0], [1e-3], depth=np.nan), ("range", "texture")),
        (lambda: random_grating(1.0, rng=np.random.default_rng(0), reading="morse"), ("unknown", "reading")),
        (lambda: random_grating(5e-4, rng=np.random.default_rng(0)), ("range", "length of the grating")),
        (lambda: random_grating(np.nan, rng=np.random.default_rng(0)), ("range", "length of the grating")),
        (lambda: random_grating(1.0, rng=np.random.default_rng(0), smallest=0.4e-3), ("range", "grating")),
        (lambda: random_grating(1.0, rng=np.random.default_rng(0), smallest=-1e-6), ("range", "grating")),
        (lambda: random_grating(1.0, rng=np.random.default_rng(0), mean_period=np.nan), ("range", "grating")),
        (lambda: random_grating(np.inf, rng=np.random.default_rng(0)), ("range", "length of the grating")),
        (lambda: random_grating(350.0, rng=np.random.default_rng(0)), ("range", "length of the grating")),
        (
            lambda: random_grating(1.0, rng=np.random.default_rng(0), mean_period=1e-6, smallest=1e-7),
            ("range", "length of the grating"),
        ),
        (lambda: periodic_grating(1e-3, period=2e-3), ("range", "length of the grating")),
        (lambda: periodic_grating(-1.0, period=2e-3), ("range", "length of the grating")),
        (lambda: periodic_grating(np.nan, period=2e-3), ("range", "length of the grating")),
        (lambda: periodic_grating(1.0, period=1e-300), ("range", "length of the grating")),
        (lambda: periodic_grating(1.0, period=0.0), ("range", "grating")),
        (lambda: periodic_grating(1.0, period=np.nan), ("range", "grating")),
        (lambda: periodic_grating(1.0, period=np.inf), ("range", "grating")),
        (lambda: periodic_grating(1.0, period=1e-3, width=1e-3), ("range", "grating")),
        (lambda: periodic_grating(1.0, period=1e-3, width=-1e-4), ("range", "grating")),
        (lambda: periodic_grating(1.0, period=1e-3, width=np.nextafter(1e-3, 0)), ("range", "texture")),
        (lambda: periodic_grating(1.0, period=1e-3, depth=0.0), ("range", "texture")),
        (lambda: troughs([1e-3], [1e-3]).reversed(1.9e-3), ("range", "length")),
        (lambda: troughs([1e-3], [1e-3]).reversed(np.nan), ("range", "length")),
        (lambda: troughs([1e-3], [1e-3]).reversed(np.inf), ("range", "texture")),
    ],
)
def test_impossible_textures_are_refused(call, rule):
    with refusal(*rule):
        call()


def test_overlapping_gaps_are_named_by_number_and_place():
    with refusal("range", "texture"):
        troughs([0.0, 1e-3, 2e-3], [5e-4, 1.5e-3, 5e-4])
