"""Spikes of a recording, whatever its format, in the trials of one protocol."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path

import xarray as xr

from vibrissa.arrays import Window
from vibrissa.errors import ConflictError, FormatError, MissingError, TooFewError
from vibrissa.netcdf import load
from vibrissa.neural.io.formats.binned import DENSE, read_binned
from vibrissa.neural.io.formats.phy import ALL, GOOD, QUALITY, UNJUDGED, is_phy, read_phy
from vibrissa.neural.io.formats.phy_traces import phy_traces, traced_snr
from vibrissa.neural.io.tables.selection import at_places
from vibrissa.neural.io.tables.spike_csv import read_spikes
from vibrissa.neural.io.tables.spikes import of_units
from vibrissa.neural.io.tables.trials import cut_into_trials, read_trials, trials_at
from vibrissa.quantities import dataset

Progress = Callable[[str, int, int], None]
ONSETS = "must be given the onsets of its trials"
PLEXON = (".plx", ".nex", ".pl2", ".pl3", ".nex5")  # the reader refuses the last three, with a remedy


def recorded_spikes(
    path: str | Path,
    *,
    window: Window,
    event: str | None = None,
    trials: str | Path | xr.Dataset | None = None,
    only: tuple[str, str] | None = None,
    groups: Collection[str] | None = None,
    unsorted: bool = False,
    counted_bin: float | None = None,
    progress: Progress | None = None,
) -> tuple[xr.Dataset, int | None]:
    """Spikes in trials, timed from the onset of the stimulus.

    Parameters
    ----------
    path : path
        NWB (``.nwb``), Plexon or NeuroExplorer (``.plx``, ``.nex``), or CSV with columns spike_time,unit
        (:func:`vibrissa.neural.io.tables.spike_csv.read_spikes`): in trials where it has a column trial, else on the
        session's clock. A dataset (``.nc``) of spikes. Counts by bin, trial and unit (``.npy``, ``.mat``). Or a folder
        of sorted units, of phy or SpikeInterface.
    window : (start, stop)
        Part of each trial that is kept, about its onset [s].
    event : str, optional
        Event channel whose marks are the onsets; for Plexon and NeuroExplorer.
    trials : path or Dataset, optional
        Table (CSV: start, stop, …) of the trials, instead of the file's own or of an event; of an NWB file also the
        name of one of its tables of intervals; or the trials themselves, see
        :func:`vibrissa.neural.io.tables.trials.trial_table`.
    only : (column, value), optional
        Keep the trials with this value in this column of their table: one protocol among interleaved ones.
    groups : collection of str, optional
        Groups of units that are taken, of a folder, or of a table that states the quality of its units (``good`` is SU,
        ``mua`` MU); ``all`` for whatever their labels. By default those called good of a folder, and all of a table.
    unsorted : bool
        Take the unsorted spikes of each channel as a unit, instead of leaving them out.
    counted_bin : float, optional
        Width of the bins of counts [s].
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
    if _kind(path) in PLEXON and trials is None and event is None:
        raise MissingError(str(path), ONSETS, remedy="give `event`, or `trial_table`")
    session = session_spikes(
        path, event=event, groups=groups, unsorted=unsorted, counted_bin=counted_bin, progress=progress
    )
    if "spike_trial" in session:
        kind = "period" if isinstance(trials, xr.Dataset) else "trial_table"
        own = {kind: trials, "event": event or None, "only": only or None}
        refuse_trials_twice([name for name, one in own.items() if one is not None], path)
        if not session.sizes["spike"]:
            raise TooFewError(str(path), "must hold at least one spike", 0)
        return session, session.attrs.get("n_trials")
    if not session.sizes["unit"]:
        left_out = session.attrs.get("spikes_unsorted", 0)
        found = f"{left_out} unsorted spikes alone" if left_out else "none"
        raise TooFewError(str(path), "must hold sorted units", found, "sort the spikes first, or give `unsorted`")
    table = trials if isinstance(trials, xr.Dataset) else trials_of_recording(path, session, event, trials, only)
    cut = cut_into_trials(session, table, window)
    if event is not None and trials is None:
        cut = cut.drop_vars("trial_stop")  # an event marks the onsets alone
    return cut, table.sizes["trial"]


def refuse_trials_twice(names: Sequence[str], path: str | Path) -> None:
    """Refuse options that cut a session into trials, for spikes that are in trials already.

    Parameters
    ----------
    names : sequence of str
        The options that were given.
    path : path
        The spikes.

    Raises
    ------
    InputError
        If there is one.
    """
    if names:
        found = f"{path}, a table with a column trial" if _kind(path) == ".csv" else f"{path}, in trials already"
        which = " and ".join(f"`{name}`" for name in [*names, *(["first_onset"] if "period" in names else [])])
        remedy = f"leave {which} out: times count from the onset of each trial"
        raise ConflictError(", ".join(names), "must go with spikes on a session's clock", found, remedy)


def trials_of_recording(
    path: str | Path,
    session: xr.Dataset | None = None,
    event: str | None = None,
    trials: str | Path | None = None,
    only: tuple[str, str] | None = None,
) -> xr.Dataset:
    """Trials of a recording: of a table beside it, of a table within it, or of an event.

    Parameters
    ----------
    path, event, trials, only
        As in :func:`recorded_spikes`.
    session : Dataset, optional
        Its spikes, with ``marker_time`` where an event is given; read where not given.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.trials.trial_table`.

    Raises
    ------
    InputError
        If the onsets of the trials are not known.
    """
    kind = _kind(path)
    if kind == ".nwb" and not (trials is not None and Path(trials).is_file()):
        from vibrissa.neural.io.formats.nwb import read_nwb_trials

        return read_nwb_trials(path, only=only, table="trials" if trials is None else Path(trials).name)
    if trials is not None:
        return read_trials(trials, only=only)
    if kind not in PLEXON:
        raise MissingError(str(path), ONSETS, None, "give `trial_table`, a CSV with columns start,stop")
    if event is None:
        raise MissingError(str(path), ONSETS, remedy="give `event`, or `trial_table`")
    if only is not None:
        raise ConflictError("only", "must go with a table of trials", remedy="give `trial_table`")
    known = session_spikes(path, event=event) if session is None else session
    return trials_at(known.marker_time.values, 1.0)


def session_spikes(
    path: str | Path,
    *,
    event: str | None = None,
    groups: Collection[str] | None = None,
    unsorted: bool = False,
    counted_bin: float | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Spikes of a recording as its file or folder has them, cut into no trials.

    Parameters
    ----------
    path, event, groups, unsorted, counted_bin, progress
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
    kind = _kind(path)
    if event is not None and kind not in PLEXON:
        remedy = "an NWB file has tables of trials" if kind == ".nwb" else ""
        raise ConflictError("event", "must go with a .plx or .nex file", str(path), remedy)
    if counted_bin is not None and kind not in DENSE:
        raise ConflictError("counted_bin", "must go with counts by bin, trial and unit (.npy, .mat)", str(path))
    if unsorted and not (kind in PLEXON or Path(path).is_dir()):
        raise ConflictError("unsorted", "must go with a .plx or .nex file, or a folder of sorted units", str(path))
    if Path(path).is_dir():
        return _sorted_units(path, (*(groups or GOOD), *([UNJUDGED] if unsorted else [])))
    if kind in PLEXON:
        from vibrissa.neural.io.formats.plexon import read_plexon

        return _of_groups(read_plexon(path, event=event, unsorted=unsorted, progress=progress), groups, path)
    return _of_groups(_table(path, kind, counted_bin), groups, path)


def with_waveforms(spikes: xr.Dataset, path: str | Path) -> xr.Dataset:
    """Units with what the waveforms of their spikes give, where these are at hand.

    Parameters
    ----------
    spikes : Dataset
        From :func:`session_spikes`.
    path : path
        The file or folder.

    Returns
    -------
    Dataset
        Of a ``.plx`` file with ``unit_waveform``, ``unit_waveform_sd`` [V] and ``snr_smallest``; of a folder of phy
        whose raw data are there with ``snr_smallest`` and ``snr_mean``, and where they are not, with the attribute
        ``snr_absent``, a phrase that says so; else the same.

    Raises
    ------
    InputError
        If the file is damaged.
    """
    if is_phy(path):
        traces = phy_traces(path)
        if isinstance(traces, str):
            return spikes.assign_attrs(snr_absent=traces)
        return spikes.assign(traced_snr(spikes, traces).data_vars)
    if _kind(path) != ".plx":
        return spikes
    from vibrissa.neural.io.formats.plexon import plexon_waveforms

    names = [str(name) for name in spikes.unit_name.values]
    return spikes.assign(dataset(**plexon_waveforms(path, names)).data_vars)


def _kind(path: str | Path) -> str:
    return "" if Path(path).is_dir() else Path(path).suffix.lower()


def _table(path: str | Path, kind: str, counted_bin: float | None) -> xr.Dataset:
    """Spikes of a file that holds a table of them, in trials or on the session's clock."""
    if kind == ".nwb":
        from vibrissa.neural.io.formats.nwb import read_nwb

        return read_nwb(path)
    if kind in DENSE:
        return read_binned(path, counted_bin)
    if kind != ".nc":
        return read_spikes(path)
    return at_places(load(path))


def _of_groups(spikes: xr.Dataset, groups: Collection[str] | None, path: str | Path) -> xr.Dataset:
    """Units of these groups by their quality; all where none are named."""
    if groups is None or ALL in groups:
        return spikes
    if "unit_quality" not in spikes:
        remedy = "leave `group` out to take all units"
        raise MissingError(str(path), "must state the quality of its units, for `group`", None, remedy)
    labels = [str(one) for one in spikes.unit_quality.values]
    wanted = {*groups, *(QUALITY[one] for one in groups if one in QUALITY)}
    kept = [k for k, label in enumerate(labels) if label in wanted]
    if not kept:
        there = ", ".join(sorted(set(labels)))
        raise TooFewError(str(path), f"must have units in the groups {', '.join(groups)}", None, f"there are {there}")
    left = len(labels) - len(kept)
    chosen = of_units(spikes, kept)
    return chosen.assign_attrs(remark=f"{left} units of other groups are left out") if left else chosen


def _sorted_units(path: str | Path, groups: Collection[str]) -> xr.Dataset:
    """Spikes of a folder that a sorter wrote."""
    if is_phy(path):
        return read_phy(path, groups=groups)
    from vibrissa.neural.io.formats.sorted_folder import is_sorted_folder, read_sorted_folder

    if is_sorted_folder(path):
        return read_sorted_folder(path, groups=groups)
    raise FormatError(str(path), "must be a folder of phy (spike_times.npy) or of SpikeInterface")
