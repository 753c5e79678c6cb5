"""A curve of Eq. 1 fitted to the mean profile of a tracked whisker by a rigid motion, by least squares."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import least_squares

from vibrissa.arrays import Array, Complex
from vibrissa.errors import ConvergenceError, TooFewError
from vibrissa.mechanics.inverse.steady_nodes import steady_nodes
from vibrissa.mechanics.statics.contact_law import ContactLaw
from vibrissa.mechanics.statics.elastica_table import equilibria
from vibrissa.mechanics.statics.profile import Curve, curve
from vibrissa.quantities import measured, measured_sd, require
from vibrissa.whisker import Whisker

BATCHES = 20  # of consecutive frames, whose means give the noise of the mean, vibration and all
FEWEST_NODES = 24
_TRIED = [(contact, angle) for contact in (0.06, 0.12, 0.2, 0.3, 0.42) for angle in (0.5, 0.8, 1.1, 1.4)]


class MeanCourse(NamedTuple):
    """Mean places of the nodes seen, as complex numbers, mirrored if need be so that the shaft turns left to the base.

    Attributes
    ----------
    arc : (N,) array
        Arc length from the skin [m].
    place : (N,) array
        Mean over frames [m].
    parts : (B, N) array
        Means of batches of frames less the mean; without rows where there are too few frames.
    sd : (N,) array
        Standard deviation of the mean as the tracker estimated it [m]; 0 where it did not.
    mirrored : bool
        Whether y was turned round.
    """

    arc: Array
    place: Complex
    parts: Complex
    sd: Array
    mirrored: bool


@dataclass(frozen=True)
class FittedCurve:
    """A curve of Eq. 1 laid into the image.

    ``theta``: logit ε, ln Λ̂, the base's place (2) over the given length, and the direction β of the substrate towards
    the base [rad]. ``length`` [m] and ``friction_angle`` are given.
    """

    theta: Array
    length: float
    friction_angle: float

    @property
    def contact(self) -> float:
        """ε."""
        return float(1 / (1 + np.exp(-self.theta[0])))

    @property
    def curve(self) -> Curve:
        """Member of the family."""
        return _curve(float(np.exp(self.theta[1])), float(-np.log(self.contact)), self.friction_angle)

    @property
    def posture(self) -> Array:
        """ε, θ_b and H (over L)."""
        return np.array([self.contact, self.curve.psi[-1], self.contact * self.curve.y[-1]])

    def at(self, s: Array, unit: float) -> tuple[Complex, Array]:
        """Places over ``unit`` and directions [rad] of points of the shaft; beyond the contact it continues straight.

        Parameters
        ----------
        s : (S,) array
            Points, over the given length.
        unit : float
            Unit of length [m].

        Returns
        -------
        place : (S,) array of complex
            Over the unit.
        angle : (S,) array
            Towards the base [rad].
        """
        solution, contact = self.curve, self.contact
        log_x = np.log(np.maximum(s / contact, 1))
        psi, x, y = (solution.at(values, log_x) for values in (solution.psi, solution.x, solution.y))
        free = np.minimum(s / contact, 1) - 1
        from_base = contact * (x + free - solution.x[-1] + 1j * (y - solution.y[-1]))
        base = self.theta[2] + 1j * self.theta[3]
        return base + self.length / unit * np.exp(1j * self.theta[4]) * from_base, self.theta[4] + psi


@lru_cache(maxsize=4096)
def _curve(load: float, span: float, friction_angle: float) -> Curve:
    return curve(load, span, ContactLaw(float(np.tan(friction_angle))))


def mean_course(profile: xr.Dataset) -> MeanCourse:
    """Mean places of the nodes seen in half of the frames or more, without those at a shadow's border.

    Parameters
    ----------
    profile : Dataset
        One whisker: ``x``, ``y`` (time, node), ``arc_length`` (node) from the skin [m]; with ``y_sd`` or ``x_sd``
        nodes without one are left out.

    Returns
    -------
    MeanCourse
        Of the mean profile.

    Raises
    ------
    InputError
        If the profile is not of one whisker, or has fewer than 24 nodes.
    """
    require(profile, "x", "y", "arc_length")
    if profile.x.ndim != 2:
        raise TooFewError("profile", "must be of one whisker", f"dimensions {profile.x.dims}", "select one")
    known = measured(profile) & np.isfinite(profile.x.values + profile.y.values)
    seen = steady_nodes(known, profile.arc_length.values)
    if seen.sum() < FEWEST_NODES:
        raise TooFewError("profile", f"must have {FEWEST_NODES} nodes seen in half the frames", int(seen.sum()))
    nodes = np.flatnonzero(seen)[np.argsort(profile.arc_length.values[seen])]  # from the skin on
    z = np.where(known, profile.x.values + 1j * profile.y.values, np.nan)[:, nodes]
    place, arc = np.nanmean(z, axis=0), profile.arc_length.values[nodes]
    bend = np.polyfit(arc, place, 3)
    ways = [np.polyval(np.polyder(bend), at) for at in (arc[0], arc[-1])]
    mirrored = bool(np.angle(ways[1] / ways[0]) > 0)
    parts = np.array([_nanmean(part) for part in np.array_split(z, BATCHES)]) if len(z) >= 2 * BATCHES else z[:0]
    parts = parts[np.isfinite(parts).all(axis=1)] - place
    sd = np.zeros(arc.size)
    if "y_sd" in profile or "x_sd" in profile:
        each = np.where(known, measured_sd(profile).values, np.nan)[:, nodes]
        sd = np.sqrt(np.nanmean(each**2, axis=0) / known[:, nodes].sum(axis=0))
    turned = np.conj if mirrored else np.asarray
    return MeanCourse(arc, turned(place), turned(parts), sd, mirrored)


def _nanmean(values: Complex) -> Complex:
    seen = np.isfinite(values)
    total = np.where(seen, values, 0).sum(axis=0)
    return np.where(seen.any(axis=0), total / np.maximum(seen.sum(axis=0), 1), np.nan)


def residuals(course: MeanCourse, laid: FittedCurve, unit: float, skin: float = 0.0) -> Array:
    """Distances across the curve at every node, and the mean distance along it, times √N; over ``unit``.

    The distance across determines the shape: nodes are at given arc lengths, so their distances along follow from it.

    Parameters
    ----------
    course : MeanCourse
        The nodes.
    laid : FittedCurve
        The curve.
    unit : float
        Unit of length [m].
    skin : float
        Distance of the first node from the skin, over the unit.

    Returns
    -------
    (N + 1,) array
        Over the unit; positive to the left of the way to the base.
    """
    place, way = laid.at(1 - (course.arc + skin) / laid.length, unit)
    off = np.exp(-1j * way) * (course.place / unit - place)
    return np.append(off.imag, np.sqrt(off.size) * off.real.mean())


def start(course: MeanCourse, whisker: Whisker, friction_angle: float) -> FittedCurve:
    """The best of some postures, each laid on the nodes by the rigid motion of least squares.

    Parameters
    ----------
    course : MeanCourse
        The nodes.
    whisker : Whisker
        Gives L.
    friction_angle : float
        tan⁻¹ μ [rad].

    Returns
    -------
    FittedCurve
        The one of least squares.
    """
    contact, angle = np.array(_TRIED).T
    load = equilibria(contact, angle, float(np.tan(friction_angle))).contact_force / contact**2
    tried = []
    for one, strength in zip(contact, load, strict=True):
        theta = np.array([np.log(one / (1 - one)), np.log(strength), 0, 0, 0])
        laid = FittedCurve(theta, whisker.length, friction_angle)
        place, _ = laid.at(1 - course.arc / whisker.length, whisker.length)
        goal = course.place / whisker.length
        turn = np.angle(np.vdot(place - place.mean(), goal - goal.mean()))
        base = goal.mean() - np.exp(1j * turn) * place.mean()
        tried.append(replace(laid, theta=np.array([*theta[:2], base.real, base.imag, turn])))
    return min(tried, key=lambda laid: float(np.sum(residuals(course, laid, whisker.length) ** 2)))


def lay(course: MeanCourse, first: FittedCurve, unit: float) -> FittedCurve:
    """Least squares of the residuals over θ.

    Parameters
    ----------
    course : MeanCourse
        The nodes.
    first : FittedCurve
        Where to start.
    unit : float
        Unit of length [m].

    Returns
    -------
    FittedCurve
        The best curve.

    Raises
    ------
    ConvergenceError
        If no curve fits: the load or the contact runs away.
    """
    try:
        found = least_squares(
            lambda theta: 1e4 * residuals(course, replace(first, theta=theta), unit),
            first.theta,
            method="lm",
            xtol=1e-11,
            ftol=1e-13,
            max_nfev=600,
        )
    except (ConvergenceError, FloatingPointError, np.linalg.LinAlgError) as error:
        raise ConvergenceError("fit of Eq. 1 to the profile", np.nan, 600) from error
    if not found.success:
        raise ConvergenceError("fit of Eq. 1 to the profile", float(found.optimality), int(found.nfev))
    return replace(first, theta=found.x)
