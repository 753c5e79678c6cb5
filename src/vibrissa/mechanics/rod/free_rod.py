"""The rod at rest in the air: in its own shape, whatever the angle of its base."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.rod.damping import RodModes, rod_modes, viscous
from vibrissa.mechanics.rod.equilibrium import rod_shaft
from vibrissa.mechanics.rod.kernels.contact_kernels import Stiffness, untouched
from vibrissa.mechanics.rod.kernels.elastic_kernels import segments
from vibrissa.mechanics.rod.kernels.ground import Ground
from vibrissa.mechanics.rod.kernels.shaft import RodShaft
from vibrissa.mechanics.rod.kernels.state import Damping, at_rest
from vibrissa.mechanics.rod.rod_model import RestingRod
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import Whisker

_FAR_BELOW = -1e6  # over L: the flat under a rod in the air


def free_shape(shaft: RodShaft, base: Array) -> Array:
    """Positions of a rod that nothing bends.

    Parameters
    ----------
    shaft : RodShaft
        The rod.
    base : (3,) array
        x, y and angle of the base.

    Returns
    -------
    (2N + 3,) array
        Positions.
    """
    turned = base[2] - np.cumsum(shaft.rest_angle[:0:-1])[::-1]  # angle of each segment
    steps = shaft.rest[:, None] * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    nodes = base[:2] - np.concatenate([np.cumsum(steps[::-1], axis=0)[::-1], np.zeros((1, 2))])
    return np.concatenate([nodes.ravel(), base[2:]])


def clear_of(ground: Ground, shift: Array, shaft: RodShaft, at: Array) -> bool:
    """Whether a rod is off the ground.

    Parameters
    ----------
    ground : Ground
        The ground.
    shift : (2,) array
        Where its origin is.
    shaft : RodShaft
        The rod.
    at : (2N + 3,) array
        Its positions.

    Returns
    -------
    bool
        No point of the shaft on or below the ground.
    """
    x, y = at[0:-1:2] - shift[0], at[1:-1:2] - shift[1] - shaft.radius
    under = (ground.x > x.min()) & (ground.x < x.max())
    order = np.argsort(x)
    above = np.interp(ground.x[under], x[order], y[order])
    level = np.interp(x, ground.x, ground.y)
    return bool((y > level).all() and (above > ground.y[under]).all())


def free_rod(whisker: Whisker, posture: Posture, s: Array, base: Array, damping: Damping, settings: Rod) -> RestingRod:
    """The rod at rest in the air.

    Parameters
    ----------
    whisker : Whisker
        The cone.
    posture : Posture
        Gives the law of friction.
    s : (N + 1,) array
        Nodes.
    base : (3,) array
        x, y and angle of the base, over L.
    damping : Damping
        Of the shaft.
    settings : Rod
        What else the rod has.

    Returns
    -------
    RestingRod
        Ready to run; its modes are free.
    """
    curved = rod_shaft(whisker, s, settings)
    state = at_rest(free_shape(curved, base))
    stiffness = Stiffness(settings.ground, settings.ground, posture.law)
    touch, work = untouched(s.size, 0), segments(s.size - 1)
    held = (damping, base.copy(), work, settings.follicle)
    rod = RestingRod(whisker, posture, settings, curved, state, touch, stiffness, *held)
    rod.modes = free_modes(rod, base[2])
    return rod


def free_modes(rod: RestingRod, angle: float) -> RodModes:
    """First modes of a rod in the air.

    Parameters
    ----------
    rod : RestingRod
        The rod.
    angle : float
        Of its base [rad].

    Returns
    -------
    RodModes
        About its own shape.
    """
    at = free_shape(rod.shaft, np.array([0.0, 0.0, angle]))
    return rod_modes(rod.shaft, at, rod.stiffness, _FAR_BELOW, rod.follicle)


class FreeDamping(NamedTuple):
    """What a damping does to a rod in the air.

    Attributes
    ----------
    kappa : (3,) array
        Adimensional frequencies of the free modes.
    ratio : (3,) array
        ζ of each.
    """

    kappa: Array
    ratio: Array


def free_damping(rod: RestingRod) -> FreeDamping:
    """Ratios that the damping of a rod gives to its free modes.

    Parameters
    ----------
    rod : RestingRod
        The rod.

    Returns
    -------
    FreeDamping
        ζ = φᵀCφ / 2κ of the first three.
    """
    modes = free_modes(rod, rod.damping.angle)
    own = ((modes.shape @ rod.damping.shape.T) ** 2) @ rod.damping.modal
    ratio = (rod.damping.mass + rod.damping.stiffness * modes.stiffness + own) / (2 * modes.kappa)
    return FreeDamping(modes.kappa, ratio)


def damped_in_air(rod: RestingRod, ratio: float) -> Damping:
    """Damping that gives each of the first three free modes one ratio.

    Parameters
    ----------
    rod : RestingRod
        The rod, at the angle that its drive has.
    ratio : float
        ζ.

    Returns
    -------
    Damping
        About the rod's own shape.
    """
    angle = float(rod.drive[2])
    return viscous(rod.shaft, free_modes(rod, angle), ratio)._replace(angle=angle)
