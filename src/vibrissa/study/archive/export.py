"""Results of a study as files of Neurodata Without Borders that archives accept, one for each animal."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, FormatError, MachineError, MissingError, RangeError
from vibrissa.files import written_whole
from vibrissa.neural.io.formats.nwb import pynwb_module
from vibrissa.neural.io.formats.nwb_session import Session, nwb_bytes, session_file
from vibrissa.quantities.kinds import Datasets, Results
from vibrissa.study.archive.export_folder import BASE, ONE_MOVIE, read_results
from vibrissa.study.archive.export_kinematics import CONTAINER, add_kinematics
from vibrissa.study.archive.export_series import Clock, add_intervals, add_table
from vibrissa.study.archive.export_session import OfAnimals, SessionDetails
from vibrissa.study.archive.export_sweeps import PlacedSweeps, add_sweeps
from vibrissa.study.archive.export_tracks import (
    add_base_signal,
    add_modes,
    add_posture,
    add_prediction,
    add_tracks,
    shown_time,
)
from vibrissa.study.archive.export_units import add_neurons, tables_of_units, taken_until, without_spikes

if TYPE_CHECKING:
    import xarray as xr

Build = Callable[[Session, Datasets], tuple[Any, dict[str, Any]]]

OF_SWEEPS = ("sweeps", "comparison", "profile")
FIRST = ("profile", "modal", "prediction", "kinematics")  # whose first time is the movie's
OF_TIME = ("profile", "true_profile", "modal", "prediction", "kinematics")


@dataclass(frozen=True, kw_only=True)
class Written:
    """One file that was written.

    Attributes
    ----------
    path : Path
        The file.
    session : Session
        Details of session and animal.
    holds : dict
        Names of its ``series`` and ``tables``; numbers of ``sweeps``, ``rejected`` sweeps, ``units`` and ``trials``.
    """

    path: Path
    session: Session
    holds: dict[str, Any]


def export_nwb(
    folder: str | Path,
    out: str | Path,
    details: SessionDetails,
    *,
    animals: OfAnimals | None = None,
    extra: Results | None = None,
    sampling_rate: float | None = None,
    pause: float = 1.0,
    overwrite: bool = False,
) -> tuple[list[Written], dict[str, str]]:
    """Write the results of a folder as NWB files; all of them, or none.

    Parameters
    ----------
    folder : path
        What ``vibrissa run`` or ``recordings`` wrote, or results of ``neural``, ``sort`` and the like put together.
    out : path
        ``NAME.nwb``; or a folder, made if absent, in which each animal of the table of sweeps gets a file that is named
        as archives want it.
    details : SessionDetails
        What only the experimenter knows.
    animals : mapping, optional
        The same where it differs between animals; see :func:`vibrissa.study.archive.export_session.read_animals`.
    extra : mapping of Datasets, optional
        ``spikes``, ``trials``, ``command`` or ``stimulus`` from other files; they take the place of the folder's.
    sampling_rate : float, optional
        Of the recording that the spikes are from [Hz]; must be given where recorded spikes do not hold it.
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
        If pynwb is not installed; the folder holds no results; details of a session are missing; a file exists.
    """
    if not 0 < pause < np.inf:
        raise RangeError("pause", "must be positive (s)", pause)
    pynwb_module()
    folder = Path(folder)
    parts, left_out = read_results(folder, may_be_empty=bool(extra))
    parts |= extra or {}
    named = _animals(parts)
    if unknown := sorted(set(animals or {}) - {*named, details.subject}):
        raise MissingError("animals", f"must name {', '.join(named) or '`subject`'}", ", ".join(unknown))
    files = _files(parts, details)
    own = details if len(files) == 1 else replace(details, subject=None)  # each by its own name
    sessions = [(own.session(name, some, folder, animals or {}), some) for name, some in files]
    paths = _paths(Path(out), sessions, overwrite)

    def build(session: Session, some: Datasets) -> tuple[Any, dict[str, Any]]:
        return _built(session, some, folder, Clock(pause, taken_until(some)), sampling_rate)

    written = _write(paths, sessions, build)
    for one in written:
        left_out |= one.holds.pop("left_out")
    return written, left_out


def _animals(parts: Results) -> list[str]:
    """Names in the table of sweeps, in its order; none if there is no table."""
    return list(dict.fromkeys(map(str, parts["sweeps"].animal.values))) if "sweeps" in parts else []


def _files(parts: Datasets, details: SessionDetails) -> list[tuple[str | None, Datasets]]:
    """Parts of each file, and its animal's name in the table of sweeps."""
    animals, profile = _animals(parts), parts.get("profile")
    shown = None if profile is None else profile.attrs.get("sweep")
    if not animals or (len(animals) == 1 and (profile is None or shown is not None)):
        return [(animals[0] if animals else None, parts)]
    table = parts["sweeps"]
    files: dict[str, Datasets] = {}
    for animal in animals:
        mine = np.flatnonzero(table.animal.values.astype(str) == animal)
        files[animal] = {"sweeps": table.isel(sweep=mine)}
        if "comparison" in parts:
            files[animal]["comparison"] = parts["comparison"]
        if profile is not None and shown is not None and shown in table.sweep.values[mine]:
            files[animal]["profile"] = profile
    rest = {
        name: data for name, data in parts.items() if name not in OF_SWEEPS or (name == "profile" and shown is None)
    }
    names = f"the table of sweeps names {', '.join(animals)}"
    if details.subject is not None and not rest:
        raise ConflictError("subject", "must be left out", details.subject, names)
    if rest:
        if details.subject is None:
            raise MissingError("subject", "must be given", remedy=f"of which animal {', '.join(sorted(rest))} is")
        if details.subject in files and not set(rest).isdisjoint(ONE_MOVIE):
            rule = "must differ from those of the sweeps: a movie that is not a sweep goes into a file of its own"
            raise FormatError("subject", rule, details.subject, names)
        files.setdefault(details.subject, {}).update(rest)
    return list(files.items())


def _paths(out: Path, sessions: list[tuple[Session, Datasets]], overwrite: bool) -> list[Path]:
    """Where each file goes; refused before any work where it cannot."""
    if out.suffix == ".nwb":
        if len(sessions) > 1:
            names = ", ".join(session.subject for session, _ in sessions)
            raise MissingError("out", "must be a folder", out, f"one file for each animal: {names}")
        paths = [out]
    else:
        if out.exists() and not out.is_dir():
            raise FormatError("out", "must end in .nwb, or be a folder", str(out))
        paths = [out / session.named(_modality(parts)) for session, parts in sessions]
    inside = out.absolute().parent
    if not inside.is_dir():
        raise MissingError(str(inside), "must be an existing folder", remedy="make it, or choose another")
    called: dict[str, str] = {}
    for path, (session, _) in zip(paths, sessions, strict=True):
        one = session.named("").partition("_")[0]
        if paths.count(path) > 1 or called.setdefault(one, session.subject) != session.subject:
            rule, remedy = "would be of two animals", "names of animals must differ in letters or digits"
            raise ConflictError(f"{path.parent / one}", rule, remedy=remedy)
        if path.exists() and not overwrite:
            raise ConflictError("out", "must not name a file that exists", str(path), "`overwrite` replaces it")
    return paths


def _modality(parts: Results) -> str:
    neural = bool({"spikes", "stimulus", "command", "motion", *tables_of_units(parts)} & set(parts))
    behaviour = bool({"sweeps", "scan", *ONE_MOVIE} & set(parts)) or any(BASE.fullmatch(name) for name in parts)
    return "+".join(["behavior"] * behaviour + ["ecephys"] * neural) or "behavior"


def _built(
    session: Session, parts: Results, folder: Path, clock: Clock, sampling_rate: float | None
) -> tuple[Any, dict[str, Any]]:
    """File in memory, and what it holds."""
    file = session_file(session)
    module = file.create_processing_module("behavior", "whiskers: tracks, modes, posture, resonances, base signals")
    holds: dict[str, Any] = {"sweeps": 0, "rejected": 0, "left_out": {}}
    recordings: list[tuple[str, Array, Array]] = []
    if "sweeps" in parts:
        laid = add_sweeps(file, module, folder, parts["sweeps"], parts.get("comparison"), clock)
        holds |= {"sweeps": len(laid.own), "rejected": laid.rejected}
        if "profile" in parts:
            holds["left_out"] = _add_shown(module, parts["profile"], laid)
    else:
        recordings += _add_movie(file, module, parts, clock)
    recordings += _add_signals(module, parts, clock)
    if len(recordings) > 1 or any((own[0] != time[0]) for _, own, time in recordings):
        _add_recordings(file, recordings)
    if "response" in parts:
        add_table(module, "response", "firing rate and envelope from the onset of a trial", parts["response"], "bin")
    add_neurons(file, module, parts, session, clock, sampling_rate)
    holds["left_out"] |= without_spikes(parts)
    each = {str(name): one for name, one in module.data_interfaces.items()}
    within = [str(name) for one in each.values() for name in getattr(one, "time_series", ())]  # of kinematics
    holds["series"] = sorted([*within, *(name for name, one in each.items() if hasattr(one, "unit"))])
    holds["tables"] = sorted(name for name, one in each.items() if not hasattr(one, "unit") and name != CONTAINER)
    holds["units"] = 0 if file.units is None else len(file.units)
    holds["trials"] = 0 if file.trials is None else len(file.trials)
    if not module.data_interfaces:
        file.processing.pop("behavior")
    return file, holds


def _add_shown(module: Any, profile: xr.Dataset, laid: PlacedSweeps) -> dict[str, str]:
    """Tracks of the sweep that the figures show, at its place; if they are not its, they are left out."""
    number = int(profile.attrs["sweep"])
    time = shown_time(profile, laid.own[number], laid.session[number]) if number in laid.own else None
    if time is None:
        return {"profile.nc": f"its times are not those of sweep {number}, which posture.nc names"}
    add_tracks(module, profile, time)
    return {}


def _add_movie(file: Any, module: Any, parts: Results, clock: Clock) -> list[tuple[str, Array, Array]]:
    """What one movie gave, on one stretch of the clock."""
    own = next((parts[name].time.values for name in FIRST if name in parts), None)
    if own is None:
        return []
    time = clock.lay(own)
    laid = {name: parts[name].time.values + (time[0] - own[0]) for name in OF_TIME if name in parts}
    for name, suffix in (("profile", ""), ("true_profile", "_true")):
        if name in parts:
            add_tracks(module, parts[name], laid[name], suffix)
    if "modal" in parts:
        add_modes(module, parts, laid["modal"])
    if "posture" in parts:
        add_posture(module, parts["posture"])
    if "prediction" in parts:
        add_prediction(module, parts["prediction"], laid["prediction"])
    if "kinematics" in parts:
        add_kinematics(file, module, parts["kinematics"], laid["kinematics"])
    return [("movie", own, time)]


def _add_signals(module: Any, parts: Results, clock: Clock) -> list[tuple[str, Array, Array]]:
    """Signals measured at a base, and a scan that was predicted, each on its own stretch."""
    laid = []
    found = {BASE.fullmatch(name): signal for name, signal in parts.items()}
    for number, signal in sorted(((int(m[1]), one) for m, one in found.items() if m), key=itemgetter(0)):
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

    first = {"units": "s", "long_name": "first time by its own clock"}
    columns = {
        "what": ("row", [name for name, _, _ in laid], {"long_name": "what was recorded"}),
        "own_start": ("row", [own[0] for _, own, _ in laid], first),
    }
    text = "recordings, from first to last sample; those after the first are laid on the clock one after the other"
    add_intervals(file, "recordings", text, [time for _, _, time in laid], xr.Dataset(columns))


def _write(paths: list[Path], sessions: list[tuple[Session, Datasets]], build: Build) -> list[Written]:
    """Write one file after the other under other names, then rename all; if one fails, none is there."""
    folder, done = paths[0].parent, list[Written]()
    made, fresh = not folder.is_dir(), [path for path in paths if not path.exists()]
    try:
        folder.mkdir(exist_ok=True)
        with ExitStack() as stack:
            for path, (session, parts) in zip(paths, sessions, strict=True):
                temporary = stack.enter_context(written_whole(path))
                file, holds = build(session, parts)
                temporary.write_bytes(nwb_bytes(file))
                del file  # before the next is built: both may not fit into memory
                done.append(Written(path=path, session=session, holds=holds))
    except BaseException as error:
        with suppress(OSError):
            for path in fresh:
                path.unlink(missing_ok=True)
            if made:
                folder.rmdir()
        if isinstance(error, OSError):
            raise MachineError(str(folder), f"could not be written ({error.strerror or error})") from error
        raise
    return done
