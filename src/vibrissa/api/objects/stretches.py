"""Spikes of stretches of recording, each of which is a trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import ConflictError
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.quantities import dataset

SAME = 1e-9  # [s] two stretches that start less than this apart start together


def in_stretches(
    names: list[str],
    stretches: Sequence[Mapping[str, Array]],
    span: Sequence[tuple[float, float]],
    attrs: Mapping[str, Any],
    observed: Mask,
    **about_units: Any,
) -> xr.Dataset:
    """Spikes in trials from the times of the units in each stretch.

    Parameters
    ----------
    names : list of str
        Names of all units.
    stretches : sequence of mappings
        Times of the units in each stretch [s], by their names; a unit that was not recorded there is absent.
    span : sequence of (float, float)
        Start and stop of each stretch on the clock of its times [s]; the stop is NaN where it is not known.
    observed : (U, N) array of bool
        Whether each unit was recorded throughout each stretch.
    attrs, **about_units
        As in :func:`vibrissa.neural.io.tables.spikes.spike_table`.

    Returns
    -------
    Dataset
        Stretches that all start together count from the onset already, and their spans are ``window_start`` and, if
        one, ``window_stop``; of stretches that follow each other on one clock, each starts at its onset, which
        ``trial_start`` keeps (and ``trial_stop``). ``unit_observed`` (unit, trial) is there where a unit was not
        recorded throughout a stretch.

    Raises
    ------
    InputError
        If stretches overlap and do not start together: their onsets are not known.
    """
    start, stop = np.array(span, float).reshape(-1, 2).T
    together = bool(np.ptp(start) < SAME)
    if not together:
        _refuse_overlaps(start, stop)
    trial, unit, time = _events(names, stretches)
    about = about_units if observed.all() else {**about_units, "unit_observed": observed}
    noted = {**attrs, "n_trials": len(stretches)}
    if missed := int((~observed).sum()):
        text = "trials in which a unit was not recorded throughout count as not presented to it"
        noted["remark"] = f"{missed} of {observed.size} {text}"
    if together:
        noted |= {"window_start": float(start[0])} | ({"window_stop": float(stop[0])} if np.ptp(stop) < SAME else {})
        return spike_table(time, unit, names, trial=trial, attrs=noted, **about)
    spikes = spike_table(time - start[trial], unit, names, trial=trial, attrs=noted, **about)
    known: dict[str, Any] = {"trial_start": start} | ({"trial_stop": stop} if np.isfinite(stop).all() else {})
    return spikes.assign(dataset(None, **known).data_vars)


def _refuse_overlaps(start: Array, stop: Array) -> None:
    end = np.where(np.isnan(stop), start, stop)[:-1]
    wrong = (np.diff(start) < SAME) | (start[1:] < end - SAME)
    if wrong.any():
        k = int(np.flatnonzero(wrong)[0])
        found = f"{k} from {start[k]:g} to {end[k]:g} s, {k + 1} from {start[k + 1]:g} s"
        remedy = "count the times of each from its onset, so that all t_start are equal"
        raise ConflictError("segments", "must follow each other, or all start together", found, remedy)


def _events(names: list[str], stretches: Sequence[Mapping[str, Array]]) -> tuple[Integers, Integers, Array]:
    """Trial, unit and time of each spike."""
    trains = [(k, names.index(name), time) for k, one in enumerate(stretches) for name, time in one.items()]
    size = [len(time) for *_, time in trains]
    trial, unit = (np.repeat(np.array([train[k] for train in trains], int), size) for k in (0, 1))
    return trial, unit, np.concatenate([*(time for *_, time in trains), np.zeros(0)])
