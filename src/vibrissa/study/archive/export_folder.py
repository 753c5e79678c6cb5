"""What a folder of results holds, by what each dataset is for an archive."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.errors import ConflictError, FormatError, MissingError
from vibrissa.netcdf import load
from vibrissa.neural.io.tables.selection import at_places
from vibrissa.quantities.kinds import Datasets
from vibrissa.study.archive.export_units import stimulus_of

if TYPE_CHECKING:
    import xarray as xr

ONE_MOVIE = (
    "profile", "true_profile", "modal", "posture", "prediction", "resonance", "resonance_true", "resonance_white",
    "kinematics",
)  # fmt: skip
NAMED = (*ONE_MOVIE, "sweeps", "comparison", "response", "spikes", "motion")
BASE = re.compile(r"base_signal_(\d+)")
UNITS = re.compile(r"units_\w+")
CONTENT = {  # role → variables that a dataset of it has
    "spikes": {"spike_time", "spike_unit", "unit_name"},
    "units": {"unit_name", "p_value"},
    "trials": {"trial_start", "trial_stop"},
    "command": {"command", "whisker", "time"},
    "scan": {"mode_amplitude", "base_moment", "time"},
    "kinematics": {"whisker_angle", "whisker_curvature", "time"},
    "profile": {"x", "y", "arc_length", "time", "node"},
}
DERIVED = "for figures and reports"


def read_results(folder: Path, *, may_be_empty: bool = False) -> tuple[Datasets, dict[str, str]]:
    """Read the datasets of a folder that ``vibrissa run`` or ``recordings`` wrote, or in which results lie together.

    Parameters
    ----------
    folder : Path
        Where they are.
    may_be_empty : bool
        Whether the folder may hold none, as what is exported comes from other files.

    Returns
    -------
    parts : dict of Datasets
        By what they are: names that a study writes; ``trials``, ``units``, ``command`` and ``scan`` by their content.
    left_out : dict of str
        Files that are not exported, and why.

    Raises
    ------
    InputError
        If it is no folder, holds no results, two of one kind, or a dataset is no dataset.
    """
    if not folder.is_dir():
        raise MissingError(str(folder), "must be an existing folder of results")
    parts, left_out, file_of = Datasets(), dict[str, str](), dict[str, str]()
    for path in sorted(folder.glob("*.nc")):
        data = load(path)
        if CONTENT["spikes"] <= set(data.variables):
            data = at_places(data)
        roles = _roles(path.stem, data)
        if not roles:
            left_out[path.name] = DERIVED
        for role, part in roles.items():
            if role in parts:
                both = f"{file_of[role]} and {path.name}"
                raise ConflictError(f"{folder}: {role}", "must be in one file", both, "move one to another folder")
            parts[role], file_of[role] = part, path.name
    if "sweeps" in parts:
        _leave_out_shown(parts, left_out)
    if not parts and not may_be_empty:
        rule = "must hold results: datasets (.nc) of vibrissa run, track, kinematics, scan, neural or sort"
        raise FormatError(str(folder), rule)
    return parts, left_out


def _roles(name: str, data: xr.Dataset) -> Datasets:
    """What a dataset is: by its name in a study, else by what it holds, which may be several things."""
    if name in NAMED or BASE.fullmatch(name) or UNITS.fullmatch(name):
        return {name: data}
    roles = {role: data for role, needed in CONTENT.items() if needed <= set(data.variables)}
    if "spikes" in roles or "unit" not in data.dims:
        roles.pop("units", None)
    if "spikes" in roles or "units" in roles:
        roles.pop("trials", None)
    if {"spikes", "scan"} <= set(roles):  # the scan went on to spikes
        roles["command"] = stimulus_of(data)
    return roles


def _leave_out_shown(parts: Datasets, left_out: dict[str, str]) -> None:
    """Keep only the tracks of the sweep that the figures show, if its number is known: the rest is in the series."""
    if "posture" in parts and "sweep" not in parts["posture"].attrs:
        return  # these are of a movie of the study's own
    known = "posture" in parts
    if known and "profile" in parts:
        parts["profile"] = parts["profile"].assign_attrs(sweep=int(parts["posture"].attrs["sweep"]))
    for name in ONE_MOVIE:
        if name in parts and not (known and name == "profile"):
            del parts[name]
            left_out[f"{name}.nc"] = "of the one sweep that the figures show, whose row is in the table of sweeps"
