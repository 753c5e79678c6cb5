"""A surface drawn under the rod: what its modes, its follicle and its contacts do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.exact import cone_kappa
from vibrissa.mechanics.rod.equilibrium import resting_rod
from vibrissa.mechanics.rod.kernels.ground import Ground, ground_of
from vibrissa.mechanics.rod.mesh import REACH
from vibrissa.mechanics.rod.observation import across, fitted_modes
from vibrissa.mechanics.rod.rod_model import RestingRod, RodRecord
from vibrissa.mechanics.rod.rod_settings import USUAL_ROD, Rod
from vibrissa.mechanics.scan.scan_settings import QUICK
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

_WIDER = 1.2  # the fine part of the mesh over the widest gap


@dataclass(frozen=True)
class RodRun:
    """A record of the rod over a surface.

    Attributes
    ----------
    time : (T,) array
        [s]; 0 is the moment x = 0 of the surface meets the contact of Eq. (1).
    mode_displacement : (M, T) array
        Amplitudes of the pinned modes in the motion from the equilibrium, over L: what a movie shows, q + Q(d).
    displacement : (P, T) array
        Along the normal at the points that were asked for, over L.
    record : RodRecord
        All else.
    rod : RestingRod
        As the run left it.
    ground : Ground
        Under it.
    """

    time: Array
    mode_displacement: Array
    displacement: Array
    record: RodRecord
    rod: RestingRod = field(repr=False)
    ground: Ground = field(repr=False)


def drag(
    whisker: Whisker,
    posture: Posture,
    surface: Gaps | HeightProfile,
    *,
    speed: float,
    damping: float,
    start: float = 0.0,
    duration: float,
    sampling_rate: float,
    n_modes: int = 3,
    nodes: Sequence[float] = (),
    settings: Rod = USUAL_ROD,
    height: float = 0.0,
    shapes: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> RodRun:
    """Draw a surface under a rod that was at rest on the flat before it.

    A surface that rises above the flat begins to move where it is clear of the shaft, on the side of the base.

    Parameters
    ----------
    whisker : Whisker
        The cone, to its physical tip.
    posture : Posture
        Its base is held at the height and angle of Eq. (1).
    surface : Gaps or HeightProfile
        It moves away from the base; flat before its beginning and after its end.
    speed : float
        [m/s].
    damping : float
        ζ of the first three modes.
    start, duration : float
        Time of the start, when the rod is in equilibrium, and for how long [s].
    sampling_rate : float
        Records per second [Hz].
    n_modes : int
        Number of pinned modes that are fitted.
    nodes : sequence of float
        Points whose motion is wanted, over L from the tip of the cone.
    settings : Rod
        Of the rod.
    height : float
        Of the surface above the flat on which the posture is that of Eq. (1) [m].
    shapes : bool
        Record the whole shaft too.
    progress : callable, optional
        Takes the records that are done, and all of them.

    Returns
    -------
    RodRun
        Records at start + 1/rate, start + 2/rate, …

    Raises
    ------
    InputError
        If a setting is out of range.
    ConvergenceError
        If the rod does not come to rest.
    """
    if not (sampling_rate > 0 and np.isfinite(sampling_rate)):
        raise RangeError("sampling_rate", "must be positive (Hz)", sampling_rate)
    length, timescale = whisker.length, whisker.timescale
    ground = ground_of(surface, length, settings.edge_radius).raised(height / length)
    rod = resting_rod(
        whisker,
        posture,
        damping=damping,
        settings=settings,
        level=float(ground.y[0]),
        reach=fine_reach(surface, length),
        n_modes=n_modes,
    )
    longest = settings.step * min(1.0, timescale / QUICK)
    every = int(np.ceil(1 / (sampling_rate * longest) - 1e-9))
    step = 1 / (sampling_rate * every)
    at = rod.state.at.copy()
    fit = fitted_modes(rod.shaft.s, at, posture.contact, cone_kappa(posture.contact, n_modes))
    project = np.vstack([fit, across(rod.shaft.s, at, np.asarray(nodes, float))])
    rod.over(ground)

    def drive(first: float, count: int) -> Array:
        travelled = -speed * (first + step * np.arange(count + 1)) / length
        return np.column_stack([travelled, np.zeros(count + 1), np.tile(rod.drive, (count + 1, 1))])

    if before := max(0, int(np.ceil((clear_of(rod, ground) * length / speed + start) / step))):
        rod.run(ground, drive(start - step * before, before), step / timescale, project, every=before)
    led = project @ (rod.state.at - at)  # from the equilibrium to where the record begins
    count = round(duration * sampling_rate) * every
    course = drive(start, count)
    record = rod.run(ground, course, step / timescale, project, every=every, shapes=shapes, progress=progress)
    record = record._replace(projected=record.projected + led[:, None])
    time = start + np.arange(1, record.moment.size + 1) / sampling_rate
    time[np.abs(time) < 1e-9 / sampling_rate] = 0.0
    return RodRun(time, record.projected[:n_modes], record.projected[n_modes:], record, rod, ground)


def clear_of(rod: RestingRod, ground: Ground) -> float:
    """How far the beginning of a surface must be from the contact, so that all of it is below the shaft.

    Parameters
    ----------
    rod : RestingRod
        In equilibrium on the flat.
    ground : Ground
        With the surface.

    Returns
    -------
    float
        Along x, towards the base, over L; 0 if nothing rises above the flat before the surface.
    """
    x, y = rod.state.at[:-1:2], rod.state.at[1:-1:2] - rod.shaft.radius
    low = np.flatnonzero(y <= ground.top)
    if ground.top <= ground.y[0] or not low.size:
        return 0.0
    return max(0.0, float(x[min(low[-1] + 1, x.size - 1)]))


def fine_reach(surface: Gaps | HeightProfile, length: float) -> float:
    """How far from the contact the mesh is fine: over the widest gap.

    Parameters
    ----------
    surface : Gaps or HeightProfile
        In metres.
    length : float
        L [m].

    Returns
    -------
    float
        Over L.
    """
    widest = float(surface.width.max()) if isinstance(surface, Gaps) else 0.0
    return max(REACH, _WIDER * widest / length)
