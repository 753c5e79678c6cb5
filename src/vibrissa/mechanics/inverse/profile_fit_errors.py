"""What a curve fitted to a mean profile leaves uncertain, and what the substrate's line adds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
from scipy.linalg import toeplitz

from vibrissa.arrays import Array, Complex
from vibrissa.mechanics.inverse.profile_fit import FittedCurve, MeanCourse, residuals
from vibrissa.mechanics.statics.edge_contact import Held
from vibrissa.mechanics.statics.profile import Posture

_STEP = 1e-6  # of the parameters, for derivatives
_LINEAR = 0.3  # by which the linear response to the mean excursion is off, at worst


@dataclass(frozen=True)
class Given:
    """What is given beside the nodes, with standard deviations, all over ``unit``, the given length [m].

    Attributes
    ----------
    course : MeanCourse
        The nodes.
    unit, length_sd, skin_sd : float
        L [m]; standard deviations of L and of where arc length is 0.
    excursion, excursion_sd : float
        Mean excursion of the contact.
    line : (2,) array of complex, optional
        Points of the substrate's line.
    line_sd : float
        Standard deviation of either, across the line.
    """

    course: MeanCourse
    unit: float
    length_sd: float
    skin_sd: float
    excursion: float
    excursion_sd: float
    line: Complex | None
    line_sd: float


class FitState(NamedTuple):
    """A fit: state θ, L and excursion (7) over the unit, its covariance, tan⁻¹ μ, and χ² of the substrate's line."""

    state: Array
    covariance: Array
    friction_angle: float
    surprise: float


def with_errors(given: Given, laid: FittedCurve) -> FitState:
    """The fit with its line, if there is one.

    Parameters
    ----------
    given : Given
        What is given beside the curve.
    laid : FittedCurve
        The best curve.

    Returns
    -------
    FitState
        State, covariance and χ² of the line.
    """
    course, unit = given.course, given.unit
    jacobian = derivative(lambda theta: residuals(course, replace(laid, theta=theta), unit), laid.theta)
    covariance = np.zeros((7, 7))
    covariance[:5, :5] = np.sum(noise_and_model(course, laid, unit, jacobian), axis=0)
    response, still = -np.linalg.pinv(jacobian), residuals(course, laid, unit)
    longer = residuals(course, replace(laid, length=laid.length + _STEP * unit), unit)
    shifted = residuals(course, laid, unit, _STEP * unit)
    for sd, off, own in ((given.length_sd, longer, 5), (given.skin_sd, shifted, None)):
        way = np.append(response @ (off - still) / _STEP, [0.0, 0.0])
        if own is not None:
            way[own] = 1
        covariance += sd**2 * np.outer(way, way)
    covariance[6, 6] = given.excursion_sd**2 + (_LINEAR * given.excursion) ** 2
    state = np.array([*laid.theta, laid.length / unit, given.excursion])
    fit = FitState(state, covariance, laid.friction_angle, 0.0)
    return fit if given.line is None else with_line(fit, given)


def noise_and_model(course: MeanCourse, laid: FittedCurve, unit: float, jacobian: Array) -> tuple[Array, Array]:
    """Covariances of θ that come from the noise of the mean, and from residuals beyond that noise.

    Parameters
    ----------
    course : MeanCourse
        The nodes.
    laid : FittedCurve
        The best curve.
    unit : float
        Unit of length [m].
    jacobian : (N + 1, P) array
        Derivatives of the residuals by the parameters.

    Returns
    -------
    noise, model : (P, P) arrays
        Covariances.
    """
    inverse = np.linalg.pinv(jacobian)
    _, way = laid.at(1 - course.arc / laid.length, unit)
    nodes = len(way)
    if len(course.parts):
        off = np.exp(-1j * way) * course.parts / unit
        scatter = np.column_stack([off.imag, np.sqrt(nodes) * off.real.mean(axis=1)])
        noise = np.cov(inverse @ scatter.T) / len(scatter)
        left = (scatter - scatter @ inverse.T @ jacobian.T)[:, :nodes]
        expected = np.mean([_autocovariance(one) for one in left], axis=0) / (len(left) - 1)
    else:
        sd = np.append(course.sd / unit, 0.0)
        noise = (inverse * sd**2) @ inverse.T
        expected = np.append(np.mean(sd**2), np.zeros(nodes - 1))
    found = _autocovariance(residuals(course, laid, unit)[:nodes])
    taper = np.maximum(1 - np.arange(nodes) / (nodes / 2), 0)
    beyond = inverse[:, :nodes] @ toeplitz((found - expected) * taper) @ inverse[:, :nodes].T
    values, vectors = np.linalg.eigh(beyond)
    return noise, (vectors * np.maximum(values, 0)) @ vectors.T


def _autocovariance(values: Array) -> Array:
    return np.correlate(values, values, "full")[values.size - 1 :] / values.size


def derivative(function: Callable[[Array], Array], at: Array) -> Array:
    """Derivative of a function of the parameters, which are of order 1, along the last axis.

    Parameters
    ----------
    function : callable
        Of parameters (P,), any array.
    at : (P,) array
        Where.

    Returns
    -------
    (…, P) array
        By central differences.
    """
    columns = [(function(at + h) - function(at - h)) / (2 * _STEP) for h in _STEP * np.eye(at.size)]
    return np.stack(columns, axis=-1)


def laid_of(state: Array, known: FitState, given: Given) -> FittedCurve:
    """The curve of a state.

    Parameters
    ----------
    state : (7,) array
        θ, L and excursion over the unit.
    known : FitState
        Gives the angle of friction.
    given : Given
        Gives the unit.

    Returns
    -------
    FittedCurve
        The curve.
    """
    return FittedCurve(state[:5], float(state[5]) * given.unit, known.friction_angle)


def lean(laid: FittedCurve, excursion: float) -> tuple[float, float]:
    """How far an excursion (over L) moves ε, and the angle at the contact that it gives, to first order.

    Parameters
    ----------
    laid : FittedCurve
        On the flat.
    excursion : float
        Mean excursion d over L.

    Returns
    -------
    shift, turn : float
        Change of ε over L; angle at the contact [rad].
    """
    if excursion == 0:
        return 0.0, 0.0
    angle = float(np.clip(laid.posture[1], 1e-3, np.pi / 2 - 1e-3))  # the sensitivity is of the curve alone
    posture = Posture(contact=laid.contact, base_angle=angle, friction=float(np.tan(laid.friction_angle)))
    held = Held(posture, 0.0, laid.contact, 0.0, laid.curve)
    shift, turn, _ = np.linalg.solve(held.sensitivity, [0.0, excursion, 0.0])
    return float(shift), float(turn)


def _heights(state: Array, known: FitState, given: Given) -> Array:
    """Heights of the line's points above the substrate of the fit, over the unit."""
    laid = laid_of(state, known, given)
    contact, _ = laid.at(np.array([laid.contact]), given.unit)
    substrate = state[4] - lean(laid, state[6] / state[5])[1]
    return np.asarray((np.exp(-1j * substrate) * (np.asarray(given.line) - contact)).imag)


def with_line(known: FitState, given: Given) -> FitState:
    """The fit after the line, as a measurement of two heights that are 0 (iterated Kalman update).

    Parameters
    ----------
    known : FitState
        Of the nodes alone.
    given : Given
        Gives the line and its error.

    Returns
    -------
    FitState
        Of nodes and line.
    """
    state = known.state
    for _ in range(4):
        slope = derivative(lambda one: _heights(one, known, given), state)
        spread = slope @ known.covariance @ slope.T + given.line_sd**2 * np.eye(2)
        gain = np.linalg.solve(spread, slope @ known.covariance).T
        off = _heights(state, known, given) + slope @ (known.state - state)
        state = known.state - gain @ off
    surprise = float(off @ np.linalg.solve(spread, off))
    return FitState(state, known.covariance - gain @ slope @ known.covariance, known.friction_angle, surprise)


def scale(course: MeanCourse, laid: FittedCurve, unit: float, free: Literal["friction_angle", "length"]) -> float:
    """What turns the sum of squares into a deviance of one more parameter, whose curvature there is 1/variance.

    Parameters
    ----------
    course : MeanCourse
        The nodes.
    laid : FittedCurve
        The best curve.
    unit : float
        Unit of length [m].
    free : {"friction_angle", "length"}
        The further parameter.

    Returns
    -------
    float
        Factor.
    """

    def at(theta: Array) -> Array:
        return residuals(course, replace(laid, theta=theta[:5], **{free: float(theta[5])}), unit)

    jacobian = derivative(at, np.append(laid.theta, getattr(laid, free)))
    variance = np.sum(noise_and_model(course, laid, unit, jacobian), axis=0)[5, 5]
    return float(np.linalg.pinv(jacobian.T @ jacobian)[5, 5] / variance)
