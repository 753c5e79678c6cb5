"""Which texture was presented in which trial."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import InputError
from vibrissa.neural.table import read_table

if TYPE_CHECKING:
    import xarray as xr


def read_textures(path: str | Path) -> list[str]:
    """Texture of every trial: a file with columns ``trial`` (from 0) and ``texture`` (any name), one line for each.

    Returns
    -------
    list of str
        In the order of the trials, whatever the order of the lines.

    Raises
    ------
    InputError
        If a trial is missing or there twice, or a texture has no name.
    """
    table = read_table(path, ("trial", "texture"))
    trial, names = table.numbers("trial"), table.columns["texture"]
    if not names:
        raise InputError(str(path), "must have a line for each trial below its header", "none")
    rule = f"must be a whole number from 0 to {trial.size - 1}, as there are {trial.size} lines"
    table.refuse_first((trial != np.floor(trial)) | (trial < 0) | (trial >= trial.size), "trial", rule)
    again = np.ones(trial.size, bool)
    again[np.unique(trial, return_index=True)[1]] = False
    table.refuse_first(again, "trial", "must be there once")
    table.refuse_first(np.array([not name for name in names], bool), "texture", "must name a texture")
    return [names[row] for row in np.argsort(trial)]


def textures_of(spikes: xr.Dataset, path: str | Path | None) -> list[str]:
    """Texture of every trial from a file, or else from the table of trials that came with the spikes.

    Raises
    ------
    InputError
        If neither tells; if the file tells of fewer or more trials than the recording has, or than there are spikes of.
    """
    if path is None and "trial_stimulus" not in spikes:
        remedy = "--textures FILE with columns trial,texture, or a table of trials with a column stimulus"
        raise InputError("textures", "must be given", remedy=remedy)
    if path is None:
        return [str(name) for name in spikes.trial_stimulus.values]
    textures = read_textures(path)
    if "trial_start" in spikes and spikes.sizes["trial"] != len(textures):
        raise InputError(str(path), f"must name {spikes.sizes['trial']} trials, as the recording has", len(textures))
    last = int(spikes.spike_trial.values.max(initial=-1))
    if last >= len(textures):
        raise InputError(str(path), f"must name every trial; there are spikes of trial {last}", len(textures))
    return textures
