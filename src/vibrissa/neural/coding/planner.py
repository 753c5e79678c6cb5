"""Number of trials until threshold, slope and latency of a unit have the intervals wanted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import ndtri

from vibrissa.arrays import Array
from vibrissa.errors import MissingError, ShapeError, UnknownError, require_not_negative, require_positive
from vibrissa.neural.coupling.analysis import FEWEST_SPIKES, FEWEST_TRIALS
from vibrissa.neural.coupling.stimulus_blocks import sensitivities
from vibrissa.neural.coupling.threshold_linear import BinnedDrive, Hinge
from vibrissa.neural.coupling.tuning import predicted
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
from vibrissa.quantities import dataset, require, stacked

LEAST_BASELINE = 0.05  # [Hz] counted for units more silent: at 0 a single spike below the threshold would decide all
TIMESCALE = 0.01  # [s] scale of the latency
MOST_ALIKE = 1e8  # condition number of the information, in units of the scales above: beyond it, rounding decides
Z = float(ndtri(0.975))


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """Half widths wanted of the 95 % intervals; None where an interval does not matter.

    Attributes
    ----------
    threshold : float, optional
        [m].
    slope : float, optional
        As a share of the slope.
    latency : float, optional
        [s].
    """

    threshold: float | None = None
    slope: float | None = None
    latency: float | None = None

    def __post_init__(self) -> None:
        given = [one for one in (self.threshold, self.slope, self.latency) if one is not None]
        if not given:
            raise UnknownError("interval", "must be given for threshold, slope or latency", remedy="give one of them")
        for one in given:
            require_positive("interval wanted", one)


def information(drive: BinnedDrive, unit: ThresholdLinearUnit) -> Array:
    """Fisher's information of one trial on threshold, slope, latency and baseline, (4, 4) in the order of ``Hinge``.

    Counts are Poisson in the bins that count, of expectation λ_k w with λ = b + s·(binned hinge): Σ w ∂λ ∂λᵀ / λ.

    Parameters
    ----------
    drive : BinnedDrive
        The stimulus.
    unit : ThresholdLinearUnit
        The unit; a baseline below 0.05 Hz counts as that.

    Returns
    -------
    (4, 4) array
        In the inverse products of the parameters' units.
    """
    slopes = sensitivities(drive, Hinge(*(getattr(unit, name) for name in Hinge._fields)))
    hinge = slopes[1]
    rate = max(unit.baseline, LEAST_BASELINE) + unit.slope * hinge
    return np.asarray(slopes * np.diff(drive.edges)[drive.valid] / rate @ slopes.T, float)


def covariance(
    drive: BinnedDrive, unit: ThresholdLinearUnit, *, gain_sd: float = 0.0, fano_factor: float = 1.0
) -> Array:
    """Covariance of the estimates times the number of trials, (4, 4) in the order of ``Hinge``.

    Parameters
    ----------
    drive, unit
        As in :func:`information`.
    gain_sd : float
        Standard deviation of a gain, of mean 1, that multiplies all of a trial's rate: slope and baseline are those of
        the trials that happened to be.
    fano_factor : float
        Variance over mean of the counts of a bin from trial to trial; 1 for Poisson counts. Variances are as many times
        as large.

    Returns
    -------
    (4, 4) array
        Infinite where the stimulus does not determine them.
    """
    scale = np.array([drive.spread(), max(unit.slope, 1e-12), TIMESCALE, max(unit.baseline, LEAST_BASELINE)])
    found = information(drive, unit) * np.outer(scale, scale)
    if unit.slope == 0 or np.linalg.cond(found) > MOST_ALIKE:
        return np.full((4, 4), np.inf)
    shared = np.array([0, unit.slope, 0, unit.baseline]) * gain_sd
    return fano_factor * np.linalg.inv(found) * np.outer(scale, scale) + np.outer(shared, shared)


def expected_of(units: xr.Dataset) -> tuple[list[ThresholdLinearUnit], Array, Array, list[str]]:
    """Units as an analysis found them, with their own variability from trial to trial.

    Parameters
    ----------
    units : Dataset
        Of :func:`vibrissa.neural.coupling.analysis.analyse_units`; units without a fit of slope above 0 are left out.

    Returns
    -------
    units : list of ThresholdLinearUnit
    gain_sd, fano_factor : (U,) arrays
        As :func:`plan_trials` takes them.
    names : list of str
        Of the units.

    Raises
    ------
    InputError
        If no unit was fitted.
    """
    require(units, *Hinge._fields, "fano_factor", "trial_gain_sd", "unit_name")
    fitted = (units.slope.values > 0) & np.isfinite(units.fano_factor.values)
    if not fitted.any():
        remedy = "fit units over several trials, or give threshold, slope and baseline"
        raise MissingError("table of units", "must have a unit that was fitted over trials", remedy=remedy)
    some = units.isel(unit=np.flatnonzero(fitted))
    columns = zip(*(some[name].values.tolist() for name in Hinge._fields), strict=True)
    found = [ThresholdLinearUnit(**dict(zip(Hinge._fields, one, strict=True))) for one in columns]
    return found, some.trial_gain_sd.values, some.fano_factor.values, some.unit_name.values.tolist()


def no_answer(drive: BinnedDrive, unit: ThresholdLinearUnit, found: Array | None = None, scale: str = "m") -> str:
    """Reason why no number of trials is enough; empty where one is.

    The rules are those by which :func:`vibrissa.neural.coupling.analysis.analyse_units` calls a unit identified.
    ``found`` is the :func:`covariance`, where it is known already.

    Parameters
    ----------
    drive, unit
        As in :func:`information`.
    found : (4, 4) array, optional
        The :func:`covariance`, where it is known already.
    scale : str
        Unit of the stimulus.

    Returns
    -------
    str
        The first reason found; empty where some number of trials is enough.
    """
    least, most = drive.identifiable_range()
    if unit.slope == 0:
        return "slope 0: the envelope does not drive the unit"
    if not least < unit.threshold < most:
        side = "below" if unit.threshold <= least else "above"
        return f"threshold {side} the envelope's range, {least:.3g} to {most:.3g} {scale} for 90 % of the time"
    if not drive.latencies[0] <= unit.latency < drive.latencies[1]:
        return f"latency not within the {drive.latencies[1]:g} s searched"
    if not np.isfinite(covariance(drive, unit) if found is None else found).all():
        return "this stimulus does not separate threshold, slope, latency and baseline"
    return ""


def plan_trials(
    drive: BinnedDrive,
    units: Sequence[ThresholdLinearUnit],
    wanted: Wanted,
    *,
    gain_sd: float | Sequence[float] | Array = 0.0,
    fano_factor: float | Sequence[float] | Array = 1.0,
    at: Sequence[int] = (10, 20, 40, 80, 160),
    unit: str = "m",
) -> xr.Dataset:
    """Trials that each unit needs, from the information of one trial.

    The estimates spread as the information says once there are enough spikes; fewer than 8 trials or 50 spikes are
    never said to be enough, nor trials that leave the threshold's interval wider than the envelope's spread or reaching
    out of its range, as the analysis calls no such unit identified.

    Parameters
    ----------
    drive : BinnedDrive
        The stimulus, such as :meth:`vibrissa.neural.coupling.presentation.Presentation.drive` gives.
    units : sequence of ThresholdLinearUnit
        What the units are expected to be.
    wanted : Wanted
        Half widths of the 95 % intervals.
    gain_sd, fano_factor : float or sequence of float
        Standard deviation of the gain from trial to trial, and variance over mean of the counts of a bin; see
        :func:`covariance`. One for all units, or one for each, such as ``trial_gain_sd`` and ``fano_factor`` that
        :func:`vibrissa.neural.coupling.analysis.analyse_units` finds.
    at : sequence of int
        Numbers of trials at which the expected intervals are reported as well.
    unit : str
        Of the stimulus, for the reasons.

    Returns
    -------
    Dataset
        ``threshold``, ``slope``, ``latency``, ``baseline`` (unit) as asked; ``trials_for_threshold``,
        ``trials_for_slope``, ``trials_for_latency``, ``trials_needed`` and ``spikes_per_trial``; NaN and a ``reason``
        where no number will do, NaN without one where nothing is wanted. ``threshold_within``, ``slope_within``,
        ``latency_within`` (unit, planned_trials).

    Raises
    ------
    InputError
        If there is no unit, the gain's spread is negative, the Fano factor not positive, or a number of trials is not
        positive.
    """
    if not units or not all(n > 0 for n in at):
        raise MissingError("plan", "must have a unit, and numbers of trials from 1", f"{len(units)} units, {at}")
    gains, fanos = (_of_each(one, len(units)) for one in (gain_sd, fano_factor))
    require_not_negative("gain_sd", float(gains.min()))
    require_positive("fano_factor", float(fanos.min()))
    spread = zip(units, gains.tolist(), fanos.tolist(), strict=True)
    rows = [_row(drive, one, wanted, (gain, fano), np.asarray(at, float), unit) for one, gain, fano in spread]
    asked: dict[str, Any] = {name: np.array([getattr(one, name) for one in units]) for name in Hinge._fields}
    attrs = {f"{name}_wanted": value for name, value in vars(wanted).items() if value is not None}
    asked |= {"trial_gain_sd": gains, "fano_factor": fanos}
    return dataset({"gain_sd": gains.max(), **attrs}, planned_trials=np.array(at), **asked, **stacked(rows))


def _of_each(value: float | Sequence[float] | Array, count: int) -> Array:
    """One value for each unit."""
    values = np.asarray(value, float)
    if values.ndim and values.shape != (count,):
        raise ShapeError(
            "gain_sd and fano_factor", f"must be one number, or one for each of {count} units", values.shape
        )
    return np.broadcast_to(values, (count,))


def _row(
    drive: BinnedDrive, unit: ThresholdLinearUnit, wanted: Wanted, variable: tuple[float, float], at: Array, scale: str
) -> dict[str, Any]:
    """Trials that one unit needs, of this gain and Fano factor."""
    gain_sd, fano_factor = variable
    found = covariance(drive, unit, gain_sd=gain_sd, fano_factor=fano_factor)
    width = np.diff(drive.edges)[drive.valid]
    reason = no_answer(drive, unit, found, scale)
    rate = predicted(drive, Hinge(*(getattr(unit, name) for name in Hinge._fields)))
    spikes = float(rate @ width)
    half = np.full(3, np.nan) if reason else Z * np.sqrt(np.diag(found)[:3])
    least, most = drive.identifiable_range()  # beyond these limits the analysis does not call the unit identified
    widest = min(drive.spread() / 2, unit.threshold - least, most - unit.threshold)
    limits = (
        min(wanted.threshold or np.inf, widest),
        np.inf if wanted.slope is None else wanted.slope * unit.slope,
        wanted.latency or np.inf,
    )
    fewest = max(FEWEST_TRIALS, FEWEST_SPIKES / spikes) if spikes > 0 else np.inf
    needed = np.ceil(np.maximum((half / np.array(limits)) ** 2, fewest))
    of = {"threshold": needed[0], "slope": needed[1], "latency": needed[2]}
    row = {f"trials_for_{name}": n if getattr(wanted, name) else np.nan for name, n in of.items()}
    within = {f"{name}_within": one / np.sqrt(at) for name, one in zip(of, half, strict=True)}
    return row | within | {"trials_needed": needed.max(), "spikes_per_trial": spikes, "reason": reason}
