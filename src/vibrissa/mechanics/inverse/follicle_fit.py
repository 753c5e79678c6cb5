"""Stiffness of shaft and follicle together, from the resonances of one whisker at several contacts.

Young's modulus E moves all resonances by one factor, its root; the springs of the follicle move them by factors that
depend on mode and contact, and a mode's displacement near the base depends on the springs alone. The likelihood is
tabulated over both springs, with E and ζ at their best in each point, so that a second answer is not overlooked. A
spring is identified if its interval of the profile likelihood ends on both sides; nothing is if there are two answers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import label
from scipy.stats import chi2

from vibrissa.arrays import Array, Mask
from vibrissa.errors import RangeError, ShapeError, TooFewError
from vibrissa.mechanics.modes.sprung import sprung_modes, sprung_shapes
from vibrissa.whisker import Whisker

PARAMETERS = ("youngs_modulus", "rotation", "translation", "damping")
_BOUNDS = np.log([[0.05, 3e4], [1.0, 1e6]])  # of both springs; the stiffest cannot be told from a clamp
_KNOTS, _FINE = 45, 301  # points of the table, and of the likelihood, along each spring
_ZOOMS, _MARGIN = 3, 30.0  # how often the likelihood is looked at more closely, and up to which χ² above the least
_GRID = np.linspace(0, 1, 201)  # where a mode's antinode is looked for, of the way from contact to base


@dataclass(frozen=True, kw_only=True)
class Resonances:
    """What was measured on one whisker at C contacts, in M modes each; NaN is not measured.

    Attributes
    ----------
    contact : (C,) array
        ε over L, in [0.1, 0.9].
    frequency, frequency_sd : (C, M) arrays
        Frequency at which each mode rings down [Hz], and its standard deviation.
    damping, damping_sd : (C, M) arrays, optional
        Damping ratios.
    near, near_sd : (C, M) arrays, optional
        Displacement of each mode at ``near_distance`` over that of its antinode, without sign.
    near_distance : float
        From the base [m].
    """

    contact: ArrayLike
    frequency: ArrayLike
    frequency_sd: ArrayLike
    damping: ArrayLike | None = None
    damping_sd: ArrayLike | None = None
    near: ArrayLike | None = None
    near_sd: ArrayLike | None = None
    near_distance: float = 5e-3

    def columns(self) -> tuple[Array, Array, Array]:
        """Contacts (C,); what was measured and its standard deviation, (3, C, M): frequency, damping, near the base.

        Raises
        ------
        InputError
            If shapes differ, or a standard deviation is missing or not positive.
        """
        contact, frequency = np.atleast_1d(np.asarray(self.contact, float)), np.asarray(self.frequency, float)
        if frequency.ndim != 2 or frequency.shape[0] != contact.size:
            raise ShapeError("frequency", f"must have a row for each of {contact.size} contacts", frequency.shape)
        found, spread = np.full((2, 3, *frequency.shape), np.nan)
        for k, name in enumerate(("frequency", "damping", "near")):
            values, sd = (getattr(self, name + end) for end in ("", "_sd"))
            if values is None:
                continue
            try:
                found[k], spread[k] = np.asarray(values, float), np.nan if sd is None else np.asarray(sd, float)
            except ValueError:
                raise ShapeError(f"{name} and {name}_sd", f"must have the shape {frequency.shape}") from None
            if not np.all(spread[k][np.isfinite(found[k])] > 0):
                raise RangeError(f"{name}_sd", "must be positive wherever a value was measured")
        return contact, found, spread


@dataclass(frozen=True, kw_only=True)
class FollicleFit:
    """Estimates, in the order of ``PARAMETERS``.

    Attributes
    ----------
    estimate : (4,) array
        E [Pa], stiffness of the follicle against rotation over EI/L and against translation over EI/L³, ζ; NaN for a
        damping ratio of which nothing was measured.
    covariance : (4, 4) array
        Of ln E, ln k_r, ln k_t and ζ, from the curvature of the likelihood; without meaning for what is not identified.
    low, high : (4,) arrays
        Ends of the profile likelihood's interval; NaN where it does not end within 0.05 to 3·10⁴ EI/L, 1 to 10⁶ EI/L³.
    unique : bool
        Whether the interval is in one piece: no other springs fit as well.
    identified : dict of bool
        Whether both ends are there, and the answer is unique.
    chi_square, freedom : float, int
        Misfit, and measurements less parameters.
    """

    estimate: Array
    covariance: Array
    low: Array
    high: Array
    unique: bool
    identified: dict[str, bool]
    chi_square: float
    freedom: int


class _Measured(NamedTuple):
    """Logarithms of frequencies and displacements near the base of one contact, with standard deviations, (M,) each."""

    contact: float
    frequency: Array
    frequency_sd: Array
    near: Array
    near_sd: Array


class _Likelihood(NamedTuple):
    """On a grid of ln k_r and ln k_t (R, T): χ², and ln E at its best, of weight ``weight``."""

    rotation: Array
    translation: Array
    chi_square: Array
    modulus: Array
    weight: float

    def inside(self, rise: float) -> Mask:
        """Springs that χ² does not refuse."""
        return self.chi_square <= self.chi_square.min() + rise


def predicted(whisker: Whisker, contact: ArrayLike, parameters: Array, n_modes: int, distance: float) -> Array:
    """What the sprung cone does.

    Parameters
    ----------
    whisker : Whisker
        Length, cone angle and density; its modulus is not used.
    contact : (C,) array
        ε.
    parameters : (4,) array
        E [Pa], k_r over EI/L, k_t over EI/L³, ζ.
    n_modes : int
        M.
    distance : float
        Of the point near the base [m].

    Returns
    -------
    (3, C, M) array
        Frequencies of the ringing √(1 − ζ²) κ/2πk [Hz], ζ, and displacements near the base over those of the antinodes.
    """
    modulus, rotation, translation, zeta = (float(one) for one in parameters)
    rate = np.sqrt(1 - zeta**2) / (2 * np.pi * replace(whisker, youngs_modulus=modulus).timescale)
    rows = [
        _of_modes(float(one), rotation, translation, n_modes, distance / whisker.length) for one in np.asarray(contact)
    ]
    kappa, near = np.swapaxes(rows, 0, 1)
    return np.stack([rate * kappa, np.full_like(kappa, zeta), near])


def follicle_fit(whisker: Whisker, measured: Resonances, *, confidence: float = 0.95) -> FollicleFit:
    """Young's modulus, stiffness of the follicle and damping ratio, jointly, by least squares.

    Density, length and cone angle are taken as exact: the frequencies know E only as E α²/ρL⁴. Errors of frequencies
    are taken as relative ones. Without damping ratios the factor √(1 − ζ²) of the ringing is taken as 1, since
    frequencies know E (1 − ζ²) only.

    Parameters
    ----------
    whisker : Whisker
        The cone.
    measured : Resonances
        At its contacts.
    confidence : float
        Of the intervals.

    Returns
    -------
    FollicleFit
        With "identified" for each parameter.

    Raises
    ------
    InputError
        If there are fewer frequencies and displacements than unknown stiffnesses, or one is out of range.
    """
    contact, found, spread = measured.columns()
    count = int(np.isfinite(found[[0, 2]]).sum())
    if count < 3 or not np.isfinite(found[0]).any():
        raise TooFewError("frequencies and displacements", "must be 3 or more, one frequency among them", count)
    rows = [
        _Measured(float(contact[c]), np.log(found[0, c]), spread[0, c] / found[0, c], found[2, c], spread[2, c])
        for c in range(contact.size)
    ]
    share = measured.near_distance / whisker.length
    unit = -float(np.log(2 * np.pi * whisker.timescale * np.sqrt(whisker.youngs_modulus)))
    zeta, zeta_sd, misfit = _mean(found[1], spread[1])
    rise = float(chi2.ppf(confidence, 1))
    surface = _likelihood(rows, share, unit, *_BOUNDS)
    for _ in range(_ZOOMS):
        surface = _likelihood(rows, share, unit, *_box(surface))
    unique = int(label(surface.inside(rise), np.ones((3, 3)))[1]) == 1
    low, high = _ends(surface, rise)
    damped = -np.log1p(-(zeta**2)) if np.isfinite(zeta) else 0.0
    half = np.sqrt(rise) * zeta_sd
    best = np.unravel_index(surface.chi_square.argmin(), surface.chi_square.shape)
    at = np.array([surface.modulus[best] + damped, surface.rotation[best[0]], surface.translation[best[1]]])
    estimate, ends = np.append(np.exp(at), zeta), np.stack([low, high])
    ends[:, 0] += damped
    ends = np.column_stack([np.exp(ends), [zeta - half, zeta + half]])
    identified = np.isfinite(ends).all(axis=0) & np.array([unique, unique, unique, True])
    return FollicleFit(
        estimate=estimate,
        covariance=_covariance(rows, share, at, zeta, zeta_sd),
        low=ends[0],
        high=ends[1],
        unique=unique,
        identified=dict(zip(PARAMETERS, identified.tolist(), strict=True)),
        chi_square=float(surface.chi_square.min()) + misfit,
        freedom=int(np.isfinite(found).sum()) - 3 - int(np.isfinite(zeta)),
    )


def _mean(values: Array, spread: Array) -> tuple[float, float, float]:
    """Weighted mean of what was measured, its standard deviation and χ²; NaN of nothing."""
    kept = np.isfinite(values)
    if not kept.any():
        return float("nan"), float("nan"), 0.0
    weight = spread[kept] ** -2
    mean = float(np.sum(weight * values[kept]) / weight.sum())
    return mean, float(weight.sum() ** -0.5), float(np.sum(weight * (values[kept] - mean) ** 2))


def _of_modes(contact: float, rotation: float, translation: float, n_modes: int, share: float) -> Array:
    """κ, and displacement at a distance from the base (over L) over that of the antinode, (2, M)."""
    kappa, shape = sprung_modes(contact, rotation, translation, n_modes)
    moved = np.abs(sprung_shapes(contact, shape, np.append(contact + _GRID * (1 - contact), 1 - share)))
    return np.stack([kappa, moved[:, -1] / moved[:, :-1].max(axis=1)])


@lru_cache(maxsize=64)
def _table(contact: float, n_modes: int, share: float) -> tuple[tuple[RectBivariateSpline, ...], ...]:
    """Splines of ln κ and of the displacement near the base, over ln k_r and ln k_t."""
    axes = [_between(bounds, _KNOTS) for bounds in _BOUNDS]
    values = np.array([[_of_modes(contact, np.exp(r), np.exp(t), n_modes, share) for t in axes[1]] for r in axes[0]])
    values[:, :, 0] = np.log(values[:, :, 0])
    return tuple(tuple(RectBivariateSpline(*axes, values[:, :, q, m]) for m in range(n_modes)) for q in (0, 1))


def _between(bounds: Array, count: int) -> Array:
    """Even points from one bound to the other."""
    return np.linspace(float(bounds[0]), float(bounds[1]), count)


def _likelihood(rows: list[_Measured], share: float, unit: float, rotation: Array, translation: Array) -> _Likelihood:
    """χ² over a rectangle of springs, the modulus at its best: ln f = unit + ln κ + ½ ln E."""
    axes = _between(rotation, _FINE), _between(translation, _FINE)
    first, second, near, weight = np.zeros((_FINE, _FINE)), np.zeros((_FINE, _FINE)), np.zeros((_FINE, _FINE)), 0.0
    for row in rows:
        kappa, moved = _table(row.contact, row.frequency.size, share)
        for m in np.flatnonzero(np.isfinite(row.frequency)):
            one = row.frequency_sd[m] ** -2
            off = row.frequency[m] - unit - kappa[m](*axes)
            first, second, weight = first + one * off, second + one * off**2, weight + one
        for m in np.flatnonzero(np.isfinite(row.near)):
            near = near + ((row.near[m] - moved[m](*axes)) / row.near_sd[m]) ** 2
    return _Likelihood(*axes, near + second - first**2 / weight, 2 * first / weight, weight / 4)


def _box(surface: _Likelihood) -> tuple[Array, Array]:
    """Smallest rectangle of springs that holds all that is not far from the best, and one point around it."""
    near, sides = surface.inside(_MARGIN), []
    for axis, along in enumerate((surface.rotation, surface.translation)):
        kept = np.flatnonzero(near.any(axis=1 - axis))
        sides.append(along[[max(0, kept[0] - 1), min(along.size - 1, kept[-1] + 1)]])
    return sides[0], sides[1]


def _ends(surface: _Likelihood, rise: float) -> tuple[Array, Array]:
    """Ends of the intervals of ln E, ln k_r and ln k_t; NaN at a bound of the table."""
    limit = surface.chi_square.min() + rise
    room = np.sqrt(np.maximum(limit - surface.chi_square, 0) / surface.weight)
    inside = surface.inside(rise)
    low, high = [float((surface.modulus - room)[inside].min())], [float((surface.modulus + room)[inside].max())]
    for axis, along in enumerate((surface.rotation, surface.translation)):
        profile = surface.chi_square.min(axis=1 - axis)
        kept = np.flatnonzero(profile <= limit)
        for ends, end, beyond, bound in ((low, kept[0], -1, _BOUNDS[axis, 0]), (high, kept[-1], 1, _BOUNDS[axis, 1])):
            if abs(along[end] - bound) < 1e-9:
                ends.append(float("nan"))
                continue
            part = (limit - profile[end]) / (profile[end + beyond] - profile[end])
            ends.append(float(along[end] + part * (along[end + beyond] - along[end])))
    return np.array(low), np.array(high)


def _covariance(rows: list[_Measured], share: float, at: Array, zeta: float, zeta_sd: float) -> Array:
    """Inverse of the likelihood's curvature at the best springs."""
    information = np.zeros((4, 4))
    for row in rows:
        for splines, sd, modulus in zip(
            _table(row.contact, row.frequency.size, share), (row.frequency_sd, row.near_sd), (0.5, 0.0), strict=True
        ):
            for m in np.flatnonzero(np.isfinite(sd)):
                turn, place = (float(splines[m](at[1], at[2], dx=d, dy=1 - d)[0, 0]) for d in (1, 0))
                slope = np.array([modulus, turn, place, 0.0 if np.isnan(zeta) else -2 * modulus * zeta / (1 - zeta**2)])
                information += np.outer(slope, slope) / sd[m] ** 2
    known = np.ones(4, bool) if np.isfinite(zeta) else np.array([True, True, True, False])
    if np.isfinite(zeta):
        information[3, 3] += zeta_sd**-2
    covariance = np.full((4, 4), np.nan)
    covariance[np.ix_(known, known)] = np.linalg.pinv(information[np.ix_(known, known)])
    return covariance
