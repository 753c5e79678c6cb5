"""The verb `export`: results as files that archives of neurophysiology take."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from vibrissa.cli.shared.options import Flag
from vibrissa.cli.shared.output import Json, print_json, tell
from vibrissa.cli.shared.progress import stage
from vibrissa.cli.shared.units import Duration, Rate

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.archive.export import Written
    from vibrissa.study.archive.export_session import SessionDetails


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class SessionOptions:
    """Description of a session that archives ask for.

    Attributes
    ----------
    start : str, optional
        When the session's clock was 0, with its zone: 2014-05-07T09:30:00+02:00. Must be given.
    age : str, optional
        Age of the animal: P90D is 90 days, P12W 12 weeks. Must be given.
    sex : str, optional
        M, F, O (other) or U (unknown). Must be given.
    subject : str, optional
        Name of the animal. Must be given where no table of sweeps names it.
    species : str, optional
        Latin name of the species; Rattus norvegicus if not given.
    session : str, optional
        Name of the session; that of the folder if not given.
    description : str, optional
        What was done; a sentence about what the folder holds if not given.
    animals : Path, optional
        CSV with the column animal and any of subject, age, sex, start, species, session, description: the same where
        it differs between the animals of the table of sweeps.
    """

    start: Annotated[str | None, Parameter(name="--session-start")] = None
    age: str | None = None
    sex: str | None = None
    subject: str | None = None
    species: str | None = None
    session: str | None = None
    description: str | None = None
    animals: Path | None = None

    def details(self) -> SessionDetails:
        """The options as the exporter takes them."""
        from vibrissa.study.archive.export_session import SessionDetails

        given = {name: value for name, value in vars(self).items() if name not in ("session", "animals")}
        return SessionDetails(name=self.session, **given)


NO_DETAILS = SessionOptions()


def export(
    folder: Path,
    *,
    out: Path,
    of: SessionOptions = NO_DETAILS,
    spikes: Path | None = None,
    trial_table: Path | None = None,
    command: Path | None = None,
    sampling_rate: Rate | None = None,
    pause: Duration = 1.0,
    overwrite: Flag = False,
    json: Json = False,
) -> None:
    """Results of any study as Neurodata Without Borders: tracks, modes, base signals, sweeps, units, stimulus.

    Each animal of a table of sweeps gets its own file. Recordings that are not on one clock are put on the
    session's, one after the other. Virtual data say so.

    Parameters
    ----------
    folder
        What `run` or `recordings` wrote; or a folder with datasets of `track`, `decompose`, `neural` and others.
    out
        NAME.nwb; or a folder, made if absent, where files are named as archives want it.
    spikes
        Spikes that are not in the folder: CSV with columns spike_time,unit, maybe trial; or a dataset.
    trial_table
        CSV with columns start,stop [s] and maybe stimulus: the trials of those spikes.
    command
        Command of `vibrissa replay`, presented in every trial.
    sampling_rate
        Samples per second of the recording that the spikes are from [Hz]. Must be given where they do not state it.
    pause
        Least time between two recordings that are put on one clock [s].
    overwrite
        Replace files that exist.
    """
    import warnings

    from vibrissa.study.archive.export import export_nwb
    from vibrissa.study.archive.export_session import read_animals

    animals = None if of.animals is None else read_animals(of.animals)
    with stage("writing NWB"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the format's library, on names of columns and the like
        written, left_out = export_nwb(
            folder,
            out,
            of.details(),
            animals=animals,
            extra=_extra(spikes, trial_table, command),
            sampling_rate=sampling_rate,
            pause=pause,
            overwrite=overwrite,
        )
    for why in dict.fromkeys(left_out.values()):
        tell(f"left out: {', '.join(name for name in left_out if left_out[name] == why)}: {why}")
    _show(written, left_out, json)


def _extra(spikes: Path | None, trials: Path | None, command: Path | None) -> dict[str, xr.Dataset]:
    """Datasets that are not in the folder."""
    from vibrissa.files import load
    from vibrissa.neural.io.tables.spike_csv import read_spikes
    from vibrissa.neural.io.tables.trials import read_trials
    from vibrissa.stimulus.export import read_command

    found: dict[str, xr.Dataset] = {}
    if spikes is not None:
        found["spikes"] = load(spikes) if spikes.suffix == ".nc" else read_spikes(spikes, all_trials=True)
    if trials is not None:
        found["trials"] = read_trials(trials)
    if command is not None:
        found["command"] = read_command(command)
    return found


def _show(written: list[Written], left_out: dict[str, str], json: bool) -> None:
    """Print what was written: a line for each file, or one JSON object."""
    if json:
        print_json({"files": [_row(one) for one in written], "left_out": left_out})
        return
    for one in written:
        holds = one.holds
        parts = [f"{len(holds['series'])} series", f"{len(holds['tables'])} tables"]
        parts += [f"{holds[name]} {name}" for name in ("sweeps", "rejected", "units", "trials") if holds[name]]
        print(f"{one.path}: {one.session.subject}, {', '.join(parts)}")


def _row(one: Written) -> dict[str, Any]:
    kept = {name: getattr(one.session, name) for name in ("subject", "session", "virtual")}
    return {"path": str(one.path), **kept, "start": one.session.start.isoformat(), **one.holds}
