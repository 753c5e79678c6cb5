"""Straight lines of the fan that the whiskers of one pad make, near their bases, in one frame.

The fan is read in polar coordinates about its pivot, the point from which the whiskers seem to come; a line
is given by its angle and by how far from the pivot it passes. Contrast is an optical density, the logarithm
of the background over the image: a whisker takes away the same share of the light in front of a bright
background and of a dim one. Angles are in degrees from the direction of increasing columns, turning towards
increasing rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import RangeError
from vibrissa.loops import njit
from vibrissa.video.kernel.band import closing, smooth_along

Values = NDArray[np.float64]
Single = NDArray[np.float32]

STEP = 0.25  # of the angle [°]
ALONG = 2.0  # step along the whiskers [px]
BACKGROUND = 15  # width of the closing at the middle radius [px], as across rows in a straightened band
DIMMEST = 12.0  # grey levels below which no density is read: the face, an arm, a paw
DENSEST = 0.6  # optical density above which it is no whisker
OFFSETS = np.arange(-14.0, 14.5)  # of a line from the pivot [px]
FAINTEST = 0.025  # optical density of the faintest line, mean over its length
MOST = 40  # lines kept in one frame


@dataclass(frozen=True, kw_only=True)
class Fan:
    """Where the whiskers of one pad are sought.

    Attributes
    ----------
    pivot : (column, row)
        The point from which the whiskers seem to come [px]; it may lie outside the image.
    radii : (inner, outer)
        Distances from the pivot between which whiskers are nearly straight and clear of the fur [px].
    angles : (first, last)
        Sector of the fan [°]: 0 towards increasing columns, positive towards increasing rows; (120, 240) opens to the
        left.
    """

    pivot: tuple[float, float]
    radii: tuple[float, float]
    angles: tuple[float, float] = (-60.0, 60.0)

    def __post_init__(self) -> None:
        if not 0 < self.radii[0] < self.radii[1]:
            raise RangeError("Fan.radii", "must be positive, the inner one first", self.radii)
        if not (-360 <= self.angles[0] < self.angles[1] <= 360 and self.angles[1] - self.angles[0] <= 360):
            rule = "must be two angles in [-360°, 360°], the lower one first, at most a turn apart"
            raise RangeError("Fan.angles", rule, self.angles)

    @property
    def middle(self) -> float:
        """Radius at which the angle of a line is given [px]."""
        return (self.radii[0] + self.radii[1]) / 2

    def grid(self) -> tuple[Values, Values]:
        """Angles [°] and radii [px] at which the image is read."""
        return np.arange(*self.angles, STEP), np.arange(self.radii[0], self.radii[1] + ALONG / 2, ALONG)


@njit(cache=True)
def _density(
    image: NDArray[Any], background: Single, sign: float, pivot: Values, angles: Values, radii: Values, size: int
) -> Single:
    """Optical density (angle, radius) of structures narrower than ``size`` steps of the angle; 0 outside the image."""
    height, width = image.shape
    margin = size - 1
    n = angles.size + 2 * margin
    # logarithm of the light in polar coordinates, bilinear, with a margin of the closing's size on either side
    light = np.empty((n, radii.size), np.float32)
    known = np.ones((n, radii.size), np.bool_)
    for k in range(n):
        angle = np.deg2rad(angles[0] + (k - margin) * STEP)
        for j in range(radii.size):
            x, y = pivot[0] + np.cos(angle) * radii[j], pivot[1] + np.sin(angle) * radii[j]
            known[k, j] = 1 <= x <= width - 2 and 1 <= y <= height - 2
            x, y = min(max(x, 0.0), width - 1.001), min(max(y, 0.0), height - 1.001)
            c, r = int(x), int(y)
            u, v = x - c, y - r
            grey = (1 - v) * ((1 - u) * image[r, c] + u * image[r, c + 1])
            grey += v * ((1 - u) * image[r + 1, c] + u * image[r + 1, c + 1])
            if background.size:
                light[k, j] = sign * np.log(max(grey, DIMMEST) / max(background[r, c], DIMMEST))
            else:
                light[k, j] = sign * np.log(max(grey, DIMMEST))
    # a closing across the angles fills structures narrower than a whisker: the light without it
    level = np.zeros((angles.size, radii.size), np.float32)
    if not background.size:
        level = closing(smooth_along(light, 1), size)
    out = level - light[margin : n - margin]
    for k in range(angles.size):
        for j in range(radii.size):
            out[k, j] = min(max(out[k, j], -DENSEST), DENSEST) if known[k + margin, j] else 0.0
    return out


@njit(cache=True)
def _along_lines(dense: Single, radii: Values, middle: float, offsets: Values) -> Values:
    """Mean density along straight lines: (angle at the middle radius, offset)."""
    angles = dense.shape[0]
    mean = np.zeros((angles, offsets.size), np.float32)
    for e in range(offsets.size):
        for j in range(radii.size):
            # a line that passes the pivot at a distance e << r is seen from it at φ + e (1/r − 1/r₀)
            shift = np.rad2deg(offsets[e] * (1 / radii[j] - 1 / middle)) / STEP
            whole = int(np.floor(shift))
            part = shift - whole
            for k in range(angles):
                i = min(max(k + whole, 0), angles - 2)
                mean[k, e] += (1 - part) * dense[i, j] + part * dense[i + 1, j]
    return mean / radii.size


@njit(cache=True)
def _between(left: float, here: float, right: float) -> float:
    """Place of the maximum of a parabola through three values, −½ to ½."""
    bend = left - 2 * here + right
    return 0.5 * (left - right) / bend if bend < 0 else 0.0


@njit(cache=True)
def _peaks(mean: Values, first: float, offsets: Values) -> Values:
    """Angle [°], offset [px] and density of the lines, the densest first; NaN after the last; (MOST, 3)."""
    found = np.empty((mean.size // 6 + 1, 3))  # no two within two angles and one offset, but for equal ones
    count = 0
    for k in range(2, mean.shape[0] - 2):
        for e in range(1, mean.shape[1] - 1):
            here = mean[k, e]
            if here < FAINTEST or here < mean[k - 2 : k + 3, e - 1 : e + 2].max() or count == len(found):
                continue
            found[count, 0] = first + STEP * (k + _between(mean[k - 1, e], here, mean[k + 1, e]))
            found[count, 1] = offsets[e] + (offsets[1] - offsets[0]) * _between(mean[k, e - 1], here, mean[k, e + 1])
            found[count, 2] = here
            count += 1
    order = np.argsort(-found[:count, 2])[:MOST]
    out = np.full((MOST, 3), np.nan)
    out[: order.size] = found[:count][order]
    return out


def fan_lines(image: NDArray[np.generic], background: NDArray[np.float32], sign: float, fan: Fan) -> Values:
    """Lines of the fan in one frame.

    Parameters
    ----------
    image : (height, width) array
        Grey levels.
    background, sign
        As in :func:`vibrissa.video.kernel.centreline.read_line`.
    fan : Fan
        Where they are sought.

    Returns
    -------
    (MOST, 3) array
        Angle [°] at the middle radius, offset from the pivot [px], mean optical density; the densest line
        first, NaN after the last.
    """
    angles, radii = fan.grid()
    size = int(np.ceil(np.rad2deg(BACKGROUND / fan.middle) / STEP))
    dense = _density(image, background, sign, np.array(fan.pivot, float), angles, radii, size)
    return np.asarray(_peaks(_along_lines(dense, radii, fan.middle, OFFSETS), angles[0], OFFSETS))


def course(fan: Fan, angle: float, offset: float, width: int) -> Values:
    """Rows of a line of the fan in the columns between its radii [px]; NaN in the others.

    Parameters
    ----------
    fan : Fan
        Where lines are sought.
    angle, offset : float
        Of the line at the fan's middle radius [°], and from the pivot [px].
    width : int
        Columns of the image.

    Returns
    -------
    (width,) array
        Rows [px].
    """
    _, radii = fan.grid()
    at = np.deg2rad(angle) + offset * (1 / radii - 1 / fan.middle)
    x, y = fan.pivot[0] + radii * np.cos(at), fan.pivot[1] + radii * np.sin(at)
    order = np.argsort(x)
    return np.interp(np.arange(width), x[order], y[order], left=np.nan, right=np.nan)


def angle_at(fan: Fan, point: tuple[float, float], offset: Values) -> Values:
    """Angle at the middle radius [°], within half a turn of the fan's own, of lines of some offsets through a point.

    Parameters
    ----------
    fan : Fan
        Where lines are sought.
    point : (column, row)
        The point [px].
    offset : (n,) array
        Distances of the lines from the pivot [px].

    Returns
    -------
    (n,) array
        Angles [°].
    """
    x, y = point[0] - fan.pivot[0], point[1] - fan.pivot[1]
    angle = np.rad2deg(np.arctan2(y, x) - offset * (1 / np.hypot(x, y) - 1 / fan.middle))
    own = sum(fan.angles) / 2
    return own + (angle - own + 180) % 360 - 180
