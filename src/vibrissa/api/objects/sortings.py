"""Spikes from a sorting of SpikeInterface that is open."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from vibrissa.api.objects.stretches import in_stretches
from vibrissa.arrays import Array, Window
from vibrissa.errors import TooFewError
from vibrissa.neural.io.formats.sorted_folder import quality_of
from vibrissa.neural.io.tables.spikes import table_of_trains
from vibrissa.tables.kinds import described


def sorted_spikes(sorting: Any) -> xr.Dataset:
    """Spikes of all units of a sorting: several segments are trials, one is a session.

    Parameters
    ----------
    sorting : spikeinterface.BaseSorting
        Of any sorter; with its recording registered, times are those of the recording. SpikeInterface's sortings in
        memory end with the segment of their last spike: silent trials after it are not in them.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`; ``unit_quality`` where the property ``quality`` has
        phy's labels. Several segments as :func:`vibrissa.api.objects.stretches.in_stretches` has them.

    Raises
    ------
    InputError
        If there is no unit; as ``in_stretches``.
    """
    units = list(sorting.unit_ids)
    if not units:
        raise TooFewError(described(sorting), "must hold at least one unit", 0)
    names, segments = [str(unit) for unit in units], range(sorting.get_num_segments())
    trains = [{str(unit): _seconds(sorting, unit, k) for unit in units} for k in segments]
    attrs = {"source": described(sorting), "sampling_rate": float(sorting.get_sampling_frequency())}
    labels = sorting.get_property("quality")
    about = quality_of(None if labels is None else [str(label) for label in labels])
    if len(segments) == 1:
        return table_of_trains(list(trains[0].values()), names, attrs, **about)
    throughout = np.ones((len(names), len(trains)), bool)
    return in_stretches(names, trains, [_span(sorting, k) for k in segments], attrs, throughout, **about)


def _seconds(sorting: Any, unit: Any, k: int) -> Array:
    return np.asarray(sorting.get_unit_spike_train_in_seconds(unit, segment_index=k), float)


def _span(sorting: Any, k: int) -> Window:
    """Start and stop of a segment [s]; the stop is NaN where no recording says how long it is."""
    start = float(sorting.sample_index_to_time(0, segment_index=k))
    if not sorting.has_recording():
        return start, np.nan
    return start, float(sorting.sample_index_to_time(sorting.get_num_samples(k), segment_index=k))
