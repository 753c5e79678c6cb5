"""The contact law: the direction of the contact force on the whisker, and its derivatives.

At the contact the ground presses on the whisker with N along the whisker's normal and drags it with T towards the
tip. The force Λ = √(N² + T²) is inclined to the normal by φ, tan φ = T/N. Everything else in the package takes the
direction and its derivatives from this file.

Loads are scaled by the local radius: Λ̂ = Λ/ε² and N̂ = N/ε², because the cone looks the same from every contact
once lengths are measured in ε. A law without a length of its own therefore gives T/N as a function of N̂ alone, and
the solutions of Eq. 1 stay a family of one parameter, Λ̂.

A new law is one function of (law, N̂) that returns T/N and its derivative by ln N̂, as :func:`coulomb` does; its
constants become fields of :class:`ContactLaw`, and :func:`friction_ratio` calls it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array
from vibrissa.loops import njit

Direction = tuple[float, float, float, float]

_ITERATIONS = 60
_ROUNDING = 4e-16  # last step of Newton's method in ln N̂


class ContactLaw(NamedTuple):
    """Constants of the contact.

    Attributes
    ----------
    friction : float
        Coefficient of friction μ [1].
    adhesion : float
        Strength b of the adhesive friction of :func:`hertzian` [1]; 0 for Coulomb's law.
    """

    friction: float
    adhesion: float = 0.0


MOST_FRICTION = 2.0  # [1] dry rubber and skin reach it


def friction_remarks(friction: float) -> list[str]:
    """What to know of a coefficient of friction outside 0 to 2.

    Parameters
    ----------
    friction : float
        μ [1].

    Returns
    -------
    list of str
        One line, or none.
    """
    if friction < 0:
        return [f"friction {friction:g} is negative: the surface then moves towards the base, not away from it"]
    if friction > MOST_FRICTION:
        return [f"friction {friction:g} is above {MOST_FRICTION:g}, which no dry surface is known to reach"]
    return []


@njit(cache=True, nogil=True, error_model="numpy")
def coulomb(law: ContactLaw, normal: float) -> tuple[float, float]:
    """Coulomb's law, T = μN: T/N and its derivative by ln N̂.

    Parameters
    ----------
    law : ContactLaw
        μ.
    normal : float
        Normal load N̂, over πEα⁴L²ε²/4.

    Returns
    -------
    tuple of 2 floats
        T/N and dT/N by ln N̂, which is 0.
    """
    return law.friction, 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def hertzian(law: ContactLaw, normal: float) -> tuple[float, float]:
    """Friction of an adhesive elastic contact, T = μN + τA: T/N and its derivative by ln N̂.

    The two terms are those of [Adams2007]_ for skin: friction in proportion to the load, and a junction of area A that
    shears at the stress τ. For one elastic contact A grows as N^{2/3} ([Archard1957]_, after Hertz). With the shaft's
    own radius αεL, A = π (3αεLN/4E*)^{2/3}, so that T/N = μ + b N̂^{−1/3} with
    b = π^{2/3} (9/4)^{1/3} τ E*^{−2/3} E^{−1/3} α^{−2/3}.

    Parameters
    ----------
    law : ContactLaw
        μ and b.
    normal : float
        Normal load N̂, over πEα⁴L²ε²/4.

    Returns
    -------
    tuple of 2 floats
        T/N, and its derivative by ln N̂.
    """
    adhesive = law.adhesion * normal ** (-1 / 3)
    return law.friction + adhesive, -adhesive / 3


@njit(cache=True, nogil=True, error_model="numpy")
def friction_ratio(law: ContactLaw, normal: float) -> tuple[float, float]:
    """T/N of a law at the normal load N̂, and its derivative by ln N̂.

    Parameters
    ----------
    law : ContactLaw
        The law.
    normal : float
        Normal load N̂.

    Returns
    -------
    tuple of 2 floats
        T/N, and its derivative by ln N̂.
    """
    if law.adhesion == 0:
        return coulomb(law, normal)
    return hertzian(law, normal)


@njit(cache=True, nogil=True, error_model="numpy")
def inclination(law: ContactLaw, load: float) -> tuple[float, float]:
    """Angle φ of the contact force to the whisker's normal, and dφ/d ln Λ̂, at the load Λ̂.

    N̂ √(1 + (T/N)²) = Λ̂ is solved for ln N̂ by Newton's method.

    Parameters
    ----------
    law : ContactLaw
        The law.
    load : float
        Contact force Λ̂ = Λ/ε², over πEα⁴L²/4.

    Returns
    -------
    tuple of 2 floats
        φ [rad], 0 or more where μ is, and dφ/d ln Λ̂ [rad].
    """
    normal = load
    for _ in range(_ITERATIONS):
        ratio, slope = friction_ratio(law, normal)
        square = 1 + ratio**2
        if slope == 0:
            break  # the direction does not depend on the load
        step = np.log(normal / load * np.sqrt(square)) * square / (square + ratio * slope)
        normal *= np.exp(-step)
        if abs(step) < _ROUNDING:
            break
    return np.arctan(ratio), slope / (square + ratio * slope)


@njit(cache=True, nogil=True, error_model="numpy")
def direction(law: ContactLaw, load: float) -> Direction:
    """Components of the contact force Λ̂ over Λ̂, and their derivatives by Λ̂ itself.

    Parameters
    ----------
    law : ContactLaw
        The law.
    load : float
        Λ̂, positive.

    Returns
    -------
    tuple of 4 floats
        cos φ (along the normal), sin φ (along the shaft towards the tip), d(Λ̂ cos φ)/dΛ̂ and d(Λ̂ sin φ)/dΛ̂.
    """
    phi, rate = inclination(law, load)
    cos, sin = np.cos(phi), np.sin(phi)
    return cos, sin, cos - rate * sin, sin + rate * cos


@njit(cache=True, nogil=True, error_model="numpy")
def across(along_normal: float, along_shaft: float, cos: float, sin: float) -> float:
    """Part of the contact force across the shaft where it is turned by ψ from the contact: Λ cos(φ − ψ).

    Parameters
    ----------
    along_normal, along_shaft : float
        Parts of the force at the contact.
    cos, sin : float
        Of ψ.

    Returns
    -------
    float
        The part across, in the unit of the parts.
    """
    return along_normal * cos + along_shaft * sin


@njit(cache=True, nogil=True, error_model="numpy")
def _inclinations(law: ContactLaw, load: Array, out: Array) -> None:
    for i in range(load.size):
        out[i] = inclination(law, load[i])[0]


def inclinations(law: ContactLaw, load: ArrayLike) -> Array:
    """Angles φ [rad] at many loads Λ̂, of the shape of ``load``.

    Parameters
    ----------
    law : ContactLaw
        The law.
    load : array_like
        Λ̂.

    Returns
    -------
    array
        φ [rad].
    """
    loads = np.asarray(load, float)
    out = np.empty(loads.size)
    _inclinations(law, np.ascontiguousarray(loads.ravel()), out)
    return out.reshape(loads.shape)


def follicle_forces(force: Array | float, base_to_force: Array | float) -> tuple[Array, Array]:
    """Parts of the contact force that the follicle bears.

    Parameters
    ----------
    force : float or array
        Λ over πEα⁴L²/4.
    base_to_force : float or array
        θ_b − φ − θ_ε [rad]: from the normal at the base to the force.

    Returns
    -------
    tuple of arrays
        Along the normal n(1) at the base, and along the shaft into the follicle.
    """
    return np.asarray(force * np.cos(base_to_force)), np.asarray(force * np.sin(base_to_force))


def lever(inclined: Array | float, distance: Array | float, height: Array | float) -> Array:
    """Lever of the contact force about the base, D cos(φ + θ_ε) + H sin(φ + θ_ε), over L.

    Parameters
    ----------
    inclined : float or array
        φ + θ_ε [rad], the angle of the force to the vertical.
    distance, height : float or array
        D and H of the base from the contact, over L.

    Returns
    -------
    array
        Over L; times Λ it is the moment at the base.
    """
    return np.asarray(distance * np.cos(inclined) + height * np.sin(inclined))


class SlidingFriction(NamedTuple):
    """How the friction of a sliding contact changes when the contact is disturbed.

    Attributes
    ----------
    by_normal : float
        ∂T/∂N at a fixed place on the shaft [1].
    by_place : float
        ∂T/∂ε at a fixed N, over πEα⁴L²/4.
    """

    by_normal: float
    by_place: float


def sliding_friction(law: ContactLaw, load: float, contact: float) -> SlidingFriction:
    """Derivatives of the friction T(N, ε) = N r(N/ε²) of a contact that slides.

    Parameters
    ----------
    law : ContactLaw
        The law, r = T/N.
    load, contact : float
        Λ̂, and ε over L.

    Returns
    -------
    SlidingFriction
        Derivatives of T.
    """
    normal = load * float(np.cos(inclination(law, load)[0]))
    ratio, slope = friction_ratio(law, normal)
    return SlidingFriction(ratio + slope, -2 * slope * normal * contact)
