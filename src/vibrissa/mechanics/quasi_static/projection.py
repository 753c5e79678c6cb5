"""Amplitudes of the modes in many profiles of one posture at once, in which edges hold the whisker."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError
from vibrissa.exact import gauss, shaft_quadrature
from vibrissa.mechanics.modes.basis import Basis
from vibrissa.mechanics.statics import shooting
from vibrissa.mechanics.statics.chebyshev import Chebyshev
from vibrissa.mechanics.statics.continuation import chain
from vibrissa.mechanics.statics.edge_contact import Held, hold
from vibrissa.mechanics.statics.placing import place_all, straightened
from vibrissa.mechanics.statics.profile import ALONG

_BETWEEN = 24  # Chebyshev nodes, and 4 more for each mode, from which modes at many points are read
_DRAWN = 8  # Gauss nodes between ε on the flat and where an edge has drawn the contact to: the shaft is straight there


class Profiles(NamedTuple):
    """Profiles that an edge holds at excursions (E,) of one posture, its base where it was.

    Attributes
    ----------
    unknowns : (E, 3) array
        ε, θ_ε [rad] and Λ̂ of each.
    x, y : (E, N) arrays
        Position over L from the base of the points asked for; below ε that of Eq. 1's curve going on.
    base_curvature : (E,) array
        θ'(1), over 1/L.
    """

    unknowns: Array
    x: Array
    y: Array
    base_curvature: Array


def profiles(flat: Held, excursions: Array, s: Array) -> Profiles:
    """Profiles at a chain of excursions (E,), over L, each found from the one before, at ascending points s (N,).

    Parameters
    ----------
    flat : Held
        Profile on the flat.
    excursions : (E,) array
        d over L, each near the one before.
    s : (N,) array
        Points, ascending, s[-1] = 1.

    Returns
    -------
    Profiles
        One for each excursion.

    Raises
    ------
    InputError
        If an excursion is not reached; see :func:`vibrissa.mechanics.statics.edge_contact.hold`.
    """
    unknowns = np.empty((len(excursions), 3))
    reached = chain(flat.start, flat.clamp, excursions, shooting.LONGEST, unknowns)
    if reached < len(excursions):
        hold(flat, float(excursions[reached]))  # refuses, and says why
        raise ConvergenceError("profile on an edge", float(excursions[reached]), reached)
    return placed(flat, unknowns, s)


def placed(flat: Held, unknowns: Array, s: Array, *, straight: bool = False) -> Profiles:
    """Place the points of profiles that are known.

    Parameters
    ----------
    flat : Held
        Profile on the flat.
    unknowns : (E, 3) array
        ε, θ_ε [rad] and Λ̂ of each.
    s : (N,) array
        Points, ascending, s[-1] = 1.
    straight : bool
        Whether the free end is straight; else Eq. 1's curve goes on below ε.

    Returns
    -------
    Profiles
        One for each row.
    """
    out = Profiles(unknowns, *(np.empty((len(unknowns), *rest)) for rest in (s.shape, s.shape, ())))
    place_all(unknowns, flat.posture.law, s, shooting.LONGEST, straight, *out[1:])
    return out


@dataclass(frozen=True)
class Projection:
    """Turns profiles into amplitudes of modes, Q_i = ∫_ε^1 s² (r − r₁)·l_i ds; for straight modes l_i = V_i n₁.

    Attributes
    ----------
    flat : Held
        Profile on the flat.
    modes : Basis
        The modes.
    """

    flat: Held
    modes: Basis

    @cached_property
    def s(self) -> Array:
        """Points from ε to 1, Chebyshev nodes in ln s, (N,): profiles are smooth between them, modes need not be."""
        return np.append(self.flat.contact * np.exp(ALONG.nodes[:-1] * self.flat.curve.span), 1.0)

    @cached_property
    def matrix(self) -> Array:
        """From displacements of the points along the substrate and up, (2, M, N)."""
        s, weights = shaft_quadrature(self.flat.contact, 80 + 8 * len(self.modes.kappa))
        between = ALONG.polynomials(np.log(s / self.flat.contact) / self.flat.curve.span) @ ALONG.to_series
        return np.asarray(self.modes.adjoint(s) * (weights * s**2) @ between)

    def of_displacement(self, x: Array, y: Array) -> Array:
        """Amplitudes (M, …) of displacements (N, …) of the points, over L.

        Parameters
        ----------
        x, y : (N, …) arrays
            Displacement of the points :attr:`s` along the substrate and up, over L.

        Returns
        -------
        (M, …) array
            Amplitudes over L.
        """
        return np.asarray(self.matrix[0] @ x + self.matrix[1] @ y)

    def of_profiles(self, held: Profiles) -> Array:
        """Amplitudes (M, E) of profiles at the points :attr:`s`; their free ends are straight.

        Parameters
        ----------
        held : Profiles
            At the points :attr:`s`.

        Returns
        -------
        (M, E) array
            Amplitudes over L.
        """
        c = self.flat.curve  # whose own nodes the points are
        x, y = (self.flat.contact * (values - values[-1]) for values in (c.x, c.y))
        out = self.of_displacement((held.x - x).T, (held.y - y).T)
        drawn = held.unknowns[:, 0] > self.flat.contact
        if drawn.any():
            out[:, drawn] += self._of_free_ends(held.unknowns[drawn])
        return out

    def _of_free_ends(self, unknowns: Array) -> Array:
        """What the shaft between ε on the flat and its contact adds by being straight there, (M, E)."""
        z, w = gauss(_DRAWN)
        low, width = self.flat.contact, unknowns[:, :1] - self.flat.contact
        s, weights = low + width * (1 + z) / 2, width * w / 2
        x, y = np.empty((2, *s.shape))
        straightened(unknowns, self.flat.posture.law, s, shooting.LONGEST, x, y)
        across = self._adjoint(s) * (weights * s**2)
        return np.asarray((across[0] * x + across[1] * y).sum(axis=-1))

    def _adjoint(self, s: Array) -> Array:
        """Adjoint modes (2, M, …) at points s near one another; of many points from polynomials between few."""
        count, low, high = _BETWEEN + 4 * len(self.modes.kappa), s.min(), s.max()
        if s.size <= 2 * count or high == low:
            return self.modes.adjoint(s.ravel()).reshape(2, -1, *s.shape)
        between = Chebyshev(count, low, high)
        few = self.modes.adjoint(between.nodes)
        return np.asarray(few @ (between.polynomials(s.ravel()) @ between.to_series).T).reshape(2, -1, *s.shape)
