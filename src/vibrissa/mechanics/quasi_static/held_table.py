"""Profiles held at Chebyshev nodes of the excursion and the height of the contact."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, RangeError
from vibrissa.mechanics.quasi_static import held_grid
from vibrissa.mechanics.quasi_static.projection import Profiles, placed
from vibrissa.mechanics.statics.chebyshev import Chebyshev, unit_nodes
from vibrissa.mechanics.statics.edge_contact import Held, hold
from vibrissa.mechanics.statics.shooting import LONGEST

_COUNTS = ((14, 18, 22, 27, 32), (6, 8, 10, 12, 14))  # of Chebyshev nodes in excursion and in height, one of each
_LEAST = (14, 6)
_AHEAD = 18  # and along the substrate, towards the base
_TAIL = 1e-9  # last coefficients over the largest: of d₂ a part in a million


@dataclass(frozen=True)
class ContactBox:
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
        """Excursions and heights (over L) of two coordinates in [−1, 1].

        Parameters
        ----------
        unit : tuple of two arrays
            Coordinates in [−1, 1].

        Returns
        -------
        d, z : arrays
            Over L.
        """
        sheared, z = ((a + b) / 2 + (b - a) / 2 * x for a, b, x in zip(self.low, self.high, unit, strict=True))
        return sheared + self.tilt * z, z

    def unit(self, d: Array, z: Array) -> tuple[Array, Array]:
        """Coordinates in [−1, 1] of excursions and heights over L.

        Parameters
        ----------
        d, z : arrays
            Excursions and heights, over L.

        Returns
        -------
        tuple of two arrays
            Coordinates in [−1, 1].
        """
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
    box : ContactBox
        Range of the nodes.
    unknowns : (J, K, 3) array
        ε, θ_ε [rad] and Λ̂ at each node of the excursion and of the height.
    reach : float
        Distance along the substrate from the contact, over L, up to which ``ahead`` holds the profile.
    ahead : (n, J, K) array
        Height of the base side above the contact over the distance from it, y/u: Chebyshev coefficients in u, δ, z.
    """

    flat: Held
    box: ContactBox
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
        """Chebyshev coefficients (…, J, K) of what the profiles have, (…, J · K).

        Parameters
        ----------
        values : (…, J · K) array
            At the nodes.

        Returns
        -------
        (…, J, K) array
            Coefficients.
        """
        first, second = (Chebyshev(n).to_series for n in self.shape)
        return np.asarray(first @ values.reshape(*values.shape[:-1], *self.shape) @ second.T)

    def profiles(self, s: Array) -> Profiles:
        """All profiles at ascending points s (N,), s[-1] = 1.

        Parameters
        ----------
        s : (N,) array
            Points, ascending, s[-1] = 1.

        Returns
        -------
        Profiles
            J · K of them; Eq. 1's curve goes on below ε.
        """
        return placed(self.flat, self.unknowns.reshape(-1, 3), s)

    def positions(self, s: Array) -> Array:
        """Positions (2, S, J · K) of points from the base, over L; straight are the free end, and above 1.

        Parameters
        ----------
        s : (S,) array
            Points of the shaft, over L; above 1 in the follicle.

        Returns
        -------
        (2, S, J · K) array
            Along the substrate and up, over L.
        """
        points = np.append(np.unique(s[s < 1]), 1.0)
        _, x, y, _ = placed(self.flat, self.unknowns.reshape(-1, 3), points, straight=True)
        which, angle = np.searchsorted(points, np.minimum(s, 1)), self.flat.posture.base_angle
        inside = np.maximum(s - 1, 0)[:, None] * np.array([np.cos(angle), np.sin(angle)])[:, None, None]
        return np.stack([x.T[which], y.T[which]]) + inside


def held_table(flat: Held, box: ContactBox, reach: float, least: tuple[int, int] = _LEAST) -> HeldTable:
    """Tabulate the profiles of a box, with as many nodes as it takes, ``least`` at first.

    Parameters
    ----------
    flat : Held
        Profile on the flat.
    box : ContactBox
        Where the contact may be.
    reach : float
        How far ahead of the contact the profiles are wanted, over L.
    least : (int, int)
        Nodes in excursion and height to begin with.

    Returns
    -------
    HeldTable
        With as many nodes as it takes.

    Raises
    ------
    InputError
        If a corner cannot be held, or lies so near the fold that no polynomial serves.
    """
    in_u, u = Chebyshev(_AHEAD), reach * (1 + unit_nodes(_AHEAD)) / 2
    shape: tuple[int, int] | None = least
    while shape is not None:
        table = HeldTable(flat, box, _held(flat, box, shape), reach, np.empty(0))
        ahead = np.tensordot(in_u.to_series, table.series(_rises(table, u)), 1)
        short = [_tail(ahead, axis, n) >= _TAIL for axis, n in enumerate(shape)]
        if not any(short):
            return replace(table, ahead=ahead)
        shape = _finer(shape, short)
    raise RangeError(
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


def _held(flat: Held, box: ContactBox, shape: tuple[int, int]) -> Array:
    """ε, θ_ε and Λ̂ of the profile held at every node, (J, K, 3)."""
    first, second = np.meshgrid(*map(unit_nodes, shape), indexing="ij")
    d, z = box.place((first, second))
    unknowns = np.empty((*shape, 3))
    rows, middle = np.argsort(np.abs(z[0])), int(np.argmin(np.abs(d[:, 0] - box.tilt * z[0, 0])))
    missed = held_grid.settle(flat.start, flat.clamp, d, z[0], rows, middle, LONGEST, unknowns)
    if missed >= 0:
        excursion, above = float(d.flat[missed]), float(z.flat[missed])
        hold(flat, excursion, height=above)  # refuses, with the reason
        raise ConvergenceError("profile on an edge", excursion, missed)
    return unknowns


def _rises(table: HeldTable, u: Array) -> Array:
    """Height of the profiles above their contact, over the distance u from it towards the base, (U, J · K)."""
    unknowns = table.unknowns.reshape(-1, 3)
    out = np.empty((len(unknowns), len(u)))
    held_grid.rises(unknowns, table.flat.posture.law, u[::-1].copy(), LONGEST, out)  # which ascend
    return np.ascontiguousarray(out.T[::-1])
