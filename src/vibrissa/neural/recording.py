"""Spikes of a recording, whatever its format, in the trials of one protocol."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.errors import InputError
from vibrissa.files import csv_lines, load
from vibrissa.neural.inputs import read_spikes
from vibrissa.neural.phy import GOOD, is_phy, read_phy
from vibrissa.neural.spikes import read_csv
from vibrissa.neural.trials import cut_into_trials, read_trials, trials_at
from vibrissa.quantities import require

if TYPE_CHECKING:
    import xarray as xr

Window = tuple[float, float]
Progress = Callable[[str, int, int], None]
PLEXON = (".plx", ".nex")


def recorded_spikes(
    path: str | Path,
    *,
    window: Window,
    event: str | None = None,
    trials: str | Path | xr.Dataset | None = None,
    only: tuple[str, str] | None = None,
    groups: Collection[str] = GOOD,
    progress: Progress | None = None,
) -> tuple[xr.Dataset, int | None]:
    """Spikes in trials, timed from the onset of the stimulus.

    Parameters
    ----------
    path : path
        NWB (``.nwb``), Plexon or NeuroExplorer (``.plx``, ``.nex``), or CSV with columns unit,trial,spike_time, whose
        spikes are in trials already. CSV with columns time,unit (:func:`vibrissa.neural.spikes.read_csv`): in trials
        where it has a column trial, else on the session's clock. A dataset (``.nc``) of spikes. Or a folder of sorted
        units, of phy or SpikeInterface.
    window : (start, stop)
        Part of each trial that is kept, about its onset [s].
    event : str, optional
        Event channel whose marks are the onsets; for Plexon and NeuroExplorer.
    trials : path or Dataset, optional
        Table (CSV: start, stop, …) of the trials, instead of the file's own or of an event; or the trials themselves,
        see :func:`vibrissa.neural.trials.trial_table`.
    only : (column, value), optional
        Keep the trials with this value in this column of their table: one protocol among interleaved ones.
    groups : collection of str, optional
        Of a folder, the groups of units that are taken; those called good where not given.
    progress : callable, optional
        Called with (stage, done, total) while a Plexon or NeuroExplorer file is read.

    Returns
    -------
    spikes : Dataset
        ``spike_time``, ``spike_trial``, ``spike_unit``, ``unit_name``.
    n_trials : int or None
        Trials of the recording; None where the file does not tell, as a CSV does not.

    Raises
    ------
    InputError
        If nothing tells where the trials begin; as the readers do.
    """
    kind = _kind(path)
    if kind == "trials":
        if event or trials is not None or only:
            raise InputError("--event, --trial-table, --only", "must go with spikes on a session's clock", str(path))
        return _in_trials(path)
    session, table = _session(path, kind, event, only if trials is None else None, trials is None, groups, progress)
    if trials is not None:
        table = read_trials(trials, only=only) if isinstance(trials, str | Path) else trials
    assert table is not None
    spikes = cut_into_trials(session, table, window)
    return spikes, table.sizes["trial"]


def _kind(path: str | Path) -> str:
    """What holds the spikes: its suffix, a folder, a table on the session's clock, or spikes in trials already."""
    kind = Path(path).suffix.lower()
    if Path(path).is_dir():
        return "folder"
    if kind in (".nwb", *PLEXON, ".pl2", ".pl3"):
        return kind
    columns = _header(path)
    timed = bool({"time", "time_ms"} & columns) and "spike_time" not in columns
    return "table" if timed and "trial" not in columns else "trials"


def _header(path: str | Path) -> set[str]:
    """Columns of a table of comma-separated values; of a dataset, what a table with the same spikes would have."""
    if Path(path).suffix == ".nc":
        spikes = load(path)
        require(spikes, "spike_time", "spike_unit", "unit_name")
        return {"time", "trial"} if "spike_trial" in spikes else {"time"}
    return {name for _, cells in csv_lines(path)[:1] for name in cells}


def _in_trials(path: str | Path) -> tuple[xr.Dataset, int | None]:
    """Spikes that are in trials already, and the number of trials where the file tells."""
    columns = _header(path)
    if "spike_time" in columns or not {"time", "time_ms"} & columns:
        return read_spikes(path), None
    spikes = _timed(path)
    return spikes, spikes.attrs.get("n_trials")


def _timed(path: str | Path) -> xr.Dataset:
    """Spikes of a dataset, or of a table that counts in the column time."""
    return load(path) if Path(path).suffix == ".nc" else read_csv(path)


def _sorted_units(path: str | Path, groups: Collection[str]) -> xr.Dataset:
    """Spikes of a folder that sorting left."""
    if is_phy(path):
        return read_phy(path, groups=groups)
    from vibrissa.neural.sorted_folder import is_sorted_folder, read_sorted_folder

    if is_sorted_folder(path):
        return read_sorted_folder(path, groups=groups)
    raise InputError(str(path), "must be a folder of phy (spike_times.npy) or of SpikeInterface")


def _session(
    path: str | Path,
    kind: str,
    event: str | None,
    only: tuple[str, str] | None,
    own_trials: bool,
    groups: Collection[str],
    progress: Progress | None,
) -> tuple[xr.Dataset, xr.Dataset | None]:
    """Spikes on the session's clock and, if wanted, the file's own trials."""
    if kind == ".nwb":
        from vibrissa.neural.nwb import read_nwb, read_nwb_trials

        if event is not None:
            raise InputError(
                "--event", "must go with a .plx or .nex file", str(path), "an NWB file has tables of trials"
            )
        return read_nwb(path), read_nwb_trials(path, only=only) if own_trials else None
    if kind in ("folder", "table"):
        if event is not None or own_trials:
            remedy = "--trial-table FILE with columns start,stop"
            raise InputError(str(path), "must be given the onsets of its trials", event, remedy)
        return _timed(path) if kind == "table" else _sorted_units(path, groups), None
    from vibrissa.neural.plexon import read_plexon

    if own_trials and event is None:
        raise InputError(
            str(path), "must be given the onsets of its trials", remedy="--event NAME, or --trial-table FILE"
        )
    if only is not None:
        raise InputError("--only", "must go with a table of trials", remedy="--trial-table FILE")
    session = read_plexon(path, event=event, progress=progress)
    return session, trials_at(session.marker_time.values, 1.0) if own_trials else None
