"""Curvature in air: tables, the Euler spiral fitted to a shape, the regression over the pad."""

import numpy as np
import pytest
from refusals import refusal
from scipy.special import fresnel

import vibrissa as vb
from vibrissa.whisker import IntrinsicCurvature, atlas, atlas_curvature, curvature_of_shape, read_curvature

ALONG = np.linspace(0, 0.03, 31)


def spiral(first, rate, direction=0.3):
    """Points of a curve of curvature first + rate·s, by Fresnel's integrals."""
    a = np.sqrt(abs(rate) / np.pi)
    low, high = first / rate, ALONG + first / rate
    turn = direction - first**2 / (2 * rate)
    sine, cosine = (np.subtract(*part) / a for part in zip(fresnel(a * high), fresnel(a * low), strict=True))
    sine = sine * np.sign(rate)
    return cosine * np.cos(turn) - sine * np.sin(turn), cosine * np.sin(turn) + sine * np.cos(turn)


@pytest.mark.parametrize(("first", "rate"), [(20.0, -300.0), (-5.0, 900.0), (12.0, 40.0)])
def test_the_fit_returns_the_curvature_of_an_euler_spiral(first, rate):
    found = curvature_of_shape(*spiral(first, rate))
    assert found.distance[1] == pytest.approx(0.03, rel=1e-4)
    np.testing.assert_allclose(found.curvature, [first, first + 0.03 * rate], atol=0.02)


def test_a_shape_and_its_mirror_image_have_one_sign():
    x, y = spiral(20.0, -300.0)
    np.testing.assert_allclose(curvature_of_shape(-x, y).curvature, curvature_of_shape(x, y).curvature, rtol=1e-6)
    np.testing.assert_allclose(curvature_of_shape(x, -y).curvature, np.negative(curvature_of_shape(x, y).curvature))


def test_a_shape_that_lifts_its_end_is_positive():
    x = np.linspace(0, 0.02, 20)
    assert min(curvature_of_shape(-x, 8 * x**2).curvature) > 0


def test_noise_of_a_tracker_leaves_the_mean_curvature():
    rng, x, y = np.random.default_rng(0), *spiral(20.0, -300.0)
    noisy = [
        curvature_of_shape(x + rng.normal(0, 15e-6, 31), y + rng.normal(0, 15e-6, 31)).at(0.015) for _ in range(20)
    ]
    assert np.mean(noisy) == pytest.approx(15.5, abs=4 * np.std(noisy) / np.sqrt(20))
    assert np.std(noisy) < 0.5


@pytest.mark.parametrize("name", ["beta", "C2", "E6"])
def test_the_curvature_of_the_atlas_is_that_of_its_parabola(name):
    column = next(one.column for one in atlas() if one.name == name)
    A = 0.24 * (13.4 * (column + 1) - 48.6) + 14.8  # as in the program of Zweifel2021
    whisker = vb.Whisker(length=0.02, cone_angle=2e-3)
    curvature = atlas_curvature(name, whisker)
    s = np.linspace(0, 0.02, 2001)
    turn = np.concatenate([[0], np.cumsum((curvature.at(s)[1:] + curvature.at(s)[:-1]) / 2 * np.diff(s))])
    x = np.concatenate([[0], np.cumsum(np.cos((turn[1:] + turn[:-1]) / 2) * np.diff(s))])
    y = np.concatenate([[0], np.cumsum(np.sin((turn[1:] + turn[:-1]) / 2) * np.diff(s))])
    np.testing.assert_allclose(y, A * x**2, atol=1e-6)


def test_the_regression_agrees_with_the_lengths_and_coefficients_of_the_average_rat():
    measured = {"beta": 6.81, "C1": 8.85, "C2": 11.8, "C3": 13.6, "D4": 17.8}  # A [1/m], average rat of Zweifel2021
    found = [atlas_curvature(name, vb.Whisker(length=0.02, cone_angle=2e-3)).at(0) / 2 for name in measured]
    np.testing.assert_allclose(found, list(measured.values()), rtol=0.2)


def test_a_table_is_read_in_its_units_and_in_any_order(tmp_path):
    path = tmp_path / "curvature.csv"
    path.write_text("distance_mm,curvature_per_m\n20,10\n0,20\n")
    assert read_curvature(path) == IntrinsicCurvature(distance=(0.0, 0.02), curvature=(20.0, 10.0))
    path.write_text("distance_mm,curvature_per_mm\n0,0.02\n20,0.01\n")
    np.testing.assert_allclose(read_curvature(path).curvature, [20.0, 10.0])
    assert vb.curvature(path, flipped=True).at(0.01) == pytest.approx(-15.0)


def test_a_shape_is_read_from_a_file(tmp_path):
    path, points = tmp_path / "shape.csv", spiral(20.0, -300.0)
    path.write_text("x_mm,y_mm\n" + "".join(f"{1e3 * x:.9f},{1e3 * y:.9f}\n" for x, y in zip(*points, strict=True)))
    np.testing.assert_allclose(read_curvature(path).curvature, [20.0, 11.0], atol=0.02)


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("distance_mm,width_mm\n0,1\n", "missing"),
        ("distance_mm,curvature_per_m\n", "too-few"),
        ("distance_mm,curvature_per_m\n0,1\n0,2\n", "range"),
        ("distance_mm,curvature_per_mm\n0,20\n", "range"),
        ("x_mm,y_mm\n0,1\n1,1\n", "too-few"),
    ],
)
def test_bad_tables_are_refused(tmp_path, text, kind):
    path = tmp_path / "curvature.csv"
    path.write_text(text)
    with refusal(kind):
        read_curvature(path)
