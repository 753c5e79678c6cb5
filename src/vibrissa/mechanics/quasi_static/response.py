"""The quasi-static response to the excursion of the contact, as polynomials in d: exact, or linear (Eq. 11)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, cached_property
from math import factorial
from typing import Literal, get_args

import numpy as np
from numpy.polynomial import chebyshev

from vibrissa.arrays import Array, Mask
from vibrissa.errors import RangeError, UnknownError
from vibrissa.mechanics.modes.basis import Basis, Modes, basis, slip
from vibrissa.mechanics.quasi_static.projection import Profiles, Projection, profiles
from vibrissa.mechanics.quasi_static.response_rows import FOLLICLE, follicle_of, follicle_slope, table_rows
from vibrissa.mechanics.statics.chebyshev import Chebyshev
from vibrissa.mechanics.statics.edge_contact import Held, on_the_flat
from vibrissa.mechanics.statics.gap import UnitResponse, unit_response
from vibrissa.mechanics.statics.profile import Posture, curve

Form = Literal["exact", "linear"]

_NODES = 12  # Chebyshev nodes of one piece
_TAIL = 1e-10  # last coefficients over the largest, above which a piece is halved
_NARROWEST = 1e-3  # [L] a piece is not halved below this
_AT_ONCE = 1 << 16  # excursions worked on at once, so that what is made in between stays small


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

    @property
    def along(self) -> Chebyshev:
        """Polynomials in d."""
        return Chebyshev(self.coefficients.shape[1], self.low, self.high)

    def taylor(self, d: Array) -> Array:
        """Coefficients of the powers of a small step from each d, (K, len(d), n).

        Parameters
        ----------
        d : (T,) array
            Excursions over L.

        Returns
        -------
        (K, T, n) array
            Over L to the power of the order.
        """
        rows, n = self.coefficients.shape
        values = self._derivatives @ self.along.polynomials(d).T
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
        out = np.empty((len(self.c) + len(FOLLICLE), len(d)))
        for piece, here in self._shared(d):
            out[:, here] = piece.coefficients @ piece.along.polynomials(d[here]).T
        return out

    def taylor(self, d: Array) -> Array:
        """Coefficients of the powers of a small step from each d within the piece above it, (K, len(d), n).

        Parameters
        ----------
        d : (T,) array
            Excursions over L.

        Returns
        -------
        (K, T, n) array
            Rows by excursion and power.
        """
        out = np.zeros((len(self.c) + len(FOLLICLE), len(d), self.pieces[0].coefficients.shape[1]))
        for start in range(0, len(d), _AT_ONCE):
            some, block = d[start : start + _AT_ONCE], out[:, start : start + _AT_ONCE]
            for piece, here in self._shared(some):
                block[:, here] = piece.taylor(some[here])
        return out

    def _shared(self, d: Array) -> list[tuple[Piece, Mask]]:
        """Each piece, and which of the excursions it serves."""
        which = np.searchsorted([piece.high for piece in self.pieces[:-1]], d, side="right")
        return [(piece, which == p) for p, piece in enumerate(self.pieces)]

    def position(self, d: Array, s: Array) -> tuple[Array, Array]:
        """Position of points of the shaft from the base, along the substrate and up, over L, (len(d), S).

        Below the contact the free end goes on straight. Of the linear response, displaced by d Ū along the normal and
        slipping along the shaft, which does not stretch.

        Parameters
        ----------
        d : (T,) array
            Excursions over L.
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        x, y : (T, S) arrays
            Along the substrate and up, over L.
        """
        x, y = np.empty((len(d), len(s))), np.empty((len(d), len(s)))
        if self.form == "linear":
            angle = self.flat.angle(s)
            u = d[:, None] * self._unit_at(s)
            w = slip(u, angle, s)
            x0, y0 = self.flat.position(s)
            return x0 - u * np.sin(angle) + w * np.cos(angle), y0 + u * np.cos(angle) + w * np.sin(angle)
        for (piece, here), members in zip(self._shared(d), self._members, strict=True):
            at_nodes = np.array([member.position(s) for member in members])
            fit = piece.along.polynomials(d[here]) @ piece.along.to_series
            x[here], y[here] = fit @ at_nodes[:, 0], fit @ at_nodes[:, 1]
        return x, y

    @cached_property
    def _members(self) -> list[list[Held]]:
        """Profiles at the nodes of each piece."""
        return [[_member(self.flat, *unknown) for unknown in piece.unknowns] for piece in self.pieces]

    def displacement(self, d: Array, s: Array) -> Array:
        """Transverse displacement n₁·(r − r₁) about the profile on the flat, over L, (len(d), S).

        Parameters
        ----------
        d : (T,) array
            Excursions over L.
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        (T, S) array
            Over L, positive away from the substrate.
        """
        if self.form == "linear":
            return d[:, None] * self._unit_at(s)
        return self.flat.displaced(*self.position(d, s), s)

    def _unit_at(self, s: Array) -> Array:
        """Ū, continued straight below the contact."""
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
        Which modes; see :func:`vibrissa.mechanics.modes.basis.basis`.

    Returns
    -------
    Response
        Polynomials in d.

    Raises
    ------
    InputError
        On or beyond the fold, or if the posture cannot follow as far as ``reach``.
    """
    if form not in get_args(Form):
        raise UnknownError("response", "must be 'exact' or 'linear'", repr(form))
    if n_modes < 1:
        raise RangeError("number of modes", "must be at least 1", n_modes)
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


def _member(flat: Held, contact: float, turn: float, load: float) -> Held:
    """The profile of these ε, θ_ε and Λ̂."""
    return Held(flat.posture, np.nan, contact, turn, curve(load, -np.log(contact), flat.posture.law))


def _pieces(project: Projection, low: float, high: float) -> list[Piece]:
    """Pieces between two excursions, halved until their polynomials have converged."""
    along = Chebyshev(_NODES, low, high)
    d = along.nodes
    outwards = np.argsort(np.abs(d))
    found = profiles(project.flat, d[outwards], project.s)
    at_nodes = Profiles(*(values[np.argsort(outwards)] for values in found))
    coefficients = table_rows(project, at_nodes) @ along.to_series.T
    if _converged(coefficients) or high - low < _NARROWEST:
        return [Piece(low, high, coefficients, at_nodes.unknowns)]
    middle = (low + high) / 2
    return _pieces(project, low, middle) + _pieces(project, middle, high)


def _converged(coefficients: Array) -> bool:
    """Whether the last coefficients are small, those of modes beside the largest mode's."""
    size, tail = np.abs(coefficients).max(axis=1), np.abs(coefficients[:, -2:]).max(axis=1)
    size[: -len(FOLLICLE)] = size[: -len(FOLLICLE)].max(initial=0)
    return bool(np.all(tail <= _TAIL * size))


def _linear_piece(unit: UnitResponse, flat: Held, c: Array, reach: tuple[float, float]) -> Piece:
    """Everything's tangent at d = 0."""
    low, high = min(reach[0], -1e-3), max(reach[1], 1e-3)
    slope = np.concatenate([c, follicle_slope(unit, flat)])
    value = np.concatenate([np.zeros_like(c), follicle_of(flat)])
    series = np.stack([value + slope * (low + high) / 2, slope * (high - low) / 2], axis=1)
    return Piece(low, high, series)
