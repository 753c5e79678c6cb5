"""Properties of a whisker from its tracks alone: L, ε, θ_b from its profile; k, ζ and maybe E from its resonances.

The profile knows lengths alone; the resonances know E, ρ and α only as the timescale k = (2L/α)√(ρ/E).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.stats import norm
from scipy.stats import t as student

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, TooFewError
from vibrissa.exact import cone_kappa
from vibrissa.mechanics.inverse.profile_fit import FittedCurve, MeanCourse, lay, mean_course, residuals, start
from vibrissa.mechanics.inverse.profile_fit_errors import Given, derivative, scale, with_errors
from vibrissa.mechanics.modes.straight import CONTACT_RANGE
from vibrissa.quantities import dataset, require
from vibrissa.whisker import DENSITY, Whisker

Measured = tuple[NDArray[np.int_], Array, Array]

LONGEST = 2.0  # length tried at most, over the length seen
_LENGTHS = 12  # tried over that range, and again over the likely part of it
_WIDE = float(norm.ppf(0.975))
_VAGUE = 10.0  # standard deviation of ln k before the resonances
_ENDS = np.array([0.0, -1.0, 1.0])  # of an interval: its middle, low and high


class Candidate(NamedTuple):
    """A length, the curve that fits best with it, and what the resonances make of it.

    ``state`` holds ln k, ε, θ_b, with their ``covariance`` at this length; ``surprise`` is χ² of the resonances.
    """

    laid: FittedCurve
    misfit: float
    state: Array
    covariance: Array
    surprise: float


def fit_whisker(
    profile: xr.Dataset,
    resonance: xr.Dataset,
    *,
    cone_angle: tuple[float, float] | None = None,
    density: tuple[float, float] = (DENSITY, 0.0),
    friction: float = 0.4,
) -> xr.Dataset:
    """Length, stiffness, damping and posture of a whisker from its tracks alone.

    The profile likelihood over L joins what the mean profile says (Eq. 1: the taper stiffens the shaft as s⁴) and the
    ratios of the resonances (κ_i(ε) of the straight shaft); k follows from their size. E = (2L/α)² ρ/k² needs α and ρ
    from elsewhere. What the data do not determine is NaN, and named.

    Parameters
    ----------
    profile : Dataset
        One whisker: ``x``, ``y`` (time, node), ``arc_length`` (node) from the skin [m].
    resonance : Dataset
        ``resonant_frequency`` and ``damping`` (mode), each with ``_low`` and ``_high`` (95 %), from the lowest mode on;
        NaN where not found.
    cone_angle : (float, float), optional
        α and its standard error [rad]; without it E is not identified.
    density : (float, float)
        ρ and its standard error [kg/m³].
    friction : float
        μ.

    Returns
    -------
    Dataset
        ``length``, ``timescale``, ``youngs_modulus``, ``contact``, ``base_angle``, ``damping_all`` (one ζ for all
        modes), each with ``_low`` and ``_high`` (95 %); ``tried_length``, ``deviance`` (tried): the likelihood of L;
        ``damping_spread``: χ² of the modes' own ζ about it over its degrees of freedom. The attribute
        ``not_identified`` names what the data cannot determine, and why.

    Raises
    ------
    InputError
        If no resonance has an interval, or the profile is not of one whisker or has too few nodes.
    ConvergenceError
        If no length fits.
    """
    course = mean_course(profile)
    freedom = len(course.parts) - 1 if len(course.parts) else np.inf
    measured = _resonances(resonance)
    wide = float(student.ppf(0.975, freedom))
    candidates: list[Candidate] = []
    lengths = course.arc[-1] * np.geomspace(1.03, LONGEST, _LENGTHS)
    for _ in range(2):
        candidates += [_joined(course, laid, measured) for laid in _candidates(course, lengths, friction)]
        candidates.sort(key=lambda one: one.laid.length)
        deviance = _deviance(course, candidates)
        low, _, high = _likely(candidates, deviance, 1.5 * wide)
        lengths = np.exp(np.linspace(low, high, _LENGTHS))[1:-1]
    columns = _over_length(candidates, deviance, wide, cone_angle, density)
    columns |= _damping(resonance)
    return dataset(
        {"not_identified": "; ".join(_unknown(columns, cone_angle))},
        tried_length=[one.laid.length for one in candidates],
        deviance=deviance - deviance.min(),
        **columns,
    )


def _resonances(resonance: xr.Dataset) -> Measured:
    """Indices from 0, ln ω, and its standard error, of the modes that have an interval."""
    require(resonance, "resonant_frequency", "resonant_frequency_low", "resonant_frequency_high")
    low, high = resonance.resonant_frequency_low.values, resonance.resonant_frequency_high.values
    index = np.arange(low.size)[np.isfinite(low) & np.isfinite(high)]
    if not index.size:
        raise TooFewError("resonant_frequency", "must have an interval for one mode at least")
    omega = 2 * np.pi * resonance.resonant_frequency.values[index]
    return index, np.log(omega), np.log(high[index] / low[index]) / (2 * _WIDE)


def _candidates(course: MeanCourse, lengths: Array, friction: float) -> list[FittedCurve]:
    """The best curve for each of some lengths; without those with which none fits."""
    seen, angle = float(course.arc[-1]), float(np.arctan(friction))
    fits = []
    for length in lengths.tolist():
        first = start(course, Whisker(length=length, cone_angle=1e-3), angle)
        theta = first.theta * [1, 1, length / seen, length / seen, 1]
        try:
            laid = lay(course, replace(first, theta=theta), seen)
        except ConvergenceError:
            continue
        if CONTACT_RANGE[0] < laid.contact < CONTACT_RANGE[1]:
            fits.append(laid)
    if len(fits) < 4:
        raise ConvergenceError("length of the whisker", float(len(fits)), _LENGTHS)
    return fits


def _joined(course: MeanCourse, laid: FittedCurve, measured: Measured) -> Candidate:
    """ε and θ_b from the profile, then from the ratios of the resonances too; ln k from their size."""
    modes, log_omega, error = measured
    seen = float(course.arc[-1])
    fit = with_errors(Given(course, seen, 0.0, 0.0, 0.0, 0.0, None, 0.0), laid)
    slope = derivative(lambda theta: replace(laid, theta=theta).posture[:2], laid.theta)
    covariance = np.zeros((3, 3))
    covariance[0, 0], covariance[1:, 1:] = _VAGUE**2, slope @ fit.covariance[:5, :5] @ slope.T

    def expected(state: Array) -> Array:
        return np.log(cone_kappa(float(state[1]), int(modes[-1]) + 1)[modes]) - state[0]

    first = np.array([-np.mean(log_omega - expected(np.array([0.0, laid.contact]))), *laid.posture[:2]])
    state = first
    for _ in range(4):
        by = derivative(expected, state)
        spread = by @ covariance @ by.T + np.diag(error**2)
        gain = np.linalg.solve(spread, by @ covariance).T
        off = log_omega - expected(state) - by @ (first - state)
        state = first + gain @ off
        state[1] = np.clip(state[1], *CONTACT_RANGE)
    misfit = float(np.sum(residuals(course, laid, seen) ** 2))
    surprise = float(off @ np.linalg.solve(spread, off))
    return Candidate(laid, misfit, state, covariance - gain @ by @ covariance, surprise)


def _deviance(course: MeanCourse, candidates: list[Candidate]) -> Array:
    misfit = np.array([one.misfit for one in candidates])
    factor = scale(course, candidates[int(misfit.argmin())].laid, float(course.arc[-1]), "length")
    return misfit * factor + [one.surprise for one in candidates]


def _likely(candidates: list[Candidate], deviance: Array, wide: float) -> tuple[float, float, float]:
    """Low end, likeliest and high end of ln L among those within ``wide`` standard deviations."""
    log_length = np.log([one.laid.length for one in candidates])
    fine = np.linspace(log_length[0], log_length[-1], 4001)
    between = CubicSpline(log_length, deviance)(fine)
    inside = fine[between <= between.min() + wide**2]
    return float(inside[0]), float(fine[between.argmin()]), float(inside[-1])


def _over_length(
    candidates: list[Candidate],
    deviance: Array,
    wide: float,
    cone_angle: tuple[float, float] | None,
    density: tuple[float, float],
) -> dict[str, Any]:
    """Values and intervals at the likeliest length; what an open length leaves open is NaN."""
    log_length = np.log([one.laid.length for one in candidates])
    low, best, high = _likely(candidates, deviance, wide)
    of_length = CubicSpline(log_length, [one.state for one in candidates])
    near = candidates[int(np.abs(log_length - best).argmin())].covariance
    ends = (np.array([*of_length(one), one - of_length(one)[0]]) for one in (best, low, high))
    values, lowest, highest = ends  # ln k, ε, θ_b, ln L/k
    variance = np.append(np.diag(near), near[0, 0]) + ((highest - lowest) / (2 * wide)) ** 2
    half = wide * np.sqrt(variance)
    closed_low, closed_high = low > log_length[0], high < log_length[-1]
    known = closed_low and closed_high
    columns = {
        "length": np.exp(best) if known else np.nan,
        "length_low": np.exp(low) if closed_low else np.nan,
        "length_high": np.exp(high) if closed_high else np.nan,
    }
    for name, i, scaled in (("timescale", 0, np.exp), ("contact", 1, np.array), ("base_angle", 2, np.array)):
        columns |= _interval(name, scaled(values[i] + half[i] * _ENDS))
    stiffness = np.full(3, np.nan)
    if cone_angle is not None and known:
        size = 2 * values[3] + 2 * np.log(2 / cone_angle[0]) + np.log(density[0])
        relative = np.array([2 * half[3] / wide, 2 * cone_angle[1] / cone_angle[0], density[1] / density[0]])
        stiffness = np.exp(size + wide * np.linalg.norm(relative) * _ENDS)
    return columns | _interval("youngs_modulus", stiffness)


def _interval(name: str, ends: Array) -> dict[str, float]:
    return {name: ends[0], f"{name}_low": ends[1], f"{name}_high": ends[2]}


def _damping(resonance: xr.Dataset) -> dict[str, Any]:
    """One ζ for all modes, weighted, with the scatter of the modes' own about it."""
    require(resonance, "damping", "damping_low", "damping_high")
    log_zeta, low, high = (np.log(resonance[f"damping{end}"].values) for end in ("", "_low", "_high"))
    use = np.isfinite(low) & np.isfinite(high)
    if not use.any():
        return _interval("damping_all", np.full(3, np.nan)) | {"damping_spread": np.nan}
    weight = ((high - low)[use] / (2 * _WIDE)) ** -2.0
    mean = np.average(log_zeta[use], weights=weight)
    degrees = use.sum() - 1
    spread = float(np.sum(weight * (log_zeta[use] - mean) ** 2) / degrees) if degrees else np.nan
    half = _WIDE * np.sqrt(max(1.0, spread if degrees else 1.0) / weight.sum())
    return _interval("damping_all", np.exp(mean + half * _ENDS)) | {"damping_spread": spread}


def _unknown(columns: dict[str, Any], cone_angle: tuple[float, float] | None) -> list[str]:
    """What the data cannot determine, and why."""
    reasons = []
    if np.isnan(columns["length"]):
        ends = [f"above {1e3 * columns['length_low']:.1f} mm"] if np.isfinite(columns["length_low"]) else []
        ends += [f"below {1e3 * columns['length_high']:.1f} mm"] if np.isfinite(columns["length_high"]) else []
        reasons.append(f"L: the interval reaches what was tried; {' and '.join(ends) or 'any will do'}")
    if cone_angle is None:
        reasons.append("E: E, ρ and α enter as k = (2L/α)√(ρ/E) alone; give α")
    elif np.isnan(columns["length"]):
        reasons.append("E: it needs L")
    if np.isnan(columns["damping_all"]):
        reasons.append("ζ: no mode has an interval")
    return reasons
