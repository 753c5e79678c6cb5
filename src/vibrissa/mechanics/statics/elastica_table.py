"""Many equilibria on the flat at once, read from one table per friction.

The scaled problem (x⁴ψ')' = Λ̂ cos(φ − ψ), ψ(1) = ψ'(1) = 0 has one parameter, Λ̂. Measured by the angle that it would
give at the base of a linear beam, p = Λ̂ σ cos φ with σ = 1/6 − ε²/2 + ε³/3, the load and all that follows are
analytic in (ε, p) on the closed square, ε = 0 and ε = 1 included: at ε = 0 the series of ψ has no ε¹ term, so H and D
hold no ln ε. Some 28 × 24 Chebyshev polynomials then hold every posture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array, Mask
from vibrissa.errors import ConvergenceError, RangeError, ShapeError
from vibrissa.mechanics.statics.chebyshev import chebyshev_sum
from vibrissa.mechanics.statics.contact_law import ContactLaw, inclination, lever
from vibrissa.mechanics.statics.elastica_family import RUNGS, Family, family

_FRICTION = 1000.0  # largest |μ| that the last degrees resolve
_BLOCK = 1024  # postures at once: their tables stay in the cache
_TOLERANCE = 1e-12
_ITERATIONS = 60


class Equilibria(NamedTuple):
    """Equilibria on the flat, one per posture.

    Attributes
    ----------
    contact : (N,) array
        Contact ε over L [1].
    contact_force : (N,) array
        Λ in units of πEα⁴L²/4 [1].
    base_distance, contact_distance : (N,) array
        H and D over L [1].
    force_slope, height_slope : (N,) array
        ∂Λ/∂θ_b and ∂H/∂θ_b at fixed ε [1/rad].
    """

    contact: Array
    contact_force: Array
    base_distance: Array
    contact_distance: Array
    force_slope: Array
    height_slope: Array


def _load(table: Family, basis: Array, base_angle: Array) -> tuple[Array, Array, Mask]:
    """Load p that gives θ_b, ∂θ_b/∂p, and whether θ_b is in reach; out of reach, p at the largest angle.

    Bracketed between two rungs, on the first rise of ψ with the load, then by Newton's method inside.
    """
    angles = basis @ table.rungs
    above = angles >= base_angle[:, None]
    reached: Mask = np.any(above, axis=1)
    top = np.where(reached, above.argmax(axis=1), angles.argmax(axis=1))
    row = np.arange(len(top))
    low, high = angles[row, top - 1], angles[row, top]
    goal = np.where(reached, base_angle, high)
    step = table.load_max / (RUNGS - 1)
    left, right = step * (top - 1), step * top
    p = left + step * (goal - low) / (high - low)
    psi = np.ascontiguousarray((basis @ table.psi).T)
    derivative = table.in_load.derivative(psi)
    floor = _TOLERANCE * np.abs(psi).sum(axis=0)
    for _ in range(_ITERATIONS):
        z = table.in_load.unit(p)
        value = chebyshev_sum(z, psi)
        slope = value + p * chebyshev_sum(z, derivative)
        miss = p * value - goal
        newton = p - miss / slope
        if np.all(np.abs(miss) <= floor * p):
            return np.clip(newton, left, right), slope, reached
        left, right = np.where(miss < 0, p, left), np.where(miss < 0, right, p)
        p = np.where((newton >= left) & (newton <= right), newton, (left + right) / 2)
    raise ConvergenceError("load on the flat", float(np.abs(miss).max()), _ITERATIONS)


def _solve(table: Family, contact: Array, base_angle: Array) -> tuple[Equilibria, Mask]:
    """Equilibria of one block, and which postures are in reach."""
    basis = table.in_contact.polynomials(contact)
    p, slope, reached = _load(table, basis, base_angle)
    z, free = table.in_load.unit(p), 1 - contact
    polynomial = np.ascontiguousarray((basis @ table.height).T)
    height = chebyshev_sum(z, polynomial)
    rise = height + p * chebyshev_sum(z, table.in_load.derivative(polynomial))
    distance = chebyshev_sum(z, (basis @ table.distance).T)
    force = contact**2 * np.hypot(1, table.friction) / (free**2 * (1 + 2 * contact) / 6)  # Λ/p = ε²/(σ cos φ)
    found = contact, force * p, free * p * height, free * distance, force / slope, free * rise / slope
    return Equilibria(*found), reached


def _solve_all(table: Family, contact: Array, base_angle: Array) -> tuple[Equilibria, Mask]:
    cuts = range(0, max(len(contact), 1), _BLOCK)
    blocks = [_solve(table, contact[i : i + _BLOCK], base_angle[i : i + _BLOCK]) for i in cuts]
    columns = (np.concatenate(column) for column in zip(*(block for block, _ in blocks), strict=True))
    return Equilibria(*columns), np.concatenate([reached for _, reached in blocks])


def _largest_angle(table: Family, contact: float) -> float:
    """Largest θ_b that any load gives, on the rungs."""
    return float((table.in_contact.polynomials(contact) @ table.rungs).max())


def _largest_height(table: Family, base_angle: float) -> float:
    """H at the least ε with an equilibrium at θ_b; sin θ_b where all have one."""
    low, high = 0.0, 1.0
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (low, middle) if _largest_angle(table, middle) >= base_angle else (middle, high)
    contact = 0.0 if high <= 1e-6 else high
    return float(_solve(table, np.array([contact]), np.array([base_angle]))[0].base_distance[0])


def _postures(first: ArrayLike, name: str, base_angle: ArrayLike, friction: float) -> tuple[Array, Array]:
    """Both columns as arrays, each in its open interval (0, 1) or (0, π/2)."""
    one, angle = np.asarray(first, float), np.asarray(base_angle, float)
    if one.ndim != 1 or one.shape != angle.shape:
        raise ShapeError(f"{name} and base_angle", "must be two (N,) arrays", f"{one.shape} and {angle.shape}")
    if not abs(friction) <= _FRICTION:
        raise RangeError("friction", f"must lie between −{_FRICTION:g} and {_FRICTION:g}", friction)
    for thing, values, top, rule in ((name, one, 1.0, "1 (over L)"), ("base_angle", angle, np.pi / 2, "π/2 rad")):
        wrong = ~((values > 0) & (values < top))
        if wrong.any():
            i = int(wrong.argmax())
            raise RangeError(f"{thing}[{i}]", f"must lie between 0 and {rule}", values[i])
    return one, angle


def equilibria(contact: ArrayLike, base_angle: ArrayLike, friction: float) -> Equilibria:
    """Contact force and place of the base of many whiskers on the flat.

    The same solutions as `stationary_profile`, to some 1e-12 relative for −30 ≤ μ ≤ 300. The first call for a friction
    makes its table.

    Parameters
    ----------
    contact : (N,) array
        Contacts ε over L, in (0, 1).
    base_angle : (N,) array
        Angles θ_b at the base [rad], in (0, π/2).
    friction : float
        Coefficient μ = tan φ, one for all, within ±1000. A negative one drags the contact towards the base; below −0.27
        no load turns a whisker with a small ε up to π/2, as the shaft then lines up with the force.

    Returns
    -------
    Equilibria
        Λ, H, D and the slopes of Λ and H by θ_b; of several loads that give θ_b, the least.

    Raises
    ------
    InputError
        If a posture is out of its interval, or out of reach: above the largest θ_b, or less than 0.05 % below it.
    ConvergenceError
        If the table or a load does not converge.
    """
    contact, base_angle = _postures(contact, "contact", base_angle, friction)
    table = family(float(friction))
    found, reached = _solve_all(table, contact, base_angle)
    if not reached.all():
        i = int((~reached).argmax())
        top = _largest_angle(table, contact[i])
        rule = f"must lie between 0 and {top:.6g} rad for the contact {contact[i]:g} and friction {friction:g}"
        raise RangeError(f"base_angle[{i}]", rule, base_angle[i])
    return found


def _contacts(table: Family, height: Array, base_angle: Array) -> tuple[Array, Mask]:
    """Contact ε that gives H at θ_b, and whether there is one, by a bracketed Newton's method.

    At a fixed load Λ̂ the scaling gives ∂H/∂ε = (H − sin θ_b)/ε, and the moment at the base ∂θ_b/∂ε =
    −Λ(D cos φ + H sin φ)/ε.
    """
    below_one = float(np.nextafter(1, 0))
    low, high = np.zeros_like(height), np.full_like(height, below_one)
    contact = np.clip(1 - height / (0.75 * np.sin(base_angle)), 0.02, below_one)
    inclined = inclination(ContactLaw(table.friction), 1.0)[0]
    for _ in range(_ITERATIONS):
        at, reached = _solve_all(table, contact, base_angle)
        miss = at.base_distance - height
        moment = at.contact_force * lever(inclined, at.contact_distance, at.base_distance)
        slope = (at.base_distance - np.sin(base_angle) + at.height_slope * moment) / contact
        newton = contact - miss / slope
        arrived = reached & (np.abs(miss) <= _TOLERANCE)
        if arrived.all():
            break
        low, high = np.where((miss > 0) | ~reached, contact, low), np.where((miss > 0) | ~reached, high, contact)
        contact = np.where(reached & (newton >= low) & (newton <= high), newton, (low + high) / 2)
    return np.clip(newton, low, high), arrived


def equilibria_at_height(height: ArrayLike, base_angle: ArrayLike, friction: float) -> Equilibria:
    """Equilibria on the flat of whiskers whose base is held at given heights and angles.

    At fixed θ_b, H falls strictly with ε, from sin θ_b at ε → 0 (all the bending at the tip) to 0 at ε = 1, so ε is
    unique: seen on grids for −1000 ≤ μ ≤ 1000, not proved. Below μ = −0.27, at large θ_b, the range ends at the least
    ε with an equilibrium at θ_b.

    Parameters
    ----------
    height : (N,) array
        Distances H of the base from the substrate, over L, in (0, 1).
    base_angle : (N,) array
        Angles θ_b at the base [rad], in (0, π/2).
    friction : float
        Coefficient μ = tan φ, one for all, within ±1000.

    Returns
    -------
    Equilibria
        With the contact ε found.

    Raises
    ------
    InputError
        If a height is out of reach at its angle; the message gives the interval in reach.
    ConvergenceError
        If the table or a load does not converge.
    """
    height, base_angle = _postures(height, "base_distance", base_angle, friction)
    table = family(float(friction))
    too_steep = base_angle > (steepest := _largest_angle(table, 1.0))
    if too_steep.any():
        i = int(too_steep.argmax())
        rule = f"must lie between 0 and {steepest:.6g} rad for friction {friction:g}"
        raise RangeError(f"base_angle[{i}]", rule, base_angle[i])
    contact, arrived = _contacts(table, height, base_angle)
    if not arrived.all():
        i = int((~arrived).argmax())
        top = _largest_height(table, base_angle[i])
        rule = f"must lie between 0 and {top:.6g} over L for the base angle {base_angle[i]:g} and friction {friction:g}"
        raise RangeError(f"base_distance[{i}]", rule, height[i])
    return _solve_all(table, contact, base_angle)[0]
