"""Resonances of a sliding shaft by a chain of links linearised in numbers: its contact a point of itself, or an edge.

Its forces are those of the bent chain and are differentiated in numbers. Over an edge the shaft slips: the load moves
along the shaft, and turns with its normal.
"""

from __future__ import annotations

import numpy as np
from case import Array, Case
from scipy.optimize import brentq
from scipy.special import iv, jv, kv, yv

LINKS = 60, 120, 240
SMALL = 1e-6  # [rad] step of the differences


class Chain:
    """N links in the units of the model: lengths over L, EI = s⁴, mass s² per length, time over k."""

    def __init__(self, case: Case, over_edge: bool, links: int) -> None:
        self.case, self.over_edge, self.links = case, over_edge, links
        s = np.linspace(1, case.contact, links + 1)
        middle = np.concatenate([[1.0], (s[1:] + s[:-1]) / 2])
        self.s, self.link = s, s[:-1] - s[1:]
        self.stiffness = 3 / (middle[1:] ** -3 - middle[:-1] ** -3)
        self.rest = case.flat.angle(middle[1:])
        self.start = np.array(self.ends(self.rest))[:, -1]

    def ends(self, angle: Array) -> tuple[Array, Array]:
        """Positions of the links' ends from the base, (N,) each."""
        return -np.cumsum(self.link * np.cos(angle)), -np.cumsum(self.link * np.sin(angle))

    def contact(self, angle: Array) -> tuple[float, float, float]:
        """Miss of the constraint; where along the last link the load is, from its upper end; angle its normal has."""
        x, y = self.ends(angle)
        if not self.over_edge:
            return y[-1] - self.start[1], self.link[-1], 0.0
        away_x, away_y = self.start[0] - x[-2], self.start[1] - y[-2]
        last = angle[-1]
        return away_x * np.sin(last) - away_y * np.cos(last), -(away_x * np.cos(last) + away_y * np.sin(last)), last

    def force(self, angle: Array, load: float) -> Array:
        """Generalised forces on the angles, (N,)."""
        _, along, turn = self.contact(angle)
        moment = self.stiffness * np.diff(angle, prepend=self.case.base_angle)
        lever = np.append(self.link[:-1], along)
        friction = self.case.posture.friction_angle
        pull = load * (np.sin(friction + turn) * -np.sin(angle) - np.cos(friction + turn) * np.cos(angle))
        return lever * pull - moment + np.append(moment[1:], 0.0)

    def mass(self) -> Array:
        """Mass matrix at rest, (N, N)."""
        up, down = self.s[:-1], self.s[1:]
        mass = (up**3 - down**3) / 3
        mean, square = (up**4 - down**4) / 4 / mass, (up**5 - down**5) / 5 / mass
        arm = np.tril(np.broadcast_to(self.link, (self.links, self.links)), -1) + np.diag(up - mean)
        between = self.rest[:, None] - self.rest
        return (arm.T * mass @ arm) * np.cos(between) + np.diag(mass * (square - mean**2))

    def kappa(self, count: int = 3) -> Array:
        """Lowest κ, complex where friction feeds or drains the motion."""
        load = self.case.flat.contact_force
        steps = SMALL * np.eye(self.links)
        change = np.stack([self.force(self.rest + h, load) - self.force(self.rest - h, load) for h in steps], axis=1)
        miss = np.array([self.contact(self.rest + h)[0] - self.contact(self.rest - h)[0] for h in steps])
        inverse = np.linalg.inv(self.mass())
        push = inverse @ (self.force(self.rest, load + 1) - self.force(self.rest, load))
        accelerate = inverse @ change / (2 * SMALL)
        held = accelerate - np.outer(push, miss @ accelerate) / (miss @ push)
        found = np.sqrt(-np.linalg.eigvals(held).astype(complex))
        return np.sort_complex(found[found.real > 1])[:count]


def limit(case: Case, over_edge: bool) -> float:
    """κ₁ of ever more links, whose error is of first and second order in their length."""
    few, some, many = (Chain(case, over_edge, links).kappa(1)[0].real for links in LINKS)
    return float((8 * many - 6 * some + few) / 3)


def clamped(contact: float) -> float:
    """κ₁ of the straight cone with V = V' = 0 at both ends, from the Bessel functions of its modes."""

    def determinant(kappa: float) -> float:
        z = 2 * np.sqrt(kappa * np.array([contact, 1.0]))
        rows = [[jv(n, z), yv(n, z), sign * iv(n, z), kv(n, z)] for n, sign in ((2, 1), (3, -1))]
        return float(np.linalg.det(np.concatenate([np.array(row).T for row in rows])))

    kappa = np.linspace(15, 40, 51)
    value = np.array([determinant(one) for one in kappa])
    first = int(np.flatnonzero(value[1:] * value[:-1] < 0)[0])
    return float(brentq(determinant, kappa[first], kappa[first + 1]))
