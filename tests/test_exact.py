"""Closed forms, against mpmath, an independent quadrature and their own differential equations."""

import itertools

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from vibrissa.exact import am_tone, cone_kappa, cone_modes, free_decay, shaft_quadrature

CONTACTS = [0.005, 0.05, 0.29, 0.6, 0.9]
BOUNDARIES = ["pinned", "free"]


def tanh_sinh(contact):
    """Nodes and weights on [ε, 1] by the double-exponential rule: not the rule of the package."""
    t = np.linspace(-3.2, 3.2, 2001)
    u = np.tanh(np.pi / 2 * np.sinh(t))
    weight = np.pi / 2 * np.cosh(t) / np.cosh(np.pi / 2 * np.sinh(t)) ** 2 * (t[1] - t[0])
    return contact + (1 - contact) * (u + 1) / 2, weight * (1 - contact) / 2


def bessel_rows(kind, kappa, s):
    """V = F₂(z)/s, sV', s²V'' and s³V''' from F₁, F₂ and Bessel's equation, with D = s d/ds.

    D²F₂ = (4 ∓ z²)/4·F₂, and D acts on F₂/s as D − 1 on F₂.
    """
    z = 2 * mpmath.sqrt(kappa * s)
    bessel = getattr(mpmath, f"bessel{kind}")
    f = bessel(2, z)
    d1 = (-1 if kind == "k" else 1) * z / 2 * bessel(1, z) - f
    z2 = (-1 if kind in "jy" else 1) * z**2 / 4
    d2, d3 = (1 + z2) * f, z2 * f + (1 + z2) * d1
    return [f / s, (d1 - f) / s, (d2 - 3 * d1 + 2 * f) / s, (d3 - 6 * d2 + 11 * d1 - 6 * f) / s]


def determinant(kappa, contact, boundary):
    """Boundary determinant, in another form than the package's."""
    kappa, contact = mpmath.mpf(kappa), mpmath.mpf(contact)
    columns = []
    for kind in "jyik":
        base, outer = bessel_rows(kind, kappa, mpmath.mpf(1)), bessel_rows(kind, kappa, contact)
        scale = max(map(abs, base + outer))
        last = 4 * outer[2] + outer[3] if boundary == "free" else outer[0]
        columns.append([value / scale for value in (base[0], base[1], outer[2], last)])
    return mpmath.det(mpmath.matrix(columns))


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("contact", [0.005, 0.05, 0.29, 0.9])
def test_frequencies_are_the_roots_of_the_bessel_determinant(contact, boundary):
    kappa = cone_kappa(contact, 10, boundary)
    with mpmath.workdps(30):
        for value in map(mpmath.mpf, kappa[[0, 1, 2, 9]]):
            below, above = (
                determinant(value * (1 + sign * mpmath.mpf("1e-12")), contact, boundary) for sign in (-1, 1)
            )
            assert below * above < 0  # the root lies between


def test_frequencies_of_the_whole_free_cone_are_the_roots_of_two_bessel_functions():
    with mpmath.workdps(30):
        for value in map(mpmath.mpf, cone_kappa(0.0, 6, "free")):

            def tip_finite(kappa):
                j, i = bessel_rows("j", kappa, mpmath.mpf(1)), bessel_rows("i", kappa, mpmath.mpf(1))
                return j[0] * i[1] - i[0] * j[1]

            assert tip_finite(value * (1 - mpmath.mpf("1e-12"))) * tip_finite(value * (1 + mpmath.mpf("1e-12"))) < 0


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("contact", CONTACTS)
def test_modes_are_orthonormal_under_the_mass_of_the_cone(contact, boundary):
    s, weights = tanh_sinh(contact)
    v = cone_modes(cone_kappa(contact, 12, boundary), contact, s, boundary)
    np.testing.assert_allclose((v * weights * s**2) @ v.T, np.eye(12), atol=1e-10)


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("contact", CONTACTS)
def test_strain_energy_of_the_modes_is_diagonal(contact, boundary):
    s, weights = tanh_sinh(contact)
    kappa = cone_kappa(contact, 8, boundary)
    bending = cone_modes(kappa, contact, s, boundary, derivative=2)
    energy = (bending * weights * s**4) @ bending.T / np.outer(kappa, kappa)
    np.testing.assert_allclose(energy, np.eye(8), atol=1e-9)


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("contact", CONTACTS)
def test_modes_meet_the_clamp_and_the_contact(contact, boundary):
    kappa = cone_kappa(contact, 10, boundary)
    ends = [cone_modes(kappa, contact, np.array([contact, 1.0]), boundary, derivative=n) for n in range(4)]
    largest = [np.abs(cone_modes(kappa, contact, np.linspace(contact, 1, 400), boundary, n)).max(1) for n in range(4)]
    zero = [ends[0][:, 1] / largest[0], ends[1][:, 1] / largest[1], ends[2][:, 0] / largest[2]]
    if boundary == "pinned":
        zero.append(ends[0][:, 0] / largest[0])
    else:  # (s⁴V'')' = s⁴V''' once V'' = 0
        zero.append((4 * ends[2][:, 0] + contact * ends[3][:, 0]) / (contact * largest[3]))
    np.testing.assert_allclose(zero, 0, atol=1e-8)  # round-off: the free tip at 0.005 cancels V'' seven digits
    assert np.all(ends[2][:, 1] > 0)


@pytest.mark.parametrize("contact", CONTACTS)
def test_each_derivative_is_the_slope_of_the_one_before(contact):
    kappa = cone_kappa(contact, 6)
    cuts = contact ** np.linspace(1, 0, 9)  # panels that follow the taper
    node, weight = np.polynomial.legendre.leggauss(40)
    for a, b in itertools.pairwise(cuts):
        s = (a + b) / 2 + (b - a) / 2 * node
        for n in range(4):
            step = np.diff(cone_modes(kappa, contact, np.array([a, b]), derivative=n))[:, 0]
            slope = cone_modes(kappa, contact, s, derivative=n + 1)
            scale = np.abs(slope).max(1) * (b - a)
            np.testing.assert_allclose((slope @ weight * (b - a) / 2 - step) / scale, 0, atol=1e-10)


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("contact", CONTACTS)
def test_modes_solve_the_equation_of_the_vibrating_cone(contact, boundary):
    kappa = cone_kappa(contact, 10, boundary)
    s = np.linspace(contact, 1, 101)
    v = [cone_modes(kappa, contact, s, boundary, derivative=n) for n in range(5)]
    terms = np.stack([s**2 * v[4], 8 * s * v[3], 12 * v[2], -(kappa[:, None] ** 2) * v[0]])
    np.testing.assert_allclose(terms.sum(0) / np.abs(terms).max((0, 2))[:, None], 0, atol=1e-9)


def test_shear_at_the_base_needs_the_taper():
    # MODEL.md, "Signals": V''' = −18.95 alone has the wrong sign, V''' + 4V'' = +163.26
    kappa = cone_kappa(0.29, 1)
    bending, slope = (cone_modes(kappa, 0.29, np.ones(1), derivative=n)[0, 0] for n in (2, 3))
    assert slope == pytest.approx(-18.95, abs=0.005)
    assert slope + 4 * bending == pytest.approx(163.26, abs=0.005)


def test_frequencies_move_smoothly_with_the_contact():
    # a skipped root would make every later κ leap; ξ = 2√κ(1 − √ε) changes by less than 0.25 between neighbours here
    contact = np.geomspace(0.005, 0.9, 80)
    for boundary in BOUNDARIES:
        kappa = np.array([cone_kappa(e, 40, boundary) for e in contact])
        xi = 2 * np.sqrt(kappa) * (1 - np.sqrt(contact))[:, None]
        assert np.abs(np.diff(xi, axis=0)).max() < 0.25
        assert 2.4 < np.diff(xi, axis=1).min() < np.diff(xi, axis=1).max() < 3.3  # a scan by 1 sees every root


def test_quadrature_is_exact_for_powers_of_the_root_of_s():
    s, weights = shaft_quadrature(0.04, 12)
    for power in range(20):  # s^(p/2) ds = 2 r^(p+1) dr: degree below 24
        exact = (1 - 0.2 ** (power + 2)) * 2 / (power + 2)
        assert weights @ s ** (power / 2) == pytest.approx(exact, rel=1e-13)


@settings(deadline=None, derandomize=True, max_examples=30)
@given(
    q0=st.floats(-2, 2),
    v0=st.floats(-100, 100),
    omega=st.floats(50, 2000),
    zeta=st.floats(0, 0.95),
)
def test_free_decay_solves_the_damped_oscillator(q0, v0, omega, zeta):
    t = np.linspace(0, 10 / omega, 20)
    sol = solve_ivp(
        lambda _, y: [y[1], -(omega**2) * y[0] - 2 * zeta * omega * y[1]],
        (0, t[-1]),
        [q0, v0],
        method="DOP853",
        t_eval=t,
        rtol=1e-12,
        atol=1e-13,
    )
    np.testing.assert_allclose(free_decay(t, q0, v0, omega, zeta), sol.y[0], atol=1e-10)


def test_undamped_oscillator_keeps_its_energy():
    t = np.linspace(0, 1, 1000)
    q = free_decay(t, 0.3, 40.0, 200.0, 0.0)
    v = free_decay(t, 40.0, -(200.0**2) * 0.3, 200.0, 0.0)  # q̇ obeys the same equation
    np.testing.assert_allclose(v**2 + (200.0 * q) ** 2, 40.0**2 + 60.0**2, rtol=1e-12)


def test_am_tone_is_three_pure_tones():
    t = np.arange(1000) / 1000
    signal, envelope = am_tone(t, 120.0, 7.0, 0.6)
    line = np.fft.rfft(signal)[[113, 120, 127]] / 500
    np.testing.assert_allclose(line, [0.3j, 1, -0.3j], atol=1e-12)
    np.testing.assert_allclose([envelope.max(), envelope.min()], [1.6, 0.4], atol=1e-3)
