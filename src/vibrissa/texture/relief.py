"""Any height profile of a surface: straight between its points, with vertical walls where it steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array, ByValue, Mask
from vibrissa.errors import FormatError, RangeError, ShapeError, TooFewError
from vibrissa.tables.stated import numbers
from vibrissa.texture.surface import LONGEST, Gaps

SHORTEST = 35e-6  # [m] a profile below the smallest feature of the paper's gratings is no texture
HIGHEST = 0.01  # [m] beyond it a unit is wrong
SAY_METRES = "positions and heights are in metres"


@dataclass(frozen=True, eq=False)
class HeightProfile(ByValue):
    """Height of a surface along the scan, straight between its points and level beyond the first and the last.

    Attributes
    ----------
    position : (N,) array
        Places X along the substrate, towards the base [m], ascending; X = 0 meets the contact at time 0. A place that
        is there twice, with two heights, is a vertical wall from the first to the second.
    height : (N,) array
        Heights h above the substrate line, away from the surface towards the base [m].
    """

    position: Array
    height: Array

    def __post_init__(self) -> None:
        for name in ("position", "height"):
            object.__setattr__(self, name, numbers(name, getattr(self, name), "m"))
        if self.position.shape != self.height.shape or self.position.ndim != 1:
            found = f"{self.position.shape}, {self.height.shape}"
            raise ShapeError("relief", "must have one height for each position", found)
        if self.position.size < 2:
            raise TooFewError("relief", "must have at least two points", self.position.size)
        self._refuse(~np.isfinite(self.position + self.height), "must have finite positions and heights")
        step, rise = np.diff(self.position), np.diff(self.height)
        later = np.concatenate([[False], step < 0])
        self._refuse(later, "must have ascending positions", "sort the points")
        self._refuse(np.concatenate([[False], (step == 0) & (rise == 0)]), "must not repeat a point")
        third = np.concatenate([[False, False], (step[1:] == 0) & (step[:-1] == 0)])
        self._refuse(third, "must have no more than two heights at one position")
        if not self.length >= SHORTEST:
            raise RangeError("relief", f"must be at least {SHORTEST:g} m long", f"{self.length:.4g} m", SAY_METRES)
        self._refuse(np.abs(self.position) > LONGEST, f"must lie within {LONGEST:g} m", SAY_METRES)
        self._refuse(np.abs(self.height) > HIGHEST, f"must be within {HIGHEST:g} m of the substrate line", SAY_METRES)

    def _refuse(self, wrong: Mask, rule: str, remedy: str = "") -> None:
        """Name the first point that breaks a rule."""
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            found = f"point {first + 1} at {self.position[first]:.6g} m, height {self.height[first]:.6g} m"
            raise FormatError("relief", rule, found, remedy)

    @property
    def length(self) -> float:
        """From the first point to the last [m]."""
        return float(self.position[-1] - self.position[0])

    def at(self, x: ArrayLike) -> Array:
        """Height of the surface; at a wall that of the side nearer the base.

        Parameters
        ----------
        x : (...) array
            Position along the substrate [m].

        Returns
        -------
        (...) array
            Height [m]; NaN where x is NaN.
        """
        x = numbers("x", x, "m")
        last = len(self.position) - 1
        right = np.clip(np.searchsorted(self.position, x, side="right"), 1, last)
        step = self.position[right] - self.position[right - 1]
        beyond = x - self.position[right - 1]
        share = np.clip(np.where(step > 0, beyond / np.where(step > 0, step, 1.0), beyond >= 0), 0, 1)
        low, high = self.height[right - 1], self.height[right]
        return np.where(np.isnan(x), np.nan, np.where(share < 1, low + share * (high - low), high))

    def low(self) -> tuple[Array, Array]:
        """Where stretches of points below the middle of all heights begin, and how wide they are [m], (J,) each."""
        below = self.height < (self.height.min() + self.height.max()) / 2
        edges = np.flatnonzero(np.diff(np.concatenate([[False], below, [False]])))
        first, last = self.position[edges[0::2]], self.position[edges[1::2] - 1]
        return first[last > first], (last - first)[last > first]

    @classmethod
    def from_gaps(cls, texture: Gaps) -> HeightProfile:
        """Rectangular gaps with vertical walls; the land around them at height 0.

        The land before the first gap and after the last is as wide as these gaps.

        Parameters
        ----------
        texture : Gaps
            The gaps.

        Returns
        -------
        HeightProfile
            Two points for each wall.
        """
        edges = np.stack([texture.position, texture.position, texture.end, texture.end], axis=1).ravel()
        heights = np.tile([0.0, -texture.depth, -texture.depth, 0.0], texture.position.size)
        before, after = edges[0] - texture.width[0], edges[-1] + texture.width[-1]
        return cls(position=np.concatenate([[before], edges, [after]]), height=np.concatenate([[0.0], heights, [0.0]]))
