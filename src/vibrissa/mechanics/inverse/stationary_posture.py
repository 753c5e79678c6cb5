"""Posture and friction from a tracked mean profile, by Eq. 1: θ_b, ε, H and, where it can be estimated, μ.

The curves of Eq. 1 form one family (:func:`vibrissa.mechanics.statics.profile.curve`), laid into the image by a rigid
motion. Where the substrate is not given, that motion is free, and the curvature alone determines the posture.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.stats import t as student

from vibrissa.arrays import Array, Complex
from vibrissa.errors import MissingError, RangeError, ShapeError
from vibrissa.mechanics.inverse.profile_fit import FittedCurve, MeanCourse, lay, mean_course, residuals, start
from vibrissa.mechanics.inverse.profile_fit_errors import FitState, Given, derivative, laid_of, lean, scale, with_errors
from vibrissa.quantities import dataset
from vibrissa.whisker import Whisker

Line = tuple[tuple[float, float], tuple[float, float]]

FRICTIONS = np.linspace(0.0, 2.0, 21)  # tried for μ; an interval that covers them all is no information
_POINTS = 201  # of the fitted curve that are given
_CHORD = 1e-3  # over which the mean profile's angle is taken [m]


def fit_profile(
    profile: xr.Dataset,
    whisker: Whisker,
    *,
    substrate: Line | None = None,
    substrate_sd: float | None = None,
    friction: float | None = 0.4,
    excursion: tuple[float, float] = (0.0, 0.0),
    length_sd: float = 0.0,
    skin_sd: float = 0.0,
) -> xr.Dataset:
    """Posture of a whisker from its mean profile: contact, base angle, height of the base; friction if asked.

    Least squares of the distance across the curve of Eq. 1, over posture and rigid motion. The covariance has the noise
    of the mean (of 20 batches of frames, vibration and all; of fewer than 40 frames, as the tracker estimated it) and
    what is left of the residuals beyond it, as long as it is correlated, as error of the model. Then come the
    uncertainties of L, of the skin, and, where the substrate's line is given, its information about orientation and
    height, as a measurement with its own error.

    With ``friction=None`` μ is estimated by the profile likelihood on [0, 2], scaled to the same covariance.

    Errors of the tracker are error of the model, and enter the covariance only as far as they leave residuals. Next to
    fur the tracker itself leaves out what is not the shaft (:mod:`vibrissa.video.profile.base_end`); at the border of
    a shadow the last nodes are left out here. With the line given, 95 % intervals of ε and θ_b then hold the truth
    with fur and shadow too (``benchmarks/fur_coverage.py``). Those of μ were not examined on such films: do not rely
    on them.

    Parameters
    ----------
    profile : Dataset
        One whisker: ``x``, ``y`` (time, node), ``arc_length`` (node) from the skin [m]. Hidden nodes are absent or NaN.
    whisker : Whisker
        Gives L.
    substrate : ((x, y), (x, y)), optional
        Two points of the substrate's line, in the profile's frame [m]. By default its place is unknown.
    substrate_sd : float, optional
        Standard deviation of either point across the line [m]; half a pixel by default.
    friction : float, optional
        μ; None to fit it.
    excursion : (float, float)
        Mean excursion of the contact by the texture, along the scan, and its standard deviation [m]: gaps let it hang
        back, by some 0.1 mm on the paper's gratings, which moves ε by 0.003 and the angle at the contact by 0.02 rad.
        To first order the posture given is that on the flat.
    length_sd, skin_sd : float
        Standard deviations of L and of where on the shaft arc length is 0 [m].

    Returns
    -------
    Dataset
        ``contact``, ``base_angle``, ``base_height`` H [m], ``friction_found``, each with ``_se``, ``_low``, ``_high``
        (95 %); ``posture_correlation`` of the errors of ε and θ_b; ``friction_identified``; ``profile_r2`` (of the
        angle, as the paper has it) and ``bend_r2`` (of the distance from the best straight line); ``fitted_x``,
        ``fitted_y`` (s) [m] from the contact to the base, in the profile's frame. Standard error and interval of a
        friction that was given are NaN. Attributes ``friction_told``,
        ``degrees_of_freedom`` of Student's t, and ``line_surprise``, χ² (2 degrees of freedom) of the line against
        the profile alone: above some 10, one of them is wrong and the intervals do not hold.

    Raises
    ------
    InputError
        If the profile is not of one whisker, or has too few nodes, or the line's error is missing.
    ConvergenceError
        If no curve of Eq. 1 fits.
    """
    course, unit = mean_course(profile), whisker.length
    line, line_sd = (None, 0.0) if substrate is None else _line(course, profile, substrate, substrate_sd)
    given = Given(
        course,
        unit,
        length_sd=length_sd / unit,
        skin_sd=skin_sd / unit,
        excursion=excursion[0] / unit,
        excursion_sd=excursion[1] / unit,
        line=None if line is None else line / unit,
        line_sd=line_sd / unit,
    )
    freedom = len(course.parts) - 1 if len(course.parts) else np.inf
    wide = float(student.ppf(0.975, freedom))
    mu = 0.4 if friction is None else friction
    laid = lay(course, start(course, whisker, float(np.arctan(mu))), unit)
    if friction is None:
        known, interval = _friction(given, laid, wide)
    else:
        known, interval = with_errors(given, laid), np.full(3, np.nan)
    return _labelled(given, known, interval, wide, freedom)


def _line(course: MeanCourse, profile: xr.Dataset, substrate: Line, sd: float | None) -> tuple[Complex, float]:
    """Both points of the line, mirrored as the course is, and their error [m]."""
    if sd is None and "pixel_size" not in profile.attrs:
        raise MissingError("substrate_sd", "must be given where the profile has no pixel size")
    error = profile.attrs["pixel_size"] / 2 if sd is None else sd
    if not error > 0:
        raise RangeError("substrate_sd", "must be above 0", error)
    points = np.array(substrate, float) @ np.array([1, -1j if course.mirrored else 1j])
    if points[0] == points[1]:
        raise ShapeError("substrate", "must be two different points", substrate)
    return points, float(error)


def _friction(given: Given, laid: FittedCurve, wide: float) -> tuple[FitState, Array]:
    """The fit at the likeliest μ, its covariance with that of μ; standard error and interval of μ."""
    course, unit, fits = given.course, given.unit, [laid]
    for mu in FRICTIONS:
        fits.append(lay(course, replace(fits[-1], friction_angle=float(np.arctan(mu))), unit))
    fits = fits[1:]
    misfit = np.array([np.sum(residuals(course, one, unit) ** 2) for one in fits])
    deviance = misfit * scale(course, fits[int(misfit.argmin())], unit, "friction_angle")
    deviance += [with_errors(given, one).surprise for one in fits]
    fine = np.linspace(FRICTIONS[0], FRICTIONS[-1], 2001)
    between = CubicSpline(FRICTIONS, deviance)(fine)
    inside = fine[between <= between.min() + wide**2]
    mu, low, high = fine[between.argmin()], inside[0], inside[-1]
    near = fits[int(np.abs(FRICTIONS - mu).argmin())]
    best, *ends = (
        with_errors(given, lay(course, replace(near, friction_angle=float(np.arctan(one))), unit))
        for one in (mu, low, high)
    )
    way = (ends[1].state - ends[0].state) / (2 * wide)
    return best._replace(covariance=best.covariance + np.outer(way, way)), np.array(
        [(high - low) / (2 * wide), low, high]
    )


def _labelled(given: Given, known: FitState, interval: Array, wide: float, freedom: float) -> xr.Dataset:
    course, unit, laid = given.course, given.unit, laid_of(known.state, known, given)

    def geometry(state: Array) -> Array:
        one = laid_of(state, known, given)
        shift, turn = lean(one, state[6] / state[5])
        away = np.exp(1j * turn) * (one.curve.x[-1] + 1j * one.curve.y[-1])
        return np.array([one.contact - shift, one.posture[1] + turn, one.contact * away.imag * one.length])

    slope = derivative(geometry, known.state)
    covariance = slope @ known.covariance @ slope.T
    values, sd = geometry(known.state), np.sqrt(np.diag(covariance))
    found: dict[str, Any] = {}
    for name, value, se in zip(("contact", "base_angle", "base_height"), values, sd, strict=True):
        found |= {name: value, f"{name}_se": se, f"{name}_low": value - wide * se, f"{name}_high": value + wide * se}
    s = np.linspace(laid.contact, 1, _POINTS)
    line = laid.at(s, unit)[0] * unit
    se, low, high = interval
    unknown = bool(low <= FRICTIONS[0] and high >= FRICTIONS[-1])
    text = "given" if np.isnan(se) else "not identified" if unknown else f"{low:.2f} to {high:.2f}"
    return dataset(
        {"whisker_length": unit, "degrees_of_freedom": freedom, "friction_told": text, "line_surprise": known.surprise},
        **found,
        posture_correlation=covariance[0, 1] / (sd[0] * sd[1]),
        friction_found=np.tan(known.friction_angle),
        friction_se=np.nan if unknown else se,
        friction_low=low,
        friction_high=high,
        friction_identified=text not in ("given", "not identified"),
        profile_r2=_angle_r2(course, laid, unit),
        bend_r2=_bend_r2(course, laid, unit),
        s=s,
        fitted_x=line.real,
        fitted_y=-line.imag if course.mirrored else line.imag,
    )


def _angle_r2(course: MeanCourse, laid: FittedCurve, unit: float) -> float:
    """Share of the variance of the angle, of chords of about a millimetre, that the curve explains."""
    step = max(1, round(_CHORD / float(np.median(np.diff(course.arc)))))
    fitted, _ = laid.at(1 - course.arc / laid.length, unit)
    chord, model = (one[:-step] - one[step:] for one in (course.place, fitted))
    # the residual is the angle between both chords: unwrapped apart, they may differ by a whole turn
    angle, residual = np.unwrap(np.angle(chord)), np.angle(chord / model)
    return float(1 - np.sum(residual**2) / np.sum((angle - angle.mean()) ** 2))


def _bend_r2(course: MeanCourse, laid: FittedCurve, unit: float) -> float:
    """Share of the squared distances from the best straight line that the curve explains."""
    centred = (course.place - course.place.mean()) / unit
    flat = np.linalg.svd(np.column_stack([centred.real, centred.imag]), compute_uv=False)[1] ** 2
    return float(1 - np.sum(residuals(course, laid, unit)[:-1] ** 2) / flat)
