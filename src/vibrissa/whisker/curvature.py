"""The curvature that a whisker has in air: a table of it, a fit to its shape, and the regression over the rat's pad."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array
from vibrissa.errors import MissingError, RangeError, ShapeError, TooFewError
from vibrissa.tables.reader import read_table
from vibrissa.tables.stated import numbers
from vibrissa.tables.table import Table
from vibrissa.whisker.cone import Whisker
from vibrissa.whisker.euler_spiral import fit_euler_spiral
from vibrissa.whisker.measured import atlas_entry

MOST = 200.0  # 1/m: a whisker that curls within five millimetres has another unit
COLUMNS = {"distance": "m", "curvature": "1/m", "x": "m", "y": "m"}
_POINTS = 101  # of the table of a parabola
_COLUMN_ANGLE, _GREEK_ANGLE = 13.4, -35.2  # [°] the base point's azimuth: 13.4 c − 48.6 with c = 1 for the Greek arc
_SLOPE, _OFFSET = 0.24, 14.8  # [1/m] of y = A x²: A = 0.24 azimuth/° + 14.8


@dataclass(frozen=True, kw_only=True)
class IntrinsicCurvature:
    """Curvature of the free shaft along it: straight lines between points, constant beyond the first and the last.

    Attributes
    ----------
    distance : (N,) array
        Arc length from the base [m], ascending; kept as a tuple.
    curvature : (N,) array
        Curvature there [1/m], positive where the free end bends away from the ground; kept as a tuple.

    Raises
    ------
    InputError
        If they differ in number, are not finite, or the distances do not ascend from 0 or more.

    Examples
    --------
    >>> measured = IntrinsicCurvature(distance=[0.0, 0.02], curvature=[20.0, 10.0])
    >>> float(measured.at(0.01))
    15.0
    """

    distance: tuple[float, ...]
    curvature: tuple[float, ...]

    def __post_init__(self) -> None:
        for name, unit in (("distance", "m"), ("curvature", "1/m")):
            values = numbers(f"IntrinsicCurvature.{name}", getattr(self, name), unit)
            if values.ndim != 1 or not values.size:
                raise ShapeError(f"IntrinsicCurvature.{name}", "must be a list of numbers", f"shape {values.shape}")
            if not np.isfinite(values).all():
                raise RangeError(f"IntrinsicCurvature.{name}", "must be finite", values[~np.isfinite(values)][0])
            object.__setattr__(self, name, tuple(values.tolist()))
        if len(self.distance) != len(self.curvature):
            found = f"{len(self.distance)} and {len(self.curvature)}"
            raise ShapeError("distances and curvatures", "must be as many", found)
        if self.distance[0] < 0 or np.any(np.diff(self.distance) <= 0):
            raise RangeError("IntrinsicCurvature.distance", "must ascend from 0 or more, each value once")
        if (largest := max(map(abs, self.curvature))) > MOST:
            raise RangeError("IntrinsicCurvature.curvature", f"must be at most {MOST:g} /m", largest, "give it in 1/m")

    def at(self, distance: ArrayLike) -> Array:
        """Curvature at distances from the base.

        Parameters
        ----------
        distance : array_like
            Arc length from the base [m].

        Returns
        -------
        array
            [1/m], of its shape.
        """
        return np.interp(np.asarray(distance, float), self.distance, self.curvature)

    def flipped(self) -> IntrinsicCurvature:
        """The same whisker, turned about its shaft so that it bends to the other side.

        Returns
        -------
        IntrinsicCurvature
            With the other sign.
        """
        return IntrinsicCurvature(distance=self.distance, curvature=tuple(-one for one in self.curvature))


def curvature_of_shape(x: ArrayLike, y: ArrayLike) -> IntrinsicCurvature:
    """Curvature of a whisker whose shape in air was measured.

    Smoothing: an Euler spiral, whose curvature is linear in arc length, is fitted to the points by least squares of
    their distances from it. [Starostin2020]_ found that 523 rat whiskers are such curves.

    Parameters
    ----------
    x, y : (N,) array
        Points from the base to the tip [m], 6 at least; y points away from the ground.

    Returns
    -------
    IntrinsicCurvature
        At the base and at the last point.

    Raises
    ------
    InputError
        If there are fewer than six points, one is not finite, or base and tip have the same x.
    """
    points = np.stack([numbers("x", x, "m").ravel(), numbers("y", y, "m").ravel()], axis=1)
    if points.shape[0] < 6:
        raise TooFewError("points of a shape", "must be 6 or more", points.shape[0])
    if not np.isfinite(points).all():
        raise RangeError("points of a shape", "must be finite")
    towards = float(np.sign(points[-1, 0] - points[0, 0]))
    if towards == 0:
        raise RangeError("x of a shape", "must differ between base and tip", points[0, 0], "y points off the ground")
    length, base, tip = fit_euler_spiral(points)
    return IntrinsicCurvature(distance=(0.0, length), curvature=(towards * base, towards * tip))


def read_curvature(path: str | Path) -> IntrinsicCurvature:
    """Measured curvature, or a measured shape, from a CSV file; the header names the units.

    Parameters
    ----------
    path : path
        Columns ``distance`` [m] (or ``distance_mm``) from the base and ``curvature`` [1/m] (or ``curvature_per_m``,
        ``curvature_per_mm``), in any order of lines; or ``x`` and ``y`` (or ``x_mm``, ``y_mm``) of points from the base
        to the tip, y away from the ground, to which :func:`curvature_of_shape` is applied.

    Returns
    -------
    IntrinsicCurvature
        As measured, or as fitted.

    Raises
    ------
    InputError
        Names the file and what is wrong in it.
    """
    return curvature_of(read_table(path, {}, COLUMNS))


def curvature_of(table: Table) -> IntrinsicCurvature:
    """Measured curvature, or a measured shape, from a table, as :func:`read_curvature` gives it.

    Parameters
    ----------
    table : Table
        With some of the columns ``COLUMNS``.

    Returns
    -------
    IntrinsicCurvature
        As measured, or as fitted.

    Raises
    ------
    InputError
        Names the table and what is wrong in it.
    """
    table.refuse_empty("must hold at least one line of numbers below its header")
    if "distance" in table and "curvature" in table:
        distance, curvature = table.numbers("distance"), table.numbers("curvature")
        order = np.argsort(distance, kind="stable")
        return IntrinsicCurvature(distance=tuple(distance[order]), curvature=tuple(curvature[order]))
    if "x" in table and "y" in table:
        return curvature_of_shape(table.numbers("x"), table.numbers("y"))
    rule, remedy = "must have columns distance and curvature, or x and y", "such as distance_mm,curvature_per_m"
    raise MissingError(table.path, rule, ",".join(table.header), remedy)


def atlas_curvature(name: str, whisker: Whisker) -> IntrinsicCurvature:
    """Curvature of the mean rat whisker of one position, by the regression of [Belli2018]_.

    Its shape is a parabola y = A x² from the base, whose A grows from 6 /m in the Greek arc to 25 /m in column 6:
    A = 0.24 azimuth + 14.8 /m, where the base point's azimuth in degrees is 13.4 (column + 1) − 48.6. The coefficients
    are those in the program of the authors' group [Zweifel2021]_; the row has no influence. Its curvature is
    2A / (1 + 4A²x²)^{3/2}. Which side faces the ground is not known: the sign is chosen by the user.

    Parameters
    ----------
    name : str
        ``C2``, ``beta``: a position of the atlas.
    whisker : Whisker
        Gives the length along which the curvature is tabulated.

    Returns
    -------
    IntrinsicCurvature
        Positive: the free end bends away from the ground.

    Raises
    ------
    InputError
        If no position has that name.
    """
    azimuth = _COLUMN_ANGLE * atlas_entry(name).column + _GREEK_ANGLE
    twice = 2 * (_SLOPE * azimuth + _OFFSET)
    x = np.linspace(0, whisker.length, _POINTS)
    steep = np.sqrt(1 + (twice * x) ** 2)
    along = (x * steep + np.arcsinh(twice * x) / twice) / 2
    return IntrinsicCurvature(distance=tuple(along), curvature=tuple(twice / steep**3))
