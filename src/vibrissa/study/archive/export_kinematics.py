"""Kinematics of whiskers for an archive: a behavioral time series of each measure, and intervals of touch."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.neural.io.formats.nwb import pynwb_module
from vibrissa.study.archive.export_series import add_intervals, add_series, add_table

if TYPE_CHECKING:
    import xarray as xr

CONTAINER = "whisker_kinematics"
TOUCHES = "whisker_touches"


def add_kinematics(file: Any, module: Any, data: xr.Dataset, time: Array) -> None:
    """Add the measures in time as ``BehavioralTimeSeries``, the whiskers as a table, and touches as intervals.

    Parameters
    ----------
    file : NWBFile
        Of pynwb; gets the intervals.
    module : ProcessingModule
        Of pynwb; gets the rest.
    data : Dataset
        From :func:`vibrissa.measures.kinematics.kinematics_of`.
    time : (T,) array
        On the session's clock [s].
    """
    container = pynwb_module().behavior.BehavioralTimeSeries(name=CONTAINER)
    module.add(container)
    names = ", ".join(map(str, data.whisker_label.values))
    remarks = " ".join(f"{one}." for one in json.loads(data.attrs.get("remarks", "[]")))
    add_series(_Series(container), data, time, comments=f"Columns: whiskers {names}. {remarks}".strip())
    add_table(module, "whiskers_measured", "whiskers whose kinematics were measured", data, "whisker")
    if data.sizes.get("touch", 0):
        own = data.time.values
        shift = float(time[0] - own[0])
        onset = data.touch_onset.values + shift
        columns = data[[name for name in data.data_vars if data[name].dims == ("touch",) and name not in IN_INTERVAL]]
        text = "touches of single whiskers, from the first frame to the end of the last one in which each touches"
        add_intervals(file, TOUCHES, text, list(np.stack([onset, onset + data.touch_duration.values], 1)), columns)


IN_INTERVAL = ("touch_onset", "touch_offset", "touch_duration")  # are in its start and stop


class _Series:
    """The container as a home of series: it names the method by which it takes them otherwise."""

    def __init__(self, container: Any) -> None:
        self._container = container

    def add(self, series: Any) -> None:
        """Take a series."""
        self._container.add_timeseries(series)
