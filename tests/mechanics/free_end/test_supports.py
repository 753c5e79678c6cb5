"""Modes of the shaft with its free end: those about the profile where the free end has no length, and their laws."""

import numpy as np
import pytest

from vibrissa.mechanics.free_end.supports import supports, whole_shaft
from vibrissa.mechanics.modes.curved import curved_modes
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture

FLAT = on_the_flat(Posture(contact=0.29, base_angle=1.2))
CONDITIONS = ("flat", "edge", "slide")


def test_without_a_free_end_they_are_the_modes_about_the_profile():
    found, _ = supports(whole_shaft(FLAT, 0.29, 6), 6, 0.11)
    for one, condition in zip(found, CONDITIONS, strict=True):
        np.testing.assert_allclose(
            one.kappa, curved_modes(FLAT, 6, condition=condition, law="coulomb").kappa, rtol=1e-6
        )


def test_a_free_end_slows_what_swings_it():
    """More mass, no more stiffness: by Rayleigh's quotient no frequency of an edge rises, nor any on land."""
    short, long = (supports(whole_shaft(FLAT, tip, 6), 6, 0.11)[0] for tip in (0.28, 0.15))
    for one, other in zip(short, long, strict=True):
        assert np.all(other.kappa < one.kappa)


@pytest.mark.parametrize("tip", [0.289, 0.15])
def test_duals_are_dual_and_the_first_three_modes_on_land_have_their_ratio(tip):
    shaft = whole_shaft(FLAT, tip, 6)
    found, relaxation = supports(shaft, 6, 0.11)
    for one in found:
        np.testing.assert_allclose(one.dual @ shaft.mass @ one.shape.T, np.eye(6), atol=1e-8)
    np.testing.assert_allclose(found[0].zeta[:3], 0.11, rtol=0.02)  # the free end's own mass is not in the rod's ratio
    assert 0 < relaxation < 0.01
