"""Results of a study as files of Neurodata Without Borders that archives accept, one for each animal."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.errors import InputError
from vibrissa.files import written_whole
from vibrissa.neural.nwb import pynwb_module
from vibrissa.neural.nwb_session import Session, nwb_bytes, session_file
from vibrissa.study.export_folder import BASE, ONE_MOVIE, Results, read_results
from vibrissa.study.export_series import Array, Clock, add_intervals, add_table
from vibrissa.study.export_session import OfAnimals, Told
from vibrissa.study.export_sweeps import Laid, add_sweeps
from vibrissa.study.export_tracks import (
    add_base_signal,
    add_modes,
    add_posture,
    add_prediction,
    add_tracks,
    shown_time,
)
from vibrissa.study.export_units import add_neurons, tables_of_units, taken_until

if TYPE_CHECKING:
    import xarray as xr

Datasets = Mapping[str, "xr.Dataset"]
Build = Callable[[], tuple[Any, dict[str, Any]]]

OF_SWEEPS = ("sweeps", "comparison", "profile")


@dataclass(frozen=True, kw_only=True)
class Written:
    """One file that was written.

    Attributes
    ----------
    path : Path
        The file.
    session : Session
        What it tells of session and animal.
    holds : dict
        Names of its ``series`` and ``tables``; numbers of ``sweeps``, ``rejected`` sweeps, ``units`` and ``trials``.
    """

    path: Path
    session: Session
    holds: dict[str, Any]


def export_nwb(
    folder: str | Path,
    out: str | Path,
    told: Told,
    *,
    animals: OfAnimals | None = None,
    extra: Datasets | None = None,
    sampling_rate: float | None = None,
    pause: float = 1.0,
    overwrite: bool = False,
) -> tuple[list[Written], dict[str, str]]:
    """Write the results of a folder as NWB files; all of them, or none.

    Parameters
    ----------
    folder : path
        What ``vibrissa run`` or ``sweeps`` wrote, or results of ``neural``, ``sort`` and the like put together.
    out : path
        ``NAME.nwb``; or a folder, made if absent, in which each animal of the table of sweeps gets a file that is named
        as archives want it.
    told : Told
        What only the experimenter knows.
    animals : mapping, optional
        The same where it differs between animals; see :func:`vibrissa.study.export_session.read_animals`.
    extra : mapping of Datasets, optional
        ``spikes``, ``trials`` or ``command`` from other files; they take the place of the folder's.
    sampling_rate : float, optional
        Of the recording that the spikes are from [Hz]; must be given where spikes were recorded and do not tell it.
    pause : float
        Least time between two recordings that are laid on one clock [s].
    overwrite : bool
        Whether files that exist are replaced.

    Returns
    -------
    written : list of Written
        The files.
    left_out : dict of str
        Datasets of the folder that are not exported, and why.

    Raises
    ------
    InputError
        If pynwb is not installed; the folder holds no results; something of a session is not told; a file exists.
    """
    if not 0 < pause < np.inf:
        raise InputError("pause", "must be positive (s)", pause)
    pynwb_module()
    results = read_results(folder)
    results = Results(results.folder, {**results.parts, **(extra or {})}, results.left_out)
    if unknown := sorted(set(animals or {}) - {*results.animals, told.subject}):
        known = ", ".join(results.animals) or "--subject"
        raise InputError("--animals", f"must name {known}", ", ".join(unknown))
    files = _files(results, told)
    named = told if len(files) == 1 else replace(told, subject=None)  # each by its own name
    sessions = [(named.session(name, parts, results.folder, animals or {}), parts) for name, parts in files]
    paths = _paths(Path(out), sessions, overwrite)
    builds: list[tuple[Path, Session, Build]] = [
        (
            path,
            session,
            partial(_built, session, parts, results.folder, Clock(pause, taken_until(parts)), sampling_rate),
        )
        for path, (session, parts) in zip(paths, sessions, strict=True)
    ]
    written, left_out = _write(builds, paths[0].parent), results.left_out
    for one in written:
        left_out = left_out | one.holds.pop("left_out")
    return written, left_out


def _files(results: Results, told: Told) -> list[tuple[str | None, Datasets]]:
    """Parts of each file, and its animal's name in the table of sweeps."""
    animals = results.animals
    if len(animals) < 2:
        return [(animals[0] if animals else None, results.parts)]
    table = results.parts["sweeps"]
    shown = results.parts["profile"].attrs.get("sweep") if "profile" in results.parts else None
    files: dict[str, dict[str, xr.Dataset]] = {}
    for animal in animals:
        mine = np.flatnonzero(table.animal.values.astype(str) == animal)
        files[animal] = {"sweeps": table.isel(sweep=mine)}
        if "comparison" in results.parts:
            files[animal]["comparison"] = results.parts["comparison"]
        if shown is not None and shown in table.sweep.values[mine]:
            files[animal]["profile"] = results.parts["profile"]
    of_sweeps = [name for name in OF_SWEEPS if name != "profile" or shown is not None]
    rest = {name: data for name, data in results.parts.items() if name not in of_sweeps}
    if told.subject is not None and not rest:
        raise InputError(
            "--subject", "must be left out", told.subject, f"the table of sweeps names {', '.join(animals)}"
        )
    if rest:
        if told.subject is None:
            raise InputError("--subject", "must be given", remedy=f"of which animal {', '.join(sorted(rest))} is")
        if told.subject in files and not set(rest).isdisjoint(ONE_MOVIE):
            rule = "must be a name of its own: a movie that is none of the sweeps goes into a file of its own"
            raise InputError("--subject", rule, told.subject, f"the table of sweeps names {', '.join(animals)}")
        files.setdefault(told.subject, {}).update(rest)
    return list(files.items())


def _paths(out: Path, sessions: list[tuple[Session, Datasets]], overwrite: bool) -> list[Path]:
    """Where each file goes; refused before any work where it cannot."""
    if out.suffix == ".nwb":
        if len(sessions) > 1:
            names = ", ".join(session.subject for session, _ in sessions)
            raise InputError("--nwb", "must be a folder", out, f"one file for each animal: {names}")
        paths = [out]
    else:
        if out.exists() and not out.is_dir():
            raise InputError("--nwb", "must end in .nwb, or be a folder", str(out))
        paths = [out / session.named(_modality(parts)) for session, parts in sessions]
    inside = out.absolute().parent
    if not inside.is_dir():
        raise InputError(str(inside), "must be an existing folder", remedy="make it, or choose another")
    called: dict[str, str] = {}
    for path, (session, _) in zip(paths, sessions, strict=True):
        one = session.named("").partition("_")[0]
        if paths.count(path) > 1 or called.setdefault(one, session.subject) != session.subject:
            rule, remedy = "would be of two animals", "names of animals must differ in letters or digits"
            raise InputError(f"{path.parent / one}", rule, remedy=remedy)
        if path.exists() and not overwrite:
            raise InputError("--nwb", "must not name a file that exists", str(path), "--overwrite replaces it")
    return paths


def _modality(parts: Datasets) -> str:
    neural = bool({"spikes", "command", "motion", *tables_of_units(parts)} & set(parts))
    behaviour = bool({"sweeps", "scan", *ONE_MOVIE} & set(parts)) or any(BASE.fullmatch(name) for name in parts)
    return "+".join(["behavior"] * behaviour + ["ecephys"] * neural) or "behavior"


def _built(
    session: Session, parts: Datasets, folder: Path, clock: Clock, sampling_rate: float | None
) -> tuple[Any, dict[str, Any]]:
    """File in memory, and what it holds."""
    file = session_file(session)
    module = file.create_processing_module("behavior", "whiskers: tracks, modes, posture, resonances, base signals")
    holds: dict[str, Any] = {"sweeps": 0, "rejected": 0, "left_out": {}}
    recordings: list[tuple[str, Array, Array]] = []
    if "sweeps" in parts:
        laid = add_sweeps(file, module, folder, parts["sweeps"], parts.get("comparison"), clock)
        holds |= {"sweeps": len(laid.own), "rejected": len(laid.rejected)}
        if "profile" in parts:
            holds["left_out"] = _add_shown(module, parts["profile"], laid)
    else:
        recordings += _add_movie(module, parts, clock)
    recordings += _add_signals(module, parts, clock)
    if len(recordings) > 1 or any((own[0] != time[0]) for _, own, time in recordings):
        _add_recordings(file, recordings)
    if "response" in parts:
        add_table(module, "response", "firing rate and envelope from the onset of a trial", parts["response"], "bin")
    add_neurons(file, module, parts, session, clock, sampling_rate)
    holds["series"] = sorted(str(name) for name, one in module.data_interfaces.items() if hasattr(one, "unit"))
    holds["tables"] = sorted(str(name) for name in module.data_interfaces if name not in holds["series"])
    holds["units"] = 0 if file.units is None else len(file.units)
    holds["trials"] = 0 if file.trials is None else len(file.trials)
    if not module.data_interfaces:
        file.processing.pop("behavior")
    return file, holds


def _add_shown(module: Any, profile: xr.Dataset, laid: Laid) -> dict[str, str]:
    """Tracks of the sweep that the figures show, at its place; if they are not its, they are left out."""
    number = int(profile.attrs["sweep"])
    time = shown_time(profile, laid.own[number], laid.session[number]) if number in laid.own else None
    if time is None:
        return {"profile.nc": f"its times are not those of sweep {number}, which posture.nc names"}
    add_tracks(module, profile, time)
    return {}


def _add_movie(module: Any, parts: Datasets, clock: Clock) -> list[tuple[str, Array, Array]]:
    """What one movie gave, on one stretch of the clock."""
    own = next((parts[name].time.values for name in ("profile", "modal", "prediction") if name in parts), None)
    if own is None:
        return []
    time = clock.lay(own)
    for name, suffix in (("profile", ""), ("true_profile", "_true")):
        if name in parts:
            add_tracks(module, parts[name], parts[name].time.values + (time[0] - own[0]), suffix)
    if "modal" in parts:
        add_modes(module, parts, parts["modal"].time.values + (time[0] - own[0]))
    if "posture" in parts:
        add_posture(module, parts["posture"])
    if "prediction" in parts:
        add_prediction(module, parts["prediction"], parts["prediction"].time.values + (time[0] - own[0]))
    return [("movie", own, time)]


def _add_signals(module: Any, parts: Datasets, clock: Clock) -> list[tuple[str, Array, Array]]:
    """Signals measured at a base, and a scan that was predicted, each on its own stretch."""
    laid = []
    for number, signal in Results(Path(), dict(parts), {}).base_signals.items():
        time = clock.lay(signal.time.values)
        add_base_signal(module, number, signal, time)
        laid.append((f"base signal {number}, {signal.attrs.get('label', 'without a name')}", signal.time.values, time))
    if "scan" in parts:
        own = parts["scan"].time.values
        time = clock.lay(own)
        add_prediction(module, parts["scan"], time, "scan_")
        laid.append(("scan, predicted", own, time))
    return laid


def _add_recordings(file: Any, laid: list[tuple[str, Array, Array]]) -> None:
    import xarray as xr

    columns = {
        "what": ("row", [name for name, _, _ in laid], {"long_name": "what was recorded"}),
        "own_start": (
            "row",
            [own[0] for _, own, _ in laid],
            {"units": "s", "long_name": "first time by its own clock"},
        ),
    }
    text = "recordings, from first to last sample; those after the first are laid on the clock one after the other"
    add_intervals(file, "recordings", text, [time for _, _, time in laid], xr.Dataset(columns))


def _write(builds: list[tuple[Path, Session, Build]], folder: Path) -> list[Written]:
    """Write one file after the other under other names, then rename all; if one fails, none is there."""
    made, done = not folder.is_dir(), []
    try:
        folder.mkdir(exist_ok=True)
        with ExitStack() as stack:
            for path, session, build in builds:
                temporary = stack.enter_context(written_whole(path))
                done.append(Written(path=path, session=session, holds=_write_one(build, temporary)))
    except BaseException as error:
        if made:
            with suppress(OSError):
                folder.rmdir()
        if isinstance(error, OSError):
            raise InputError(str(folder), f"could not be written ({error.strerror or error})") from error
        raise
    return done


def _write_one(build: Build, path: Path) -> dict[str, Any]:
    """Build a file, write it, and let its memory go."""
    file, holds = build()
    path.write_bytes(nwb_bytes(file))
    return holds
