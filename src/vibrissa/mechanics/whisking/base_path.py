"""How the base of a whole whisker moves: height, angle and travel, whether anything touches or not."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from vibrissa.arrays import Array, Mask
from vibrissa.errors import MissingError, RangeError, ShapeError, TooFewError
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.posture_path import EITHER, NEEDED, PosturePath
from vibrissa.tables.reader import read_table
from vibrissa.tables.stated import number, numbers
from vibrissa.tables.units import PURE

_STEEPEST = np.pi / 2


@dataclass(frozen=True, kw_only=True)
class BasePath:
    """Where the base of a whisker is, sampled in time; cubic splines between the samples.

    Unlike the postures of :class:`vibrissa.mechanics.whisking.posture_path.PosturePath`, those of a base path need not
    touch the ground.

    Attributes
    ----------
    time : (T,) array
        Times [s], ascending, two at least.
    base_angle : (T,) array
        Angle θ_b of the shaft at the base to the substrate [rad], in (−π/2, π/2).
    base_distance : (T,) array
        Height H of the base above the substrate line, over L.
    travel : (T,) array, optional
        Way of the base along the substrate [m], beside that at the scanning speed; none by default.
    friction : float
        Coefficient μ.

    Raises
    ------
    InputError
        If a sample is out of range: named with its time.
    """

    time: Array
    base_angle: Array
    base_distance: Array
    travel: Array | None = None
    friction: float = 0.4

    def __post_init__(self) -> None:
        if self.travel is None:
            object.__setattr__(self, "travel", np.zeros(np.shape(self.time)))
        for name, unit in (NEEDED | {"base_distance": PURE, "travel": "m"}).items():
            object.__setattr__(self, name, numbers(f"BasePath.{name}", getattr(self, name), unit))
        object.__setattr__(self, "friction", number("BasePath.friction", self.friction, PURE))
        samples = (self.base_angle, self.base_distance, self._travel)
        if self.time.ndim != 1 or self.time.size < 2 or any(one.shape != self.time.shape for one in samples):
            sizes = ", ".join(str(one.size) for one in (self.time, *samples))
            raise ShapeError("BasePath", "must have one value for each of two times or more", f"sizes {sizes}")
        if not (np.isfinite(self.time).all() and (np.diff(self.time) > 0).all()):
            raise RangeError("BasePath.time", "must be finite and ascend", "other times")
        self._refuse("base_angle", ~(np.abs(self.base_angle) < _STEEPEST), "must lie in −π/2 to π/2 rad")
        self._refuse("base_distance", ~((self.base_distance > 0) & (self.base_distance < 2)), "must lie in 0 to 2 L")
        self._refuse("travel", ~np.isfinite(self._travel), "must be finite (m)")
        if not self.friction >= 0:
            raise RangeError("BasePath.friction", "must not be negative for the rod", self.friction)

    def _refuse(self, name: str, bad: Mask, rule: str) -> None:
        if bad.any():
            i = int(bad.argmax())
            raise RangeError(f"BasePath.{name} at {self.time[i]:.4g} s", rule, getattr(self, name)[i])

    @property
    def _travel(self) -> Array:
        return np.asarray(self.travel)

    @cached_property
    def spline(self) -> CubicSpline:
        """Height over L, base angle [rad] and travel [m], of time."""
        return CubicSpline(self.time, np.stack([self.base_distance, self.base_angle, self._travel]), axis=1)

    @classmethod
    def of(cls, path: PosturePath) -> BasePath:
        """Motion of the base on a path of postures.

        Parameters
        ----------
        path : PosturePath
            Of contact or height, and angle.

        Returns
        -------
        BasePath
            Whose heights are those of Eq. (1) where the contact is given.
        """
        height = path.base_distance
        if height is None:
            height = np.array([_height(path.posture(place)) for place in path._samples.T])
        return cls(time=path.time, base_angle=path.base_angle, base_distance=height, friction=path.friction)


def _height(posture: Posture) -> float:
    return float(on_the_flat(posture).base[1])


def read_base_path(path: str | Path, friction: float = 0.4) -> BasePath:
    """Path of a base from a CSV: ``time`` [s], ``base_angle`` [rad], ``base_distance`` or ``contact`` (over L).

    Parameters
    ----------
    path : Path
        CSV file; a fourth column ``travel`` [m] may be there.
    friction : float
        μ.

    Returns
    -------
    BasePath
        The path; heights of contacts are those of Eq. (1).

    Raises
    ------
    InputError
        If the file is missing or not such a table, a cell is no number, or as :class:`BasePath`.
    """
    table = read_table(path, NEEDED, {**EITHER, "travel": "m"}, others=False)
    if ("contact" in table.named) == ("base_distance" in table.named):
        rule = "must have the columns time,base_angle and base_distance or contact (and travel)"
        raise MissingError(str(path), rule, ",".join(table.header), "in seconds, radians, over L (and metres)")
    if len(table) < 2:
        raise TooFewError(str(path), "must have two lines or more below its header", len(table))
    values = {name: table.numbers(name) for name in table.named}
    travel = values.pop("travel", None)
    if "contact" in values:
        found = BasePath.of(PosturePath(friction=friction, **values))
        return BasePath(
            time=found.time,
            base_angle=found.base_angle,
            base_distance=found.base_distance,
            travel=travel,
            friction=friction,
        )
    return BasePath(travel=travel, friction=friction, **values)
