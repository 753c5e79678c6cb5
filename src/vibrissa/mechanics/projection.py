"""Amplitudes of the modes in many profiles of one posture at once, in which edges hold the whisker."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from vibrissa.errors import ConvergenceError
from vibrissa.exact import gauss, shaft_quadrature
from vibrissa.mechanics import march
from vibrissa.mechanics.basis import Basis
from vibrissa.mechanics.edge import Held, hold
from vibrissa.mechanics.profile import nodes_to_series, unit_nodes

Array = NDArray[np.float64]

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

    Raises
    ------
    InputError
        If an excursion is not reached; see :func:`vibrissa.mechanics.edge.hold`.
    """
    out = Profiles(*(np.empty((len(excursions), *rest)) for rest in ((3,), s.shape, s.shape, ())))
    posture, (distance, height) = flat.posture, flat.base
    start = np.array([flat.contact, 0.0, flat.curve.load])
    stands = posture.base_angle, distance, height, posture.friction_angle
    reached = march.follow(start, *stands, excursions, s, march.LONGEST, *out)
    if reached < len(excursions):
        hold(flat, float(excursions[reached]))  # refuses, and tells why
        raise ConvergenceError("profile on an edge", float(excursions[reached]), reached)
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
        return np.append(self.flat.contact * np.exp(unit_nodes()[:-1] * self.flat.curve.span), 1.0)

    @cached_property
    def matrix(self) -> Array:
        """From displacements of the points along the substrate and up, (2, M, N)."""
        s, weights = shaft_quadrature(self.flat.contact, 80 + 8 * len(self.modes.kappa))
        at = 2 * np.log(s / self.flat.contact) / self.flat.curve.span - 1
        between = chebyshev.chebvander(at, len(self.s) - 1) @ nodes_to_series()
        return np.asarray(self.modes.adjoint(s) * (weights * s**2) @ between)

    def of_displacement(self, x: Array, y: Array) -> Array:
        """Amplitudes (M, …) of displacements (N, …) of the points, over L."""
        return np.asarray(self.matrix[0] @ x + self.matrix[1] @ y)

    def of_profiles(self, held: Profiles) -> Array:
        """Amplitudes (M, E) of profiles at the points :attr:`s`; their free ends are straight."""
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
        march.straightened(unknowns, self.flat.posture.friction_angle, s, march.LONGEST, x, y)
        across = self._adjoint(s) * (weights * s**2)
        return np.asarray((across[0] * x + across[1] * y).sum(axis=-1))

    def _adjoint(self, s: Array) -> Array:
        """Adjoint modes (2, M, …) at points s near one another; of many points from polynomials between few."""
        count, low, high = _BETWEEN + 4 * len(self.modes.kappa), s.min(), s.max()
        if s.size <= 2 * count or high == low:
            return self.modes.adjoint(s.ravel()).reshape(2, -1, *s.shape)
        nodes = chebyshev.chebpts1(count)
        to_series = np.linalg.inv(chebyshev.chebvander(nodes, count - 1))
        at = chebyshev.chebvander((2 * s.ravel() - low - high) / (high - low), count - 1)
        few = self.modes.adjoint((low + high) / 2 + (high - low) / 2 * nodes)
        return np.asarray(few @ (at @ to_series).T).reshape(2, -1, *s.shape)
