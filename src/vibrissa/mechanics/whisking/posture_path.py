"""A posture that changes in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, InputError, MissingError, RangeError, ShapeError, TooFewError
from vibrissa.mechanics.statics.elastica_table import equilibria_at_height
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.tables.reader import read_table
from vibrissa.tables.stated import number, numbers
from vibrissa.tables.units import PURE

NEEDED, EITHER = {"time": "s", "base_angle": "rad"}, {"contact": PURE, "base_distance": PURE}
_ROUNDING = 1e-9  # [s] by which the ends of a path may be missed


@dataclass(frozen=True, kw_only=True)
class PosturePath:
    """How the whisker is held against the substrate, sampled in time; cubic splines between the samples.

    Attributes
    ----------
    time : (T,) array
        Times [s], ascending, two at least.
    base_angle : (T,) array
        Angle θ_b of the shaft at the base to the substrate [rad], in (0, π/2).
    contact, base_distance : (T,) arrays
        One of the two, over L: the contact ε along the shaft, or the height H of the base, from which ε follows.
    friction : float
        Coefficient μ.

    Raises
    ------
    InputError
        If a sample is out of range, or no contact exists under a base: named with its time.
    """

    time: Array
    base_angle: Array
    contact: Array | None = None
    base_distance: Array | None = None
    friction: float = 0.4

    def __post_init__(self) -> None:
        if (self.contact is None) == (self.base_distance is None):
            raise ConflictError("PosturePath", "must have either contact or base_distance")
        for name, unit in (NEEDED | EITHER).items():
            if getattr(self, name) is not None:
                object.__setattr__(self, name, numbers(f"PosturePath.{name}", getattr(self, name), unit))
        object.__setattr__(self, "friction", number("PosturePath.friction", self.friction, PURE))
        shapes = (self.time.shape, self.base_angle.shape, self._first.shape)
        if len(set(shapes)) > 1 or self.time.ndim != 1 or self.time.size < 2:
            sizes = ", ".join(" × ".join(map(str, shape)) or "a single number" for shape in shapes)
            raise ShapeError("PosturePath", "must have one value for each of two times or more", f"sizes {sizes}")
        back = np.flatnonzero(~(np.diff(self.time) > 0))
        if back.size or not np.isfinite(self.time).all():
            found = f"{self.time[back[0] + 1]:g} s after {self.time[back[0]]:g} s" if back.size else "infinity"
            raise RangeError("PosturePath.time", "must be finite and ascend", found)
        self._check()

    @property
    def _first(self) -> Array:
        chosen = self.base_distance if self.contact is None else self.contact
        return np.asarray(chosen)

    @property
    def _samples(self) -> Array:
        return np.stack([self._first, self.base_angle])

    def _check(self) -> None:
        """Refuse the first sample that is no equilibrium."""
        places = zip(self.time, self._samples.T, strict=True)
        if self.contact is not None:
            for t, place in places:
                _standing(t, partial(self.posture, place))
            return
        try:
            equilibria_at_height(self._first, self.base_angle, self.friction)
        except InputError:
            for t, (height, angle) in places:
                _standing(t, partial(equilibria_at_height, [height], [angle], self.friction))
            raise

    @cached_property
    def spline(self) -> CubicSpline:
        """Contact or height, and base angle, of time."""
        return CubicSpline(self.time, self._samples, axis=1)

    @cached_property
    def box(self) -> PostureBox:
        """Least and largest of both coordinates on the way."""
        t = np.interp(np.linspace(0, self.time.size - 1, 8 * self.time.size), np.arange(self.time.size), self.time)
        places = np.concatenate([self.spline(t), self._samples], axis=1)
        (a, b), (c, d) = places.min(axis=1).tolist(), places.max(axis=1).tolist()
        return PostureBox((a, b), (c, d), self.contact is None, self.friction)

    def posture(self, place: Array) -> Posture:
        """Posture at a pair of coordinates: contact or height, and base angle.

        Parameters
        ----------
        place : (2,) array
            Contact or height over L, base angle [rad].

        Returns
        -------
        Posture
            The posture.
        """
        return _posture(place, self.contact is None, self.friction)

    def at(self, t: float) -> Posture:
        """Posture at a time [s].

        Parameters
        ----------
        t : float
            Time [s].

        Returns
        -------
        Posture
            Of that moment.

        Raises
        ------
        InputError
            If the path does not reach that time.
        """
        first, last = self.time[0], self.time[-1]
        if not first - _ROUNDING <= t <= last + _ROUNDING:
            raise RangeError("t", f"must lie on the path, {first:g} to {last:g} s", f"{t:g}")
        return self.posture(self.spline(t))


@dataclass(frozen=True)
class PostureBox:
    """A range of postures: two that ask for the same tables are equal.

    Attributes
    ----------
    low, high : (float, float)
        Least and largest contact or height over L, and base angle [rad].
    at_height : bool
        Whether the first is the height.
    friction : float
        Coefficient μ.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    at_height: bool
    friction: float

    def posture(self, place: Array) -> Posture:
        """Posture at a pair of coordinates.

        Parameters
        ----------
        place : (2,) array
            Contact or height over L, base angle [rad].

        Returns
        -------
        Posture
            The posture.
        """
        return _posture(place, self.at_height, self.friction)


def _posture(place: Array, at_height: bool, friction: float) -> Posture:
    first, angle = map(float, place)
    if at_height:
        return Posture.at_height(first, angle, friction)
    return Posture(contact=first, base_angle=angle, friction=friction)


def _standing(t: float, attempt: Callable[[], object]) -> None:
    try:
        attempt()
    except InputError as refused:
        raise RangeError(f"posture at {t:.4g} s", "must be an equilibrium", str(refused)) from None


def read_posture_path(path: str | Path, friction: float = 0.4) -> PosturePath:
    """Posture path from a CSV: ``time`` [s], ``base_angle`` [rad], and ``contact`` or ``base_distance`` (over L).

    Parameters
    ----------
    path : Path
        CSV file.
    friction : float
        μ.

    Returns
    -------
    PosturePath
        The path.

    Raises
    ------
    InputError
        If the file is missing or not such a table, a cell is no number, or as :class:`PosturePath`.
    """
    table = read_table(path, NEEDED, EITHER, others=False)
    if len(table.header) != 3:
        rule = "must have the columns time,base_angle and contact or base_distance"
        raise MissingError(str(path), rule, ",".join(table.header), "in seconds, radians and over L")
    if len(table) < 2:
        raise TooFewError(str(path), "must have two lines or more below its header", len(table))
    values = {name: table.numbers(name) for name in table.named}
    try:
        return PosturePath(friction=friction, **values)
    except InputError as refused:
        raise refused.renamed(f"{path}: {refused.quantity}") from None
