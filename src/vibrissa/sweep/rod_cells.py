"""The cells of a map by the rod: each is a run of the whole whisker over the texture."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.rod.rod_prediction import RodPrediction
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.sweep.grid import Measure
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

_RATE = 10_000.0  # [Hz] of the record: the third resonance has ten samples in a period


def rod_cell(whisker: Whisker, posture: Posture, texture: Gaps, speed: float, measure: Measure, rod: Rod) -> float:
    """What a cell holds, of one run of the rod.

    Parameters
    ----------
    whisker : Whisker
        To its physical tip.
    posture : Posture
        Of the cell.
    texture : Gaps
        Of the map.
    speed : float
        [m/s].
    measure : Measure
        Quantity, ζ and point.
    rod : Rod
        Settings of the rod.

    Returns
    -------
    float
        Over L; NaN where the rod does not come to rest or a step does not converge.

    Raises
    ------
    InputError
        If there is no equilibrium.
    """
    scan = Scan(speed=speed, damping=measure.damping)
    asked = RodPrediction(whisker, posture, texture, scan, n_modes=1, settings=rod)
    last = float(texture.end[-1]) / speed
    if measure.quantity == "peak":
        last += 1 / float(asked.resonances[0])
    try:
        run = asked.run(_RATE, np.array([measure.node]), duration=last)
    except ConvergenceError:
        return np.nan
    met = run.time >= texture.position[0] / speed
    if measure.quantity == "peak":
        return float(np.abs(run.displacement[0, met]).max())
    return float(run.mode_displacement[0, met].std())


def rod_row(
    whisker: Whisker, contact: float, friction: float, base_angle: Array, speed: Array, texture: Gaps, measure: Measure
) -> tuple[Array, Mask]:
    """All base angles and speeds of one contact.

    Parameters
    ----------
    whisker : Whisker
        To its physical tip.
    contact, friction : float
        ε and μ.
    base_angle : (B,) array
        [rad].
    speed : (V,) array
        [m/s].
    texture : Gaps
        Of the map.
    measure : Measure
        Of the map, with the rod's settings.

    Returns
    -------
    values : (V, B) array
        NaN where there is none.
    reachable : (B,) array of bool
        Whether there is an equilibrium.
    """
    values, reachable = np.full((speed.size, base_angle.size), np.nan), np.ones(base_angle.size, bool)
    rod = measure.rod
    if rod is None:
        raise ValueError("the measure has no rod")
    for b, angle in enumerate(base_angle.tolist()):
        try:
            posture = Posture(contact=contact, base_angle=angle, friction=friction)
            values[:, b] = [rod_cell(whisker, posture, texture, v, measure, rod) for v in speed.tolist()]
        except InputError:
            reachable[b] = False
    return values, reachable
