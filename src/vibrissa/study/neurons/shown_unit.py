"""The unit of a population that Figure 8 shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Mask
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis
from vibrissa.neural.coupling.response import spike_counts
from vibrissa.neural.io.tables.spikes import of_unit
from vibrissa.neural.io.tables.stimuli import in_unit_of, name_of
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr


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
    shown = how.presentation(stimulus)
    start, stop = float(shown.edges[0]), float(shown.edges[-1])
    own = of_unit(spikes, str(unit.unit_name.values))
    inside = (own.spike_time.values >= start) & (own.spike_time.values < stop)
    own = own.isel(spike=np.flatnonzero(inside))
    bins = len(shown.edges) - 1
    counts = spike_counts(own, n_trials=n_trials, start=start, n_bins=bins, bin_width=how.bin_width)
    response = dataset(
        {"bin_width": how.bin_width, "n_trials": n_trials},
        bin=shown.edges[:-1],
        firing_rate=counts.mean(axis=0) / how.bin_width,
        bin_envelope=shown.binned(),
    )
    response, motion = in_unit_of(response, stimulus), stimulus[[name_of(stimulus)]]
    fitted = {"unit": unit} if np.isfinite(float(unit.threshold)) else {}
    return {"spikes": own, "response": response, "motion": motion, **fitted}
