"""Rectangular troughs in a flat substrate, and random gratings made of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError

Array = NDArray[np.float64]
Reading = Literal["telegraph", "widths"]

WIDTH_SD = 0.1e-3  # [m] spread of the Gaussian widths in the reading "widths"


@dataclass(frozen=True, kw_only=True)
class Troughs:
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
    depth: float = 35e-6

    def __post_init__(self) -> None:
        if self.position.size == 0:
            raise InputError("texture", "must have at least one gap")
        if self.position.shape != self.width.shape or self.position.ndim != 1:
            raise InputError(
                "texture",
                "must have one width for each position",
                f"{self.position.shape}, {self.width.shape}",
            )
        finite = np.isfinite([*self.position, *self.width, self.depth]).all()
        if not (finite and np.all(self.width > 0) and self.depth > 0):
            raise InputError("texture", "must have finite positions, positive widths and a positive depth")
        gap = self.position[1:] - (self.position + self.width)[:-1]
        if not np.all(gap > 0):
            first = int(np.flatnonzero(~(gap > 0))[0]) + 1
            raise InputError(
                "texture",
                "must have ascending gaps that do not overlap",
                f"gap {first + 1} at {self.position[first]:.4g} m",
            )


def random_grating(
    length: float,
    *,
    rng: np.random.Generator,
    reading: Reading = "telegraph",
    mean_period: float = 0.6e-3,
    smallest: float = 35e-6,
    depth: float = 35e-6,
) -> Troughs:
    """Random square-wave grating: lands and gaps of random width in turn.

    "The position of the grating edges were chosen from a Gaussian distribution" has two readings. ``telegraph``
    (default): edges without memory, as the sign changes of white noise, so widths are exponential beyond the
    smallest feature; ``widths``: Gaussian widths of spread 0.1 mm, redrawn below the smallest feature.

    Parameters
    ----------
    length : float
        Length of the grating [m]; it starts with a land at x = 0.
    rng : Generator
        Source of randomness.
    reading : {"telegraph", "widths"}
        How widths are drawn.
    mean_period : float
        Mean of one land and one gap together [m].
    smallest : float
        No feature is narrower [m].
    depth : float
        Depth of the gaps [m].

    Returns
    -------
    Troughs
        Gaps that end before ``length``.

    Raises
    ------
    InputError
        If the reading is unknown or no feature fits.
    """
    mean = mean_period / 2
    if not 0 < smallest < mean or not length > mean_period:
        raise InputError("grating", "must have 0 < smallest feature < mean_period / 2 and length > mean_period")
    count = 2 * int(np.ceil(2 * length / mean_period) + 50)
    if reading == "telegraph":
        widths = smallest + rng.exponential(mean - smallest, count)
    elif reading == "widths":
        widths = rng.normal(mean, WIDTH_SD, 4 * count)
        widths = widths[widths >= smallest][:count]
    else:
        raise InputError("reading", "must be 'telegraph' or 'widths'", repr(reading))
    edges = np.cumsum(widths)
    start, end = edges[0::2], edges[1::2]
    inside = end < length
    return Troughs(position=start[inside], width=(end - start)[inside], depth=depth)
