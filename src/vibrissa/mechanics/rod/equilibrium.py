"""The rod at rest on a flat that drags it away from the base."""

from __future__ import annotations

from functools import partial

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, RangeError
from vibrissa.mechanics.rod.curved_profile import curved_profile
from vibrissa.mechanics.rod.damping import rod_modes, viscous
from vibrissa.mechanics.rod.kernels.contact_kernels import Stiffness, untouched
from vibrissa.mechanics.rod.kernels.elastic_kernels import segments
from vibrissa.mechanics.rod.kernels.ground import ground_of
from vibrissa.mechanics.rod.kernels.shaft import RodShaft, shaft
from vibrissa.mechanics.rod.kernels.state import Damping, Follicle, RodState, at_rest
from vibrissa.mechanics.rod.mesh import REACH, graded_nodes
from vibrissa.mechanics.rod.rod_model import RestingRod
from vibrissa.mechanics.rod.rod_settings import USUAL_ROD, Rod
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture, check_tip
from vibrissa.whisker import Whisker

_FIRST, _GROWTH, _LAST = 0.05, 1.3, 3.0  # steps towards equilibrium, over k: in the end so long that nothing rings
_GROWING = 20  # of them, while curvature and level grow
_SETTLED = 200  # at most
_THINNEST = 0.03  # s at which a shaft ends whose tip is thinner: what lies beyond has 3e-5 of the mass
_STILL = 1e-10  # motion in such a step, over L: a hundredth of a nanometre at most; less is creep towards it


def resting_rod(
    whisker: Whisker,
    posture: Posture,
    *,
    damping: float,
    settings: Rod = USUAL_ROD,
    level: float = 0.0,
    reach: float = REACH,
    nodes: Array | None = None,
    n_modes: int = 3,
) -> RestingRod:
    """The rod in equilibrium on a flat that drags it away from the base.

    Parameters
    ----------
    whisker : Whisker
        The cone, to its physical tip, or to s = 0.03 where that is thinner.
    posture : Posture
        Its base is held at the height and angle of Eq. (1), for a straight shaft or for this one.
    damping : float
        ζ of the first three modes about the equilibrium.
    settings : Rod
        What else the rod has.
    level : float
        Height of the flat, over L.
    reach : float
        Of the fine part of the mesh to both sides of the contact, over L.
    nodes : (N + 1,) array, optional
        Nodes of another mesh, ascending to 1.
    n_modes : int
        How many of its modes are wanted.

    Returns
    -------
    RestingRod
        Ready to run.

    Raises
    ------
    InputError
        If the tip lies beyond the contact, or friction is negative.
    ConvergenceError
        If it does not come to rest.
    """
    check_tip(posture, whisker)
    if posture.friction < 0:
        raise RangeError("Posture.friction", "must not be negative for the rod", posture.friction)
    s = graded_nodes(shaft_end(whisker), posture.contact, settings.fineness, reach) if nodes is None else nodes
    own = partial(settings.curvature_at, length=whisker.length)
    curved = rod_shaft(whisker, s, settings)
    flat, lift = on_the_flat(posture), whisker.cone_angle * posture.contact * settings.thick
    base = np.array([flat.base[0], flat.base[1] + lift, posture.base_angle])
    moved = (
        curved_profile(posture, own).base - [*flat.base, posture.base_angle] if settings.hold_contact else np.zeros(3)
    )
    state = at_rest(_first_guess(posture, s, lift, base))
    stiffness = Stiffness(settings.ground, settings.ground, posture.law)
    touch, work = untouched(s.size, 0), segments(s.size - 1)
    straight = curved._replace(rest_angle=np.zeros_like(s))
    free = Damping(0.0, 0.0, np.zeros((0, state.at.size)), np.zeros(0))
    rod = RestingRod(whisker, posture, settings, straight, state, touch, stiffness, free, base + moved, work)
    _settle(rod, curved, level, moved)
    rod.modes = rod_modes(curved, rod.state.at, stiffness, level, settings.follicle, n_modes)
    rod.damping = viscous(curved, rod.modes, damping)
    _unclamp(rod, settings.follicle)
    rod.damping = rod.damping._replace(angle=float(rod.drive[2]))
    return rod


def shaft_end(whisker: Whisker) -> float:
    """Where the rod ends: at the physical tip, or at s = 0.03 where that is thinner.

    Parameters
    ----------
    whisker : Whisker
        The cone.

    Returns
    -------
    float
        s.
    """
    return max(whisker.tip, _THINNEST)


def rod_shaft(whisker: Whisker, s: Array, settings: Rod) -> RodShaft:
    """The shaft of a whisker with nodes at s.

    Parameters
    ----------
    whisker : Whisker
        The cone.
    s : (N + 1,) array
        Nodes.
    settings : Rod
        Gives its curvature, and whether it is thick.

    Returns
    -------
    RodShaft
        Discretised.
    """
    own = settings.curvature_at(s, whisker.length)
    return shaft(s, whisker.cone_angle, curvature=own, thick=settings.thick)


def _unclamp(rod: RestingRod, follicle: Follicle) -> None:
    """Hand the base to the springs of the follicle, which are drawn so that it stays where it is."""
    load = np.array([rod.work.force_x[-1], rod.work.force_y[-1], rod.work.moment[-1]])
    springs = np.array([follicle.translation, follicle.translation, follicle.rotation])
    rod.drive, rod.follicle = rod.drive + load / springs, follicle


def _first_guess(posture: Posture, s: Array, lift: float, base: Array) -> Array:
    """Eq. (1) above the contact, straight along the flat below it."""
    flat, contact = on_the_flat(posture), posture.contact
    x, y = flat.position(np.maximum(s, contact))
    places = np.stack([x + base[0] + np.minimum(s - contact, 0), y + flat.base[1] + lift], axis=1)
    return np.concatenate([places.ravel(), base[2:]])


def _settle(rod: RestingRod, curved: RodShaft, level: float, way: Array) -> None:
    """Ever longer steps from rest to rest, while curvature, level and the base's way grow, until all is still."""
    nothing = np.zeros((0, rod.state.at.size))
    flat = ground_of(None, 1.0)
    for k in range(_SETTLED):
        grown = min(1.0, (k + 1) / _GROWING)
        rod.shaft = curved._replace(rest_angle=grown * curved.rest_angle)
        before = rod.state.at.copy()
        places = np.array([[0.0, grown * level], [-1.0, grown * level]])
        drive = np.hstack([places, np.tile(rod.drive - (1 - grown) * way, (2, 1))])
        rod.run(flat, drive, min(_LAST, _FIRST * _GROWTH**k), nothing, halvings=0)
        _stop(rod.state)
        if grown == 1 and np.abs(rod.state.at - before).max() < _STILL:
            return
    moved = float(np.abs(rod.state.at - before).max())
    raise ConvergenceError("equilibrium of the rod", moved, _SETTLED)


def _stop(state: RodState) -> None:
    """Bring the rod to rest where it is."""
    for rate in (state.rate, state.rate_before, state.rate_earlier):
        rate[:] = 0.0
    state.before[:] = state.earlier[:] = state.at
    state.totals[:], state.counts[:] = 0.0, 0
