"""Profiles held at any excursion and height of the contact, as polynomials in the two."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import get_args

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.mechanics.basis import Basis, Modes, basis, couplings
from vibrissa.mechanics.edge import Held, hold
from vibrissa.mechanics.gap import unit_response
from vibrissa.mechanics.response import Form, displaced, held_rows

Array = NDArray[np.float64]

_DEGREES = ((14, 6), (22, 10), (32, 14))  # Chebyshev nodes in excursion and height
_AHEAD = 18  # and along the substrate, towards the base
_BLOCK = 4096  # places at once
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
    held : tuple of tuple of Held
        For each node of the excursion, one for each node of the height.
    reach : float
        Distance along the substrate from the contact, over L, up to which ``ahead`` tells the profile.
    ahead : (n, J, K) array
        Height of the base side above the contact over the distance from it, y/u: Chebyshev coefficients in u, δ, z.
    """

    flat: Held
    box: Box
    held: tuple[tuple[Held, ...], ...]
    reach: float
    ahead: Array

    @property
    def shape(self) -> tuple[int, int]:
        """Number of nodes of the excursion and of the height."""
        return len(self.held), len(self.held[0])

    def coefficients(self, of: Callable[[Held], Array]) -> Array:
        """Chebyshev coefficients (…, J, K) of what each profile has, (…)."""
        values = np.array([[of(held) for held in row] for row in self.held])
        first, second = (np.linalg.inv(chebyshev.chebvander(_nodes(n), n - 1)) for n in self.shape)
        return np.einsum("aj,bk,jk...->...ab", first, second, values, optimize=True)


def held_table(flat: Held, box: Box, reach: float) -> HeldTable:
    """Tabulate the profiles of a box, with as many nodes as it takes.

    Raises
    ------
    InputError
        If a corner cannot be held, or lies so near the fold that no polynomial serves.
    """
    u = reach * (1 + _nodes(_AHEAD)) / 2
    in_u = np.linalg.inv(chebyshev.chebvander(_nodes(_AHEAD), _AHEAD - 1))
    for shape in _DEGREES:
        held = _profiles(flat, box, shape)
        table = HeldTable(flat, box, held, reach, np.empty(0))
        ahead = np.einsum("nu,ujk->njk", in_u, table.coefficients(partial(_rise, u=u)))
        size = np.abs(ahead)
        if max(size[:, -1].max(), size[:, :, -1].max()) < _TAIL * size.max():
            return HeldTable(flat, box, held, reach, ahead)
    raise InputError(
        "relief",
        "must be within what the posture can follow",
        f"excursions {box.low[0]:.4g} to {box.high[0]:.4g} L at heights {box.low[1]:.4g} to {box.high[1]:.4g} L, "
        "too near the fold",
        "lower the base angle, raise the contact, or flatten the surface",
    )


def _nodes(count: int) -> Array:
    return np.asarray(np.cos(np.pi * (np.arange(count) + 0.5) / count), float)


def _profiles(flat: Held, box: Box, shape: tuple[int, int]) -> tuple[tuple[Held, ...], ...]:
    """Hold the contact at every node, each from a neighbour nearer the flat."""
    first, second = np.meshgrid(_nodes(shape[0]), _nodes(shape[1]), indexing="ij")
    d, z = box.place((first, second))
    found: dict[tuple[int, int], Held] = {}
    row = flat
    outwards = np.argsort(np.abs(d[:, 0] - box.tilt * z[:, 0])).tolist()
    for k in np.argsort(np.abs(z[0])).tolist():
        near = row = hold(flat, float(d[outwards[0], k]), row, height=float(z[0, k]))
        for j in outwards:
            near = found[j, k] = hold(flat, float(d[j, k]), near, height=float(z[j, k]))
    return tuple(tuple(found[j, k] for k in range(shape[1])) for j in range(shape[0]))


def _rise(held: Held, u: Array) -> Array:
    """Height of the profile above its contact, over the distance u from it towards the base."""
    (x0,), (y0,) = held.position(np.array([held.contact]))
    s = held.contact + u
    for _ in range(60):
        x, y = held.position(s)
        step = (x - x0 - u) / np.cos(held.angle(s))
        s = np.clip(s - step, held.contact, 1.0)
        if np.abs(step).max() < 1e-15:
            break
    return np.asarray((y - y0) / (x - x0), float)


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
        return self._formed(lambda held: held_rows(self.table.flat, self.basis, held))

    def __call__(self, d: Array, z: Array) -> Array:
        """All rows at excursions d and heights z, (K, len(d))."""
        return self._at(self.rows, d, z)

    def position(self, d: Array, z: Array, s: Array) -> tuple[Array, Array]:
        """Position of points of the shaft from the base, along the substrate and up, over L, (len(d), S).

        Below the contact the free end goes on straight.
        """
        x, y = self._at(self._formed(lambda held: np.array(held.position(s))), d, z).transpose(0, 2, 1)
        return x, y

    def displacement(self, d: Array, z: Array, s: Array) -> Array:
        """Transverse displacement n₁·(r − r₁) about the profile on the flat, over L, (len(d), S)."""
        return self._at(self._formed(lambda held: displaced(self.table.flat, held, s)), d, z).T

    def _formed(self, of: Callable[[Held], Array]) -> Array:
        coefficients = self.table.coefficients(of)
        if self.form == "exact":
            return coefficients
        by_d, by_z = _tangent(coefficients, self.table.box)
        (a, c), (b, e) = zip(self.table.box.low, self.table.box.high, strict=True)
        plane = np.zeros((*by_d.shape, 2, 2))
        by_height = by_z + by_d * self.table.box.tilt  # at a fixed sheared excursion
        plane[..., 0, 0] = of(self.table.flat) + by_d * (a + c) / 2 + by_height * (b + e) / 2
        plane[..., 1, 0], plane[..., 0, 1] = by_d * (c - a) / 2, by_height * (e - b) / 2
        return plane

    def _at(self, coefficients: Array, d: Array, z: Array) -> Array:
        """Series (…, J, K) at the places of the box, (…, len(d))."""
        j, k = coefficients.shape[-2:]
        flat, out = coefficients.reshape(-1, j * k), np.empty((coefficients[..., 0, 0].size, len(d)))
        for start in range(0, len(d), _BLOCK):
            some = slice(start, start + _BLOCK)
            first, second = self.table.box.unit(d[some], z[some])
            basis = chebyshev.chebvander(first, j - 1)[:, :, None] * chebyshev.chebvander(second, k - 1)[:, None, :]
            out[:, some] = flat @ basis.reshape(-1, j * k).T
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
