"""The sweeps of one animal, for an archive: laid on one clock, a row and a stretch of each series for each."""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.neural.io.formats.nwb_writer import measured
from vibrissa.study.archive.export_series import Clock, add_intervals, add_series, add_table
from vibrissa.study.sweeps.sweeps import read_series

if TYPE_CHECKING:
    import xarray as xr

REASON = ("accepted", "rejected")


@dataclass(frozen=True)
class PlacedSweeps:
    """Sweeps on the session's clock.

    Attributes
    ----------
    own, session : dict of arrays
        By number: times of the sweep's samples, its own and the session's [s].
    rejected : int
        How many have none.
    """

    own: dict[int, Array]
    session: dict[int, Array]
    rejected: int


def add_sweeps(
    file: Any, module: Any, folder: Path, sweeps: xr.Dataset, comparison: xr.Dataset | None, clock: Clock
) -> PlacedSweeps:
    """Add the sweeps of one animal.

    Those accepted become rows of the intervals ``sweeps``, and their series one series each of all, in the order of the
    table, so that an interval cuts a sweep out of it. Those rejected become rows of a table of their own: they have no
    time.

    Parameters
    ----------
    file, module : NWBFile, ProcessingModule
        Of pynwb.
    folder : Path
        Results of the study.
    sweeps : Dataset
        Rows of the table that are this animal's.
    comparison : Dataset, optional
        Prediction against measurement, by sweep.
    clock : Clock
        Where they are laid.

    Returns
    -------
    PlacedSweeps
        Where each sweep lies.

    Raises
    ------
    InputError
        If the series of a sweep is missing.
    """
    accepted = sweeps.accepted.values.astype(bool)
    numbers = [int(number) for number in sweeps.sweep.values[accepted]]
    series = [read_series(folder, number) for number in numbers]
    own = [one.time.values for one in series]
    laid = [clock.lay(time) for time in own]
    _add_joined(module, series, laid)
    if numbers:
        rows = _columns(sweeps.isel(sweep=accepted), comparison)
        start = {"units": "s", "long_name": "time of the first sample on the sweep's own clock"}
        rows["own_start"] = "sweep", [float(time[0]) for time in own], start
        add_intervals(file, "sweeps", _about(laid), laid, rows)
    text = "sweeps that could not be analysed, and why; they have no series"
    lost = _columns(sweeps.isel(sweep=~accepted), None).assign(rejected=sweeps.rejected.variable[~accepted])
    add_table(module, "rejected_sweeps", text, lost, "sweep")
    by_number, by_session = (dict(zip(numbers, times, strict=True)) for times in (own, laid))
    return PlacedSweeps(by_number, by_session, int((~accepted).sum()))


def _add_joined(module: Any, series: list[xr.Dataset], laid: list[Array]) -> None:
    """One series of all sweeps for each variable; a sweep without it, as one over an unknown texture, is left out."""
    import xarray as xr

    named = dict.fromkeys(str(name) for one in series for name in one.data_vars if "time" in one[name].dims)
    together: dict[tuple[int, ...], list[str]] = {}
    for name in named:
        together.setdefault(tuple(k for k, one in enumerate(series) if name in one), []).append(name)
    for having, names in together.items():
        parts = [series[k][names].transpose("time", ...) for k in having]
        whole = xr.concat(parts, "time", join="outer", combine_attrs="override")
        add_series(
            module, whole, np.concatenate([laid[k] for k in having]), comments="Sweeps laid one after the other."
        )


def _columns(sweeps: xr.Dataset, comparison: xr.Dataset | None) -> xr.Dataset:
    """One column for each thing known of a sweep; what goes by mode, one for each mode; what nobody measured, none."""
    import xarray as xr

    columns = {"sweep_number": sweeps.sweep.variable.to_base_variable(), **_by_mode(sweeps)}
    if comparison is not None:
        columns |= _by_mode(comparison.reindex(sweep=sweeps.sweep.values))
    if "textures" in sweeps.attrs:
        names = json.loads(sweeps.attrs["textures"])
        words = [names[k] if 0 <= k < len(names) else "unknown" for k in sweeps.texture.values.tolist()]
        columns["texture_name"] = xr.Variable("sweep", words, {"long_name": "file of the texture"})
    return xr.Dataset({name: one for name, one in columns.items() if measured(one) and name not in REASON})


def _by_mode(data: xr.Dataset) -> dict[str, xr.Variable]:
    """Columns of the variables by sweep, and of those by sweep and mode."""
    columns = {}
    for name, one in data.variables.items():
        if one.dims == ("sweep",) and name != "sweep":
            columns[str(name)] = one
        elif one.dims == ("sweep", "mode"):
            columns |= {f"{name}_mode_{mode}": one[:, k] for k, mode in enumerate(data.mode.values.tolist())}
    return columns


def _about(laid: list[Array]) -> str:
    gaps = [float(later[0] - earlier[-1]) for earlier, later in pairwise(laid)]
    text = "sweeps: one whisker drawn once over one texture each, from its first to its last sample"
    if not gaps:
        return text
    between = f"{min(gaps):.3g} to {max(gaps):.3g} s between two"
    return f"{text}; when they were made is not known: they are laid in the order of the table, {between}"
