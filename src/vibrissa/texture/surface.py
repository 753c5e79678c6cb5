"""Rectangular troughs in a flat substrate, and the gratings made of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array, ByValue
from vibrissa.errors import FormatError, RangeError, ShapeError, TooFewError, UnknownError
from vibrissa.tables.stated import number, numbers

Reading = Literal["telegraph", "widths"]

DEPTH = 35e-6  # [m] of the paper's gratings
WIDTH_SD = 0.1e-3  # [m] spread of the Gaussian widths in the reading "widths"
LONGEST, MOST_PERIODS = 10.0, 100_000  # [m], [1] beyond these a grating's unit is wrong


@dataclass(frozen=True, eq=False)
class Gaps(ByValue):
    """Rectangular gaps in an otherwise flat substrate.

    Eq. (18) of [Boubenec2014]_: T(x) = Σ_j H(x − x_j, λ_j).

    Attributes
    ----------
    position : (J,) array
        Edge x_j of each gap that meets the contact first [m], ascending; x = 0 meets it at time 0.
    width : (J,) array
        Widths λ_j [m].
    depth : float
        Depth of the gaps [m].
    """

    position: Array
    width: Array
    depth: float = DEPTH

    def __post_init__(self) -> None:
        for name in ("position", "width"):
            object.__setattr__(self, name, numbers(name, getattr(self, name), "m"))
        if self.position.size == 0:
            raise TooFewError("texture", "must have at least one gap")
        if self.position.shape != self.width.shape or self.position.ndim != 1:
            found = f"{self.position.shape}, {self.width.shape}"
            raise ShapeError("texture", "must have one width for each position", found)
        wrong = ~(np.isfinite(self.position) & (self.width > 0) & np.isfinite(self.width))
        if wrong.any():
            first = int(wrong.argmax())
            found = f"gap {first + 1} at {self.position[first]:.4g} m, {self.width[first]:.4g} m wide"
            raise RangeError("texture", "must have finite positions and positive widths", found)
        object.__setattr__(self, "depth", number("depth", self.depth, "m", "one depth for all gaps [m]"))
        if not 0 < self.depth < np.inf:
            raise RangeError("texture", "must have a positive depth", self.depth)
        land = self.position[1:] - self.end[:-1]
        if not np.all(land > 0):
            first = int(np.flatnonzero(~(land > 0))[0]) + 1
            found = f"gap {first + 1} at {self.position[first]:.4g} m"
            raise RangeError("texture", "must have ascending gaps that do not overlap", found)

    @property
    def end(self) -> Array:
        """Edge x_j + λ_j of each gap that meets the contact last [m], (J,)."""
        return self.position + self.width

    def height(self, x: ArrayLike) -> Array:
        """Height of the surface, to be drawn.

        Parameters
        ----------
        x : (...) array
            Position along the substrate [m].

        Returns
        -------
        (...) array
            0 on the lands, −depth in the gaps x_j ≤ x < x_j + λ_j [m]; NaN where x is NaN.
        """
        x = numbers("x", x, "m")
        nearest = np.searchsorted(self.position, x, side="right") - 1  # −1 before the first gap
        inside = (nearest >= 0) & (x < self.end[nearest])
        return np.where(np.isnan(x), np.nan, np.where(inside, -self.depth, 0.0))

    def reversed(self, length: float) -> Gaps:
        """Give the texture as it is met when scanned the other way: the last gap first, by its other edge.

        Parameters
        ----------
        length : float
            Position [m] that becomes x = 0, where the scan back sets out.

        Returns
        -------
        Gaps
            Gaps at ``length`` − (x_j + λ_j), as wide and as deep.

        Raises
        ------
        InputError
            If a gap ends beyond ``length``: it would be met before time 0.
        """
        length = number("length", length, "m")
        if not length >= self.end[-1] * (1 - 1e-12):  # a gap at x = 0, reversed twice, may round to beyond it
            raise RangeError("length", f"must reach the end of the last gap, {self.end[-1]:.6g} m", length)
        return Gaps(position=(length - self.end)[::-1], width=self.width[::-1], depth=self.depth)


def periodic_grating(length: float, *, period: float, width: float | None = None, depth: float = DEPTH) -> Gaps:
    """Periodic square-wave grating: equal lands and equal gaps in turn.

    Parameters
    ----------
    length : float
        Length of the grating [m]; it starts with a land at x = 0.
    period : float
        One land and one gap together [m].
    width : float, optional
        Width of the gaps [m], half the period by default.
    depth : float
        Depth of the gaps [m].

    Returns
    -------
    Gaps
        As many gaps as there are whole periods within ``length``; each ends a period.

    Raises
    ------
    InputError
        If the gaps do not fit into the period, or no period or too many of them into the length.

    Examples
    --------
    >>> grating = periodic_grating(0.01, period=1e-3)
    >>> len(grating.position), float(grating.width[0])
    (10, 0.0005)
    """
    length, period = number("length", length, "m"), number("period", period, "m")
    width = period / 2 if width is None else number("width", width, "m")
    if not 0 < width < period:
        raise RangeError("grating", "must have 0 < width < period", f"width {width:g} m, period {period:g} m")
    _refuse_length(length, period)
    count = int(length / period + 1e-9)  # ten periods in a length of ten, whatever their quotient rounds to
    end = period * np.arange(1, count + 1, dtype=np.float64)
    return Gaps(position=end - width, width=np.full(count, width), depth=depth)


def generator(rng: np.random.Generator | int) -> np.random.Generator:
    """Source of randomness, as it is or from its seed.

    Parameters
    ----------
    rng : Generator or int
        Source, or a seed.

    Returns
    -------
    Generator
        Of NumPy.

    Raises
    ------
    InputError
        If a seed is negative or no whole number.
    """
    try:
        return np.random.default_rng(rng)
    except (TypeError, ValueError) as error:
        raise FormatError("rng", "must be a NumPy generator, or a whole number from 0", repr(rng)[:60]) from error


def random_grating(
    length: float,
    *,
    rng: np.random.Generator | int,
    reading: Reading = "telegraph",
    mean_period: float = 0.6e-3,
    smallest: float = 35e-6,
    depth: float = DEPTH,
) -> Gaps:
    """Random square-wave grating: lands and gaps of random width in turn.

    "The position of the grating edges were chosen from a Gaussian distribution" has two readings. ``telegraph``
    (default): edges without memory, as the sign changes of white noise, so widths are exponential beyond the
    smallest feature; ``widths``: Gaussian widths of spread 0.1 mm, redrawn below the smallest feature. The mean
    period of ``telegraph`` is as asked. The redraw lengthens that of ``widths``: with μ = mean_period / 2,
    σ = 0.1 mm, a = (smallest − μ)/σ and the normal density φ and distribution Φ, the mean width is
    μ + σ φ(a)/(1 − Φ(a)), 0.3012 mm by default: a mean period of 0.6024 mm, 0.4 % above 0.6 mm.

    Parameters
    ----------
    length : float
        Length of the grating [m]; it starts with a land at x = 0.
    rng : Generator or int
        Source of randomness, or a seed.
    reading : {"telegraph", "widths"}
        How widths are drawn.
    mean_period : float
        Mean of one land and one gap together [m], before any redraw.
    smallest : float
        No feature is narrower [m].
    depth : float
        Depth of the gaps [m].

    Returns
    -------
    Gaps
        Gaps that end before ``length``.

    Raises
    ------
    InputError
        If the reading is unknown, no feature fits, or the grating is beyond 10 m or 100 000 periods.
    """
    length, mean_period = number("length", length, "m"), number("mean_period", mean_period, "m")
    smallest = number("smallest", smallest, "m")
    rng, mean = generator(rng), mean_period / 2
    if not 0 < smallest < mean:
        found = f"smallest {smallest:g} m, mean_period {mean_period:g} m"
        raise RangeError("grating", "must have 0 < smallest feature < mean_period / 2", found)
    _refuse_length(length, mean_period)
    count = 2 * int(np.ceil(2 * length / mean_period) + 50)
    if reading == "telegraph":
        widths = smallest + rng.exponential(mean - smallest, count)
    elif reading == "widths":
        widths = rng.normal(mean, WIDTH_SD, 4 * count)
        widths = widths[widths >= smallest][:count]
    else:
        raise UnknownError("reading", "must be 'telegraph' or 'widths'", repr(reading))
    edges = np.cumsum(widths)
    start, end = edges[0::2], edges[1::2]
    inside = end < length
    return Gaps(position=start[inside], width=(end - start)[inside], depth=depth)


def _refuse_length(length: float, period: float) -> None:
    if not period <= length <= min(LONGEST, MOST_PERIODS * period):
        rule = f"must be one to {MOST_PERIODS} periods of {period:g} m, and at most {LONGEST:g} m"
        raise RangeError("length of the grating", rule, f"{length:g} m", "lengths are in metres")
