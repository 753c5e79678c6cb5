"""Which texture was presented in which trial."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from vibrissa.errors import MissingError, ShapeError
from vibrissa.neural.io.tables.selection import of_same_trials
from vibrissa.tables.reader import read_table
from vibrissa.tables.units import PURE, TEXT


def read_textures(path: str | Path) -> list[str]:
    """Texture of every trial: a file with columns ``trial`` (from 0) and ``texture`` (any name), one line for each.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    list of str
        In the order of the trials, whatever the order of the lines.

    Raises
    ------
    InputError
        If a trial is missing or there twice, or a texture has no name.
    """
    table = read_table(path, {"trial": PURE, "texture": TEXT})
    table.refuse_empty("must have a line for each trial below its header")
    rule = f"must be a whole number from 0 to {len(table) - 1}, as there are {len(table)} lines"
    trial = table.whole_numbers("trial", rule, 0, len(table) - 1)
    again = np.ones(trial.size, bool)
    again[np.unique(trial, return_index=True)[1]] = False
    table.refuse_first(again, "trial", "must be there once")
    names = table.names("texture", "must name a texture")
    return [names[row] for row in np.argsort(trial)]


def textures_of(spikes: xr.Dataset, path: str | Path | None) -> list[str]:
    """Texture of every trial from a file, or else from the table of trials that came with the spikes.

    Parameters
    ----------
    spikes : Dataset
        In trials.
    path : path, optional
        A file as :func:`read_textures` takes it.

    Returns
    -------
    list of str
        In the order of the trials.

    Raises
    ------
    InputError
        If there is neither; if the file has fewer or more trials than the recording, or than there are spikes of.
    """
    if path is None and "trial_stimulus" not in spikes:
        remedy = "give `textures`, a CSV with columns trial,texture, or a table of trials with a column stimulus"
        raise MissingError("textures", "must be given", remedy=remedy)
    if path is None:
        return [str(name) for name in spikes.trial_stimulus.values]
    textures = read_textures(path)
    textures = [textures[k] for k in of_same_trials(spikes, len(textures), str(path))]
    if "trial_start" in spikes and spikes.sizes["trial"] != len(textures):
        raise MissingError(str(path), f"must name {spikes.sizes['trial']} trials, as the recording has", len(textures))
    listed = int(spikes.attrs.get("n_trials", len(textures)))  # of a table with lines for silent trials, too
    if listed != len(textures):
        raise MissingError(str(path), f"must name {listed} trials, as the spikes do", len(textures))
    last = int(spikes.spike_trial.values.max(initial=-1))
    if last >= len(textures):
        raise ShapeError(str(path), f"must name every trial; there are spikes of trial {last}", len(textures))
    return textures
