"""Where a swing begins: the rod in the air or at rest on level ground, its mesh and its damping."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, InputError, RangeError
from vibrissa.mechanics.rod.equilibrium import resting_rod, rod_shaft, shaft_end
from vibrissa.mechanics.rod.free_rod import clear_of, damped_in_air, free_rod, free_shape
from vibrissa.mechanics.rod.kernels.ground import Ground
from vibrissa.mechanics.rod.kernels.shaft import RodShaft
from vibrissa.mechanics.rod.kernels.state import Damping
from vibrissa.mechanics.rod.mesh import REACH, graded_nodes
from vibrissa.mechanics.rod.rod_model import RestingRod
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.base_motion import BaseMotion
from vibrissa.mechanics.whisking.base_path import BasePath
from vibrissa.whisker import Whisker

About = Literal["contact", "air"]
_LOOKED_AT = 60  # postures of a path
_ABOUT = 5e-3  # over L: how far about contact and free end the ground is level under a rod at rest
_BEYOND = 2e-4  # over L: a contact that is nearer to the tip than this does not hold


@dataclass(frozen=True)
class Start:
    """The rod where its motion begins.

    Attributes
    ----------
    rod : RestingRod
        In the air or at rest.
    in_air : bool
        Which of the two.
    distance : float
        From the base to x = 0 of the surface where the path begins, over L.
    level : float
        Height of the ground at the beginning, over L: zero of the rod's own frame.
    about : {"contact", "air"}
        Whose modes have the damping ratio: in the air where the path touches level ground nowhere.
    """

    rod: RestingRod
    in_air: bool
    distance: float
    level: float
    about: About

    def drive(self, motion: BaseMotion, time: Array, length: float) -> Array:
        """Ground and base at each time, in a frame that goes along at the first rate of travel.

        Parameters
        ----------
        motion : BaseMotion
            Of the base.
        time : (T,) array
            [s].
        length : float
            L [m].

        Returns
        -------
        (T, 5) array
            As :func:`vibrissa.mechanics.rod.kernels.step_kernels.advance` takes it.
        """
        place, rate, _ = motion.along(time)
        moved = place - place[:, :1]
        swerve = (moved[2] - rate[2, 0] * (time - time[0])) / length
        base = self.rod.drive[:, None] + np.stack([swerve, moved[0], moved[1]])
        ground = base[0] - self.distance - place[2] / length
        return np.column_stack([ground, np.full(time.size, -self.level), *base])


def begun(
    whisker: Whisker,
    path: BasePath,
    motion: BaseMotion,
    ground: Ground,
    damping: float,
    settings: Rod,
    about: About,
    surface_distance: float | None,
) -> Start:
    """The rod at the first moment, in the air or at rest.

    Parameters
    ----------
    whisker, path, motion, ground, damping, settings, about, surface_distance
        As of :func:`vibrissa.mechanics.whisking.swing.swing`.

    Returns
    -------
    Start
        Ready to run.

    Raises
    ------
    InputError
        If the rod is neither in the air nor at an equilibrium on level ground.
    """
    if settings.hold_contact:
        remedy = "the path says where the base is"
        raise ConflictError("Rod.hold_contact", "must be left out where the base moves", remedy=remedy)
    level = float(ground.y[0])
    touching = _touching(whisker, path, level)
    s = _nodes(whisker, path, touching, ground, settings)
    curved = rod_shaft(whisker, s, settings)
    distance = _distance(path, curved, level) if surface_distance is None else surface_distance / whisker.length
    height, angle, travel = motion.along(motion.grid(1)[:1])[0][:, 0]
    base = np.array([0.0, height - level, angle])
    shift = np.array([-distance - travel / whisker.length, -level])
    in_air = clear_of(ground, shift, curved, free_shape(curved, base))
    if in_air:
        posture = touching[len(touching) // 2] if touching else _any_posture(path)
        rod = free_rod(whisker, posture, s, base, _undamped(s.size), settings)
        if touching and about == "contact":
            rod.damping = resting_rod(whisker, posture, damping=damping, settings=settings, nodes=s).damping
            return Start(rod, True, distance, level, "contact")
        rod.damping = damped_in_air(rod, damping)
        return Start(rod, True, distance, level, "air")
    posture = _resting_posture(whisker, height - level, angle, path.friction)
    _refuse_uneven(ground, shift[0] + float(on_the_flat(posture).base[0]), posture, whisker)
    rod = resting_rod(whisker, posture, damping=damping, settings=settings, nodes=s)
    if about == "air":
        rod.damping = damped_in_air(rod, damping)
    return Start(rod, False, distance, level, about)


def _touching(whisker: Whisker, path: BasePath, level: float) -> list[Posture]:
    """Postures of Eq. (1) on level ground along the path that the shaft reaches, by rising contact."""
    found = []
    for height, angle, _ in path.spline(np.linspace(path.time[0], path.time[-1], _LOOKED_AT)).T:
        try:
            posture = Posture.at_height(float(height) - level, float(angle), path.friction)
        except InputError:
            continue
        if posture.contact > shaft_end(whisker) + _BEYOND:
            found.append(posture)
    return sorted(found, key=lambda posture: posture.contact)


def _nodes(whisker: Whisker, path: BasePath, touching: list[Posture], ground: Ground, settings: Rod) -> Array:
    """Mesh that is fine wherever a contact may be: from the tip, if it leaves level ground, to the highest one."""
    end, level = shaft_end(whisker), float(ground.y[0])
    even = len(touching) == _LOOKED_AT and np.ptp(ground.y) == 0
    raised = touching if ground.top == level else _touching(whisker, path, ground.top)
    contacts = [posture.contact for posture in (*touching, *raised)] or [end + 2 * REACH]
    low, high = (min(contacts) if even else end + _BEYOND), max(contacts)
    return graded_nodes(end, (low + high) / 2, settings.fineness, (high - low) / 2 + REACH)


def _distance(path: BasePath, curved: RodShaft, level: float) -> float:
    """From the base to the contact of Eq. (1) where the path begins, or to what is under the tip."""
    height, angle, _ = path.spline(path.time[0])
    try:
        return float(on_the_flat(Posture.at_height(float(height) - level, float(angle), path.friction)).base[0])
    except InputError:
        return -float(free_shape(curved, np.array([0.0, height - level, angle]))[0])


def _any_posture(path: BasePath) -> Posture:
    """Of a path that never touches level ground: only its friction counts."""
    return Posture(contact=0.5, base_angle=1.0, friction=path.friction)


def _undamped(nodes: int) -> Damping:
    return Damping(0.0, 0.0, np.zeros((0, 2 * nodes + 1)), np.zeros(0))


def _resting_posture(whisker: Whisker, height: float, angle: float, friction: float) -> Posture:
    remedy = "let it begin in the air, or where the shaft above its tip rests on level ground"
    try:
        posture = Posture.at_height(float(height), float(angle), friction)
    except InputError as refused:
        raise RangeError("BasePath", "must begin in the air or at an equilibrium", str(refused), remedy) from None
    if posture.contact <= shaft_end(whisker):
        found = f"contact {posture.contact:.4g} beyond the tip at {whisker.tip:.4g}"
        raise RangeError("BasePath", "must not begin where the tip alone touches", found, remedy)
    return posture


def _refuse_uneven(ground: Ground, origin: float, posture: Posture, whisker: Whisker) -> None:
    """The rest is on level ground; ``origin`` is that of the surface from the contact."""
    free_end = posture.contact - shaft_end(whisker)
    under = (ground.x + origin > -free_end - _ABOUT) & (ground.x + origin < _ABOUT)
    if (ground.y[under] != ground.y[0]).any():
        remedy = "let it begin in the air, or farther from what is not level (surface_distance, travel)"
        raise RangeError("BasePath", "must begin in the air or on level ground", "uneven ground", remedy)
