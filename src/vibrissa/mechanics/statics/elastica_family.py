"""The table of all equilibria on the flat for one friction: how it is made; see ``elastica_table``."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError
from vibrissa.mechanics.statics.chebyshev import Chebyshev
from vibrissa.mechanics.statics.elastica_kernels import ends

_DEGREES = ((28, 24), (42, 36), (63, 54), (94, 81))  # in ε and p: the first will do for −0.3 < μ < 3
_TAIL = 3e-12  # last coefficients over the largest
_ITERATIONS = 60
RUNGS = 33  # loads between which the root is bracketed


@dataclass(frozen=True)
class Family:
    """Chebyshev coefficients in (ε, p) on [0, 1] × [0, ``load_max``] for one friction.

    ``psi``: ψ/p at the base, ``height``: H/(p(1 − ε)), ``distance``: D/(1 − ε); the first index counts polynomials in
    ε, the second in p.
    ``rungs``: ψ at evenly spaced loads, as coefficients in ε.
    """

    friction: float
    load_max: float
    psi: Array
    height: Array
    distance: Array
    rungs: Array

    @property
    def in_contact(self) -> Chebyshev:
        """Polynomials in ε."""
        return Chebyshev(self.psi.shape[0], 0.0, 1.0)

    @property
    def in_load(self) -> Chebyshev:
        """Polynomials in p."""
        return Chebyshev(self.psi.shape[1], 0.0, self.load_max)


def _march(contact: Array, load: Array, friction: float, tolerance: float) -> tuple[Array, Array, Array]:
    """ψ/p at the base, H/(p(1 − ε)) and D/(1 − ε) by marching in ln x.

    With n = m/x: dψ/d ln x = n/x², dn/d ln x = cos ψ + μ sin ψ − n (per Λ̂ cos φ), and likewise dD = cos ψ − D,
    dH = sin ψ − H for lengths over the piece of shaft below x. Every state is scaled to be of order 1 for any ε and p.
    """
    both = np.broadcast_arrays(contact, load)
    out = np.empty((3, both[0].size))
    epsilon, p = (np.ascontiguousarray(one, float).ravel() for one in both)
    ends(epsilon, p, friction, tolerance, out)
    psi, height, distance = out.reshape(3, *both[0].shape)
    return psi, height, distance


def _largest_load(friction: float) -> float:
    """Load p at which the base of any whisker has passed either π/2 or its largest angle."""
    contact = np.array([1e-3, 0.25, 0.5, 0.75, 0.999])[:, None]
    ladder, p = 1.1 ** np.arange(12), 1 / np.hypot(1, friction)
    for _ in range(_ITERATIONS):
        angle = p * ladder * _march(contact, p * ladder, friction, 1e-5)[0]
        falls = np.diff(angle, axis=1, prepend=0) < 0
        passed = np.logical_or.accumulate((angle > np.pi / 2) | falls, axis=1).all(axis=0)
        if passed.any():
            return float(p * ladder[passed.argmax()])
        p *= ladder[-2]
    raise ConvergenceError("largest load of a family", float(np.pi / 2 - angle.max()), _ITERATIONS)


def _tail(coefficients: Array) -> float:
    c = np.abs(coefficients)
    return float(max(c[-2:].max(), c[:, -2:].max()) / c.max())


@lru_cache(maxsize=32)
def family(friction: float) -> Family:
    """Tables of all equilibria on the flat for one friction.

    Parameters
    ----------
    friction : float
        μ.

    Returns
    -------
    Family
        The tables.

    Raises
    ------
    ConvergenceError
        If 94 × 81 polynomials are too few: μ above 1000.
    """
    load_max = _largest_load(friction)
    for degrees in _DEGREES:
        in_load = Chebyshev(degrees[1], 0.0, load_max)
        z, w = (chebyshev.chebpts1(n) for n in degrees)
        from_values = [np.linalg.inv(chebyshev.chebvander(v, len(v) - 1)) for v in (z, w)]
        tables = _march((1 + z[:, None]) / 2, load_max * (1 + w) / 2, friction, 1e-13)
        psi, height, distance = (from_values[0] @ table @ from_values[1].T for table in tables)
        worst = max(map(_tail, (psi, height, distance)))
        if worst < _TAIL:
            rungs = np.linspace(0, load_max, RUNGS)
            angles = psi @ in_load.polynomials(rungs).T * rungs
            return Family(friction, load_max, psi, height, distance, angles)
    raise ConvergenceError("family of equilibria", worst, len(_DEGREES))
