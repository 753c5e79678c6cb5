"""How far a gap moves the contact along the shaft."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.quasi_static.projection import profiles
from vibrissa.mechanics.scan.texture_prediction import Prediction


def contact_travel(prediction: Prediction) -> Array:
    """How far the contact moves along the shaft in each gap, (J,), over L.

    The far edge carries it towards the tip until the jump at d₂, and the near one takes it up the shaft, at d₂ − λ:
    ε falls with d, so that the travel is ε(d₂ − λ) − ε(d₂).

    Parameters
    ----------
    prediction : Prediction
        Over gaps.

    Returns
    -------
    (J,) array
        Over L, positive up the shaft.

    Raises
    ------
    InputError
        If the posture cannot follow as far.
    """
    flat, (before, after) = prediction.response.flat, prediction.events.gaps
    excursions = np.concatenate([after, before])
    contact = np.empty(excursions.size)
    for side in (excursions < 0, excursions >= 0):  # outwards, so that each profile is near the one before
        outwards = np.flatnonzero(side)[np.argsort(np.abs(excursions[side]))]
        contact[outwards] = profiles(flat, excursions[outwards], np.array([flat.contact, 1.0])).unknowns[:, 0]
    return np.asarray(contact[: after.size] - contact[after.size :])
