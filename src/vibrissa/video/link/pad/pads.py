"""Pads: the points from which lines radiate, and each line in polar coordinates about its pad.

Pixels are those of the size at which lines are linked, see :mod:`vibrissa.video.link.pad.placing`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.video.link.pad.pieces import Pieces

HIDDEN = 10.0  # px of each whisker that fur hides
BEYOND = 1.3  # of the range between inner and outer radius, from its middle, in which lines are fitted
SCATTER = 0.8  # standard deviation of a traced point, of 8 each [px]
INDEPENDENT = 8.0  # points of a line over which errors are alike
SHORTEST = 12.0  # px of a line that can be a whisker's


class Pad(NamedTuple):
    """Where the whiskers of one side come from.

    Attributes
    ----------
    pivot : (2,) array
        Column and row of the point from which lines radiate [px].
    middle : float
        Direction of the middle of the pad, down from the right [rad].
    inner, outer : float
        Distances from the pivot between which lines are compared [px].
    """

    pivot: Array
    middle: float
    inner: float
    outer: float

    @property
    def centre(self) -> float:
        """Distance from the pivot at which the place of a line is given [px]."""
        return (self.inner + self.outer) / 2

    @property
    def way(self) -> Array:
        """Unit vector of the middle of the pad, (2,)."""
        return np.array([np.cos(self.middle), np.sin(self.middle)])

    @property
    def degree(self) -> float:
        """Displacement at the middle distance of a whisker that turns by 1° about its base [px]."""
        return float(np.deg2rad(self.centre - self.inner + HIDDEN))

    def polar(self, column: Array, row: Array) -> tuple[Array, Array]:
        """Distance from the inner to the outer radius, as −1 to 1, and place across in degrees of swing."""
        x, y = column - self.pivot[0], row - self.pivot[1]
        angle = (np.arctan2(y, x) - self.middle + np.pi) % (2 * np.pi) - np.pi
        return (np.hypot(x, y) - self.centre) * 2 / (self.outer - self.inner), angle * self.centre / self.degree

    def pixels(self, column: Array, row: Array) -> tuple[Array, Array]:
        """Distance from the pivot, and across it from the middle of the pad [px]."""
        along, across = self.polar(column, row)
        radius = along * (self.outer - self.inner) / 2 + self.centre
        return radius, across * self.degree * radius / self.centre

    def points(self, along: Array, across: Array) -> tuple[Array, Array]:
        """Column and row of places as of :meth:`polar` [px]."""
        radius, angle = along * (self.outer - self.inner) / 2 + self.centre, across * self.degree / self.centre
        return (
            self.pivot[0] + radius * np.cos(angle + self.middle),
            self.pivot[1] + radius * np.sin(angle + self.middle),
        )


class Lines(NamedTuple):
    """Each segment as a line of its pad.

    Attributes
    ----------
    pad : (S,) array of int
        Which pad; −1 for lines that lead away from none.
    turned : (S,) array of bool
        Whether the last point is nearer to the base.
    place : (S, 3) array
        Place across at the inner, middle and outer radius, in degrees of swing.
    covariance : (S, 3, 3) array
        Of the place.
    reach : (S, 2) array
        First and last distance from the pivot, as −1 at the inner to 1 at the outer radius.
    look : (S, 2) array
        What it looks like: logarithm of contrast times width, mean over the line, and the second reach.
    """

    pad: Integers
    turned: Mask
    place: Array
    covariance: Array
    reach: Array
    look: Array


def lines_of(pieces: Pieces, pads: list[Pad], pad: Integers, back: Mask) -> Lines:
    """Polynomials of second degree through the segments in the polar coordinates of their pads.

    Parameters
    ----------
    pieces : Pieces
        Segments.
    pads, pad, back
        From :func:`vibrissa.video.link.pad.pad_finding.find_pads`.

    Returns
    -------
    Lines
        Of all segments; NaN for those of no pad.
    """
    count, owner = pad.size, pieces.owner
    place, covariance, reach = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan), np.full((count, 2), np.nan)
    for number, one in enumerate(pads):
        mine = pad == number
        if not mine.any():
            continue
        along, across = one.polar(pieces.column, pieces.row)
        low, high = (f.reduceat(along, pieces.start) for f in (np.minimum, np.maximum))
        # a line that hardly overlaps the range is fitted as a whole
        part = (np.minimum(high, BEYOND) - np.maximum(low, -BEYOND)) * (one.outer - one.inner) / 2
        use = (np.abs(along) <= BEYOND) | (part < SHORTEST)[owner]
        radius = np.maximum(along * (one.outer - one.inner) / 2 + one.centre, 1.0)
        error = SCATTER * one.centre / radius / one.degree
        weight = np.where(use, 1 / (INDEPENDENT * error**2), 0.0)
        fitted = _fit(pieces, along, across, weight, mine)
        place[mine], covariance[mine], reach[mine] = fitted[0][mine], fitted[1][mine], np.stack([low, high], 1)[mine]
    strength = np.log(pieces.sums(pieces.width * pieces.contrast) / (pieces.stop - pieces.start))
    return Lines(pad, back, place, covariance, reach, np.stack([strength, reach[:, 1]], axis=1))


def parabola_weights(reach: Array) -> Array:
    """Weights (n, 3) of values at the three radii in the parabola through them at distances (n,) as of ``reach``."""
    return np.stack([reach * (reach - 1) / 2, 1 - reach * reach, reach * (reach + 1) / 2], axis=1)


AT = np.array([[1.0, -1.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0]])  # from coefficients to places at −1, 0, 1


def _fit(pieces: Pieces, along: Array, across: Array, weight: Array, mine: Mask) -> tuple[Array, Array]:
    """Places (S, 3) and covariances (S, 3, 3) of parabolas; slope and bend have the pad's as a prior."""
    powers = np.stack([np.ones(along.size), along, along**2], axis=1)
    left = pieces.sums(weight[:, None, None] * powers[:, :, None] * powers[:, None, :])
    right = pieces.sums((weight * across)[:, None] * powers)
    mean, prior = np.zeros(3), np.diag([1e-6, 1e-3, 1e-1])
    for _ in range(3):
        found = np.linalg.inv(left + prior)
        best = np.einsum("sij,sj->si", found, right + prior @ mean)
        # slope and bend of this pad's whiskers, from the lines that show them
        clear = mine & (found[:, 2, 2] < np.quantile(found[mine, 2, 2], 0.3))
        clear = clear if clear.any() else mine  # few lines, all alike
        mean[1:] = np.median(best[clear, 1:], axis=0)
        sd = 1.5 * np.median(np.abs(best[clear, 1:] - mean[1:]), axis=0) + 0.5
        prior = np.diag([1e-6, *(1 / (2 * sd) ** 2)])
    return best @ AT.T, AT @ found @ AT.T
