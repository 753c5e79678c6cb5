"""How far the model's assumptions hold along a path of postures: the whisker's own weight, lift-off, sticking."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.modes.shift import resonance_shift
from vibrissa.mechanics.quasi_static.response_rows import FOLLICLE
from vibrissa.mechanics.scan.diagnostics import own_weight
from vibrissa.mechanics.whisking.slow_prediction import SlowPrediction
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr


def path_diagnostics(prediction: SlowPrediction, t: Array) -> xr.Dataset:
    """How far the assumptions of a prediction hold along its path; one beyond the fold has been refused.

    Parameters
    ----------
    prediction : SlowPrediction
        To be judged.
    t : (T,) array
        Times at which the contact is looked at [s], ascending.

    Returns
    -------
    Dataset
        ``free_end_length``, the shortest at a jump [m], ``jump_count``, ``jumps_allowed`` and their share;
        ``weight_ratio``, the largest own weight over contact force; ``lift_off`` and ``slip_reversed``, shares of the
        times; ``resonance_ratio`` and ``growth_rate`` (contact_law, mode) where the base is steepest. Names as of
        :func:`vibrissa.mechanics.scan.diagnostics.diagnostics`.
    """
    path = prediction.path
    steepest = float(t[path.spline(t)[1].argmax()])
    shift = resonance_shift(path.at(steepest), prediction.table.n_modes)
    force = _resting_load(prediction, t) / np.cos(np.arctan(path.friction))
    return dataset(
        {"response": prediction.scan.response, "modes": "straight"},
        lead=("contact_law",),
        contact_law=shift.contact_law.values,
        mode=shift.mode.values,
        resonance_ratio=shift.resonance_ratio.values,
        growth_rate=shift.growth_rate.values,
        **prediction.free_end,
        weight_ratio=own_weight(prediction.whisker) / force.min(),
        lift_off=np.mean(prediction.contact_load(t) <= 0),
        slip_reversed=np.mean(contact_slip(prediction, t) <= 0),
    )


def contact_slip(prediction: SlowPrediction, t: Array) -> Array:
    """Speed of the contact of the vibrating shaft over the ground, over that of the contact at rest.

    Parameters
    ----------
    prediction : SlowPrediction
        The motion.
    t : (T,) array
        Times [s], ascending.

    Returns
    -------
    (T,) array
        Where it is not positive, the contact would stick.
    """
    advance, rows = prediction.advance, prediction.table.rows
    along = np.einsum("it,it->t", advance.slow(t)[rows.along], prediction.vibration(t)[1])
    return np.asarray(1 + prediction.whisker.length * along / advance.pace(t))


def _resting_load(prediction: SlowPrediction, t: Array) -> Array:
    """Vertical load on the contact of the moment's profile on the flat, at rest, over πEα⁴L²/4, (T,)."""
    rows = prediction.table.respond(prediction.path.spline(t), np.zeros(t.shape))
    return np.asarray(rows[prediction.table.n_modes + FOLLICLE.index("contact_load")])
