"""Two supports of the shaft at rest: a gap's near edge, and behind it the far edge or the floor of the gap.

To first order in the deflection. Above the near edge, at s = ε + x, the shaft is that on the flat, turned by Δθ and
lifted by Δy where its contact was; there the bending moment falls by K_θ Δθ + K_y Δy. Between the supports it is a beam
of stiffness s⁴. Both have the same slope and moment at the near edge, and both are on its level there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Mask

POWERS = 6  # of the excursion over the width, by which the turn is described


class Resistance(NamedTuple):
    """What the shaft on the flat resists at its contact.

    Attributes
    ----------
    contact : float
        ε.
    load : float
        Normal force there, over πEα⁴L²/4.
    turn, lift : float
        K_θ and K_y.
    """

    contact: float
    load: float
    turn: float
    lift: float


def two_supports(at: Resistance, place: Array, span: Array, drop: float = 0.0) -> tuple[Array, Array]:
    """Turn and lift of the shaft above two supports.

    Parameters
    ----------
    at : Resistance
        Of the shaft.
    place : array
        x, how far above ε the near edge touches the shaft, over L.
    span : array
        Length of shaft between the supports, over L.
    drop : float
        How much lower the second support is, over L.

    Returns
    -------
    turn, lift : arrays
        Δθ [rad] and Δy over L; both 0 on the flat.
    """
    e, s, x = at.contact, at.contact + place, place
    flexibility, a, b, c, d = _balance(at, place, span)
    moment = at.load * x
    slope = at.load * (1 / (6 * e**2) - 1 / (2 * s**2) + e / (3 * s**3))
    height = at.load * (x / (6 * e**2) + 1 / (2 * s) - e / (6 * s**2) - 1 / (3 * e))
    given, level = flexibility * moment - slope + drop / span, -height
    determinant = a * d - b * c
    return (given * d - b * level) / determinant, (a * level - c * given) / determinant


def _balance(at: Resistance, place: Array, span: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Flexibility of the beam between the supports, and what a turn and a lift do to slope and height at x."""
    e, s, x = at.contact, at.contact + place, place
    end = s - span
    # slope at the near edge per unit of moment there, of the beam between the supports
    flexibility = (_bent(s, end) - _bent(end, end)) / span**2
    # turn and lift of the shaft between ε and s by a unit of moment that is missing there
    once, twice = (e**-3 - s**-3) / 3, x / (3 * e**3) - (e**-2 - s**-2) / 6
    a, b = 1 - (once - flexibility) * at.turn, -(once - flexibility) * at.lift
    c, d = x - twice * at.turn, 1 - twice * at.lift
    return flexibility, a, b, c, d


def too_wide(at: Resistance, width: Array, free_end: float) -> Mask:
    """Gaps over which the shaft on both edges has no stable equilibrium to first order in its deflection.

    Turn and lift grow without bound as the determinant of their balance falls to 0, in gaps of some 0.2 L.

    Parameters
    ----------
    at : Resistance
        Of the shaft.
    width : (J,) array
        Widths λ, over L.
    free_end : float
        Length of shaft beyond ε, over L; beyond it there is nothing that the far edge could bear.

    Returns
    -------
    (J,) array of bool
        Which are too wide.
    """
    return _unbalanced(at, width, _to_the_tip(width, free_end))


def _to_the_tip(width: Array, free_end: float) -> Array:
    """Largest d/λ with the far edge on the shaft; short of the tip, for that of a sharp cone resists no turn."""
    return np.minimum(0.999 * free_end / width, 1.0)


def _unbalanced(at: Resistance, width: Array, reach: Array) -> Mask:
    """Whether the determinant is not positive somewhere from d = 0 to reach λ."""
    place = width[:, None] * (1 - reach[:, None] * np.linspace(0, 1, 2 * POWERS))
    _, a, b, c, d = _balance(at, place, width[:, None])
    return np.asarray((a * d <= b * c).any(axis=1))


def _bent(s: Array, end: Array) -> Array:
    """Antiderivative of (s − end)²/s⁴."""
    return -1 / s + end / s**2 - end**2 / (3 * s**3)


def bridged(at: Resistance, width: Array, free_end: float) -> tuple[Array, Array]:
    """Turn and lift while a gap is bridged, as polynomials in d/λ.

    Parameters
    ----------
    at : Resistance
        Of the shaft.
    width : (J,) array
        Widths λ, over L.
    free_end : float
        Length of shaft beyond ε, over L.

    Returns
    -------
    turn, lift : (J, POWERS) arrays
        Coefficients.
    """
    # a shaft without an end is as smooth as the real one, unless it loses its balance beyond the tip
    whole = np.ones(len(width))
    reach = np.where(_unbalanced(at, width, whole), _to_the_tip(width, free_end), whole)[:, None]
    share, powers = np.linspace(0, 1, 2 * POWERS), np.arange(POWERS)
    fit = np.linalg.pinv(share[:, None] ** powers)
    found = two_supports(at, width[:, None] * (1 - reach * share), width[:, None])
    turn, lift = (values @ fit.T / reach**powers for values in found)
    return turn, lift


def on_the_floor(
    at: Resistance, width: Array, free_end: float, depth: float, compliance: float
) -> tuple[Array, Array, float]:
    """Turn and lift while the tip rests on the floor of a gap, as polynomials in d/λ of the far edge.

    Parameters
    ----------
    at : Resistance
        Of the shaft.
    width : (J,) array
        Widths λ, over L.
    free_end : float
        Length of shaft beyond ε, over L.
    depth : float
        Of the gaps, over L.
    compliance : float
        |dθ_ε/dd| on an edge [rad per L].

    Returns
    -------
    turn, lift : (J, POWERS) arrays
        Coefficients; 0 where the tip does not come to the floor.
    place : float
        x below which it does not rest there, over L: half the depth is out of reach at twice the turn of statics.
    """
    turn, lift = np.zeros((2, len(width), POWERS))
    least = float(np.sqrt(free_end**2 / 4 + depth / (2 * compliance)) - free_end / 2)
    some = np.flatnonzero(width - free_end > 1.02 * least)
    if not some.size:
        return turn, lift, least
    wide, part = width[some, None], np.linspace(0, 1, 2 * POWERS)
    first, reach = free_end / wide, 1 - (least + free_end) / wide
    place = wide * (1 - first - reach * part)
    fit = np.linalg.pinv(part[:, None] ** np.arange(POWERS))
    for out, values in zip((turn, lift), two_supports(at, place, free_end + place, depth), strict=True):
        out[some] = _shifted(values @ fit.T, -first / reach, 1 / reach)
    return turn, lift, least


def _shifted(series: Array, place: Array, rate: Array) -> Array:
    """Powers of u of Σ_k series[k] (place + rate u)^k, (J, n)."""
    out = np.zeros_like(series)
    for k in range(series.shape[1] - 1, -1, -1):
        out = np.concatenate([place * out[:, :1], place * out[:, 1:] + rate * out[:, :-1]], axis=1)
        out[:, 0] += series[:, k]
    return out
