"""Many equilibria on the flat at once, read from one table per friction.

The scaled problem (x⁴ψ')' = Λ̂ cos(φ − ψ), ψ(1) = ψ'(1) = 0 has one parameter, Λ̂. Measured by the angle that it would
give at the base of a linear beam, p = Λ̂ σ cos φ with σ = 1/6 − ε²/2 + ε³/3, the load and all that follows are
analytic in (ε, p) on the closed square, ε = 0 and ε = 1 included: at ε = 0 the series of ψ has no ε¹ term, so H and D
hold no ln ε. Some 28 × 24 Chebyshev polynomials then hold every posture.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.family_loop import ends
from vibrissa.mechanics.series import chebyshev_sum

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_DEGREES = ((28, 24), (42, 36), (63, 54), (94, 81))  # in ε and p: the first will do for −0.3 < μ < 3
_FRICTION = 1000.0  # largest |μ| that the last degrees resolve
_TAIL = 3e-12  # last coefficients over the largest
_RUNGS = 33  # loads between which the root is bracketed
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


@dataclass(frozen=True)
class Family:
    """Chebyshev coefficients in (ε, p) on [0, 1] × [0, ``load_max``] for one friction.

    ``psi``: ψ/p at the base, ``height``: H/(p(1 − ε)), ``distance``: D/(1 − ε); the first index counts polynomials in
    ε, the second in p.
    ``rungs``: ψ at evenly spaced loads, as coefficients in ε.
    """

    friction: float
    load_max: float
    psi: Array
    height: Array
    distance: Array
    rungs: Array


def _march(contact: Array, load: Array, friction: float, tolerance: float) -> tuple[Array, Array, Array]:
    """ψ/p at the base, H/(p(1 − ε)) and D/(1 − ε) by marching in ln x.

    With n = m/x: dψ/d ln x = n/x², dn/d ln x = cos ψ + μ sin ψ − n (per Λ̂ cos φ), and likewise dD = cos ψ − D,
    dH = sin ψ − H for lengths over the piece of shaft below x. Every state is scaled to be of order 1 for any ε and p.
    """
    both = np.broadcast_arrays(contact, load)
    out = np.empty((3, both[0].size))
    epsilon, p = (np.ascontiguousarray(one, float).ravel() for one in both)
    ends(epsilon, p, friction, tolerance, out)
    psi, height, distance = out.reshape(3, *both[0].shape)
    return psi, height, distance


def _largest_load(friction: float) -> float:
    """Load p at which the base of any whisker has passed either π/2 or its largest angle."""
    contact = np.array([1e-3, 0.25, 0.5, 0.75, 0.999])[:, None]
    ladder, p = 1.1 ** np.arange(12), 1 / np.hypot(1, friction)
    for _ in range(_ITERATIONS):
        angle = p * ladder * _march(contact, p * ladder, friction, 1e-5)[0]
        falls = np.diff(angle, axis=1, prepend=0) < 0
        passed = np.logical_or.accumulate((angle > np.pi / 2) | falls, axis=1).all(axis=0)
        if passed.any():
            return float(p * ladder[passed.argmax()])
        p *= ladder[-2]
    raise ConvergenceError("largest load of a family", float(np.pi / 2 - angle.max()), _ITERATIONS)


def _tail(coefficients: Array) -> float:
    c = np.abs(coefficients)
    return float(max(c[-2:].max(), c[:, -2:].max()) / c.max())


@lru_cache(maxsize=32)
def family(friction: float) -> Family:
    """Tables of all equilibria on the flat for one friction.

    Raises
    ------
    ConvergenceError
        If 94 × 81 polynomials are too few: μ above 1000.
    """
    load_max = _largest_load(friction)
    for degrees in _DEGREES:
        z, w = (chebyshev.chebpts1(n) for n in degrees)
        from_values = [np.linalg.inv(chebyshev.chebvander(v, len(v) - 1)) for v in (z, w)]
        tables = _march((1 + z[:, None]) / 2, load_max * (1 + w) / 2, friction, 1e-13)
        psi, height, distance = (from_values[0] @ table @ from_values[1].T for table in tables)
        worst = max(map(_tail, (psi, height, distance)))
        if worst < _TAIL:
            rungs = np.linspace(0, 1, _RUNGS)
            angles = psi @ chebyshev.chebvander(2 * rungs - 1, len(w) - 1).T * load_max * rungs
            return Family(friction, load_max, psi, height, distance, angles)
    raise ConvergenceError("family of equilibria", worst, len(_DEGREES))


def _load(table: Family, basis: Array, base_angle: Array) -> tuple[Array, Array, Flags]:
    """Load p that gives θ_b, ∂θ_b/∂p, and whether θ_b is in reach; out of reach, p at the largest angle.

    Bracketed between two rungs, on the first rise of ψ with the load, then by Newton's method inside.
    """
    angles = basis @ table.rungs
    above = angles >= base_angle[:, None]
    reached: Flags = np.any(above, axis=1)
    top = np.where(reached, above.argmax(axis=1), angles.argmax(axis=1))
    row = np.arange(len(top))
    low, high = angles[row, top - 1], angles[row, top]
    goal = np.where(reached, base_angle, high)
    step = table.load_max / (_RUNGS - 1)
    left, right = step * (top - 1), step * top
    p = left + step * (goal - low) / (high - low)
    psi = np.ascontiguousarray((basis @ table.psi).T)
    derivative = chebyshev.chebder(psi) * (2 / table.load_max)
    floor = _TOLERANCE * np.abs(psi).sum(axis=0)
    for _ in range(_ITERATIONS):
        z = 2 * p / table.load_max - 1
        value = chebyshev_sum(z, psi)
        slope = value + p * chebyshev_sum(z, derivative)
        miss = p * value - goal
        newton = p - miss / slope
        if np.all(np.abs(miss) <= floor * p):
            return np.clip(newton, left, right), slope, reached
        left, right = np.where(miss < 0, p, left), np.where(miss < 0, right, p)
        p = np.where((newton >= left) & (newton <= right), newton, (left + right) / 2)
    raise ConvergenceError("load on the flat", float(np.abs(miss).max()), _ITERATIONS)


def _solve(table: Family, contact: Array, base_angle: Array) -> tuple[Equilibria, Flags]:
    """Equilibria of one block, and which postures are in reach."""
    basis = np.asarray(chebyshev.chebvander(2 * contact - 1, len(table.psi) - 1), float)
    p, slope, reached = _load(table, basis, base_angle)
    z, free = 2 * p / table.load_max - 1, 1 - contact
    polynomial = np.ascontiguousarray((basis @ table.height).T)
    height = chebyshev_sum(z, polynomial)
    rise = height + p * chebyshev_sum(z, chebyshev.chebder(polynomial) * (2 / table.load_max))
    distance = chebyshev_sum(z, (basis @ table.distance).T)
    force = contact**2 * np.hypot(1, table.friction) / (free**2 * (1 + 2 * contact) / 6)  # Λ/p = ε²/(σ cos φ)
    found = contact, force * p, free * p * height, free * distance, force / slope, free * rise / slope
    return Equilibria(*found), reached


def _solve_all(table: Family, contact: Array, base_angle: Array) -> tuple[Equilibria, Flags]:
    cuts = range(0, max(len(contact), 1), _BLOCK)
    blocks = [_solve(table, contact[i : i + _BLOCK], base_angle[i : i + _BLOCK]) for i in cuts]
    columns = (np.concatenate(column) for column in zip(*(block for block, _ in blocks), strict=True))
    return Equilibria(*columns), np.concatenate([reached for _, reached in blocks])


def _largest_angle(table: Family, contact: float) -> float:
    """Largest θ_b that any load gives, on the rungs."""
    return float((chebyshev.chebvander(2 * contact - 1, len(table.psi) - 1) @ table.rungs).max())


def _largest_height(table: Family, base_angle: float) -> float:
    """H at the least ε that can stand at θ_b; sin θ_b where all can."""
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
        raise InputError(f"{name} and base_angle", "must be two (N,) arrays", f"{one.shape} and {angle.shape}")
    if not abs(friction) <= _FRICTION:
        raise InputError("friction", f"must lie between −{_FRICTION:g} and {_FRICTION:g}", friction)
    for thing, values, top, rule in ((name, one, 1.0, "1 (over L)"), ("base_angle", angle, np.pi / 2, "π/2 rad")):
        wrong = ~((values > 0) & (values < top))
        if wrong.any():
            i = int(wrong.argmax())
            raise InputError(f"{thing}[{i}]", f"must lie between 0 and {rule}", values[i])
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
        raise InputError(f"base_angle[{i}]", rule, base_angle[i])
    return found


def _contacts(table: Family, height: Array, base_angle: Array) -> tuple[Array, Flags]:
    """Contact ε that gives H at θ_b, and whether there is one, by a bracketed Newton's method.

    At a fixed load Λ̂ the scaling gives ∂H/∂ε = (H − sin θ_b)/ε, and the moment at the base ∂θ_b/∂ε =
    −Λ(D cos φ + H sin φ)/ε.
    """
    below_one = float(np.nextafter(1, 0))
    low, high = np.zeros_like(height), np.full_like(height, below_one)
    contact = np.clip(1 - height / (0.75 * np.sin(base_angle)), 0.02, below_one)
    cos, sin = 1 / np.hypot(1, table.friction), table.friction / np.hypot(1, table.friction)
    for _ in range(_ITERATIONS):
        at, reached = _solve_all(table, contact, base_angle)
        miss = at.base_distance - height
        moment = at.contact_force * (at.contact_distance * cos + at.base_distance * sin)
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
    ε that can stand at θ_b.

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
        raise InputError(f"base_angle[{i}]", rule, base_angle[i])
    contact, arrived = _contacts(table, height, base_angle)
    if not arrived.all():
        i = int((~arrived).argmax())
        top = _largest_height(table, base_angle[i])
        rule = f"must lie between 0 and {top:.6g} over L for the base angle {base_angle[i]:g} and friction {friction:g}"
        raise InputError(f"base_distance[{i}]", rule, height[i])
    return _solve_all(table, contact, base_angle)[0]
