"""A whisker as a rod that rests on the ground: its mesh, its equilibrium, its damping, and its run through time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, RangeError
from vibrissa.mechanics.rod.contact_kernels import Stiffness, Touch, untouched
from vibrissa.mechanics.rod.damping import RodModes, rod_modes, viscous
from vibrissa.mechanics.rod.elastic_kernels import Segments, segments
from vibrissa.mechanics.rod.ground import Ground, ground_of
from vibrissa.mechanics.rod.mesh import REACH, Fineness, graded_nodes
from vibrissa.mechanics.rod.shaft import Shaft, shaft
from vibrissa.mechanics.rod.step_kernels import COLUMNS, Damping, Follicle, State, advance, at_rest
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture, check_tip
from vibrissa.whisker import Whisker

CLAMPED = Follicle()
_FIRST, _GROWTH, _LAST = 0.05, 1.3, 3.0  # steps towards equilibrium, over k: in the end so long that nothing rings
_GROWING = 20  # of them, while curvature and level grow
_SETTLED = 200  # at most
_THINNEST = 0.03  # s at which a shaft ends whose tip is thinner: what lies beyond has 3e-5 of the mass and bears nothing
_LOST = 0.1  # share of steps whose iterations may fail before a run is given up
_STILL = 1e-8  # motion in such a step, over L: a nanometre at most


@dataclass(frozen=True, kw_only=True)
class Rod:
    """What the rod has that the single-contact model has not, and how finely it is computed.

    Attributes
    ----------
    curvature : float
        Intrinsic curvature of the free shaft [1/m]; positive where it bends as a pressed one does, away from the ground
        towards the base.
    edge_radius : float
        Radius of the upper edges of gaps [m].
    thick : bool
        The ground touches the surface of the shaft, whose tip is rounded by its radius; otherwise its midline.
    follicle_translation, follicle_rotation : float
        Stiffness of the follicle against translation of the base, over EI/L³, and against its rotation, over EI/L;
        infinite where it is clamped.
    fineness : Fineness
        Of the mesh.
    step : float
        Longest step in time [s].
    ground : float
        Stiffness of the ground, over force unit and L.
    tolerance : float
        Largest motion of a step's last iteration, over L.
    """

    curvature: float = 0.0
    edge_radius: float = 0.0
    thick: bool = False
    follicle_translation: float = np.inf
    follicle_rotation: float = np.inf
    fineness: Fineness = Fineness()
    step: float = 25e-6
    ground: float = 1e6
    tolerance: float = 1e-7

    def __post_init__(self) -> None:
        if not 0 < self.step <= 1e-3:
            raise RangeError("Rod.step", "must lie in (0, 1 ms]", self.step, "in seconds")
        if not np.isfinite(self.curvature):
            raise RangeError("Rod.curvature", "must be finite (1/m)", self.curvature)
        for name in ("follicle_translation", "follicle_rotation", "ground", "tolerance"):
            if not getattr(self, name) > 0:
                raise RangeError(f"Rod.{name}", "must be positive", getattr(self, name))

    @property
    def follicle(self) -> Follicle:
        """How the base is held."""
        return Follicle(self.follicle_translation, self.follicle_rotation)


class Record(NamedTuple):
    """What was recorded of a run, along time.

    Attributes
    ----------
    projected : (M, T) array
        Projections of the motion from the equilibrium.
    force : (2, T) array
        Of the shaft on the follicle, along x and y, over the force unit.
    moment : (T,) array
        At the base, over force unit and L.
    contact : (9, T) array
        ``Touch.summary``.
    energy : (6, T) array
        Kinetic, elastic, power of viscous damping; work of the ground, work at the base, lost to friction.
    steps, unconverged : int
        Steps in all, and those whose iterations did not end.
    shapes : (T, 2N + 3) array
        Positions; empty where they were not asked for.
    """

    projected: Array
    force: Array
    moment: Array
    contact: Array
    energy: Array
    steps: int
    unconverged: int
    shapes: Array


@dataclass
class RestingRod:
    """A rod in equilibrium under a steady drag of the ground.

    Attributes
    ----------
    whisker : Whisker
        The cone.
    posture : Posture
        As Eq. (1) has it; gives the height of the base.
    shaft : Shaft
        Its discretisation.
    state : State
        At rest.
    touch : Touch
        Its contacts.
    stiffness : Stiffness
        Of the ground, and friction.
    damping : Damping
        For the damping ratio that was asked for.
    drive : (3,) array
        x, y and angle of what holds the base, so that the base itself is where Eq. (1) has it.
    work : Segments
        Forces in the shaft.
    follicle : Follicle
        How the base is held.
    modes : RodModes, optional
        About the equilibrium.
    """

    whisker: Whisker
    posture: Posture
    settings: Rod
    shaft: Shaft
    state: State
    touch: Touch
    stiffness: Stiffness
    damping: Damping
    drive: Array
    work: Segments = field(repr=False)
    follicle: Follicle = CLAMPED
    modes: RodModes | None = None

    def over(self, ground: Ground) -> None:
        """Make room for the edges of a ground; what the nodes remember stays.

        Parameters
        ----------
        ground : Ground
            That comes.
        """
        fresh = untouched(self.shaft.s.size, ground.edge.size)
        self.touch = fresh._replace(node_drag=self.touch.node_drag, node_drag_now=self.touch.node_drag_now)

    def run(
        self,
        ground: Ground,
        drive: Array,
        step: float,
        project: Array,
        *,
        every: int = 1,
        shapes: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> Record:
        """Carry the rod through a drive; it goes on from where it was.

        Parameters
        ----------
        ground : Ground
            Under it.
        drive : (T + 1, 5) array
            As of :func:`vibrissa.mechanics.rod.step_kernels.advance`.
        step : float
            Over k.
        project : (M, 2N + 3) array
            What is recorded of the positions.
        every : int
            Steps for each record.
        shapes : bool
            Record all positions too.
        progress : callable, optional
            Takes the records that are done, and all of them.

        Returns
        -------
        Record
            At every record's end.

        Raises
        ------
        ConvergenceError
            If more than a tenth of the steps do not converge.
        """
        steps = drive.shape[0] - 1
        rows = steps // every
        record = np.zeros((rows, project.shape[0] + COLUMNS))
        kept = np.zeros((rows if shapes else 0, self.state.at.size))
        resting = project @ self.state.at
        chunk = every * max(1, 4000 // every)
        settings = self.settings
        for first in range(0, rows * every, chunk):
            last = min(first + chunk, rows * every)
            lines = slice(first // every, last // every)
            advance(
                self.shaft, ground, self.stiffness, self.damping, self.follicle, drive[first : last + 1], step,
                settings.tolerance, every, project, self.state, self.touch, self.work, record[lines],
                kept[lines] if shapes else kept,
            )  # fmt: skip
            if self.state.counts[1] > _LOST * (first + chunk) or not np.isfinite(self.state.at).all():
                raise ConvergenceError("motion of the rod", float(np.abs(self.state.force).max()), int(self.state.counts[0]))
            if progress is not None:
                progress(lines.stop, rows)
        m = project.shape[0]
        columns = record.T
        return Record(
            projected=columns[:m] - resting[:, None],
            force=columns[m : m + 2],
            moment=columns[m + 2],
            contact=columns[m + 3 : m + 12],
            energy=columns[m + 12 : m + 18],
            steps=rows * every,
            unconverged=int(columns[m + 18, -1]) if rows else 0,
            shapes=kept,
        )


def resting_rod(
    whisker: Whisker,
    posture: Posture,
    *,
    damping: float,
    settings: Rod = Rod(),
    level: float = 0.0,
    reach: float = REACH,
) -> RestingRod:
    """The rod in equilibrium on a flat that drags it away from the base.

    Parameters
    ----------
    whisker : Whisker
        The cone, to its physical tip, or to s = 0.03 where that is thinner.
    posture : Posture
        Its base is held at the height and angle of Eq. (1).
    damping : float
        ζ of the first three modes about the equilibrium.
    settings : Rod
        What else the rod has.
    level : float
        Height of the flat, over L.
    reach : float
        Of the fine part of the mesh to both sides of the contact, over L.

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
    s = graded_nodes(max(whisker.tip, _THINNEST), posture.contact, settings.fineness, reach)
    curved = shaft(s, whisker.cone_angle, curvature=settings.curvature * whisker.length, thick=settings.thick)
    flat, lift = on_the_flat(posture), whisker.cone_angle * posture.contact * settings.thick
    base = np.array([flat.base[0], flat.base[1] + lift, posture.base_angle])
    state = at_rest(_first_guess(posture, s, lift, base))
    stiffness = Stiffness(settings.ground, settings.ground, posture.law)
    touch, work = untouched(s.size, 0), segments(s.size - 1)
    straight = curved._replace(rest_angle=np.zeros_like(s))
    free = Damping(0.0, 0.0, np.zeros((0, state.at.size)), np.zeros(0))
    rod = RestingRod(whisker, posture, settings, straight, state, touch, stiffness, free, base, work)
    _settle(rod, curved, level)
    rod.modes = rod_modes(curved, rod.state.at, stiffness, level, settings.follicle)
    rod.damping = viscous(curved, rod.modes, damping)
    _unclamp(rod, settings.follicle)
    return rod


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


def _settle(rod: RestingRod, curved: Shaft, level: float) -> None:
    """Steps from rest to rest, ever longer, first with the intrinsic curvature and the level growing, until all is still."""
    nothing = np.zeros((0, rod.state.at.size))
    flat = ground_of(None, 1.0)
    for k in range(_SETTLED):
        grown = min(1.0, (k + 1) / _GROWING)
        rod.shaft = curved._replace(rest_angle=grown * curved.rest_angle)
        before = rod.state.at.copy()
        places = np.array([[0.0, grown * level], [-1.0, grown * level]])
        drive = np.hstack([places, np.tile(rod.drive, (2, 1))])
        rod.run(flat, drive, min(_LAST, _FIRST * _GROWTH**k), nothing)
        _stop(rod.state)
        if grown == 1 and np.abs(rod.state.at - before).max() < _STILL:
            return
    moved = float(np.abs(rod.state.at - before).max())
    raise ConvergenceError("equilibrium of the rod", moved, _SETTLED)


def _stop(state: State) -> None:
    """Bring the rod to rest where it is."""
    for rate in (state.rate, state.rate_before, state.rate_earlier):
        rate[:] = 0.0
    state.before[:] = state.earlier[:] = state.at
    state.totals[:], state.counts[:] = 0.0, 0
