"""Resonant modes of the whisker, against a Galerkin solver and published tables."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import legendre
from refusals import refusal

from vibrissa.mechanics.modes.straight import eigenmodes, resonances
from vibrissa.whisker import Whisker

# MODEL.md and research/mechanics.md §2b (mpmath, 40 digits)
PINNED = {
    0.05: [10.389778980, 26.561061867, 50.320137925],
    0.10: [12.232832491, 32.232839515, 62.202600447],
    0.20: [16.872996848, 46.348308377, 91.442298783],
    0.30: [23.585537548, 66.823690763, 133.719738565],
    0.40: [33.980115182, 98.774865035, 199.705362023],
    0.50: [51.401907270, 152.795292177, 311.404958194],
}
FREE = {
    0.05: [8.746958051, 21.548766642, 40.453847854],
    0.10: [8.894903270, 23.061927394, 45.831894271],
    0.20: [9.681860948, 28.727292793, 62.240046659],
    0.25: [10.352117106, 32.852808483, 73.460164564],
    0.30: [11.243389387, 38.043187585, 87.368171677],
    0.50: [18.500601010, 78.190452722, 194.315597335],
}
WHOLE_CONE = [8.7192588550799, 21.145662387869, 38.453771227733, 60.680138775097, 87.833991294601]
TABLES = [("pinned", c, k) for c, k in PINNED.items()] + [("free", c, k) for c, k in FREE.items()]


def galerkin_kappa(contact, boundary, count, degree=70):
    """κ by Rayleigh–Ritz on polynomials in √s: knows nothing of Bessel functions, skips no root.

    κ are the singular values of V ↦ s²V'' in a basis made orthonormal under s².
    """
    node, weight = legendre.leggauss(2 * degree)
    r0 = np.sqrt(contact)
    half = (1 - r0) / 2
    r = r0 + half * (node + 1)
    s, weight = r**2, 2 * weight * half * r
    legs = np.eye(degree)
    p = [legendre.legval(node, legendre.legder(legs, n, axis=1).T if n else legs.T) / half**n for n in range(3)]
    a, da, dda = (1 - r) ** 2, -2 * (1 - r), 2 * np.ones_like(r)
    if boundary == "pinned":  # × (r − r₀)
        a, da, dda = a * (r - r0), da * (r - r0) + a, dda * (r - r0) + 2 * da
    v = a * p[0]
    slope = da * p[0] + a * p[1]
    bend = dda * p[0] + 2 * da * p[1] + a * p[2]
    bending = (bend / r**2 - slope / r**3) / 4  # d/ds = d/(2r dr)
    triangle = np.linalg.qr((np.sqrt(weight) * s * v).T)[1]
    strain = np.linalg.solve(triangle.T, np.sqrt(weight) * s**2 * bending)
    return np.linalg.svd(strain, compute_uv=False)[::-1][:count]


@pytest.mark.parametrize(("boundary", "contact", "kappa"), TABLES)
def test_resonances_are_those_of_the_tables(boundary, contact, kappa):
    found = eigenmodes(contact, 3, boundary=boundary).kappa
    np.testing.assert_allclose(found, kappa, rtol=0, atol=6e-10)  # all printed digits


def test_whole_cone_resonates_at_the_bessel_roots():
    np.testing.assert_allclose(eigenmodes(0.0, 5, boundary="free").kappa, WHOLE_CONE, rtol=1e-13)


def test_reference_posture_resonates_as_the_model_says():
    np.testing.assert_allclose(eigenmodes(0.29, 3).kappa, [22.783829, 64.371254, 128.656927], atol=6e-7)


@pytest.mark.parametrize("boundary", ["pinned", "free"])
@pytest.mark.parametrize("contact", [0.005, 0.0113, 0.03, 0.07, 0.15, 0.29, 0.45, 0.6, 0.75, 0.85, 0.9])
def test_no_resonance_is_skipped(contact, boundary):
    kappa = eigenmodes(contact, 15, boundary=boundary).kappa
    # the solver's round-off: κ_max of its basis × 1e-16 over κ₁
    np.testing.assert_allclose(kappa, galerkin_kappa(contact, boundary, 15), rtol=2e-7)


def test_galerkin_witness_converges_from_above():
    kappa = float(eigenmodes(0.05, 1).kappa[0])
    error = [galerkin_kappa(0.05, "pinned", 1, degree)[0] / kappa - 1 for degree in (5, 8, 11, 14)]
    assert np.all(np.diff(error) < 0)
    assert 0 < error[-1] < 1e-6


@settings(deadline=None, derandomize=True, max_examples=15)
@given(contact=st.floats(0.005, 0.9), count=st.integers(2, 20))
def test_holding_the_contact_raises_every_resonance_but_never_above_the_next(contact, count):
    free = eigenmodes(contact, count, boundary="free", s=[1.0]).kappa.values
    pinned = eigenmodes(contact, count, s=[1.0]).kappa.values
    assert np.all(free < pinned)  # one constraint more: Rayleigh's interlacing
    assert np.all(pinned[:-1] < free[1:])


@settings(deadline=None, derandomize=True, max_examples=15)
@given(contact=st.floats(0.03, 0.89), boundary=st.sampled_from(["pinned", "free"]))
def test_each_mode_has_one_node_more_than_the_one_below(contact, boundary):
    edge = (1 - contact) * 1e-3
    modes = eigenmodes(contact, 10, boundary=boundary, s=np.linspace(contact + edge, 1 - edge, 1000))
    nodes = (np.diff(np.sign(modes.mode_shape.values), axis=1) != 0).sum(axis=1)
    np.testing.assert_array_equal(nodes, np.arange(10))


def test_frequencies_do_not_depend_on_how_many_are_asked_for():
    few, many = eigenmodes(0.2, 3), eigenmodes(0.2, 40)
    np.testing.assert_allclose(few.kappa, many.kappa[:3], rtol=1e-14)
    np.testing.assert_allclose(few.mode_shape, many.mode_shape[:3], rtol=0, atol=1e-11)


def test_short_free_end_resonates_as_a_uniform_cantilever_in_the_limit():
    # ε → 1: the beam is uniform; (κ(1 − ε)²)^½ → 1.8751, 4.6941, the taper enters at first order in 1 − ε
    beam = np.array([1.8751040687, 4.6940911330]) ** 2
    error = [
        eigenmodes(e, 2, boundary="free").kappa.values * (1 - e) ** 2 / (beam * (1 + e) / 2) - 1 for e in (0.8, 0.9)
    ]
    assert np.all(np.abs(error[1]) < 0.1)
    assert np.all((error[1] / error[0] > 0.4) & (error[1] / error[0] < 0.6))


def test_double_tapered_cantilever_of_mabie_and_rogers():
    # JASA 51:1771 (1972), h₀/h₁ = b₀/b₁ = 4: λ = 4(1 − ε)²κ; their integration errs by up to 3.4e-4
    found = 4 * 0.75**2 * eigenmodes(0.25, 5, boundary="free").kappa
    np.testing.assert_allclose(found, [23.289, 73.9, 165.23, 299.7, 478.1], rtol=4e-4)


@pytest.mark.parametrize(
    ("tip", "published"),
    [  # Georgian; Conway: λ = κ(1 − ε)², ratio of tip to base diameter ε; their method errs by up to 0.7 %
        (0.0, [8.718, 21.146, 38.45]),
        (0.1, [7.201, 18.71, 37.10]),
        (0.25, [5.850, 18.51, 41.34]),
        (1 / 3, [5.289, 18.76, 43.78]),
        (0.5, [4.625, 19.55, 48.50]),
    ],
)
def test_truncated_cones_of_georgian_and_conway(tip, published):
    found = (1 - tip) ** 2 * eigenmodes(tip, 3, boundary="free").kappa
    np.testing.assert_allclose(found, published, rtol=7.5e-3)


def test_resonances_in_air_of_the_paper():
    kappa = eigenmodes(0.0, 2, boundary="free").kappa
    np.testing.assert_allclose(kappa, [8.72, 21.15], atol=0.005)  # "κ_air = 8.72, 21.15"


def test_reference_whisker_resonates_at_123_hz():
    whisker = Whisker(length=0.04, cone_angle=1.5e-3, youngs_modulus=3.74e9, density=1140.0)
    found = resonances(whisker, 0.29)
    assert float(found.resonant_frequency[0]) == pytest.approx(123, abs=0.5)
    np.testing.assert_allclose(found.resonant_frequency * 2 * np.pi * whisker.timescale, found.kappa, rtol=1e-14)


@settings(deadline=None, derandomize=True, max_examples=20)
@given(scale=st.floats(0.1, 10))
def test_resonance_falls_as_the_square_of_the_length_at_given_base_radius(scale):
    def first(length):
        return float(resonances(Whisker(length=length, cone_angle=6e-5 / length), 0.3, 1).resonant_frequency[0])

    assert first(0.04 * scale) == pytest.approx(first(0.04) / scale**2, rel=1e-12)


def test_shapes_of_the_whole_cone_are_not_measured_at_its_tip():
    modes = eigenmodes(0.0, 2, boundary="free", s=[0.0, 0.5])
    assert np.isnan(modes.mode_shape[:, 0]).all()
    assert np.isfinite(modes.mode_shape[:, 1]).all()


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: eigenmodes(0.004), ("range", "contact")),
        (lambda: eigenmodes(0.91), ("range", "contact")),
        (lambda: eigenmodes(0.0), ("range", "contact")),
        (lambda: eigenmodes(np.nan), ("range", "contact")),
        (lambda: eigenmodes(0.3, 0), ("range", "number of modes")),
        (lambda: eigenmodes(0.3, 41), ("range", "number of modes")),
        (lambda: eigenmodes(0.3, boundary="clamped"), ("unknown", "boundary")),
        (lambda: eigenmodes(0.3, s=[0.2, 0.5]), ("range", "s")),
        (lambda: eigenmodes(0.3, s=[0.5, np.nan]), ("range", "s")),
        (lambda: resonances(Whisker(length=0.04, cone_angle=1.5e-3, tip=0.2), 0.1), ("range", "contact")),
    ],
)
def test_modes_refuse_what_they_cannot_know(call, rule):
    with refusal(*rule):
        call()
