"""The units of a population that Figure 8 shows: one at length, and up to four side by side."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis
from vibrissa.neural.coupling.response import UnitCounts
from vibrissa.neural.io.tables.spikes import of_unit
from vibrissa.neural.io.tables.stimuli import in_unit_of, name_of
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr

EXAMPLES = "unit_examples"  # name of the result


def best_unit(units: xr.Dataset, usual: Mask | None = None) -> int:
    """Place of the unit whose fit explains most of its rate.

    Single units of known threshold and slope come first, of them those that are usual; then other units of known
    threshold; then any that is significant; then any.

    Parameters
    ----------
    units : Dataset
        From :func:`vibrissa.neural.coupling.analysis.analyse_units`.
    usual : (U,) array of bool, optional
        Units that are preferred.

    Returns
    -------
    int
        From 0.
    """
    significant = units.significant.values.astype(bool)
    sure = significant & units.identified.values.astype(bool)
    single = units.unit_quality.values == "SU" if "unit_quality" in units else np.ones(len(sure), bool)
    first = sure & single & (True if usual is None else usual)
    explained, correlation = (units[name].values for name in ("tuning_r_squared", "envelope_correlation"))
    for allowed, merit in (
        (first, explained),
        (sure & single, explained),
        (sure, explained),
        (significant, correlation),
    ):
        if (allowed & np.isfinite(merit)).any():
            return int(np.argmax(np.where(allowed & np.isfinite(merit), merit, -np.inf)))
    return int(np.argmax(np.where(np.isfinite(correlation), correlation, -np.inf)))


def shown_unit(
    spikes: xr.Dataset, unit: xr.Dataset, stimulus: xr.Dataset, n_trials: int, how: EnvelopeAnalysis
) -> dict[str, xr.Dataset]:
    """Datasets that Figure 8 is made of.

    Parameters
    ----------
    spikes : Dataset
        Spikes in trials, of this unit and perhaps of others.
    unit : Dataset
        Its row of :func:`vibrissa.neural.coupling.analysis.analyse_units`.
    stimulus : Dataset
        ``time`` and ``point_displacement``.
    n_trials : int
        Presentations.
    how : EnvelopeAnalysis
        As the unit was analysed.

    Returns
    -------
    dict of Datasets
        ``spikes`` within the stimulus, ``response`` (mean rate and envelope in bins), ``motion`` and, where a threshold
        was fitted, ``unit``.
    """
    own, edges, rate, envelope = _binned(spikes, str(unit.unit_name.values), stimulus, n_trials, how)
    about = {"bin_width": how.bin_width, "n_trials": n_trials, "lag_low": how.lags[0], "lag_high": how.lags[1]}
    response = dataset(about, bin=edges[:-1], firing_rate=rate, bin_envelope=envelope)
    response, motion = in_unit_of(response, stimulus), stimulus[[name_of(stimulus)]]
    fitted = {"unit": unit} if np.isfinite(float(unit.threshold)) else {}
    return {"spikes": own, "response": response, "motion": motion, **fitted}


def example_units(units: xr.Dataset) -> list[int]:
    """Places of two single and two multi-units of one session whose fits explain most of their rates.

    Parameters
    ----------
    units : Dataset
        From :func:`vibrissa.neural.coupling.analysis.analyse_units`.

    Returns
    -------
    list of int
        Single units first; fewer where the best session has fewer that the envelope drives. Empty where none is driven.
    """
    driven = units.significant.values.astype(bool) & np.isfinite(units.tuning_r_squared.values)
    session = units.unit_session.values if "unit_session" in units else np.zeros(len(driven), int)
    single = units.unit_quality.values == "SU" if "unit_quality" in units else np.ones(len(driven), bool)
    groups = [
        [place for kind in (single, ~single) for place in _best(units, driven & (session == one) & kind)]
        for one in np.unique(session[driven])
    ]
    return max(groups, key=len, default=[])


def _best(units: xr.Dataset, some: Mask) -> list[int]:
    """The two whose fit explains most."""
    merit = np.where(some, units.tuning_r_squared.values, -np.inf)
    return [int(place) for place in np.argsort(-merit, kind="stable")[: min(2, int(some.sum()))]]


def unit_examples(
    spikes: xr.Dataset,
    units: xr.Dataset,
    places: list[int],
    stimulus: Callable[[int], xr.Dataset],
    n_trials: int,
    how: EnvelopeAnalysis,
) -> xr.Dataset:
    """Rates of some units and the envelopes of their stimuli, side by side.

    Parameters
    ----------
    spikes : Dataset
        Spikes in trials, of these units and perhaps of others.
    units : Dataset
        From :func:`vibrissa.neural.coupling.analysis.analyse_units`.
    places : list of int
        Which of them.
    stimulus : callable
        Place of a unit → ``time`` and ``point_displacement`` of its stimulus.
    n_trials, how
        As in :func:`shown_unit`.

    Returns
    -------
    Dataset
        ``example_rate`` [Hz], ``example_bin_envelope`` [m] (example_unit, bin), ``example_quality`` and
        ``example_session``; empty where no unit is given.
    """
    if not places:
        return dataset()
    some = units.isel(unit=places)
    names = some.unit_name.values.astype(str)
    each = [
        _binned(spikes, name, stimulus(place), n_trials, how)[1:] for place, name in zip(places, names, strict=True)
    ]
    edges, rates, envelopes = zip(*each, strict=True)
    quality, session = (
        some[f"unit_{name}"].values if f"unit_{name}" in some else None for name in ("quality", "session")
    )
    return dataset(
        {"bin_width": how.bin_width, "n_trials": n_trials},
        example_unit=names,
        bin=edges[0][:-1],
        example_rate=np.array(rates),
        example_bin_envelope=np.array(envelopes),
        example_quality=[""] * len(names) if quality is None else quality,
        example_session=np.zeros(len(names), int) if session is None else session,
    )


def _binned(
    spikes: xr.Dataset, name: str, stimulus: xr.Dataset, n_trials: int, how: EnvelopeAnalysis
) -> tuple[xr.Dataset, Array, Array, Array]:
    """A unit's spikes within the stimulus and its trials, the edges of the bins, its mean rate [Hz], the envelope."""
    shown = how.presentation(stimulus)
    start, stop = float(shown.edges[0]), float(shown.edges[-1])
    own = of_unit(spikes, name)
    counts = UnitCounts.of(own, n_trials, shown.edges, how.bin_width, partial=True)
    inside = (own.spike_time.values >= start) & (own.spike_time.values < stop)
    inside &= counts.observed[0, own.spike_trial.values]
    return own.isel(spike=np.flatnonzero(inside)), shown.edges, counts.rates()[0], shown.binned()
