"""Spikes of a recording, whatever its format, in the trials of one protocol."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path

import xarray as xr

from vibrissa.arrays import Window
from vibrissa.errors import ConflictError, FormatError, MissingError, TooFewError
from vibrissa.files import load
from vibrissa.neural.io.formats.phy import GOOD, is_phy, read_phy
from vibrissa.neural.io.tables.spike_csv import read_spikes
from vibrissa.neural.io.tables.trials import cut_into_trials, read_trials, trials_at
from vibrissa.quantities import require

Progress = Callable[[str, int, int], None]
PLEXON = (".plx", ".nex", ".pl2", ".pl3", ".nex5")  # the reader refuses the last three, with a remedy


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
        NWB (``.nwb``), Plexon or NeuroExplorer (``.plx``, ``.nex``), or CSV with columns spike_time,unit
        (:func:`vibrissa.neural.io.tables.spike_csv.read_spikes`): in trials where it has a column trial, else on the
        session's clock. A dataset (``.nc``) of spikes. Or a folder of sorted units, of phy or SpikeInterface.
    window : (start, stop)
        Part of each trial that is kept, about its onset [s].
    event : str, optional
        Event channel whose marks are the onsets; for Plexon and NeuroExplorer.
    trials : path or Dataset, optional
        Table (CSV: start, stop, …) of the trials, instead of the file's own or of an event; or the trials themselves,
        see :func:`vibrissa.neural.io.tables.trials.trial_table`.
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
        Trials of the recording; None where the file does not say, as a CSV that lists no silent ones.

    Raises
    ------
    InputError
        If the onsets of the trials are not known; if there is no unit; as the readers do.
    """
    session, own_trials = _session(path, event, only if trials is None else None, trials is None, groups, progress)
    if "spike_trial" in session:
        if event or trials is not None or only:
            raise ConflictError("event, trial_table, only", "must go with spikes on a session's clock", str(path))
        if not session.sizes["spike"]:
            raise TooFewError(str(path), "must hold at least one spike", 0)
        return session, session.attrs.get("n_trials")
    if not session.sizes["unit"]:
        unsorted = session.attrs.get("spikes_unsorted", 0)
        found = f"{unsorted} unsorted spikes alone" if unsorted else "none"
        raise TooFewError(str(path), "must hold sorted units", found, "sort the spikes first")
    table = read_trials(trials, only=only) if isinstance(trials, str | Path) else trials
    table = own_trials if table is None else table
    assert table is not None
    return cut_into_trials(session, table, window), table.sizes["trial"]


def _session(
    path: str | Path,
    event: str | None,
    only: tuple[str, str] | None,
    own: bool,
    groups: Collection[str],
    progress: Progress | None,
) -> tuple[xr.Dataset, xr.Dataset | None]:
    """Spikes of a recording and, if its own are wanted, its trials; a table may have the spikes in trials."""
    kind = "" if Path(path).is_dir() else Path(path).suffix.lower()
    if kind == ".nwb":
        from vibrissa.neural.io.formats.nwb import read_nwb, read_nwb_trials

        if event is not None:
            remedy = "an NWB file has tables of trials"
            raise ConflictError("event", "must go with a .plx or .nex file", str(path), remedy)
        return read_nwb(path), read_nwb_trials(path, only=only) if own else None
    rule = "must be given the onsets of its trials"
    if kind in PLEXON and own and event is None:
        raise MissingError(str(path), rule, remedy="give `event`, or `trial_table`")
    if kind in PLEXON and only is not None:
        raise ConflictError("only", "must go with a table of trials", remedy="give `trial_table`")
    session = session_spikes(path, event=event, groups=groups, progress=progress)
    if "spike_trial" not in session and kind not in PLEXON and (event is not None or own):
        raise MissingError(str(path), rule, event, "give `trial_table`, a CSV with columns start,stop")
    return session, trials_at(session.marker_time.values, 1.0) if own and "marker_time" in session else None


def session_spikes(
    path: str | Path,
    *,
    event: str | None = None,
    groups: Collection[str] = GOOD,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Spikes of a recording as its file or folder has them, cut into no trials; NWB has its own reader.

    Parameters
    ----------
    path, event, groups, progress
        As in :func:`recorded_spikes`.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`; with ``marker_time`` where an event is given.

    Raises
    ------
    InputError
        As the readers.
    """
    if Path(path).is_dir():
        return _sorted_units(path, groups)
    if Path(path).suffix.lower() not in PLEXON:
        return _table(path)
    from vibrissa.neural.io.formats.plexon import read_plexon

    return read_plexon(path, event=event, progress=progress)


def _table(path: str | Path) -> xr.Dataset:
    """Spikes of a dataset, or of a table, in trials or on the session's clock."""
    if Path(path).suffix != ".nc":
        return read_spikes(path)
    spikes = load(path)
    require(spikes, "spike_time", "spike_unit", "unit_name")
    return spikes


def _sorted_units(path: str | Path, groups: Collection[str]) -> xr.Dataset:
    """Spikes of a folder that a sorter wrote."""
    if is_phy(path):
        return read_phy(path, groups=groups)
    from vibrissa.neural.io.formats.sorted_folder import is_sorted_folder, read_sorted_folder

    if is_sorted_folder(path):
        return read_sorted_folder(path, groups=groups)
    raise FormatError(str(path), "must be a folder of phy (spike_times.npy) or of SpikeInterface")
