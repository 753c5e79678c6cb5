"""The cone behind measured diameters: reading them, fitting the line, its standard errors."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, ShapeError, TooFewError
from vibrissa.quantities import dataset
from vibrissa.tables.reader import read_table
from vibrissa.tables.stated import numbers
from vibrissa.tables.table import Table
from vibrissa.whisker.cone import DENSITY, YOUNGS_MODULUS, Whisker

if TYPE_CHECKING:
    import xarray as xr


LONGEST, THINNEST, THICKEST = 1.0, 1e-6, 1e-2  # [m] beyond these a unit is wrong
COLUMNS = {"distance": "m", "diameter": "m"}
CONE_ONLY = "the model is for a cone only, one that thins from base to tip"


@dataclass(frozen=True, kw_only=True)
class WhiskerFit:
    """A cone fitted to measured diameters; standard errors end in ``_se``.

    They are those of ordinary least squares carried to first order (covariance of offset and slope included); E, ρ and
    the physical length count as exact. A coverage probability needs Student's t with ``points`` − 2 degrees of freedom.

    Attributes
    ----------
    whisker : Whisker
        The cone.
    length_se, cone_angle_se, base_radius_se, tip_se, timescale_se : float
        Standard errors of L [m], α [rad], b [m], the tip's position and k [s].
    residual_sd : float
        Standard deviation of the diameters about the line [m], with ``points`` − 2 degrees of freedom.
    r_squared : float
        Share of the diameters' variance on the line.
    points : int
        Number of diameters.
    """

    whisker: Whisker
    length_se: float
    cone_angle_se: float
    base_radius_se: float
    tip_se: float
    timescale_se: float
    residual_sd: float
    r_squared: float
    points: int


def from_diameters(
    distance: ArrayLike,
    diameter: ArrayLike,
    *,
    physical_length: float | None = None,
    youngs_modulus: float = YOUNGS_MODULUS,
    density: float = DENSITY,
) -> WhiskerFit:
    """Straight-line fit of the diameter along the shaft, extrapolated to the cone's tip.

    With diameter = A − B·distance (ordinary least squares): L = A/B, where the line vanishes; b = A/2; α = B/2.

    Parameters
    ----------
    distance : (N,) array
        Arc length from the base [m], at least 3 different values, in any order.
    diameter : (N,) array
        Diameter there [m].
    physical_length : float, optional
        Arc length from base to physical tip [m]. By default the largest distance: a lower bound, so the tip's
        position is then an upper bound. A tip up to three standard errors beyond the cone's own counts as sharp (0).
    youngs_modulus, density : float
        E [Pa] and ρ [kg/m³], not measured here.

    Returns
    -------
    WhiskerFit
        The whisker, its standard errors and the quality of the line.

    Raises
    ------
    InputError
        If there are too few points, a value is negative or not finite, the shaft cannot be distinguished from a
        cylinder (its slope is not above zero at 5 %, one-sided), widens away from the base, or ends well beyond the
        fitted cone.
    """
    x, d = _checked_points(distance, diameter)
    line, covariance, residual_sd, r_squared = _straight_line(x, d)
    A, B = line
    _refuse_cylinder(B, float(np.sqrt(covariance[1, 1])), x, d)
    L, root = A / B, float(np.sqrt(density / youngs_modulus))

    def se(*gradient: float) -> float:
        return float(np.sqrt(np.array(gradient) @ covariance @ np.array(gradient)))

    length_se = se(1 / B, -A / B**2)
    end = float(x.max()) if physical_length is None else physical_length
    whisker = Whisker(
        length=L, cone_angle=B / 2, tip=_tip(end, L, length_se, x), youngs_modulus=youngs_modulus, density=density
    )
    return WhiskerFit(
        whisker=whisker,
        length_se=length_se,
        cone_angle_se=se(0, 1 / 2),
        base_radius_se=se(1 / 2, 0),
        tip_se=end / L**2 * length_se,
        timescale_se=se(4 * root / B**2, -8 * root * A / B**3),  # k = 4A/B² √(ρ/E)
        residual_sd=residual_sd,
        r_squared=r_squared,
        points=x.size,
    )


def _checked_points(distance: ArrayLike, diameter: ArrayLike) -> tuple[Array, Array]:
    x, d = numbers("distance", distance, "m"), numbers("diameter", diameter, "m")
    if x.ndim != 1 or x.shape != d.shape:
        raise ShapeError("distance and diameter", "must be two lists of equal length", f"{x.shape} and {d.shape}")
    for name, values in (("distance", x), ("diameter", d)):
        wrong = np.flatnonzero(~((values >= 0) & np.isfinite(values)))
        if wrong.size:
            raise RangeError(f"{name} of point {wrong[0] + 1}", "must be finite, not negative", values[wrong[0]])
    if np.unique(x).size < 3:
        raise TooFewError("diameters", "must be measured at 3 different distances at least", np.unique(x).size)
    return x, d


def _straight_line(x: Array, d: Array) -> tuple[tuple[float, float], Array, float, float]:
    """Least squares of d = A − Bx: (A, B), their covariance, residual standard deviation, R²."""
    (slope, A), covariance = np.polyfit(x, d, 1, cov=True)
    turned = np.array([[0, 1], [-1, 0]])  # from (slope, A) to (A, B)
    residual, spread = d - (A + slope * x), d - d.mean()
    left, total = float(residual @ residual), float(spread @ spread)
    r_squared = 1 - left / total if total > 0 else 0.0
    return (A, -slope), turned @ covariance @ turned.T, float(np.sqrt(left / (x.size - 2))), r_squared


def _refuse_cylinder(slope: float, slope_se: float, x: Array, d: Array) -> None:
    from scipy.special import stdtrit

    if slope < 0:
        raise RangeError("diameters", "grow away from the base", remedy=f"{CONE_ONLY}; is the distance from the base?")
    rounding = 1e-9 * d.mean() / np.ptp(x)
    # one-sided: a shaft that widens has been refused already
    if slope <= max(stdtrit(x.size - 2, 0.95) * slope_se, rounding):
        found = f"a slope of {slope:.2g} ± {slope_se:.2g} from {x.size} points"
        raise RangeError(
            "diameters", "must fall from base to tip, beyond their scatter", found, f"measure more points; {CONE_ONLY}"
        )


def _tip(end: float, L: float, length_se: float, x: Array) -> float:
    """Position of the physical tip over L; 0 where it cannot be distinguished from the cone's own."""
    if not x.max() <= end < np.inf:
        raise RangeError("physical_length", f"must reach the last measured distance, {x.max():.4g} m", end)
    if end - L > 3 * length_se + 1e-9 * L:
        found = f"a line that vanishes at {L * 1e3:.4g} ± {length_se * 1e3:.2g} mm"
        raise RangeError(f"a whisker of {end * 1e3:.4g} mm", "must end within its fitted cone", found, CONE_ONLY)
    return max(0.0, 1 - end / L)


def read_diameters(path: str | Path) -> xr.Dataset:
    """Measured diameters from a CSV file; the header names the units.

    Parameters
    ----------
    path : path
        Comma-separated, with columns ``distance`` [m] or ``distance_mm`` (arc length from the base) and ``diameter``
        [m] or ``diameter_um``, in any order; other columns are left alone. The order of the lines does not matter.

    Returns
    -------
    Dataset
        ``distance`` and ``diameter`` (point) [m].

    Raises
    ------
    InputError
        Names the file and the line: a missing column, a cell that is no number or negative; a unit that cannot be.
    """
    return diameters_of(read_table(path, COLUMNS))


def diameters_of(table: Table) -> xr.Dataset:
    """Measured diameters from a table, as :func:`read_diameters` gives them.

    Parameters
    ----------
    table : Table
        With the columns ``COLUMNS``.

    Returns
    -------
    Dataset
        ``distance`` and ``diameter`` (point) [m].

    Raises
    ------
    InputError
        Names the table and the line: a cell that is no number or negative; a unit that cannot be.
    """
    table.refuse_empty("must hold at least one line of numbers below its header")
    distance, diameter = table.numbers("distance"), table.numbers("diameter")
    for name, values in (("distance", distance), ("diameter", diameter)):
        table.refuse_first(values < 0, name, "must not be negative")
    if distance.max() > LONGEST or not THINNEST <= diameter.max() <= THICKEST:
        rule = f"must reach at most {LONGEST:g} m and a diameter of {THINNEST:g} to {THICKEST:g} m"
        remedy = "columns distance_mm and diameter_um take millimetres and micrometres"
        raise RangeError(table.path, rule, f"{distance.max():g} m and {diameter.max():g} m", remedy)
    return dataset(distance=distance, diameter=diameter)
