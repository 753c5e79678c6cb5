"""The tables of a path of postures: how they are made."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array
from vibrissa.errors import InputError, RangeError
from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.modes.basis import contact_motion
from vibrissa.mechanics.quasi_static.response import Form, Response, quasi_static
from vibrissa.mechanics.quasi_static.response_rows import FOLLICLE
from vibrissa.mechanics.statics.chebyshev import Chebyshev
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.gap import coupling, excursion_at_jump, jump_table, unit_response
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.path_table import PathTable, Slow, mode_mixing
from vibrissa.mechanics.whisking.posture_path import PostureBox, PosturePath

_DEGREES = (4, 6, 9, 13, 19, 28)  # of the polynomials in one coordinate of the posture
_TAIL = 1e-7  # last coefficients over the largest
_STILL = 1e-12  # range of a coordinate that does not change
_WAYPOINTS = 25  # of the path, looked at when a posture has been refused


def _astray(contact: float, kappa: Array) -> Array:
    """Root sum square over j of 2 A_ji κ_i/(κ_i² − κ_j²): mode i's ringing in the other modes, per dε/dt."""
    gap = np.subtract.outer(kappa**2, kappa**2) + np.eye(len(kappa))
    return np.asarray(np.sqrt(np.sum((2 * mode_mixing(contact, len(kappa)) * kappa / gap) ** 2, axis=0)))


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

    Returns
    -------
    PathTable
        The polynomials.

    Raises
    ------
    InputError
        If a posture on the way, or in its box, is beyond the fold or cannot cross the gaps; named with the time
        where it is on the way.
    """
    widths = np.asarray(widths, float)
    try:
        return _tables(path.box, (float(widths.min()), float(widths.max())), form, n_modes)
    except InputError as refused:
        raise _named_with_time(path, widths, refused) from None


def _named_with_time(path: PosturePath, widths: Array, refused: InputError) -> InputError:
    """The first posture on the way that is refused, else what was refused in the box."""
    for t in np.linspace(path.time[0], path.time[-1], _WAYPOINTS):
        try:
            unit_response(path.at(t))
            excursion_at_jump(path.at(t), float(widths.max()))
        except InputError as error:
            return RangeError(f"posture at {t:.4g} s", "must be one that can cross the gaps", str(error))
    return RangeError(
        "posture path", "must keep to a range of contacts and angles that are all equilibria", str(refused)
    )


@lru_cache(maxsize=8)
def _tables(box: PostureBox, range_of_widths: tuple[float, float], form: Form, n_modes: int) -> PathTable:
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
    jumps = [jump_table(posture, widths) for posture in postures]
    d2 = np.array([jump(widths.max(keepdims=True))[0] for jump in jumps])
    slack = 1 + (1e-9 if len(postures) == 1 else 0.02)
    reach = slack * float(d2.min() - widths.max()), slack * float(d2.max())
    responses = [quasi_static(posture, reach, form=form, n_modes=n_modes) for posture in postures]
    borders = np.unique([end for one in responses for piece in one.pieces for end in (piece.low, piece.high)])
    coefficients = np.array([jump.coefficients for jump in jumps]).reshape(*shape, -1)
    along = np.array([contact_motion(one.basis) for one in responses]).reshape(*shape, -1)
    table = np.concatenate([values, coefficients, along], axis=2)
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


def _resolved(box: PostureBox, row: Callable[[Posture], Array]) -> tuple[list[Array], Array, float]:
    """Nodes of both coordinates, the rows there (A, B, R), and the tail, with degrees that resolve them."""
    rungs = [0, 0]
    while True:
        nodes = [
            Chebyshev(_DEGREES[rung] + 1, a, b, ends=True).nodes if b - a > _STILL else np.array([(a + b) / 2])
            for a, b, rung in zip(box.low, box.high, rungs, strict=True)
        ]
        values = np.array([[row(box.posture(np.array([a, b]))) for b in nodes[1]] for a in nodes[0]])
        tails = _tails(_in_posture(values))
        rough = [axis for axis in (0, 1) if tails[axis] > _TAIL and rungs[axis] < len(_DEGREES) - 1]
        if not rough:
            return nodes, values, max(tails)
        for axis in rough:
            rungs[axis] += 1


def _in_posture(values: Array) -> Array:
    """Chebyshev coefficients in the first two axes."""
    for axis in (0, 1):
        n = values.shape[axis]
        if n > 1:
            to_series = Chebyshev(n, ends=True).to_series
            values = np.moveaxis(np.tensordot(to_series, values, (1, axis)), 0, axis)
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
    d = np.concatenate([Chebyshev(n, low, high).nodes for low, high in pairwise(borders)])
    values = np.array([one(d) for one in responses]).reshape(len(responses), -1, len(borders) - 1, n)
    return np.asarray(np.einsum("mn,rkpn->rpkm", Chebyshev(n).to_series, values))
