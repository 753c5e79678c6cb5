"""Profiles held at any excursion and height of the contact, as polynomials in the two."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import get_args

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, UnknownError
from vibrissa.mechanics.modes.basis import Basis, Modes, basis, couplings
from vibrissa.mechanics.quasi_static.held_table import ContactBox, HeldTable
from vibrissa.mechanics.quasi_static.projection import Projection
from vibrissa.mechanics.quasi_static.response import Form
from vibrissa.mechanics.quasi_static.response_rows import held_rows, table_rows
from vibrissa.mechanics.statics.chebyshev import Chebyshev, sum_of_two
from vibrissa.mechanics.statics.edge_contact import Held
from vibrissa.mechanics.statics.gap import unit_response


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
        """Chebyshev coefficients (K, J, K') of the rows of a flat's ``Response``."""
        project = Projection(self.flat, self.basis)
        of_flat = held_rows(self.flat, self.basis, self.flat)
        return self._formed(table_rows(project, self.table.profiles(project.s)), of_flat)

    def __call__(self, d: Array, z: Array) -> Array:
        """All rows at excursions d and heights z, (K, len(d))."""
        return self._at(self.rows, d, z)

    def position(self, d: Array, z: Array, s: Array) -> tuple[Array, Array]:
        """Position of points of the shaft from the base, along the substrate and up, over L, (len(d), S).

        Below the contact the free end goes on straight.

        Parameters
        ----------
        d : (T,) array
            Excursions over L.
        z : (T,) array
            Heights over L.
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        x, y : (T, S) arrays
            Along the substrate and up, over L.
        """
        return self.placed(d, z, self.places(s))

    def places(self, s: Array) -> Array:
        """Chebyshev coefficients (2, S, J, K) of the position of points of the shaft, for :meth:`placed`.

        Parameters
        ----------
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        (2, S, J, K) array
            Chebyshev coefficients.
        """
        return self._formed(self.table.positions(s), np.stack(self.flat.position(s)))

    def placed(self, d: Array, z: Array, places: Array) -> tuple[Array, Array]:
        """As :meth:`position`, of points whose places are known.

        Parameters
        ----------
        d : (T,) array
            Excursions over L.
        z : (T,) array
            Heights over L.
        places : (2, S, J, K) array
            Of :meth:`places`.

        Returns
        -------
        x, y : (T, S) arrays
            Along the substrate and up, over L.
        """
        x, y = self._at(places, d, z).transpose(0, 2, 1)
        return x, y

    def displacement(self, d: Array, z: Array, s: Array) -> Array:
        """Transverse displacement n₁·(r − r₁) about the profile on the flat, over L, (len(d), S).

        Parameters
        ----------
        d : (T,) array
            Excursions over L.
        z : (T,) array
            Heights over L.
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        (T, S) array
            Over L, positive away from the substrate.
        """
        return self.flat.displaced(*self.position(d, z, s), s)

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
        sum_of_two(series, *self.table.box.unit(d, z), out)
        return out.reshape(*coefficients.shape[:-2], len(d))


def _tangent(coefficients: Array, box: ContactBox) -> tuple[Array, Array]:
    """Derivatives (…) by d at fixed z and by z at fixed d, at d = z = 0."""
    out = []
    zero = box.unit(np.zeros(1), np.zeros(1))
    for axis in (0, 1):
        along = Chebyshev(coefficients.shape[axis - 2], box.low[axis], box.high[axis])
        slope = np.moveaxis(along.derivative(np.moveaxis(coefficients, axis - 2, 0)), 0, axis - 2)
        basis = [Chebyshev(n).polynomials(x)[0] for x, n in zip(zero, slope.shape[-2:], strict=True)]
        out.append(np.einsum("...jk,j,k->...", slope, *basis))
    return out[0], out[1] - box.tilt * out[0]


def ground_response(
    table: HeldTable, *, form: Form = "exact", n_modes: int = 12, modes: Modes = "straight"
) -> GroundResponse:
    """Response of a posture whose profiles are tabulated.

    See :func:`vibrissa.mechanics.quasi_static.response.quasi_static`.

    Parameters
    ----------
    table : HeldTable
        The profiles.
    form : {"exact", "linear"}
        Rows of the profiles themselves, or their tangent on the flat.
    n_modes : int
        Number of modes.
    modes : str
        Which modes; see :func:`vibrissa.mechanics.modes.basis.basis`.

    Returns
    -------
    GroundResponse
        By excursion and height.

    Raises
    ------
    InputError
        If there is no mode, or no such form.
    """
    if form not in get_args(Form):
        raise UnknownError("response", "must be 'exact' or 'linear'", repr(form))
    if n_modes < 1:
        raise RangeError("number of modes", "must be at least 1", n_modes)
    shapes = basis(modes, table.flat, n_modes)
    return GroundResponse(table, form, shapes, couplings(shapes, unit_response(table.flat.posture)))


def flat_tilt(flat: Held) -> float:
    """∂d/∂z along which the contact angle stays 0: where flat ground at another height holds the contact.

    Parameters
    ----------
    flat : Held
        Profile on the flat.

    Returns
    -------
    float
        Excursion over height [1].
    """
    by_d, by_z = np.linalg.solve(flat.sensitivity, np.array([[0.0, 0.0], [1.0, 0.0], [0.0, -1.0]]))[1]
    return float(-by_z / by_d)
