"""What the paper's numbers of size and place mean on a whisker, by witnesses that share no code with the package."""

import tomllib
from importlib.resources import files

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import iv, jv, kv, yv

from vibrissa.exact import cone_kappa
from vibrissa.study.paper.paper_numbers import paper_numbers
from vibrissa.study.paper.paper_scale import amplitude, amplitude_here
from vibrissa.study.spec.settings import read_study

KAPPA_AIR = 8.71925886
RMS, CONTACT, LENGTH = 2.64e-3, 0.29, 0.04


def mode_1(contact):
    """V₁ of the pinned cone from its Bessel functions, orthonormal under s² by the trapezoidal rule."""

    def bessel(kappa, s, order):  # J, Y, I, K of order 2 and up: V ∝ F₂/s, each derivative one order and √(κ/s) more
        z = 2 * np.sqrt(kappa * s)
        signs = (-1) ** (order % 2)
        return np.array([signs * jv(order, z), signs * yv(order, z), iv(order, z), signs * kv(order, z)])

    def conditions(kappa):
        rows = [bessel(kappa, s, order) for s, order in ((1.0, 2), (1.0, 3), (contact, 2), (contact, 4))]
        return np.array([row / np.abs(row).max() for row in rows])

    kappa = brentq(lambda k: np.linalg.det(conditions(k)), 8.8, 55)
    weights = np.linalg.svd(conditions(kappa))[2][-1]
    s = np.linspace(contact, 1, 20_001)
    shape = weights @ bessel(kappa, s, 2) / s
    return kappa, s, np.abs(shape) / np.sqrt(np.trapezoid(s**2 * shape**2, s))


def test_the_mean_rms_is_376_micrometres_at_the_antinode_and_47_near_the_base():
    """Mean of the envelope of Gaussian noise that a narrow filter has made ring, by its quadratures."""
    kappa, s, shape = mode_1(CONTACT)
    assert kappa == pytest.approx(22.783829, abs=1e-5)
    rng = np.random.default_rng(1)
    envelope = np.hypot(*rng.normal(size=(2, 1_000_000))).mean()
    near = np.interp(1 - 5e-3 / LENGTH, s, shape)
    expected = 1e6 * RMS * LENGTH * np.array([shape.max(), near * envelope])
    np.testing.assert_allclose(1e6 * np.array(amplitude(RMS, CONTACT, LENGTH)), expected, rtol=2e-3)
    np.testing.assert_allclose(expected, (376.1, 47.2), rtol=2e-3)
    unit = 1e6 * np.array(amplitude(RMS, CONTACT, LENGTH, "unit-antinode"))
    np.testing.assert_allclose(unit, expected / shape.max(), rtol=2e-3)
    np.testing.assert_allclose(unit, (105.6, 13.26), rtol=2e-3)


def test_the_table_has_both_readings_of_the_mean_rms():
    number = {one.id: one for one in paper_numbers()}
    for norm, end in (("orthonormal", ""), ("unit-antinode", "_max")):
        for part, value in amplitude(RMS, CONTACT, LENGTH, norm)._asdict().items():
            row = number[f"gain_{part}{end}"]
            assert row.value == pytest.approx(value, rel=1e-4)
            low, high = (getattr(amplitude(rms, CONTACT, LENGTH, norm), part) for rms in number["gain_mean"].interval)
            assert row.interval == pytest.approx((low, high), rel=1e-4)


def test_the_same_of_sweeps_goes_by_the_contact_and_length_of_each(sweeps_of_two):
    here = amplitude_here("antinode", sweeps_of_two)
    each = [amplitude(1e-3, 0.2, 0.03).antinode, amplitude(2e-3, 0.35, 0.05).antinode]
    assert here.value == pytest.approx(np.mean(each))
    assert here.draws == 2


@pytest.fixture
def sweeps_of_two():
    import xarray as xr

    columns = {"contact": [0.2, 0.35], "length": [0.03, 0.05], "animal": ["a", "a"], "whisker_name": ["C1", "C2"]}
    table = {name: ("sweep", np.array(values)) for name, values in columns.items()}
    return xr.Dataset(table | {"mode_rms": (("sweep", "mode"), [[1e-3], [2e-3]])}, {"mode": [1]})


def test_the_papers_experiment_draws_no_contact_whose_resonance_is_beyond_four_times_that_in_air():
    """By κ₁(ε) from the Bessel functions: 4 × 8.719 at ε = 0.4067."""
    bound = brentq(lambda contact: mode_1(contact)[0] - 4 * KAPPA_AIR, 0.3, 0.45)
    assert bound == pytest.approx(0.407, abs=5e-4)
    study = read_study(files("vibrissa") / "data" / "paper.toml")
    least, most = study.laboratory.contacts
    assert least == 0.1
    assert cone_kappa(most, 1)[0] <= 4 * KAPPA_AIR < cone_kappa(most + 1e-4, 1)[0]
    assert tomllib.loads((files("vibrissa") / "data" / "paper.toml").read_text())["laboratory"]["contacts"][1] == most
