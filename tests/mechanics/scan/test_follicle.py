"""Curvature, moment and forces at the base, whole and apart."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import simpson
from shooting import held_by_an_edge, march

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.modes.straight import contact_shear, shear
from vibrissa.mechanics.quasi_static.response import quasi_static
from vibrissa.mechanics.scan.follicle import (
    PARTS,
    base_curvature,
    base_moment,
    follicle_signals,
    force_unit,
)
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture, stationary_profile
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, youngs_modulus=3.74e9)
POSTURE = Posture(contact=0.29, base_angle=1.2)
TEXTURE = Gaps(position=np.array([1e-3, 1.9e-3, 2.6e-3]), width=np.array([0.6e-3, 0.2e-3, 0.5e-3]))
SIGNALS = ("base_curvature", "base_moment", "transverse_force", "axial_force")


@cache
def prediction(form="exact", damping=0.11):
    response = quasi_static(POSTURE, (-0.0152, 6e-4), form=form, n_modes=3)
    scan = Scan(speed=0.12, damping=damping, response=form)
    return predict(WHISKER, POSTURE, TEXTURE, scan, n_modes=3, response=response)


# Exact solutions


def test_base_curvature_is_that_of_the_displaced_shaft():
    kappa, q = cone_kappa(0.3, 3), np.array([[2e-3, -1e-3], [5e-4, 3e-4], [1e-4, 2e-4]])
    arc = np.linspace(0, 0.2, 12)  # clamped: u = C s²/2 + O(s³) from the base
    u = q.T @ cone_modes(kappa, 0.3, 1 - arc) * WHISKER.length
    fit = [np.polynomial.Polynomial.fit(arc * WHISKER.length, row, 10).deriv(2)(0.0) for row in u]
    bending = cone_modes(kappa, 0.3, np.ones(1), derivative=2)[:, 0]
    np.testing.assert_allclose(base_curvature(WHISKER, bending, q), fit, rtol=1e-5)


def test_moment_of_a_curved_cylinder_end_by_hand():
    # b = 60 µm: Eπb⁴/4 = 3.74e9 · π/4 · 1.296e-17 = 3.8068e-8 N m²
    assert base_moment(WHISKER, np.array([2.0]))[0] == pytest.approx(2 * 3.8068e-8, rel=1e-4)


def test_unit_of_force_by_hand():
    # α⁴ = 5.0625e-12, L² = 1.6e-3: 3.74e9 · π/4 · 8.1e-15 = 2.37929e-5 N
    assert force_unit(WHISKER) == pytest.approx(2.37929e-5, rel=1e-5)


@pytest.mark.parametrize("contact", [0.2, 0.29, 0.4])
def test_forces_of_a_mode_balance_its_inertia(contact):
    """(s⁴V'')'' = κ²s²V: what leaves at the base less what leaves at the contact is ∫κ²s²V ds."""
    kappa, s = cone_kappa(contact, 4), np.linspace(contact, 1, 4001)
    for i in range(4):
        q = np.eye(4)[:, [i]]
        inertia = kappa[i] ** 2 * simpson(s**2 * cone_modes(kappa, contact, s)[i], x=s)
        found = shear(kappa, contact, q)[0] - contact_shear(kappa, contact, q)[0]
        assert found == pytest.approx(inertia, rel=1e-8)


@pytest.mark.parametrize("form", ["exact", "linear"])
def test_between_two_gaps_the_quasi_static_part_is_the_posture_on_the_flat(form):
    signals = follicle_signals(prediction(form), np.array([0.0, 0.005, 1.7e-3 / 0.12, 1.0]))
    unit = force_unit(WHISKER)
    expected = {"base_moment": 0.490152 * unit * 0.04, "transverse_force": 0.545672 * unit}
    expected |= {"axial_force": 0.584211 * unit, "base_curvature": 0.490152 / 0.04}
    for name, value in expected.items():  # MODEL.md, "Statics": 6 digits
        np.testing.assert_allclose(signals[f"{name}_quasi_static"], value, rtol=1.1e-6)
        np.testing.assert_allclose(signals[f"{name}_quasi_static_rate"], 0, atol=1e-9 * value)


def test_quasi_static_part_in_a_gap_is_that_of_a_profile_found_by_shooting():
    t1, t2, t3 = prediction().events.time[:3]
    unit, flat = force_unit(WHISKER), stationary_profile(POSTURE)
    for when in (0.4 * t1 + 0.6 * t2, t2 + 0.1 * (t3 - t2), t2 + 0.7 * (t3 - t2)):
        d = 3.0 * (when - t1) - (0.015 if when > t2 else 0)  # v/L = 3 per second
        _, (contact, turn, load) = held_by_an_edge(POSTURE, flat, d, np.array([0.9]))
        moment = march(contact, turn, load, POSTURE.friction_angle)[1, -1]
        force = load * np.exp(1j * (1.2 - POSTURE.friction_angle - turn))
        signals = follicle_signals(prediction(), np.array([when]))
        assert signals["base_moment_quasi_static"][0] == pytest.approx(moment * unit * 0.04, rel=1e-8)
        assert signals["transverse_force_quasi_static"][0] == pytest.approx(force.real * unit, rel=1e-8)
        assert signals["axial_force_quasi_static"][0] == pytest.approx(force.imag * unit, rel=1e-8)


# Laws


@pytest.mark.parametrize("form", ["exact", "linear"])
def test_whole_is_the_sum_of_its_parts(form):
    signals = follicle_signals(prediction(form), np.linspace(0, 0.05, 300))
    assert set(signals) == {name + part + end for name in SIGNALS for part in PARTS for end in ("", "_rate")}
    for name in SIGNALS[:3]:
        for end in ("", "_rate"):
            whole, steady, vibration = (signals[name + part + end] for part in PARTS)
            np.testing.assert_allclose(whole, steady + vibration, rtol=1e-14, atol=1e-14 * np.abs(whole).max())
            assert np.abs(vibration).max() > 0


@pytest.mark.parametrize("form", ["exact", "linear"])
def test_axial_vibration_is_not_modelled(form):
    signals = follicle_signals(prediction(form), np.linspace(0, 0.05, 30))
    for end in ("", "_rate"):
        assert np.isnan(signals[f"axial_force_vibration{end}"]).all()
        assert np.isnan(signals[f"axial_force{end}"]).all()
        assert np.isfinite(signals[f"axial_force_quasi_static{end}"]).all()


@pytest.mark.parametrize("form", ["exact", "linear"])
def test_rates_are_derivatives(form):
    """Central differences of step h: away from the events they err as h²."""
    one, step = prediction(form), 4e-6
    t = np.linspace(1e-3, 0.05, 400)
    t = t[np.abs(t[:, None] - one.events.time).min(axis=1) > 2 * step]
    assert t.size > 350
    ahead, here, behind = (follicle_signals(one, t + h) for h in (step, 0.0, -step))
    for name in SIGNALS:
        for part in PARTS:
            if name == "axial_force" and part != "_quasi_static":
                continue
            rate = (ahead[name + part] - behind[name + part]) / (2 * step)
            size = np.abs(here[f"{name}{part}_rate"]).max()
            np.testing.assert_allclose(here[f"{name}{part}_rate"], rate, rtol=0, atol=2e-4 * size)


def test_moment_and_curvature_tell_the_same():
    signals = follicle_signals(prediction(), np.linspace(0, 0.05, 100))
    stiff = 3.74e9 * np.pi / 4 * (1.5e-3 * 0.04) ** 4
    for part in PARTS:
        for end in ("", "_rate"):
            np.testing.assert_allclose(
                signals[f"base_moment{part}{end}"], stiff * signals[f"base_curvature{part}{end}"], rtol=1e-12
            )


@pytest.mark.parametrize("zeta", [0.0, 0.03, 0.11])
@pytest.mark.parametrize("form", ["exact", "linear"])
def test_energy_of_a_mode_left_alone_goes_into_the_damping(form, zeta):
    one = prediction(form, zeta)
    after = one.events.time[-1] + 1e-6
    t = np.linspace(after, after + 0.02, 4001)
    q, rate = one.vibration(t)
    omega = one.omega[:, None]
    energy, lost = (rate**2 + omega**2 * q**2) / 2, 2 * zeta * omega * rate**2
    for i in range(3):  # dE/dt = −2ζω q̇²
        work = simpson(lost[i], x=t)
        assert energy[i, 0] - energy[i, -1] == pytest.approx(work, abs=1e-8 * energy[i, 0])
    # (q̇ + ζωq)² + Ω²q² falls as e^{−2ζωt}, whatever the phase
    turning = (rate + zeta * omega * q) ** 2 + (1 - zeta**2) * omega**2 * q**2
    held = turning * np.exp(2 * zeta * omega * (t - after))
    np.testing.assert_allclose(held / held[:, :1], 1, rtol=1e-9)


def test_energy_on_a_land_between_gaps_falls_too():
    one = prediction()
    t3, t1 = one.events.time[2:4]
    q, rate = one.vibration(np.linspace(t3 + 1e-6, t1 - 1e-6, 200))
    energy = (rate**2 + one.omega[:, None] ** 2 * q**2) / 2
    assert np.all(np.diff(energy, axis=1) <= 0)


# Numbers of the model


def test_the_taper_counts_in_the_transverse_force():
    kappa, one = cone_kappa(0.29, 1), np.ones((1, 1))
    third = cone_modes(kappa, 0.29, np.ones(1), derivative=3)[0, 0]
    assert third == pytest.approx(-18.95, abs=5e-3)  # MODEL.md, "Signals"
    assert shear(kappa, 0.29, one)[0] == pytest.approx(163.26, abs=5e-3)
