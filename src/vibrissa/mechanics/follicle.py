"""What the follicle feels: curvature and moment at the base (Eq. 16)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.exact import cone_modes

if TYPE_CHECKING:
    from vibrissa.whisker import Whisker

Array = NDArray[np.float64]


def base_curvature(whisker: Whisker, kappa: Array, contact: float, amplitude: Array) -> Array:
    """Curvature of the vibration at the base.

    Eq. (16) of [Boubenec2014]_: C(t) = u''(1)/L = (1/L) Σ_i q_i(t) V_i''(1); the quasi-static part is left out.

    Parameters
    ----------
    whisker : Whisker
        Gives L.
    kappa : (M,) array
        Frequencies of the modes.
    contact : float
        Position ε of the contact, over L.
    amplitude : (M, T) array
        Vibration amplitudes q, over L.

    Returns
    -------
    (T,) array
        Curvature [1/m], positive where the shaft bends away from the substrate.
    """
    bending = cone_modes(kappa, contact, np.ones(1), derivative=2)[:, 0]
    return bending @ amplitude / whisker.length


def base_moment(whisker: Whisker, curvature: Array) -> Array:
    """Bending moment at the base, M = E (π/4) b⁴ C with the base radius b = αL.

    Parameters
    ----------
    whisker : Whisker
        Gives E and b.
    curvature : (T,) array
        Curvature at the base [1/m].

    Returns
    -------
    (T,) array
        Moment [N m], of the sign of the curvature.
    """
    return whisker.youngs_modulus * np.pi / 4 * whisker.base_radius**4 * curvature
