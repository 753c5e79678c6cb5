"""All that the model needs of the postures on a path, as polynomials in the posture and the excursion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from vibrissa.errors import InputError
from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.edge import on_the_flat
from vibrissa.mechanics.gap import JumpTable, coupling, excursion_at_jump, jump_table, unit_response
from vibrissa.mechanics.posture_path import Box, PosturePath
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.response import FOLLICLE, Form, Response, quasi_static

Array = NDArray[np.float64]

_DEGREES = (4, 6, 9, 13, 19, 28)  # of the polynomials in one coordinate of the posture
_TAIL = 1e-7  # last coefficients over the largest
_STILL = 1e-12  # range of a coordinate that does not change
_BLOCK = 4096  # times at once
_WAYPOINTS = 25  # of the path, looked at when a posture has been refused


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
    """

    contact: slice
    distance: slice
    kappa: slice
    c: slice
    mixing: slice
    shear: slice
    bending: slice
    jump: slice

    @classmethod
    def of(cls, n_modes: int, n_jump: int) -> Slow:
        """Rows for so many modes and coefficients."""
        ends = np.cumsum([1, 1, *5 * [n_modes], n_jump])
        return cls(*(slice(int(a), int(b)) for a, b in zip([0, *ends[:-1]], ends, strict=True)))


def mode_mixing(contact: float, n_modes: int) -> Array:
    """How the modes of one contact turn into those of the next: A_ji = ∫ s² V_j ∂V_i/∂ε ds.

    From the operator's symmetry, A_ji = ε⁴ [V_j'V_i''' + V_j'''V_i'](ε) / (κ_j² − κ_i²), antisymmetric; by the same
    token dκ_i/dε = −ε⁴ V_i'V_i'''/κ_i. A moving contact adds 2 (dε/dt) Σ_i A_ji q̇_i, and smaller terms, to mode j.

    Returns
    -------
    (M, M) array
        A [1], row j, column i.
    """
    kappa, end = cone_kappa(contact, n_modes), np.array([contact])
    slope, third = (cone_modes(kappa, contact, end, derivative=k)[:, 0] for k in (1, 3))
    gap = np.subtract.outer(kappa**2, kappa**2) + np.eye(n_modes)
    return np.asarray(contact**4 * (np.outer(slope, third) + np.outer(third, slope)) * (1 - np.eye(n_modes)) / gap)


def _astray(contact: float, kappa: Array) -> Array:
    """Root sum square over j of 2 A_ji κ_i/(κ_i² − κ_j²): mode i's ringing in the other modes, per dε/dt."""
    gap = np.subtract.outer(kappa**2, kappa**2) + np.eye(len(kappa))
    return np.asarray(np.sqrt(np.sum((2 * mode_mixing(contact, len(kappa)) * kappa / gap) ** 2, axis=0)))


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
        Where what stands.
    jump : JumpTable
        Its interval of widths.
    borders : (P + 1,) array
        Excursions that bound the pieces of the response, over L.
    response : (P, K, n, A, B) array
        Chebyshev coefficients in d and the posture; rows as in :class:`vibrissa.mechanics.response.Response`.
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
        """All slow rows at places (2, T), (R, T)."""
        return np.asarray(self.slow.reshape(len(self.slow), -1) @ self._basis(place).T)

    def _of_piece(self, place: Array, d: Array, piece: int) -> Array:
        table = self.response[piece]
        flat = table.reshape(-1, table.shape[2] * table.shape[3])
        low, high = self.borders[piece : piece + 2]
        out = np.empty((len(table), len(d)))
        for i in range(0, len(d), _BLOCK):
            here = slice(i, i + _BLOCK)
            inside = chebyshev.chebvander(2 * (d[here] - low) / (high - low) - 1, table.shape[1] - 1)
            columns = (flat @ self._basis(place[:, here]).T).reshape(*table.shape[:2], -1)
            out[:, here] = np.einsum("knt,tn->kt", columns, inside)
        return out

    def respond(self, place: Array, d: Array, piece: NDArray[np.int64] | None = None) -> Array:
        """All rows at places (2, T) and excursions (T,), (K, T), of the pieces given or those that d lies in."""
        piece = self.piece(d) if piece is None else piece
        out = np.empty((self.response.shape[1], len(d)))
        for p in np.unique(piece):
            out[:, piece == p] = self._of_piece(place[:, piece == p], d[piece == p], int(p))
        return out

    def piece(self, d: Array) -> NDArray[np.int64]:
        """Which piece of the response excursions lie in, (T,)."""
        return np.asarray(np.clip(np.searchsorted(self.borders, d, side="right") - 1, 0, len(self.response) - 1))

    def deepest(self, place: Array, width: Array) -> Array:
        """Excursion d₂ over L at which the contact jumps, at places (2, J) in gaps λ over L, (J,)."""
        low, high = self.jump.low, self.jump.high
        inside = chebyshev.chebvander((2 * width - low - high) / (high - low), len(self.jump.coefficients) - 1)
        return np.asarray(width**2 * np.einsum("nj,jn->j", self.slow_at(place)[self.rows.jump], inside))

    @property
    def n_modes(self) -> int:
        """Number of modes M."""
        return self.rows.kappa.stop - self.rows.kappa.start

    def _basis(self, place: Array) -> Array:
        degrees = np.array(self.slow.shape[1:]) - 1
        span = np.where(self.high > self.low, self.high - self.low, 1.0)
        z = (2 * place - (self.low + self.high)[:, None]) / span[:, None]
        one, two = (chebyshev.chebvander(row, degree) for row, degree in zip(z, degrees, strict=True))
        return np.asarray((one[:, :, None] * two[:, None, :]).reshape(place.shape[1], -1))


def tabulate(path: PosturePath, widths: ArrayLike, form: Form, n_modes: int) -> PathTable:
    """Tables over the box of postures that a path runs through.

    Parameters
    ----------
    path : PosturePath
        The way.
    widths : (J,) array
        Widths of gaps to be met, over L.
    form : {"exact", "linear"}
        Of the response.
    n_modes : int
        Number of modes.

    Raises
    ------
    InputError
        If a posture on the way, or in its box, stands beyond the fold or cannot cross the gaps; named with the time
        where it is on the way.
    """
    widths = np.asarray(widths, float)
    try:
        return _tables(path.box, (float(widths.min()), float(widths.max())), form, n_modes)
    except InputError as refused:
        raise _told_with_time(path, widths, refused) from None


def _told_with_time(path: PosturePath, widths: Array, refused: InputError) -> InputError:
    """The first posture on the way that is refused, else what was refused in the box."""
    for t in np.linspace(path.time[0], path.time[-1], _WAYPOINTS):
        try:
            unit_response(path.at(t))
            excursion_at_jump(path.at(t), float(widths.max()))
        except InputError as error:
            return InputError(f"posture at {t:.4g} s", "must be one that can cross the gaps", str(error))
    return InputError("posture path", "must keep to a range of contacts and angles that all can stand", str(refused))


@lru_cache(maxsize=8)
def _tables(box: Box, range_of_widths: tuple[float, float], form: Form, n_modes: int) -> PathTable:
    widths = np.array(range_of_widths)

    def slow(posture: Posture) -> Array:
        unit, kappa, contact = unit_response(posture), cone_kappa(posture.contact, n_modes), posture.contact
        shear = contact**4 * cone_modes(kappa, contact, np.array([contact]), derivative=3)[:, 0]
        bending = cone_modes(kappa, contact, np.ones(1), derivative=2)[:, 0]
        rows = [[contact, on_the_flat(posture).base[0]], kappa, coupling(unit, n_modes), _astray(contact, kappa)]
        return np.concatenate([*rows, shear, bending])

    nodes, values, error = _resolved(box, slow)
    postures = [box.posture(np.array([a, b])) for a in nodes[0] for b in nodes[1]]
    shape = len(nodes[0]), len(nodes[1])
    jumps = [_jumps(posture, widths) for posture in postures]
    d2 = np.array([jump(widths.max(keepdims=True))[0] for jump in jumps])
    slack = 1 + (1e-9 if len(postures) == 1 else 0.02)
    reach = slack * float(d2.min() - widths.max()), slack * float(d2.max())
    responses = [quasi_static(posture, reach, form=form, n_modes=n_modes) for posture in postures]
    borders = np.unique([end for one in responses for piece in one.pieces for end in (piece.low, piece.high)])
    coefficients = np.array([jump.coefficients for jump in jumps]).reshape(*shape, -1)
    table = np.concatenate([values, coefficients], axis=2)
    at_nodes = _on_common_pieces(responses, borders).reshape(*shape, len(borders) - 1, n_modes + len(FOLLICLE), -1)
    return PathTable(
        np.array(box.low),
        np.array(box.high),
        _in_posture(table).transpose(2, 0, 1),
        Slow.of(n_modes, coefficients.shape[2]),
        jumps[0],
        borders,
        _in_posture(at_nodes).transpose(2, 3, 4, 0, 1),
        error,
    )


def _jumps(posture: Posture, widths: Array) -> JumpTable:
    """Table of d₂; one number where all gaps are equally wide."""
    width = float(widths[0])
    if np.any(widths != width):
        return jump_table(posture, widths)
    ratio = excursion_at_jump(posture, width) / width**2
    return JumpTable(0.999 * width, 1.001 * width, np.array([ratio]))


def _resolved(box: Box, row: Callable[[Posture], Array]) -> tuple[list[Array], Array, float]:
    """Nodes of both coordinates, the rows there (A, B, R), and the tail, with degrees that resolve them."""
    rungs = [0, 0]
    while True:
        nodes = [
            _lobatto(a, b, _DEGREES[rung]) if b - a > _STILL else np.array([(a + b) / 2])
            for a, b, rung in zip(box.low, box.high, rungs, strict=True)
        ]
        values = np.array([[row(box.posture(np.array([a, b]))) for b in nodes[1]] for a in nodes[0]])
        tails = _tails(_in_posture(values))
        rough = [axis for axis in (0, 1) if tails[axis] > _TAIL and rungs[axis] < len(_DEGREES) - 1]
        if not rough:
            return nodes, values, max(tails)
        for axis in rough:
            rungs[axis] += 1


def _lobatto(low: float, high: float, degree: int) -> Array:
    z = -np.cos(np.pi * np.arange(degree + 1) / degree)
    return np.asarray((low + high) / 2 + (high - low) / 2 * z)


def _in_posture(values: Array) -> Array:
    """Chebyshev coefficients in the first two axes."""
    for axis in (0, 1):
        n = values.shape[axis]
        if n > 1:
            inverse = np.linalg.inv(chebyshev.chebvander(_lobatto(-1, 1, n - 1), n - 1))
            values = np.moveaxis(np.tensordot(inverse, values, (1, axis)), 0, axis)
    return values


def _tails(coefficients: Array) -> list[float]:
    """Last two coefficients in either coordinate over the largest, the worst row."""
    size = np.abs(coefficients).max(axis=(0, 1))
    tails = []
    for axis in (0, 1):
        last = np.abs(np.take(coefficients, [-2, -1], axis)) if coefficients.shape[axis] > 1 else np.zeros((1, 1, 1))
        tails.append(float((last.max(axis=(0, 1)) / np.where(size > 0, size, 1)).max()))
    return tails


def _on_common_pieces(responses: list[Response], borders: Array) -> Array:
    """Chebyshev coefficients in d of every response on the finest pieces of all, (N, P, K, n)."""
    n = max(one.pieces[0].coefficients.shape[1] for one in responses)
    z = np.cos(np.pi * (np.arange(n) + 0.5) / n)
    inverse = np.linalg.inv(chebyshev.chebvander(z, n - 1))
    middle, half = (borders[1:] + borders[:-1]) / 2, np.diff(borders) / 2
    d = (middle[:, None] + half[:, None] * z).ravel()
    values = np.array([one(d) for one in responses]).reshape(len(responses), -1, len(middle), n)
    return np.asarray(np.einsum("mn,rkpn->rpkm", inverse, values))
