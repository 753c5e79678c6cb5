"""What a decomposition with a wrong contact takes for other modes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.modes import check_contact

Array = NDArray[np.float64]


def leakage(contact: float, assumed: float, s: Array, *, n_modes: int = 3, extra_modes: int = 2) -> Array:
    """Amplitude that is found in one mode for a unit of another, where the contact stands elsewhere than assumed.

    Least squares over the nodes, weighted by s² as the modes' orthogonality is. Mode 1 is the largest, so its leak into
    modes 2 and 3 counts: with all nodes seen −3.0 δ and +1.5 δ of it, for a small error δ of any ε from 0.15 to 0.4.

    Parameters
    ----------
    contact, assumed : float
        True ε, and the ε that the decomposition takes, over L.
    s : (N,) array
        Nodes seen; those below the assumed contact are left out. Beyond the true one the shaft is straight.
    n_modes, extra_modes : int
        Modes told, and modes above them that take part.

    Returns
    -------
    (n_modes, n_modes) array
        Rows: mode found; columns: mode that moved. The unit matrix where both contacts are the same.

    Raises
    ------
    InputError
        If a contact is out of range.
    """
    check_contact(contact)
    check_contact(assumed)
    s = s[(s >= assumed) & (s <= 1)]
    count = n_modes + extra_modes
    shapes = cone_modes(cone_kappa(assumed, count), assumed, s)
    kappa = cone_kappa(contact, n_modes)
    slope = cone_modes(kappa, contact, np.array([contact]), derivative=1)
    moved = cone_modes(kappa, contact, np.maximum(s, contact)) + slope * np.minimum(s - contact, 0)
    return np.asarray(np.linalg.lstsq((shapes * s).T, (moved * s).T)[0][:n_modes])
