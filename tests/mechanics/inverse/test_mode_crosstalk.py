"""What a decomposition with a wrong contact takes for other modes, against the boundary term that gives it exactly."""

import numpy as np

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.inverse.decomposition import decompose
from vibrissa.mechanics.statics.profile import Posture, stationary_profile
from vibrissa.quantities import dataset
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
ARC = np.arange(1, 245) * 116e-6
TIME = np.arange(400) / 2000


def by_boundary_term(contact, assumed, n_modes=3):
    """∫ s² V_i(ε') V_j(ε) ds over [ε', 1], ε' > ε, from what Green's identity leaves at ε': no quadrature, no nodes."""
    told, moved = cone_kappa(assumed, n_modes), cone_kappa(contact, n_modes)
    at = np.array([assumed])
    slope, jerk = (cone_modes(told, assumed, at, derivative=k)[:, 0] for k in (1, 3))
    value, bend = (cone_modes(moved, contact, at, derivative=k)[:, 0] for k in (0, 2))
    return -(assumed**4) * (np.outer(jerk, value) + np.outer(slope, bend)) / (told[:, None] ** 2 - moved**2)


def swung(contact, noise, seed=0):
    """Profile whose mode 1 alone swings, by some tenths of a millimetre."""
    s = 1 - ARC / WHISKER.length
    flat = stationary_profile(Posture(contact=contact, base_angle=1.2), np.maximum(s, contact))
    q = 2e-3 * np.sin(2 * np.pi * 90 * TIME)
    u = np.outer(q, cone_modes(cone_kappa(contact, 1), contact, np.maximum(s, contact))[0])
    rng = np.random.default_rng(seed)
    x, y = flat.profile_x.values - u * np.sin(flat.angle.values), flat.profile_y.values + u * np.cos(flat.angle.values)
    x, y = (WHISKER.length * one + noise * rng.standard_normal(one.shape) for one in (x, y))
    return q, dataset(x=x, y=y, arc_length=ARC, time=TIME, node=np.arange(len(ARC)))


def test_the_decomposition_leaks_as_much():
    contact, assumed = 0.285, 0.291
    q, profile = swung(contact, 3e-6)  # the tracker's noise
    found = decompose(profile, WHISKER, assumed).mode_displacement.values @ q / (q @ q)
    expected = by_boundary_term(contact, assumed)[:, 0]
    np.testing.assert_allclose(found[:2], expected[:2], rtol=0.2, atol=2e-3)
    assert abs(found[1]) > 0.005


def test_noise_leaks_nothing_of_mode_1_where_the_contact_is_right():
    told = []
    for seed in range(20):
        q, profile = swung(0.291, 3e-6, seed)
        told.append(decompose(profile, WHISKER, 0.291).mode_displacement.values @ q / (q @ q))
    told = np.array(told)
    error = told.std(axis=0) / np.sqrt(len(told))
    # what is left is of second order in the swing: the mean profile's normal is not that at rest
    assert np.all(np.abs(told.mean(axis=0)[1:]) < 3 * error[1:] + 1e-3)
