"""What the follicle feels: curvature, bending moment and forces at the base (Eq. 16)."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.scan.motion import PredictedMotion
from vibrissa.whisker import Whisker

PARTS = ("", "_quasi_static", "_vibration")


def base_curvature(whisker: Whisker, bending: Array, amplitude: Array) -> Array:
    """Curvature of the vibration at the base.

    Eq. (16) of [Boubenec2014]_: C(t) = u''(1)/L = (1/L) Σ_i q_i(t) V_i''(1); the quasi-static part is left out.

    Parameters
    ----------
    whisker : Whisker
        Gives L.
    bending : (M,) array
        V_i''(1), or ϑ_i'(1) of modes about the curved profile.
    amplitude : (M, T) array
        Vibration amplitudes q, over L.

    Returns
    -------
    (T,) array
        Curvature [1/m], positive where the shaft bends away from the substrate.
    """
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


def force_unit(whisker: Whisker) -> float:
    """Unit of force of the model, πEα⁴L²/4 [N].

    Parameters
    ----------
    whisker : Whisker
        Gives E, α and L.

    Returns
    -------
    float
        The unit [N].
    """
    return float(np.pi / 4 * whisker.youngs_modulus * whisker.cone_angle**4 * whisker.length**2)


def follicle_signals(prediction: PredictedMotion, t: Array) -> dict[str, Array]:
    """Curvature, moment and forces at the base and their rates, whole and apart, at times t [s].

    The quasi-static part is whole: the posture on the flat and what the excursion changes of it. Its rate has no value
    where the contact jumps; what is given is that of the ramp which begins there. Straight modes carry no axial
    vibration: that part, and with it the whole, is then not modelled and NaN; modes about the curved profile do.

    In the exact response the point of the shaft that stood at ε leaves the ground as the edge slides on, which no
    pinned mode follows: Q_i falls only as 1/i, and the first millisecond after a jump of curvature, moment and force
    grows with the number of modes. It is the burst of a band that ends at the highest mode taken.

    Parameters
    ----------
    prediction : PredictedMotion
        Any prediction.
    t : (T,) array
        Times [s], ascending.

    Returns
    -------
    dict of (T,) arrays
        ``base_curvature`` [1/m], ``base_moment`` [N m], ``transverse_force`` [N] along n(1), ``axial_force`` [N] into
        the follicle, each also with ``_quasi_static`` and ``_vibration``; ``…_rate`` of each [1/s more].
    """
    whisker, basis = prediction.whisker, prediction.response.basis
    unit, n = force_unit(whisker), len(basis.kappa)
    drive, rates = prediction.drive(t)[n:], prediction.drive.rate(t)[n:]
    signals: dict[str, Array] = {}
    for end, q, steady in zip(("", "_rate"), prediction.vibration(t), (drive, rates), strict=True):
        bending = base_curvature(whisker, basis.base_curvature, q)
        slow = steady[0] / whisker.length
        _put(signals, "base_curvature", end, slow, bending)
        _put(signals, "base_moment", end, base_moment(whisker, slow), base_moment(whisker, bending))
        _put(signals, "transverse_force", end, unit * steady[1], unit * basis.transverse_force @ q)
        _put(signals, "axial_force", end, unit * steady[2], unit * basis.axial_force @ q)
    return signals


def _put(signals: dict[str, Array], name: str, end: str, slow: Array, vibration: Array) -> None:
    for part, values in zip(PARTS, (slow + vibration, slow, vibration), strict=True):
        signals[name + part + end] = values
