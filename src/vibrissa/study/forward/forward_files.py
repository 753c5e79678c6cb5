"""Predicted spikes as files that other programs read."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.errors import FormatError, MissingError
from vibrissa.neural.io.formats.nwb_writer import Session, write_nwb
from vibrissa.neural.io.tables.spike_csv import write_csv
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.stimulus_csv import write_stimulus
from vibrissa.neural.io.tables.trials import trial_table
from vibrissa.neural.simulated.driven import write_driven
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr

FIRST, PAUSE = 1.0, 1.0  # [s] onset of the first presentation on a session's clock, and rest between two
SUFFIXES = (".csv", ".nwb")
EPOCH = datetime(2014, 1, 1, tzinfo=UTC)  # of a session that never was: a file must have a date


def refuse_name(path: str | Path) -> None:
    """Refuse, before any work, a name that :func:`write_spikes` would refuse.

    Parameters
    ----------
    path : path
        File to be written.

    Raises
    ------
    InputError
        If the name ends in another suffix, or its folder is not there.
    """
    path = Path(path)
    if path.suffix not in SUFFIXES:
        raise FormatError("file of spikes", f"must end in {' or '.join(SUFFIXES)}", str(path))
    if not path.parent.is_dir():
        raise MissingError(str(path.parent), "must be an existing folder", remedy="make it, or choose another")


def write_spikes(spikes: xr.Dataset, path: str | Path) -> list[Path]:
    """Write predicted spikes.

    Parameters
    ----------
    spikes : Dataset
        From :func:`vibrissa.study.forward.forward.forward`.
    path : path
        ``NAME.csv``: one line for each spike, in trials. Or ``NAME.nwb``: a session of units and trials with the motion
        as stimulus, 1 s between presentations. Beside it ``NAME-stimulus.csv``, the motion as ``vibrissa neural`` takes
        it, and ``NAME-units.csv``, the truth as :func:`vibrissa.neural.simulated.driven.read_driven` takes it.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    InputError
        As :func:`refuse_name`; without pynwb for the latter.
    """
    refuse_name(path)
    path = Path(path)
    stimulus, units = (path.with_name(f"{path.stem}-{what}.csv") for what in ("stimulus", "units"))
    (write_csv if path.suffix == ".csv" else _write_session)(spikes, path)
    write_stimulus(spikes, stimulus)
    write_driven(spikes, units)
    return [path, stimulus, units]


def _write_session(spikes: xr.Dataset, path: Path) -> None:
    """Presentations one after the other on one clock."""
    n_trials, duration = int(spikes.attrs["n_trials"]), float(spikes.attrs["duration"])
    onset = FIRST + (duration + PAUSE) * np.arange(n_trials, dtype=np.float64)
    about: dict[str, Any] = {name: spikes[name].values for name in ("unit_name", "unit_quality")}
    names = about.pop("unit_name").tolist()
    time, moved = onset[spikes.spike_trial.values] + spikes.spike_time, spikes.point_displacement.values[None]
    session = spike_table(time, spikes.spike_unit.values, names, **about)
    command = dataset(time=spikes.time.values, whisker=np.array(["scanned"]), command=moved)
    details: dict[str, Any] = {"description": "spikes predicted by vibrissa", "start": EPOCH, "subject": "simulated"}
    details |= {"age": "P90D", "sex": "U", "species": "Rattus norvegicus"}
    own = Session(identifier=path.stem, **details)
    write_nwb(session, path, own, trials=trial_table(onset, onset + duration), command=command)
