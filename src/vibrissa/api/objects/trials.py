"""Trials from any object that holds their onsets."""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Window
from vibrissa.errors import FormatError, InputError, MissingError, ShapeError
from vibrissa.neural.io.formats.foreign import one_line
from vibrissa.neural.io.tables.trials import NEEDED, OPTIONAL, read_trials, trial_table, trials_at, trials_of_table
from vibrissa.quantities import require
from vibrissa.tables.frame import table_of_frame
from vibrissa.tables.kinds import described, is_a
from vibrissa.tables.stated import bare

SPELLINGS = {"start": ("start_time", "trial_start", "onset"), "stop": ("stop_time", "trial_stop", "end", "end_time")}


def as_trials(thing: Any, *, window: Window | None = None) -> xr.Dataset:
    """Trials of any object: when each presentation began and ended, on the session's clock.

    Parameters
    ----------
    thing : object
        A dataset of trials. The name of a CSV file, or a pandas ``DataFrame``, with columns ``start`` and ``stop`` [s].
        A pynapple ``IntervalSet``, a neo ``Epoch``, a table of intervals of an open pynwb file. Pairs of start and
        stop, (R, 2) [s]. Or onsets alone, which need a window: an array (R,) [s], a pynapple ``Ts``, a neo ``Event``.
    window : (start, stop), optional
        Part of each trial about its onset [s]; trials that are given by their onsets end with it.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.trials.trial_table`. Trials are half-open: their stop is no part of them.

    Raises
    ------
    InputError
        If the object is of no such kind, onsets have no window, or trials do not ascend.

    Examples
    --------
    >>> as_trials([10.0, 20.0], window=(-0.5, 2.0)).trial_stop.values.tolist()
    [12.0, 22.0]
    >>> as_trials([(0.0, 1.5), (3.0, 4.5)]).trial_start.values.tolist()
    [0.0, 3.0]
    """
    if isinstance(thing, xr.Dataset):
        require(thing, "trial_start", "trial_stop")
        return thing
    if isinstance(thing, str | PathLike):
        return read_trials(str(thing))
    if is_a(thing, "pandas", "DataFrame"):
        return trials_of_table(table_of_frame(thing, NEEDED, OPTIONAL, SPELLINGS), described(thing))
    if is_a(thing, "pynwb", "TimeIntervals"):
        from vibrissa.neural.io.formats.nwb import trials_of

        with one_line(f"table {thing.name}", "must be of an NWB file that is open"):
            return trials_of(thing, f"table {thing.name}")
    if is_a(thing, "pynapple", "IntervalSet"):
        named = np.asarray(thing["stimulus"]) if "stimulus" in thing.metadata_columns else None
        start, stop = np.asarray(thing.values, float).T
        return trial_table(start, stop, named, {"source": described(thing)})
    if is_a(thing, "neo", "Epoch"):
        start, last = (np.asarray(one.rescale("s").magnitude, float) for one in (thing.times, thing.durations))
        named = np.asarray(thing.labels) if len(thing.labels) else None
        return trial_table(start, start + last, named, {"source": described(thing)})
    return _of_numbers(_numbers(thing), window)


def _numbers(thing: Any) -> Array:
    if is_a(thing, "pynapple", "Ts"):
        thing = thing.t
    if is_a(thing, "neo", "Event"):
        thing = thing.times
    try:
        return np.asarray(bare(thing, "s"), float)
    except InputError as error:
        raise error.renamed("trials") from None
    except (TypeError, ValueError) as error:
        raise FormatError("trials", "must be pairs of start and stop [s]", described(thing)) from error


def _of_numbers(values: Array, window: Window | None) -> xr.Dataset:
    if values.ndim == 2 and values.shape[1] == 2:
        return trial_table(*values.T)
    if values.ndim != 1:
        raise ShapeError("trials", "must be (R, 2), start and stop of each, or (R,), onsets", values.shape)
    if window is None:
        remedy = "window=(0.0, 2.0), in seconds about each onset"
        raise MissingError("window", "must be given: onsets do not say how long a trial lasts", remedy=remedy)
    return trials_at(values, window[1])
