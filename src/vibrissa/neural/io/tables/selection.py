"""Tables of spikes from which units or trials were selected: spikes refer to labels, then to places again."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Integers
from vibrissa.errors import ConflictError, FormatError, RangeError, ShapeError
from vibrissa.quantities import QUANTITIES, dataset, require

NUMBER = "trial_number"  # what says of selected trials which they were
ONSETS = "onsets"  # attribute: those of all trials, of which some may be selected [s]
PLAIN = ("spike_unit", "spike_trial", "spike_time", "unit_name")  # along one dimension each
REFERENCES = {"unit": ("spike_unit", "interval_unit"), "trial": ("spike_trial",)}  # what refers to each dimension


def labelled(spikes: xr.Dataset) -> xr.Dataset:
    """Number the units and trials of a table, so that spikes find theirs after a selection of xarray.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`.

    Returns
    -------
    Dataset
        With the coordinate ``unit`` and, where it has this dimension, ``trial``: 0, 1, 2 and so on, to which
        ``spike_unit`` and ``spike_trial`` refer; the attribute ``onsets`` keeps those of the trials, where known.
    """
    numbers = {
        dim: (dim, np.arange(spikes.sizes[dim]), {"units": "1", "long_name": QUANTITIES[dim].long_name})
        for dim in REFERENCES
        if dim in spikes.dims
    }
    known = "trial_start" in spikes and spikes.sizes["trial"] > 0
    onsets = {ONSETS: tuple(spikes.trial_start.values.tolist())} if known else {}
    return spikes.assign_coords(numbers).assign_attrs(onsets)


def is_labelled(data: xr.Dataset) -> bool:
    """Whether a dataset has the numbers that :func:`labelled` gives.

    Parameters
    ----------
    data : Dataset
        Any.

    Returns
    -------
    bool
        For units or for trials.
    """
    return any(_ours(data, dim) for dim in REFERENCES)


def at_places(spikes: xr.Dataset) -> xr.Dataset:
    """Bring a table from which units or trials may have been selected to places again.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`, or a selection of one from :func:`labelled`:
        some of its units and trials, in any order.

    Returns
    -------
    Dataset
        Without coordinates of units and trials: ``spike_unit``, ``interval_unit`` and ``spike_trial`` are places along
        their dimensions. Spikes of units and trials that were not selected are left out, ``n_trials`` counts those
        that were, and ``trial_number`` (trial) says which they were, if not all in their order.

    Raises
    ------
    InputError
        If a unit or trial is there twice, is numbered in another way, or spikes refer to one that is not there.
    """
    _refuse_other_dimensions(spikes)
    require(spikes, "spike_time", "spike_unit", "unit_name")
    placed, known = spikes, {dim: _labels(spikes, dim) for dim in REFERENCES if dim in spikes.dims}
    for dim, labels in known.items():
        placed = _at_places(placed, dim, labels)
    if all(labels is None for labels in known.values()):
        return placed
    keys = [placed[name].values for name in ("spike_time", "spike_trial", "spike_unit") if name in placed]
    return placed.isel(spike=np.lexsort(keys))


def _at_places(spikes: xr.Dataset, dim: str, labels: Integers | None) -> xr.Dataset:
    """Let what refers to the labels of one dimension refer to its places; without labels it must do so already."""
    spikes, size = spikes.drop_vars(dim, errors="ignore"), spikes.sizes[dim]
    for name in REFERENCES[dim]:
        if name not in spikes:
            continue
        numbers = _whole(spikes[name])
        place = _places(numbers, np.arange(size) if labels is None else labels)
        if labels is None and (place < 0).any():
            remedy = f"to select, take a table of vb.read_spikes: it has a coordinate {dim}"
            raise RangeError(name, f"must be from 0 to {size - 1}, a {dim} of the table", numbers[place < 0][0], remedy)
        kept = {spikes[name].dims[0]: np.flatnonzero(place >= 0)}
        spikes = spikes.assign({name: spikes[name].copy(data=place)}).isel(kept)
    if labels is None or dim != "trial":
        return spikes
    some = size < spikes.attrs.get("n_trials", size)
    if NUMBER not in spikes and (some or not np.array_equal(labels, np.arange(size))):
        spikes = spikes.assign({NUMBER: dataset(trial_number=labels).trial_number})
    return spikes.drop_attrs(deep=False).assign_attrs(_about_trials(spikes, labels))


def _about_trials(spikes: xr.Dataset, labels: Integers) -> dict[str, Any]:
    """Attributes of a table of which the trials with these labels are kept: their number, and the onsets of others."""
    onsets, left = (np.atleast_1d(spikes.attrs.get(name, [])) for name in (ONSETS, "onsets_left_out"))
    mine = labels[labels < onsets.size]
    if "trial_start" in spikes and np.array_equal(onsets[mine], spikes.trial_start.values):  # the clock is the same
        left = np.append(left, np.delete(onsets, mine))
    kept = {name: one for name, one in spikes.attrs.items() if name != ONSETS} | {"n_trials": labels.size}
    return kept | ({"onsets_left_out": tuple(left.tolist())} if left.size else {})


def _refuse_other_dimensions(spikes: xr.Dataset) -> None:
    """Refuse a table that ``swap_dims``, ``where`` or the choice of one place made: spikes may lose their units."""
    for dim in REFERENCES:
        if dim not in spikes.coords or dim in spikes.dims:
            continue
        if along := spikes[dim].dims:
            remedy = f"swap_dims({along[0]}={dim!r})"
            raise ShapeError("spikes", f"must keep the dimension {dim}", f"{dim} along {along[0]}", remedy)
        number = spikes[dim].values.item()
        raise ShapeError("spikes", f"must keep the dimension {dim}", f"{dim} {number}", f"isel({dim}=[{number}])")
    for name in PLAIN:
        if name in spikes and spikes[name].dims != QUANTITIES[name].dims:
            found = f"{spikes[name].dtype} {spikes[name].dims}"
            rule = f"must have the dimension {QUANTITIES[name].dims[0]} alone"
            raise FormatError(name, rule, found, "select by isel or sel, not by where")


def of_same_trials(spikes: xr.Dataset, count: int, source: str) -> Integers:
    """Places, in a file of all trials, of those that a table of spikes has.

    Parameters
    ----------
    spikes : Dataset
        From :func:`at_places`.
    count : int
        Trials of the file.
    source : str
        The file, for the message.

    Returns
    -------
    (N,) array of int
        All in their order, unless trials were selected.

    Raises
    ------
    InputError
        If one that was selected is not in the file.
    """
    if NUMBER not in spikes:
        return np.arange(count)
    numbers: Integers = spikes[NUMBER].values
    if (last := numbers.max(initial=-1)) >= count:
        rule = f"must have the trials from which the spikes were selected, up to trial {last}"
        remedy = f"number the selected ones from 0: vb.read_spikes(spikes).drop_vars({NUMBER!r})"
        raise ShapeError(source, rule, f"{count} trials", remedy)
    return numbers


def _labels(spikes: xr.Dataset, dim: str) -> Integers | None:
    """Numbers of the units or trials, each once; None where they are places."""
    if dim not in spikes.coords:
        return None
    labels = spikes[dim].values
    if not _ours(spikes, dim):
        if np.array_equal(labels, np.arange(labels.size)):
            return None
        remedy = f"select with attributes kept; only if spikes refer to places along it: spikes.drop_vars({dim!r})"
        raise ConflictError(f"coordinate {dim}", "must be that of vb.read_spikes", labels[:5].tolist(), remedy)
    if np.unique(labels).size < labels.size:
        raise ConflictError(f"coordinate {dim}", f"must have each {dim} once", labels.tolist(), "select each once")
    return _whole(spikes[dim])


def _ours(data: xr.Dataset, dim: str) -> bool:
    return dim in data.coords and data[dim].attrs.get("long_name") == QUANTITIES[dim].long_name


def _whole(numbers: xr.DataArray) -> Integers:
    """Values that must be whole numbers, along one dimension."""
    values = numbers.values
    if values.ndim != 1 or values.dtype.kind not in "iuf" or (values != np.floor(values)).any():
        found = f"{values.dtype} {numbers.dims}"
        raise FormatError(
            str(numbers.name), "must be whole numbers along one dimension", found, "select by isel or sel"
        )
    return values.astype(int)


def _places(numbers: Integers, labels: Integers) -> Integers:
    """Place of each number among the labels; −1 where it is none of them."""
    order = np.argsort(labels)
    ranks = np.searchsorted(labels, numbers, sorter=order)
    place = np.append(order, -1)[ranks]
    return np.where(np.append(labels, 0)[place] == numbers, place, -1)
