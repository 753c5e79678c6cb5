"""Surfaces made to measure: spectra over many draws, sums by hand."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.texture.generators import riding, self_affine, wave
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps, random_grating

SEEDS = 60


def drawn(seed, hurst=0.8, **more):
    asked = {"rms": 8e-6, "spacing": 5e-6, "longest": 2e-3, "shortest": 20e-6} | more
    return self_affine(0.02, rng=np.random.default_rng(seed), hurst=hurst, **asked)


@pytest.mark.parametrize("hurst", [0.3, 0.8])
def test_spectrum_falls_as_one_and_twice_the_hurst_exponent(hurst):
    window = np.hanning(4001)
    power = np.mean([np.abs(np.fft.rfft(window * drawn(s, hurst).height)) ** 2 for s in range(SEEDS)], axis=0)
    k = np.fft.rfftfreq(4001, 5e-6)
    inside = (k > 2 / 2e-3) & (k < 0.8 / 20e-6)
    slope = np.polyfit(np.log(k[inside]), np.log(power[inside]), 1)[0]
    assert slope == pytest.approx(-(1 + 2 * hurst), abs=0.05)
    assert power[k > 1.1 / 20e-6].max() < 1e-3 * power[inside].min()  # nothing shorter than the shortest
    low = power[(k > 0.1 / 2e-3) & (k < 0.8 / 2e-3)]
    assert low.mean() == pytest.approx(power[np.abs(k - 1 / 2e-3) < 60].mean(), rel=0.35)  # level above the longest


def test_rms_is_as_asked_over_draws_and_heights_are_gaussian():
    heights = np.array([drawn(s).height for s in range(SEEDS)])
    # some 10 independent waves of 2 mm in 20 mm: 60 draws give the variance to 1/√300
    assert np.sqrt(np.mean(heights**2)) == pytest.approx(8e-6, rel=0.1)
    assert abs(heights.mean()) < 1e-6
    assert np.mean(heights**4) / np.mean(heights**2) ** 2 == pytest.approx(3, abs=0.3)


def test_one_seed_makes_one_surface():
    one, same, other = drawn(1), drawn(1), drawn(2)
    assert one.height.tobytes() == same.height.tobytes()
    assert one.position.tobytes() == same.position.tobytes()
    assert one.height[0] != other.height[0]


def test_wave_worked_by_hand():
    surface = wave(0.01, amplitude=1e-4, period=0.01, phase=np.pi / 2, spacing=2.5e-3)
    np.testing.assert_allclose(surface.position, [0, 2.5e-3, 5e-3, 7.5e-3, 0.01], rtol=1e-12)
    np.testing.assert_allclose(surface.height, [0, -1e-4, -2e-4, -1e-4, 0], atol=1e-18)


def test_texture_on_a_shape_is_the_sum_of_heights_on_both_sides_of_every_wall():
    grating = random_grating(0.02, rng=np.random.default_rng(3))
    shape = wave(0.03, amplitude=0.3e-3, period=0.03, spacing=1e-4)
    both = riding(HeightProfile.from_gaps(grating), shape)
    x = np.concatenate([np.random.default_rng(4).uniform(-1e-3, 0.03, 5000), grating.position, grating.end])
    np.testing.assert_allclose(both.at(x), grating.height(x) + shape.at(x), atol=1e-18)
    walls = np.flatnonzero(np.diff(both.position) == 0)
    assert walls.size == 2 * grating.position.size
    np.testing.assert_allclose(np.abs(np.diff(both.height)[walls]), grating.depth, rtol=1e-9)


def test_shape_of_height_zero_changes_nothing():
    texture = HeightProfile.from_gaps(Gaps(position=np.array([1e-3]), width=np.array([5e-4])))
    level = HeightProfile(position=np.array([0.5e-3, 2e-3]), height=np.zeros(2))
    same = riding(texture, level)
    np.testing.assert_array_equal(same.position, texture.position)
    np.testing.assert_array_equal(same.height, texture.height)


WALL = HeightProfile(position=np.array([0, 1e-3, 1e-3, 2e-3]), height=np.array([0, 0, 1e-5, 1e-5]))


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: drawn(1, hurst=1.0), ("range", "hurst")),
        (lambda: drawn(1, hurst=np.nan), ("range", "hurst")),
        (lambda: drawn(1, rms=0.0), ("range", "rms")),
        (lambda: drawn(1, shortest=6e-6), ("range", "roughness")),
        (lambda: drawn(1, longest=1e-5), ("range", "roughness")),
        (lambda: drawn(1, longest=1.0), ("range", "roughness")),
        (lambda: self_affine(20.0, rng=np.random.default_rng(1), rms=1e-5), ("range", "length")),
        (lambda: wave(0.01, amplitude=1e-4, period=1e-6), ("range", "wave")),
        (lambda: wave(0.01, amplitude=np.nan, period=1e-2), ("range", "wave")),
        (lambda: wave(-1.0, amplitude=1e-4, period=1e-2), ("range", "length")),
        (lambda: riding(WALL, WALL), ("range", "shape")),
    ],
)
def test_impossible_surfaces_are_refused(call, rule):
    with refusal(*rule) as refused:
        call()
    assert len(str(refused.value).splitlines()) == 1
