"""Rods that tests of several files look at."""

from functools import cache

from vibrissa.mechanics.rod.equilibrium import resting_rod
from vibrissa.mechanics.rod.mesh import Fineness
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import Whisker

POSTURE = Posture(contact=0.29, base_angle=1.2)


def cone(tip=0.25):
    """The whisker of MODEL's last section, cut at a tip."""
    return Whisker(length=0.04, cone_angle=1.5e-3, tip=tip)


@cache
def resting(tip=0.25, refined=1.0, damping=0.11, posture=POSTURE, **settings):
    """A rod in equilibrium; not to be run, since it is shared."""
    fineness = Fineness().refined(refined)
    return resting_rod(cone(tip), posture, damping=damping, settings=Rod(fineness=fineness, **settings))
