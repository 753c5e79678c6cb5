"""Spikes from pynapple: the times of a group, and when its units were observed."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import TooFewError, UnknownError
from vibrissa.neural.io.tables.spikes import table_of_trains, with_intervals
from vibrissa.tables.kinds import described, is_a

PERIEVENT = {"events", "ref_times"}  # columns of the metadata by which a group of trials of one unit is known
ABOUT_UNITS = {"quality": "unit_quality", "whisker": "unit_whisker"}  # columns of the metadata, and our variables


def pynapple_spikes(thing: Any) -> xr.Dataset:
    """Spikes of a ``TsGroup`` or ``Ts``, on the session's clock.

    Parameters
    ----------
    thing : pynapple.TsGroup or pynapple.Ts
        Times of the units [s]; those of a ``TsGroup`` are named by its metadata ``unit_name``, else by its ``name`` if
        no two units share one, else by their keys.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`. The time support is the ``interval`` of every unit;
        one that begins and ends at spikes says nothing, as pynapple makes it so where none is given.

    Raises
    ------
    InputError
        If there is no unit, or two have one name; if the elements are not units but trials of one, as
        ``compute_perievent`` gives them.
    """
    group = {0: thing} if is_a(thing, "pynapple", "Ts") else {int(key): thing[key] for key in thing}
    if not group:
        raise TooFewError(described(thing), "must hold at least one unit", 0)
    if found := PERIEVENT & set(getattr(thing, "metadata_columns", ())):
        remedy = "give the units' own times, with trials=Ts of the events and window=(start, stop)"
        raise UnknownError(described(thing), "must have a unit in each element", f"trials about {found.pop()}", remedy)
    known = {} if is_a(thing, "pynapple", "Ts") else _metadata(thing)
    named, keys = known.pop("name", None), np.array(list(group), str)
    named = keys if named is None or len({*named.astype(str)}) < len(named) else named
    names = [str(name) for name in known.pop("unit_name", named)]
    trains = [np.asarray(one.t, float) for one in group.values()]
    about = {ABOUT_UNITS[name]: values.astype(str) for name, values in known.items()}
    spikes = table_of_trains(trains, names, {"source": described(thing)}, unit_id=np.array(list(group)), **about)
    support = np.asarray(thing.time_support.values, float)
    stated = support if not np.isin(support, spikes.spike_time.values).all() else np.zeros((0, 2))
    return with_intervals(spikes, [stated] * len(trains)) if stated.size else spikes


def _metadata(group: Any) -> dict[str, Array]:
    """Columns of the metadata that are known here."""
    wanted = [name for name in ("unit_name", "name", *ABOUT_UNITS) if name in group.metadata_columns]
    return {name: np.asarray(group.get_info(name)) for name in wanted}
