"""The quasi-static response to the excursion of the contact, as polynomials in d: exact, or linear (Eq. 11)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, cached_property
from math import factorial
from typing import Literal, get_args

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from vibrissa.errors import InputError
from vibrissa.exact import gauss
from vibrissa.mechanics.basis import Basis, Modes, amplitudes, basis, slip
from vibrissa.mechanics.edge import Held, on_the_flat
from vibrissa.mechanics.gap import UnitResponse, unit_response
from vibrissa.mechanics.profile import Posture, curve
from vibrissa.mechanics.projection import Profiles, Projection, profiles

Array = NDArray[np.float64]
Form = Literal["exact", "linear"]

_NODES = 12  # Chebyshev nodes of one piece
_TAIL = 1e-10  # last coefficients over the largest, above which a piece is halved
_NARROWEST = 1e-3  # [L] a piece is not halved below this
_PANEL = 48  # Gauss nodes in each of the two panels of Q, and 4 more for each mode

FOLLICLE = ("base_curvature", "transverse_force", "axial_force", "contact_load", "contact_angle")


@dataclass(frozen=True)
class Piece:
    """Polynomials in d on one interval.

    Attributes
    ----------
    low, high : float
        Ends of the interval, over L.
    coefficients : (K, n) array
        Chebyshev coefficients of each row.
    unknowns : (n, 3) array
        ε, θ_ε and Λ̂ of the profiles at the Chebyshev nodes that made them; none where the response is linear.
    """

    low: float
    high: float
    coefficients: Array
    unknowns: Array = field(default_factory=lambda: np.empty((0, 3)))

    def taylor(self, d: Array) -> Array:
        """Coefficients of the powers of a small step from each d, (K, len(d), n)."""
        rows, n = self.coefficients.shape
        z = 2 * (d - self.low) / (self.high - self.low) - 1
        values = self._derivatives @ chebyshev.chebvander(z, n - 1).T
        return np.ascontiguousarray(values.reshape(n, rows, len(d)).transpose(1, 2, 0))

    @cached_property
    def _derivatives(self) -> Array:
        """Chebyshev coefficients of the k-th derivatives by d over k!, (n · K, n), k the slower index."""
        rows, n = self.coefficients.shape
        scale = (2 / (self.high - self.low)) ** np.arange(n)
        return np.asarray((scale[:, None, None] * (self.coefficients @ _derivative_series(n))).reshape(n * rows, n))


@dataclass(frozen=True)
class Response:
    """What the excursion of the contact does to the whisker, without its vibration.

    Attributes
    ----------
    posture : Posture
        On the flat.
    form : {"exact", "linear"}
        Q_i(d), or c_i d.
    unit : UnitResponse
        The linearised response, Ū.
    modes : {"straight", "curved", "curved-coulomb", "curved-edge"}
        Which modes.
    basis : Basis
        The modes.
    c : (M,) array
        Linear couplings c_i.
    flat : Held
        Profile on the flat.
    pieces : tuple of Piece
        Rows: Q_i of M modes, over L; then ``FOLLICLE``, whole: curvature at the base, over 1/L, transverse and axial
        force at the base and vertical load on the contact, over πEα⁴L²/4, and the angle θ_ε [rad].
    """

    posture: Posture
    form: Form
    unit: UnitResponse
    modes: Modes
    basis: Basis
    c: Array
    flat: Held
    pieces: tuple[Piece, ...]

    @property
    def kappa(self) -> Array:
        """Adimensional frequencies of the modes, (M,)."""
        return self.basis.kappa

    @property
    def reach(self) -> tuple[float, float]:
        """Least and largest d, over L."""
        return self.pieces[0].low, self.pieces[-1].high

    def __call__(self, d: Array) -> Array:
        """All rows at excursions d, (K, len(d))."""
        return self.taylor(d)[..., 0]

    def taylor(self, d: Array) -> Array:
        """Coefficients of the powers of a small step from each d within the piece above it, (K, len(d), n)."""
        out = np.zeros((len(self.c) + len(FOLLICLE), len(d), self.pieces[0].coefficients.shape[1]))
        for piece, here in self._shared(d):
            out[:, here] = piece.taylor(d[here])
        return out

    def _shared(self, d: Array) -> list[tuple[Piece, NDArray[np.bool_]]]:
        """Each piece, and which of the excursions it serves."""
        which = np.searchsorted([piece.high for piece in self.pieces[:-1]], d, side="right")
        return [(piece, which == p) for p, piece in enumerate(self.pieces)]

    def position(self, d: Array, s: Array) -> tuple[Array, Array]:
        """Position of points of the shaft from the base, along the substrate and up, over L, (len(d), S).

        Below the contact the free end goes on straight. Of the linear response, displaced by d Ū along the normal and
        slipping along the shaft, which does not stretch.
        """
        x, y = np.empty((len(d), len(s))), np.empty((len(d), len(s)))
        if self.form == "linear":
            angle = self.flat.angle(s)
            u = d[:, None] * self._unit_at(s)
            w = slip(u, angle, s)
            x0, y0 = self.flat.position(s)
            return x0 - u * np.sin(angle) + w * np.cos(angle), y0 + u * np.cos(angle) + w * np.sin(angle)
        for piece, here in self._shared(d):
            basis = chebyshev.chebvander(2 * (d[here] - piece.low) / (piece.high - piece.low) - 1, _NODES - 1)
            at_nodes = np.array([_member(self.flat, *unknown).position(s) for unknown in piece.unknowns])
            fit = basis @ _to_series()
            x[here], y[here] = fit @ at_nodes[:, 0], fit @ at_nodes[:, 1]
        return x, y

    def displacement(self, d: Array, s: Array) -> Array:
        """Transverse displacement n₁·(r − r₁) about the profile on the flat, over L, (len(d), S)."""
        if self.form == "linear":
            return d[:, None] * self._unit_at(s)
        angle, (x0, y0) = self.flat.angle(s), self.flat.position(s)
        x, y = self.position(d, s)
        return np.cos(angle) * (y - y0) - np.sin(angle) * (x - x0)

    def _unit_at(self, s: Array) -> Array:
        """Ū, going on straight below the contact."""
        contact = self.posture.contact
        unit = self.unit.displacement(np.clip(s, contact, 1))
        return np.asarray(unit + self.unit.contact_angle * np.minimum(s - contact, 0), float)


def quasi_static(
    posture: Posture,
    reach: tuple[float, float],
    *,
    form: Form = "exact",
    n_modes: int = 12,
    modes: Modes = "straight",
) -> Response:
    """Tabulate the response of a posture.

    Parameters
    ----------
    posture : Posture
        On the flat.
    reach : (float, float)
        Least (at most 0) and largest (at least 0) excursion, over L.
    form : {"exact", "linear"}
        ``exact``: Q_i(d) = ∫ s² (U_qs(d) − U₁) V_i ds of the profile held by the edge. ``linear``: c_i d,
        the paper's U_qs = U₁ + d(t) Ū(s); wide gaps and large base angles are over-estimated by it.
    n_modes : int
        Number of modes.
    modes : {"straight", "curved", "curved-coulomb", "curved-edge"}
        Which modes; see :func:`vibrissa.mechanics.basis.basis`.

    Raises
    ------
    InputError
        On or beyond the fold, or if the posture cannot follow as far as ``reach``.
    """
    if form not in get_args(Form):
        raise InputError("response", "must be 'exact' or 'linear'", repr(form))
    if n_modes < 1:
        raise InputError("number of modes", "must be at least 1", n_modes)
    unit, flat = unit_response(posture), on_the_flat(posture)
    shapes = basis(modes, flat, n_modes)
    project = Projection(flat, shapes)
    c = project.of_displacement(*unit.shift_at_nodes)
    if form == "linear":
        pieces = [_linear_piece(unit, flat, c, reach)]
    else:
        for end in reach:
            profiles(flat, np.array([end]), project.s)  # refuse at once what cannot be reached
        behind = _pieces(project, reach[0], 0.0) if reach[0] < 0 else []
        pieces = [*behind, *(_pieces(project, 0.0, reach[1]) if reach[1] > 0 else [])]
    return Response(posture, form, unit, modes, shapes, c, flat, tuple(pieces))


@cache
def _derivative_series(n: int) -> Array:
    """Matrices (k, n, n) from Chebyshev coefficients, from the left, to those of the k-th derivative over k!."""
    out = np.zeros((n, n, n))
    for k in range(n):
        out[k, :, : n - k] = chebyshev.chebder(np.eye(n), k, axis=1) / factorial(k)
    return out


@cache
def _unit_nodes() -> Array:
    return np.asarray(np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES), float)


@cache
def _to_series() -> Array:
    """Matrix from values at the nodes of a piece to Chebyshev coefficients."""
    return np.asarray(np.linalg.inv(chebyshev.chebvander(_unit_nodes(), _NODES - 1)), float)


def _member(flat: Held, contact: float, turn: float, load: float) -> Held:
    """The profile of these ε, θ_ε and Λ̂."""
    return Held(flat.posture, np.nan, contact, turn, curve(load, -np.log(contact), flat.posture.friction_angle))


def _pieces(project: Projection, low: float, high: float) -> list[Piece]:
    """Pieces between two excursions, halved until their polynomials have converged."""
    d = (low + high) / 2 + (high - low) / 2 * _unit_nodes()
    outwards = np.argsort(np.abs(d))
    found = profiles(project.flat, d[outwards], project.s)
    at_nodes = Profiles(*(values[np.argsort(outwards)] for values in found))
    coefficients = table_rows(project, at_nodes) @ _to_series().T
    if _converged(coefficients) or high - low < _NARROWEST:
        return [Piece(low, high, coefficients, at_nodes.unknowns)]
    middle = (low + high) / 2
    return _pieces(project, low, middle) + _pieces(project, middle, high)


def _converged(coefficients: Array) -> bool:
    """Whether the last coefficients are small, those of modes beside the largest mode's."""
    size, tail = np.abs(coefficients).max(axis=1), np.abs(coefficients[:, -2:]).max(axis=1)
    size[: -len(FOLLICLE)] = size[: -len(FOLLICLE)].max(initial=0)
    return bool(np.all(tail <= _TAIL * size))


def table_rows(project: Projection, held: Profiles) -> Array:
    """The table at many profiles (E,) at once, (K, E)."""
    contact, turn, load = held.unknowns.T
    follicle = _follicle(project.flat.posture, turn, load * contact**2, held.base_curvature)
    return np.concatenate([project.of_profiles(held), follicle])


def held_rows(flat: Held, shapes: Basis, held: Held) -> Array:
    """One column of the table: Q_i of the modes, then ``FOLLICLE``, of one held profile."""
    return np.concatenate([_amplitudes(flat, shapes, held), _follicle_of(held)])


def _follicle_of(held: Held) -> Array:
    """``FOLLICLE`` of one held profile."""
    return _follicle(held.posture, held.contact_angle, held.contact_force, held.base_curvature)


def _follicle(posture: Posture, turn: ArrayLike, force: ArrayLike, curvature: ArrayLike) -> Array:
    """``FOLLICLE`` (5, …) by θ_ε and Λ at the contact and the curvature at the base, (…)."""
    phi, turn, force = posture.friction_angle, np.asarray(turn), np.asarray(force)
    base_to_force = posture.base_angle - phi - turn
    forces = force * np.stack([np.cos(base_to_force), np.sin(base_to_force), np.cos(phi + turn)])
    return np.stack([np.asarray(curvature), *forces, turn])


def displaced(flat: Held, held: Held, s: Array) -> Array:
    """Transverse displacement n₁·(r − r₁) of points of the shaft about the profile on the flat, over L."""
    angle = flat.angle(s)
    (x, y), (x1, y1) = held.position(s), flat.position(s)
    return -np.sin(angle) * (x - x1) + np.cos(angle) * (y - y1)


def _amplitudes(flat: Held, shapes: Basis, held: Held) -> Array:
    """Q_i = ∫_ε^1 s² (r − r₁)·l_i ds, for straight modes l_i = V_i n₁, in two panels: the free end is straight."""
    contact = flat.posture.contact
    z, w = gauss(_PANEL + 4 * len(shapes.kappa))
    total = np.zeros(len(shapes.kappa))
    for low, high in ((contact, max(held.contact, contact)), (max(held.contact, contact), 1.0)):
        s = (low + high) / 2 + (high - low) / 2 * z
        (x, y), (x1, y1) = held.position(s), flat.position(s)
        total += amplitudes(shapes, s, (high - low) / 2 * w, x - x1, y - y1)
    return total


def _linear_piece(unit: UnitResponse, flat: Held, c: Array, reach: tuple[float, float]) -> Piece:
    """Everything's tangent at d = 0."""
    low, high = min(reach[0], -1e-3), max(reach[1], 1e-3)
    slope = np.concatenate([c, _follicle_slope(unit, flat)])
    value = np.concatenate([np.zeros_like(c), _follicle_of(flat)])
    series = np.stack([value + slope * (low + high) / 2, slope * (high - low) / 2], axis=1)
    return Piece(low, high, series)


def _follicle_slope(unit: UnitResponse, flat: Held) -> Array:
    """Derivatives of ``FOLLICLE`` by d, from the derivatives of ε, θ_ε and Λ̂ and the balance of moments."""
    phi, force = flat.posture.friction_angle, flat.contact_force
    gain = unit.load * flat.contact**2 + 2 * flat.curve.load * flat.contact * unit.contact
    turn, to_force = unit.contact_angle, flat.posture.base_angle - phi
    distance, height = flat.base
    lever = distance * np.cos(phi) + height * np.sin(phi)  # moment = Λ [(D + d) cos(φ + θ_ε) + H sin(φ + θ_ε)]
    return np.array(
        [
            gain * lever + force * (np.cos(phi) + turn * (height * np.cos(phi) - distance * np.sin(phi))),
            gain * np.cos(to_force) + force * np.sin(to_force) * turn,
            gain * np.sin(to_force) - force * np.cos(to_force) * turn,
            gain * np.cos(phi) - force * np.sin(phi) * turn,
            turn,
        ]
    )
