"""A whole whisker whose base moves over a surface: it swings through the air, touches, sweeps, leaves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, UnknownError
from vibrissa.mechanics.rod.kernels.ground import Ground, ground_of
from vibrissa.mechanics.rod.rod_model import RestingRod, RodRecord
from vibrissa.mechanics.rod.rod_settings import USUAL_ROD, Rod
from vibrissa.mechanics.whisking.base_motion import BaseMotion
from vibrissa.mechanics.whisking.base_path import BasePath
from vibrissa.mechanics.whisking.swing_start import About, begun
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

_TIGHT = 1e-11  # over L, of the last iteration: a moving shaft's axial force is then found to 1e-4, without it to 0.4


@dataclass(frozen=True)
class SwingRun:
    """A record of a swing.

    Attributes
    ----------
    time : (T,) array
        [s], from the path's first time on.
    place : (3, T) array
        Height of the base over L, its angle [rad] and its travel [m].
    rate, acceleration : (3, T) arrays
        Of them, per second and per second squared.
    surface_distance : float
        Distance from the base to x = 0 of the surface at the path's first time [m].
    level : float
        Height of the ground under the rod's own zero, over L.
    record : RodRecord
        All else; x of the contacts in the frame of the ground.
    tip : (2, T) array
        x in the frame of the ground and height, over L.
    ground : Ground
        Under it.
    drive : (T, 5) array
        Ground and base at the records.
    in_air : bool
        Whether it began in the air.
    about : {"contact", "air"}
        Whose modes have the damping ratio.
    rod : RestingRod
        As the run left it.
    """

    time: Array
    place: Array
    rate: Array
    acceleration: Array
    surface_distance: float
    level: float
    record: RodRecord
    tip: Array
    ground: Ground
    drive: Array
    in_air: bool
    about: About
    rod: RestingRod = field(repr=False)


def swing(
    whisker: Whisker,
    path: BasePath,
    surface: Gaps | HeightProfile,
    *,
    speed: float = 0.0,
    damping: float,
    sampling_rate: float,
    settings: Rod = USUAL_ROD,
    about: About = "contact",
    surface_distance: float | None = None,
    shapes: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> SwingRun:
    """Move the base of a rod over a surface.

    In 25 ms before the path begins the base is brought from rest to the rate with which it begins, so that the record
    does not begin with the ringing of a jerk. A path that begins at rest needs none of this.

    Parameters
    ----------
    whisker : Whisker
        The cone, to its physical tip.
    path : BasePath
        Height, angle and travel of the base. Where it begins the rod is in the air, or at rest on level ground at the
        contact of Eq. (1).
    surface : Gaps or HeightProfile
        It lies still; flat before its beginning and after its end.
    speed : float
        At which the base travels beside the path's own travel, towards growing x of the surface [m/s].
    damping : float
        ζ of the first three modes.
    sampling_rate : float
        Records per second [Hz].
    settings : Rod
        Of the rod.
    about : {"contact", "air"}
        Whose modes have that ratio: those about the posture on level ground where the path begins, or, of one that
        begins in the air, about the posture of the path whose contact is the median; or those of the rod in the air,
        as also where no posture of the path touches.
    surface_distance : float, optional
        Distance along the substrate from the base back to x = 0 of the surface, where the path begins [m]. By default
        x = 0 lies under the contact of Eq. (1), or, in the air, under the tip.
    shapes : bool
        Record the whole shaft too.
    progress : callable, optional
        Takes the records that are done, and all of them.

    Returns
    -------
    SwingRun
        Records from the path's first time to its last.

    Raises
    ------
    InputError
        If a setting is out of range, or the rod begins neither in the air nor at an equilibrium on level ground.
    ConvergenceError
        If the rod does not come to rest, or is lost.
    """
    _check(speed, damping, sampling_rate, about)
    length, timescale = whisker.length, whisker.timescale
    ground = ground_of(surface, length, settings.edge_radius)
    settings = replace(settings, tolerance=min(settings.tolerance, _TIGHT))
    motion = BaseMotion(path, speed, sampling_rate)
    start = begun(whisker, path, motion, ground, damping, settings, about, surface_distance)
    rod, every = start.rod, int(np.ceil(1 / (sampling_rate * settings.step) - 1e-9))
    step = 1 / (sampling_rate * every)
    drive = start.drive(motion, motion.grid(every), length)
    tip = np.zeros((2, rod.state.at.size))
    tip[0, 0] = tip[1, 1] = 1.0
    rod.over(ground)
    origin = tip @ rod.state.at
    record = rod.run(ground, drive, step / timescale, tip, every=every, shapes=shapes, progress=progress)
    first, held = motion.lead - 1, drive[every::every]
    place, rate, acceleration = (part[:, first:] for part in motion.along(motion.grid(1)[1:]))
    return SwingRun(
        time=motion.grid(1)[1:][first:],
        place=place,
        rate=rate,
        acceleration=acceleration,
        surface_distance=start.distance * length,
        level=start.level,
        record=_from(record, first),
        tip=(record.projected + origin[:, None] - held[:, :2].T)[:, first:],
        ground=ground,
        drive=held[first:],
        in_air=start.in_air,
        about=start.about,
        rod=rod,
    )


def _check(speed: float, damping: float, sampling_rate: float, about: str) -> None:
    if not 0 <= damping < 1:
        raise RangeError("damping", "must lie in [0, 1)", damping)
    if not (sampling_rate > 0 and np.isfinite(sampling_rate)):
        raise RangeError("sampling_rate", "must be positive (Hz)", sampling_rate)
    if not abs(speed) <= 10:
        raise RangeError("speed", "must be at most 10 m/s", speed)
    if about not in ("contact", "air"):
        raise UnknownError("about", "must be 'contact' or 'air'", repr(about))


def _from(record: RodRecord, first: int) -> RodRecord:
    """The record without its beginning."""
    cut = {name: getattr(record, name)[..., first:] for name in ("projected", "force", "moment", "contact", "energy")}
    return record._replace(**cut, shapes=record.shapes[first:] if record.shapes.size else record.shapes)
