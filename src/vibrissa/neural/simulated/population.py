"""Populations of simulated units as the paper recorded them, with their truth."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import lognorm, truncnorm

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import RangeError, ShapeError, UnknownError
from vibrissa.neural.simulated.refractoriness import Refractoriness
from vibrissa.neural.simulated.virtual import PhaseUnit, ThresholdLinearUnit, draw_spikes
from vibrissa.neural.simulated.wandering import SlowState, unrelated_feature
from vibrissa.quantities import dataset, require
from vibrissa.signals.envelope import analytic_envelope

Counts = Literal["results", "methods"]

# Units and, of them, those driven by the envelope. The paper counts its units twice, 170/344 in the Results and 143/289
# in the Methods, and the driven ones once.
COUNTS: dict[Counts, dict[str, tuple[int, int]]] = {
    "results": {"SU": (170, 45), "MU": (344, 157)},
    "methods": {"SU": (143, 45), "MU": (289, 157)},
}
SESSIONS, RATS = 15, 11
# Mean and standard deviation: the paper's standard errors times the square root of 45 and 157.
THRESHOLD = {"SU": (42.3e-6, 2.1e-6 * np.sqrt(45)), "MU": (43.5e-6, 0.9e-6 * np.sqrt(157))}  # [m]
SLOPE = {"SU": (0.25e6, 0.05e6 * np.sqrt(45)), "MU": (0.25e6, 0.02e6 * np.sqrt(157))}  # [1/(s m)]
# Assumed, as the paper does not state them:
BASELINE = {"SU": 3.0, "MU": 8.0}  # [Hz] median above the 1 Hz that a unit needs to be kept
BASELINE_SPREAD = 0.7  # of its logarithm
LATENCY = (6e-3, 22e-3)  # [s] evenly spread
WHISKERS_PER_SESSION = 4  # principal whiskers met by one probe
# what drives the units that the envelope of their whisker does not drive, and how often
OTHERWISE = {"nothing": 0.4, "onset": 0.2, "slow feature": 0.15, "other whisker": 0.15, "carrier": 0.1}
FEATURE_TIME = 0.05  # [s] correlation time of the slow feature
ADAPTING = 1.0  # [s] time constant with which a unit that answers the onset calms down
SURROUND = (0.3, 0.15)  # share of the driven units with a surround; its gain, over the slope, for each whisker in it
SURROUND_WHISKERS = (-2, -1, 1, 2)  # from the principal one, in the order of the stimulator
REST = Refractoriness(absolute=1e-3, relative=2e-3)  # of single units; several neurons together have none


def draw_population(counts: Counts = "results", *, n_whiskers: int = 24, rng: np.random.Generator) -> xr.Dataset:
    """Draw the units of 15 sessions: who they are, and what drives them.

    Thresholds are normal, cut at 0, slopes log-normal (their standard deviation is as large as their mean), both with
    the paper's means and standard deviations. Every distribution is met evenly: one draw in each of its n quantiles.

    Parameters
    ----------
    counts : {"results", "methods"}
        Which of the paper's two counts of units.
    n_whiskers : int
        Whiskers that are stimulated.
    rng : Generator
        Source of randomness.

    Returns
    -------
    Dataset
        ``unit_name``, ``unit_quality`` (SU, MU), ``unit_session``, ``unit_rat``, ``unit_whisker``, ``driven_by``,
        ``driving_whisker``, ``true_threshold``, ``true_slope``, ``true_latency``, ``true_baseline``, ``surround_gain``
        (unit). Threshold and slope are NaN where no hinge is in the unit.

    Raises
    ------
    InputError
        If the counts have another name, or there are too few whiskers.
    """
    if counts not in COUNTS:
        raise UnknownError("counts", f"must be one of {list(COUNTS)}", counts)
    if n_whiskers < 2 * len(SURROUND_WHISKERS):
        raise RangeError("number of whiskers", f"must be at least {2 * len(SURROUND_WHISKERS)}", n_whiskers)
    parts = [drawn_units(quality, *of, rng) for quality, of in COUNTS[counts].items()]
    units: dict[str, Any] = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    n = len(units["unit_name"])
    session = rng.permutation(np.arange(n) % SESSIONS)
    first = rng.integers(n_whiskers, size=SESSIONS)  # neighbouring whiskers share a probe
    whisker = (first[session] + rng.integers(WHISKERS_PER_SESSION, size=n)) % n_whiskers
    other = (whisker + rng.integers(WHISKERS_PER_SESSION, n_whiskers - WHISKERS_PER_SESSION, size=n)) % n_whiskers
    return dataset(
        {"counts": counts, "n_whiskers": n_whiskers},
        **units,
        unit_session=session,
        unit_rat=session % RATS,
        unit_whisker=whisker,
        driving_whisker=np.where(units["driven_by"] == "other whisker", other, whisker),
    )


def drawn_units(quality: str, n: int, n_driven: int, rng: np.random.Generator) -> dict[str, NDArray[Any]]:
    """Units of one quality, the driven ones at random places among them.

    Parameters
    ----------
    quality : {"SU", "MU"}
        Single or multi-units.
    n, n_driven : int
        Units, and those of them that the envelope drives.
    rng : Generator
        Source of randomness.

    Returns
    -------
    dict of (n,) arrays
        ``unit_name``, ``unit_quality``, ``driven_by``, ``true_threshold`` [m], ``true_slope`` [1/(s m)],
        ``true_latency`` [s], ``true_baseline`` [Hz], ``surround_gain``.
    """
    names, weights = list(OTHERWISE), list(OTHERWISE.values())
    driven_by = np.concatenate([np.repeat("envelope", n_driven), rng.choice(names, n - n_driven, p=weights)])
    driven_by = rng.permutation(driven_by)
    driven = driven_by == "envelope"
    threshold, slope = _hinges(quality, driven, rng)
    hinged = np.isin(driven_by, ["envelope", "slow feature", "other whisker"])
    share, gain = SURROUND
    return {
        "unit_name": np.array([f"{quality}{k:03d}" for k in range(1, n + 1)]),
        "unit_quality": np.repeat(quality, n),
        "driven_by": driven_by,
        "true_threshold": np.where(hinged, threshold, np.nan),
        "true_slope": np.where(hinged, slope, np.nan),
        "true_latency": LATENCY[0] + np.ptp(LATENCY) * _even(n, rng),
        "true_baseline": 1 + lognorm.ppf(_even(n, rng), BASELINE_SPREAD, scale=BASELINE[quality]),
        "surround_gain": np.where(driven & (rng.random(n) < share), gain, 0.0),
    }


def _hinges(quality: str, driven: Mask, rng: np.random.Generator) -> tuple[Array, Array]:
    """Thresholds and slopes, evenly met among the driven units and among the others."""
    (mean, sd), (slope_mean, slope_sd) = THRESHOLD[quality], SLOPE[quality]
    sigma = np.sqrt(np.log1p((slope_sd / slope_mean) ** 2))
    threshold, slope = np.empty(len(driven)), np.empty(len(driven))
    for part in (driven, ~driven):
        threshold[part] = truncnorm.ppf(_even(int(part.sum()), rng), -mean / sd, np.inf, mean, sd)
        slope[part] = lognorm.ppf(_even(int(part.sum()), rng), sigma, scale=slope_mean * np.exp(-(sigma**2) / 2))
    return threshold, slope


def _even(n: int, rng: np.random.Generator) -> Array:
    """One probability in the middle of each of n equal parts of (0, 1), in random order."""
    return rng.permutation((np.arange(n) + 0.5) / n)


def population_rate(unit: xr.Dataset, time: Array, envelope: Array, phase: Array, *, rng: np.random.Generator) -> Array:
    """Firing rate of one unit of a population, before its slow state.

    Parameters
    ----------
    unit : Dataset
        One unit of :func:`draw_population`.
    time : (T,) array
        Even grid [s].
    envelope, phase : (W, T) arrays
        Of each whisker's displacement [m], [rad].
    rng : Generator
        Draws the feature that drives a unit of "slow feature".

    Returns
    -------
    (T,) array
        Rate [Hz].
    """
    role, baseline, latency = str(unit.driven_by.values), float(unit.true_baseline), float(unit.true_latency)
    own, driving = int(unit.unit_whisker), int(unit.driving_whisker)
    if role == "carrier":
        return PhaseUnit(baseline=baseline, latency=latency).rate(time, phase[own])
    if role in ("nothing", "onset"):  # twice as lively at the onset, calm after a second
        return np.full(len(time), baseline) * (1 + (role == "onset") * np.exp(-(time - time[0]) / ADAPTING))
    hinge = ThresholdLinearUnit(
        threshold=float(unit.true_threshold), slope=float(unit.true_slope), baseline=baseline, latency=latency
    )
    if role == "slow feature":
        mean = float(envelope[own].mean())
        return hinge.rate(time, unrelated_feature(time, mean=mean, timescale=FEATURE_TIME, rng=rng))
    rate = hinge.rate(time, envelope[driving])
    if float(unit.surround_gain) > 0:
        around = [envelope[(own + step) % len(envelope)] for step in SURROUND_WHISKERS]
        rate = rate + float(unit.surround_gain) * sum(hinge.rate(time, one) - baseline for one in around)
    return rate


def record_population(
    truth: xr.Dataset,
    time: Array,
    displacement: Array,
    n_trials: int,
    *,
    rng: np.random.Generator,
    state: SlowState | None = None,
    only: Integers | None = None,
) -> xr.Dataset:
    """Spikes of all units while the whiskers are moved again and again.

    Units of one session share its slow state, trial by trial. Every unit has a random stream of its own, so that a part
    of the units fires as it does among all.

    Parameters
    ----------
    truth : Dataset
        From :func:`draw_population`.
    time : (T,) array
        Even grid of one presentation [s].
    displacement : (W, T) array
        Motion of each whisker [m].
    n_trials : int
        Presentations; the paper's 40 to 100.
    rng : Generator
        Source of randomness, best a fresh one: equal seeds give equal spikes.
    state : SlowState, optional
        Of the sessions; the default one where none is given.
    only : (n,) array of int, optional
        Places of the units that are recorded, ascending; all by default.

    Returns
    -------
    Dataset
        ``spike_time`` [s], ``spike_trial``, ``spike_unit`` (spike), sorted by unit, trial and time; ``unit_name``,
        ``unit_quality``, ``unit_whisker`` (unit). Attributes ``n_trials`` and ``duration``.

    Raises
    ------
    InputError
        If a unit's whisker is not moved.
    """
    require(truth, "unit_name", "driven_by", "true_threshold", "unit_session")
    if displacement.ndim != 2 or len(displacement) != truth.attrs["n_whiskers"]:
        raise ShapeError("displacement", f"must be of {truth.attrs['n_whiskers']} whiskers", displacement.shape)
    envelope, phase = analytic_envelope(displacement)
    duration, state = float(time[-1] - time[0]), state or SlowState(depth=0.3, trial_sd=0.1)
    for_sessions, for_units = rng.spawn(2)
    sessions = dict(enumerate(for_sessions.spawn(SESSIONS)))
    streams = for_units.spawn(truth.sizes["unit"])
    places = np.arange(len(streams)) if only is None else np.asarray(only, int)
    when: list[Array] = [np.empty(0)] * len(places)
    trial: list[Integers] = [np.empty(0, int)] * len(places)
    units = truth.isel(unit=places)
    for session in np.unique(units.unit_session.values).tolist():  # one at a time: its state is large
        gain = state.draw(n_trials, duration, rng=sessions[session])
        for k in np.flatnonzero(units.unit_session.values == session).tolist():
            unit, stream = units.isel(unit=k), streams[places[k]]
            rate = population_rate(unit, time, envelope, phase, rng=stream)
            rest = REST if str(unit.unit_quality.values) == "SU" else None
            when[k], trial[k] = draw_spikes(time, rate, n_trials, rng=stream, gain=gain, refractoriness=rest)
    return dataset(
        {"n_trials": n_trials, "duration": duration},
        spike_time=np.concatenate(when),
        spike_trial=np.concatenate(trial),
        spike_unit=np.repeat(np.arange(len(when)), [len(times) for times in when]),
        unit_name=units.unit_name.values,
        unit_quality=units.unit_quality.values,
        unit_whisker=units.unit_whisker.values,
    )
