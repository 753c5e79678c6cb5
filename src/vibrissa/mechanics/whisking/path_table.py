"""All that the model needs of the postures on a path, as polynomials in the posture and the excursion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.statics.chebyshev import Chebyshev
from vibrissa.mechanics.statics.gap import JumpTable

_BLOCK = 4096  # times at once


class Slow(NamedTuple):
    """What changes with the posture alone, in the order of the rows of :attr:`PathTable.slow`.

    Attributes
    ----------
    contact, distance : slice
        ε and D over L.
    kappa, c : slice
        Frequencies and linear couplings of M modes.
    mixing : slice
        For each mode, what share of its ringing goes astray to the other modes per dε/dt [1/timescale]: see
        :func:`mode_mixing`.
    shear, bending : slice
        ε⁴V'''(ε) and V''(1) of each mode.
    jump : slice
        Chebyshev coefficients of d₂/λ².
    along : slice
        Displacement of the contact along the ground for each mode, per unit of amplitude.
    """

    contact: slice
    distance: slice
    kappa: slice
    c: slice
    mixing: slice
    shear: slice
    bending: slice
    jump: slice
    along: slice

    @classmethod
    def of(cls, n_modes: int, n_jump: int) -> Slow:
        """Rows for this number of modes and coefficients.

        Parameters
        ----------
        n_modes : int
            Number of modes M.
        n_jump : int
            Number of coefficients of d₂/λ².

        Returns
        -------
        Slow
            The slices.
        """
        ends = np.cumsum([1, 1, *5 * [n_modes], n_jump, n_modes])
        return cls(*(slice(int(a), int(b)) for a, b in zip([0, *ends[:-1]], ends, strict=True)))


def mode_mixing(contact: float, n_modes: int) -> Array:
    """How the modes of one contact turn into those of the next: A_ji = ∫ s² V_j ∂V_i/∂ε ds.

    From the operator's symmetry, A_ji = ε⁴ [V_j'V_i''' + V_j'''V_i'](ε) / (κ_j² − κ_i²), antisymmetric; by the same
    token dκ_i/dε = −ε⁴ V_i'V_i'''/κ_i. A moving contact adds 2 (dε/dt) Σ_i A_ji q̇_i, and smaller terms, to mode j.

    Parameters
    ----------
    contact : float
        ε over L.
    n_modes : int
        M.

    Returns
    -------
    (M, M) array
        A [1], row j, column i.
    """
    kappa, end = cone_kappa(contact, n_modes), np.array([contact])
    slope, third = (cone_modes(kappa, contact, end, derivative=k)[:, 0] for k in (1, 3))
    gap = np.subtract.outer(kappa**2, kappa**2) + np.eye(n_modes)
    return np.asarray(contact**4 * (np.outer(slope, third) + np.outer(third, slope)) * (1 - np.eye(n_modes)) / gap)


@dataclass(frozen=True)
class PathTable:
    """Polynomials in the two coordinates of a path.

    Attributes
    ----------
    low, high : (2,) arrays
        The box of postures.
    slow : (R, A, B) array
        Chebyshev coefficients of what changes with the posture alone; rows by ``rows``.
    rows : Slow
        Which rows hold what.
    jump : JumpTable
        Its interval of widths.
    borders : (P + 1,) array
        Excursions that bound the pieces of the response, over L.
    response : (P, K, n, A, B) array
        Chebyshev coefficients in d and the posture; rows as in
        :class:`vibrissa.mechanics.quasi_static.response.Response`.
    error : float
        Last coefficients in the posture over the largest, the worst of all.
    """

    low: Array
    high: Array
    slow: Array
    rows: Slow
    jump: JumpTable
    borders: Array
    response: Array
    error: float

    def slow_at(self, place: Array) -> Array:
        """All slow rows at places (2, T), (R, T).

        Parameters
        ----------
        place : (2, T) array
            Coordinates of the posture.

        Returns
        -------
        (R, T) array
            Rows by :attr:`rows`.
        """
        return np.asarray(self.slow.reshape(len(self.slow), -1) @ self._basis(place).T)

    def _of_piece(self, place: Array, d: Array, piece: int) -> Array:
        table = self.response[piece]
        flat = table.reshape(-1, table.shape[2] * table.shape[3])
        low, high = self.borders[piece : piece + 2]
        out = np.empty((len(table), len(d)))
        for i in range(0, len(d), _BLOCK):
            here = slice(i, i + _BLOCK)
            inside = Chebyshev(table.shape[1], low, high).polynomials(d[here])
            columns = (flat @ self._basis(place[:, here]).T).reshape(*table.shape[:2], -1)
            out[:, here] = np.einsum("knt,tn->kt", columns, inside)
        return out

    def respond(self, place: Array, d: Array, piece: Integers | None = None) -> Array:
        """All rows at places (2, T) and excursions (T,), (K, T), of the pieces given or those that d lies in.

        Parameters
        ----------
        place : (2, T) array
            Coordinates of the posture.
        d : (T,) array
            Excursions over L.
        piece : (T,) array of int, optional
            Piece of the response for each.

        Returns
        -------
        (K, T) array
            Rows as of the response.
        """
        piece = self.piece(d) if piece is None else piece
        out = np.empty((self.response.shape[1], len(d)))
        for p in np.unique(piece):
            out[:, piece == p] = self._of_piece(place[:, piece == p], d[piece == p], int(p))
        return out

    def piece(self, d: Array) -> Integers:
        """Which piece of the response excursions lie in, (T,).

        Parameters
        ----------
        d : (T,) array
            Excursions over L.

        Returns
        -------
        (T,) array of int
            From 0.
        """
        return np.asarray(np.clip(np.searchsorted(self.borders, d, side="right") - 1, 0, len(self.response) - 1))

    def deepest(self, place: Array, width: Array) -> Array:
        """Excursion d₂ over L at which the contact jumps, at places (2, J) in gaps λ over L, (J,).

        Parameters
        ----------
        place : (2, J) array
            Coordinates of the posture.
        width : (J,) array
            λ over L.

        Returns
        -------
        (J,) array
            d₂ over L.
        """
        inside = self.jump.along.polynomials(width)
        return np.asarray(width**2 * np.einsum("nj,jn->j", self.slow_at(place)[self.rows.jump], inside))

    @property
    def n_modes(self) -> int:
        """Number of modes M."""
        return self.rows.kappa.stop - self.rows.kappa.start

    def _basis(self, place: Array) -> Array:
        one, two = (
            Chebyshev(n, low, high if high > low else low + 1).polynomials(row)
            for n, low, high, row in zip(self.slow.shape[1:], self.low, self.high, place, strict=True)
        )
        return np.asarray((one[:, :, None] * two[:, None, :]).reshape(len(one), one.shape[1] * two.shape[1]))
