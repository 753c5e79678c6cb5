"""What a folder of results holds, by what each dataset is for an archive."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.errors import InputError
from vibrissa.files import load
from vibrissa.study.export_units import stimulus_of

if TYPE_CHECKING:
    import xarray as xr

ONE_MOVIE = (
    "profile", "true_profile", "modal", "posture", "prediction", "resonance", "resonance_true", "resonance_white",
)  # fmt: skip
NAMED = (*ONE_MOVIE, "sweeps", "comparison", "response", "spikes", "motion")
BASE = re.compile(r"base_signal_(\d+)")
UNITS = re.compile(r"units_\w+")
DERIVED = "for figures and reports"


@dataclass(frozen=True)
class Results:
    """Datasets of a folder.

    Attributes
    ----------
    folder : Path
        Where they are.
    parts : dict of Datasets
        By what they are: names that a study writes; ``trials``, ``units``, ``command`` and ``scan`` by their content.
    left_out : dict of str
        Files that are not exported, and why.
    """

    folder: Path
    parts: dict[str, xr.Dataset]
    left_out: dict[str, str]

    @property
    def animals(self) -> list[str]:
        """Names in the table of sweeps, in its order; none if there is no table."""
        table = self.parts.get("sweeps")
        return [] if table is None else list(dict.fromkeys(map(str, table.animal.values)))

    @property
    def base_signals(self) -> dict[int, xr.Dataset]:
        """Base signals by their number."""
        found = {BASE.fullmatch(name): data for name, data in self.parts.items()}
        return {int(match[1]): data for match, data in sorted(found.items(), key=str) if match}


def read_results(folder: str | Path) -> Results:
    """Read the datasets of a folder that ``vibrissa run`` or ``sweeps`` wrote, or in which results were put together.

    Raises
    ------
    InputError
        If it is no folder, holds no results, two of one kind, or a dataset is no dataset.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(str(folder), "must be an existing folder of results")
    parts: dict[str, xr.Dataset] = {}
    left_out: dict[str, str] = {}
    for path in sorted(folder.glob("*.nc")):
        data = load(path)
        roles = _roles(path.stem, data)
        if not roles:
            left_out[path.name] = DERIVED
        for role, part in roles.items():
            if role in parts:
                raise InputError(f"{folder}, {role}", "must be there once", path.name, "keep one recording in a folder")
            parts[role] = part
    if "sweeps" in parts:
        _leave_out_shown(parts, left_out)
    if not parts:
        raise InputError(str(folder), "must hold results: datasets (.nc) of vibrissa run, sweeps, neural or sort")
    return Results(folder, parts, left_out)


def _roles(name: str, data: xr.Dataset) -> dict[str, xr.Dataset]:
    """What a dataset is: by its name in a study, else by what it holds, which may be several things."""
    if name in NAMED or BASE.fullmatch(name) or UNITS.fullmatch(name):
        return {name: data}
    roles: dict[str, xr.Dataset] = {}
    if {"spike_time", "spike_unit", "unit_name"} <= set(data.variables):
        roles["spikes"] = data
    elif {"unit_name", "p_value"} <= set(data.variables) and "unit" in data.dims:
        roles["units"] = data
    elif {"trial_start", "trial_stop"} <= set(data.variables):
        roles["trials"] = data
    if {"command", "whisker", "time"} <= set(data.variables):
        roles["command"] = data
    if {"mode_amplitude", "base_moment", "time"} <= set(data.variables):
        roles["scan"] = data
        if "spikes" in roles:  # it went on to them
            roles["command"] = stimulus_of(data)
    return roles


def _leave_out_shown(parts: dict[str, xr.Dataset], left_out: dict[str, str]) -> None:
    """Of the one sweep that figures show only the tracks stay, if it is told which it is: all else is in the series."""
    if "posture" in parts and "sweep" not in parts["posture"].attrs:
        return  # these are of a movie of the study's own
    number = int(parts["posture"].attrs["sweep"]) if "posture" in parts else -1
    shown = {"profile"} if number >= 0 else set()
    if "profile" in parts and shown:
        parts["profile"] = parts["profile"].assign_attrs(sweep=number)
    for name in ONE_MOVIE:
        if name in parts and name not in shown:
            del parts[name]
            left_out[f"{name}.nc"] = (
                "of the one sweep that the figures show: what it tells stands in the table of sweeps"
            )
