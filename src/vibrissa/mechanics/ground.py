"""Profiles held at any excursion and height of the contact, as polynomials in the two."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import get_args

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics import held_grid
from vibrissa.mechanics.basis import Basis, Modes, basis, couplings
from vibrissa.mechanics.edge import Held, hold
from vibrissa.mechanics.gap import unit_response
from vibrissa.mechanics.march import LONGEST
from vibrissa.mechanics.projection import Profiles, Projection
from vibrissa.mechanics.response import Form, held_rows, table_rows

Array = NDArray[np.float64]

_COUNTS = ((14, 18, 22, 27, 32), (6, 8, 10, 12, 14))  # of Chebyshev nodes in excursion and in height, one of each
_LEAST = (14, 6)
_AHEAD = 18  # and along the substrate, towards the base
_TAIL = 1e-9  # last coefficients over the largest: of d₂ a part in a million


@dataclass(frozen=True)
class Box:
    """Where the contact may be: the excursion, sheared so that its flat ground is level, and the height.

    Attributes
    ----------
    low, high : (float, float)
        Ends of δ = d − tilt · z and of z, over L; 0 lies within.
    tilt : float
        Excursion at which flat ground at z holds the contact, over z, in the limit z → 0.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    tilt: float

    def place(self, unit: tuple[Array, Array]) -> tuple[Array, Array]:
        """Excursions and heights (over L) of two coordinates in [−1, 1]."""
        sheared, z = ((a + b) / 2 + (b - a) / 2 * x for a, b, x in zip(self.low, self.high, unit, strict=True))
        return sheared + self.tilt * z, z

    def unit(self, d: Array, z: Array) -> tuple[Array, Array]:
        """Coordinates in [−1, 1] of excursions and heights over L."""
        first, second = (
            (2 * x - a - b) / (b - a) for a, b, x in zip(self.low, self.high, (d - self.tilt * z, z), strict=True)
        )
        return first, second


@dataclass(frozen=True)
class HeldTable:
    """Profiles at Chebyshev nodes of a box.

    Attributes
    ----------
    flat : Held
        Profile on the flat.
    box : Box
        Where the nodes stand.
    unknowns : (J, K, 3) array
        ε, θ_ε [rad] and Λ̂ at each node of the excursion and of the height.
    reach : float
        Distance along the substrate from the contact, over L, up to which ``ahead`` tells the profile.
    ahead : (n, J, K) array
        Height of the base side above the contact over the distance from it, y/u: Chebyshev coefficients in u, δ, z.
    """

    flat: Held
    box: Box
    unknowns: Array
    reach: float
    ahead: Array

    @property
    def shape(self) -> tuple[int, int]:
        """Number of nodes of the excursion and of the height."""
        return self.unknowns.shape[0], self.unknowns.shape[1]

    @property
    def enough(self) -> tuple[int, int]:
        """The fewest nodes that would have served."""
        first, second = (next(n for n in _COUNTS[axis] if _tail(self.ahead, axis, n) < _TAIL) for axis in (0, 1))
        return first, second

    def series(self, values: Array) -> Array:
        """Chebyshev coefficients (…, J, K) of what the profiles have, (…, J · K)."""
        first, second = (np.linalg.inv(chebyshev.chebvander(_nodes(n), n - 1)) for n in self.shape)
        return np.asarray(first @ values.reshape(*values.shape[:-1], *self.shape) @ second.T)

    def profiles(self, s: Array) -> Profiles:
        """All profiles at ascending points s (N,), s[-1] = 1."""
        unknowns = self.unknowns.reshape(-1, 3)
        out = Profiles(unknowns, *(np.empty((len(unknowns), *rest)) for rest in (s.shape, s.shape, ())))
        held_grid.laid(unknowns, self.flat.posture.friction_angle, s, LONGEST, *out[1:])
        return out

    def positions(self, s: Array) -> Array:
        """Positions (2, S, J · K) of points from the base, over L; straight are the free end, and above 1."""
        unknowns, points = self.unknowns.reshape(-1, 3), np.append(np.unique(s[s < 1]), 1.0)
        x, y = np.empty((2, len(unknowns), len(points)))
        held_grid.placed(unknowns, self.flat.posture.friction_angle, points, LONGEST, x, y)
        which, angle = np.searchsorted(points, np.minimum(s, 1)), self.flat.posture.base_angle
        inside = np.maximum(s - 1, 0)[:, None] * np.array([np.cos(angle), np.sin(angle)])[:, None, None]
        return np.stack([x.T[which], y.T[which]]) + inside


def held_table(flat: Held, box: Box, reach: float, least: tuple[int, int] = _LEAST) -> HeldTable:
    """Tabulate the profiles of a box, with as many nodes as it takes, ``least`` at first.

    Raises
    ------
    InputError
        If a corner cannot be held, or lies so near the fold that no polynomial serves.
    """
    u = reach * (1 + _nodes(_AHEAD)) / 2
    in_u = np.linalg.inv(chebyshev.chebvander(_nodes(_AHEAD), _AHEAD - 1))
    shape: tuple[int, int] | None = least
    while shape is not None:
        table = HeldTable(flat, box, _held(flat, box, shape), reach, np.empty(0))
        ahead = np.tensordot(in_u, table.series(_rises(table, u)), 1)
        short = [_tail(ahead, axis, n) >= _TAIL for axis, n in enumerate(shape)]
        if not any(short):
            return replace(table, ahead=ahead)
        shape = _finer(shape, short)
    raise InputError(
        "relief",
        "must be within what the posture can follow",
        f"excursions {box.low[0]:.4g} to {box.high[0]:.4g} L at heights {box.low[1]:.4g} to {box.high[1]:.4g} L, "
        "too near the fold",
        "lower the base angle, raise the contact, or flatten the surface",
    )


def _tail(ahead: Array, axis: int, count: int) -> float:
    """Largest of the last coefficients of as many nodes in excursion (0) or height (1), over the largest of all."""
    size = np.abs(ahead)
    return float(size.take(count - 1, 1 + axis).max() / size.max())


def _finer(shape: tuple[int, int], short: list[bool]) -> tuple[int, int] | None:
    """Two counts further in excursion or height, where nodes are short; none if there are no more."""
    j, k = (
        counts[min(counts.index(n) + 2, len(counts) - 1)] if one else n
        for n, one, counts in zip(shape, short, _COUNTS, strict=True)
    )
    return None if (j, k) == shape else (j, k)


def _nodes(count: int) -> Array:
    return np.asarray(np.cos(np.pi * (np.arange(count) + 0.5) / count), float)


def _held(flat: Held, box: Box, shape: tuple[int, int]) -> Array:
    """ε, θ_ε and Λ̂ of the profile held at every node, (J, K, 3)."""
    first, second = np.meshgrid(_nodes(shape[0]), _nodes(shape[1]), indexing="ij")
    d, z = box.place((first, second))
    posture, (distance, height) = flat.posture, flat.base
    start, unknowns = np.array([flat.contact, 0.0, flat.curve.load]), np.empty((*shape, 3))
    rows, middle = np.argsort(np.abs(z[0])), int(np.argmin(np.abs(d[:, 0] - box.tilt * z[0, 0])))
    stands = posture.base_angle, distance, height, posture.friction_angle
    missed = held_grid.settle(start, *stands, d, z[0], rows, middle, LONGEST, unknowns)
    if missed >= 0:
        excursion, above = float(d.flat[missed]), float(z.flat[missed])
        hold(flat, excursion, height=above)  # refuses, and tells why
        raise ConvergenceError("profile on an edge", excursion, missed)
    return unknowns


def _rises(table: HeldTable, u: Array) -> Array:
    """Height of the profiles above their contact, over the distance u from it towards the base, (U, J · K)."""
    unknowns, ascending = table.unknowns.reshape(-1, 3), np.argsort(u)
    out, found = np.empty((2, len(unknowns), len(u)))
    held_grid.rises(unknowns, table.flat.posture.friction_angle, u[ascending], LONGEST, found)
    out[:, ascending] = found
    return np.ascontiguousarray(out.T)


@dataclass(frozen=True)
class GroundResponse:
    """What excursion and height of the contact do to the whisker, without its vibration.

    Attributes
    ----------
    table : HeldTable
        The profiles.
    form : {"exact", "linear"}
        Rows of the profiles themselves, or of their tangent at d = z = 0, U₁ + d Ū_x + z Ū_z.
    basis : Basis
        The modes.
    c : (M,) array
        Their linear couplings to the excursion.
    """

    table: HeldTable
    form: Form
    basis: Basis
    c: Array

    @property
    def kappa(self) -> Array:
        """Adimensional frequencies of the modes, (M,)."""
        return self.basis.kappa

    @property
    def flat(self) -> Held:
        """Profile on the flat."""
        return self.table.flat

    @cached_property
    def rows(self) -> Array:
        """Chebyshev coefficients (K, J, K') of the rows of :class:`vibrissa.mechanics.response.Response`."""
        project = Projection(self.flat, self.basis)
        of_flat = held_rows(self.flat, self.basis, self.flat)
        return self._formed(table_rows(project, self.table.profiles(project.s)), of_flat)

    def __call__(self, d: Array, z: Array) -> Array:
        """All rows at excursions d and heights z, (K, len(d))."""
        return self._at(self.rows, d, z)

    def position(self, d: Array, z: Array, s: Array) -> tuple[Array, Array]:
        """Position of points of the shaft from the base, along the substrate and up, over L, (len(d), S).

        Below the contact the free end goes on straight.
        """
        return self.placed(d, z, self.places(s))

    def places(self, s: Array) -> Array:
        """Chebyshev coefficients (2, S, J, K) of the position of points of the shaft, for :meth:`placed`."""
        return self._formed(self.table.positions(s), np.stack(self.flat.position(s)))

    def placed(self, d: Array, z: Array, places: Array) -> tuple[Array, Array]:
        """As :meth:`position`, of points whose places are known."""
        x, y = self._at(places, d, z).transpose(0, 2, 1)
        return x, y

    def displacement(self, d: Array, z: Array, s: Array) -> Array:
        """Transverse displacement n₁·(r − r₁) about the profile on the flat, over L, (len(d), S)."""
        angle, (x0, y0) = self.flat.angle(s), self.flat.position(s)
        x, y = self.position(d, z, s)
        return np.cos(angle) * (y - y0) - np.sin(angle) * (x - x0)

    def _formed(self, values: Array, of_flat: Array) -> Array:
        """Series (…, J, K) of what the profiles have, (…, J · K), and the one on the flat, (…)."""
        coefficients = self.table.series(values)
        if self.form == "exact":
            return coefficients
        by_d, by_z = _tangent(coefficients, self.table.box)
        (a, c), (b, e) = zip(self.table.box.low, self.table.box.high, strict=True)
        plane = np.zeros((*by_d.shape, 2, 2))
        by_height = by_z + by_d * self.table.box.tilt  # at a fixed sheared excursion
        plane[..., 0, 0] = of_flat + by_d * (a + c) / 2 + by_height * (b + e) / 2
        plane[..., 1, 0], plane[..., 0, 1] = by_d * (c - a) / 2, by_height * (e - b) / 2
        return plane

    def _at(self, coefficients: Array, d: Array, z: Array) -> Array:
        """Series (…, J, K) at the places of the box, (…, len(d))."""
        series = np.ascontiguousarray(coefficients.reshape(-1, *coefficients.shape[-2:]))
        out = np.empty((len(series), len(d)))
        held_grid.summed(series, *self.table.box.unit(d, z), out)
        return out.reshape(*coefficients.shape[:-2], len(d))


def _tangent(coefficients: Array, box: Box) -> tuple[Array, Array]:
    """Derivatives (…) by d at fixed z and by z at fixed d, at d = z = 0."""
    out = []
    zero = box.unit(np.zeros(1), np.zeros(1))
    for axis in (0, 1):
        scale = 2 / (box.high[axis] - box.low[axis])
        slope = np.moveaxis(chebyshev.chebder(np.moveaxis(coefficients, axis - 2, 0), scl=scale), 0, axis - 2)
        basis = [chebyshev.chebvander(x, n - 1)[0] for x, n in zip(zero, slope.shape[-2:], strict=True)]
        out.append(np.einsum("...jk,j,k->...", slope, *basis))
    return out[0], out[1] - box.tilt * out[0]


def ground_response(
    table: HeldTable, *, form: Form = "exact", n_modes: int = 12, modes: Modes = "straight"
) -> GroundResponse:
    """Response of a posture whose profiles are tabulated; see :func:`vibrissa.mechanics.response.quasi_static`.

    Raises
    ------
    InputError
        If there is no mode, or no such form.
    """
    if form not in get_args(Form):
        raise InputError("response", "must be 'exact' or 'linear'", repr(form))
    if n_modes < 1:
        raise InputError("number of modes", "must be at least 1", n_modes)
    shapes = basis(modes, table.flat, n_modes)
    return GroundResponse(table, form, shapes, couplings(shapes, unit_response(table.flat.posture)))


def flat_tilt(flat: Held) -> float:
    """∂d/∂z along which the contact angle stays 0: where flat ground at another height holds the contact."""
    by_d, by_z = np.linalg.solve(flat.sensitivity, np.array([[0.0, 0.0], [1.0, 0.0], [0.0, -1.0]]))[1]
    return float(-by_z / by_d)
