"""The verb `export`: results as files that archives of neurophysiology take."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import Json, Out, print_json, tell
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.options import Flag
from vibrissa.cli.shared.recorded import ALL_TRIALS, MOTION, SignalOptions, TrialOptions
from vibrissa.cli.shared.words.refusals import in_options
from vibrissa.cli.shared.words.units import Duration, Rate
from vibrissa.errors import ConflictError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.archive.export import Written
    from vibrissa.study.archive.export_session import SessionDetails
    from vibrissa.study.spec.given import StimulusInput


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class SessionOptions:
    """Description of a session that archives require.

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
        Latin name of the species: Mus musculus. Must be given.
    session : str, optional
        Name of the session; that of the folder if not given.
    description : str, optional
        Description of the experiment; a sentence about the folder's contents by default.
    experimenter : list of str, optional
        Experimenter, as archives write names: "Doe, Jane"; once for each.
    institution : str, optional
        Where it was done.
    lab : str, optional
        Laboratory in which it was done.
    animals : Path, optional
        CSV with the column animal and any of subject, age, sex, start, species, session, description, institution, lab:
        the same where it differs between the animals of the table of sweeps.
    """

    start: Annotated[str | None, Parameter(name="--session-start")] = None
    age: str | None = None
    sex: str | None = None
    subject: str | None = None
    species: str | None = None
    session: str | None = None
    description: str | None = None
    experimenter: list[str] | None = None
    institution: str | None = None
    lab: str | None = None
    animals: Path | None = None

    def details(self) -> SessionDetails:
        """The options as the exporter takes them."""
        from vibrissa.study.archive.export_session import SessionDetails

        others = ("session", "animals", "experimenter")
        given = {name: value for name, value in vars(self).items() if name not in others}
        return SessionDetails(name=self.session, experimenter=tuple(self.experimenter or ()), **given)


NO_DETAILS = SessionOptions()


def export(
    folder: Path,
    *,
    out: Out,
    of: SessionOptions = NO_DETAILS,
    spikes: Path | None = None,
    trials: int | None = None,
    cut: TrialOptions = ALL_TRIALS,
    command: Path | None = None,
    stimulus: Path | None = None,
    whisker: str | None = None,
    signal: SignalOptions = MOTION,
    sampling_rate: Rate | None = None,
    pause: Duration = 1.0,
    overwrite: Flag = False,
    json: Json = False,
) -> None:
    """Write results of any study as NWB: tracks, modes, base signals, sweeps, units, stimulus.

    Each animal of a table of sweeps gets its own file. Recordings that are not on one clock are put on the
    session's, one after the other. Virtual data say so.

    Parameters
    ----------
    folder
        What `run` or `recordings` wrote; or a folder with datasets of `track`, `decompose`, `neural` and others.
    out
        NAME.nwb; or a folder, made if absent, where files are named as archives require.
    spikes
        Spikes that are not in the folder, in any format that `vibrissa neural` reads.
    trials
        Presentations, silent ones included, of those spikes; up to the last that has a spike if not given.
    command
        Command of `vibrissa replay`, or a table with a column for each whisker, presented in every trial.
    stimulus
        Instead, the stimulus of one whisker, or an envelope, as `vibrissa neural` reads it.
    whisker
        Channel of that stimulus that is taken.
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

    extra, remarks = _extra(spikes, trials, cut, _stimulus(command, stimulus, whisker, signal))
    animals = None if of.animals is None else read_animals(of.animals)
    with stage("writing NWB"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the format's library, on names of columns and the like
        written, left_out = export_nwb(
            folder,
            out,
            of.details(),
            animals=animals,
            extra=extra,
            sampling_rate=sampling_rate,
            pause=pause,
            overwrite=overwrite,
        )
    tell(*remarks)
    for why in dict.fromkeys(left_out.values()):
        tell(f"left out: {', '.join(name for name in left_out if left_out[name] == why)}: {in_options(why)}")
    _show(written, left_out, json)


def _stimulus(
    command: Path | None, stimulus: Path | None, whisker: str | None, signal: SignalOptions
) -> StimulusInput | None:
    """What was presented, if a file is given."""
    from vibrissa.study.spec.given import StimulusInput

    if command is not None and stimulus is not None:
        raise ConflictError("--stimulus", "must be left out where --command is given", str(stimulus))
    path = stimulus or command
    return None if path is None else StimulusInput(stimulus=str(path), whisker=whisker, **vars(signal))


def _extra(
    spikes: Path | None, trials: int | None, cut: TrialOptions, shown: StimulusInput | None
) -> tuple[dict[str, xr.Dataset], list[str]]:
    """Datasets that are not in the folder, and remarks on them."""
    from vibrissa.neural.io.tables.trials import read_trials
    from vibrissa.stimulus.export import read_command
    from vibrissa.study.neurons.inputs import read_session
    from vibrissa.study.neurons.session_stimuli import cut_stimulus
    from vibrissa.study.neurons.stimuli import SESSION, is_command, read_stimulus
    from vibrissa.study.spec.given import SpikesInput

    found: dict[str, xr.Dataset] = {}
    remarks: list[str] = []
    if shown is not None and shown.whisker is None and is_command(Path(shown.stimulus)):
        found["stimulus"] = read_command(shown.stimulus)
    elif shown is not None:
        found["stimulus"], remarks = read_stimulus(shown, channels=shown.whisker is None, named=False)
    time = found["stimulus"].time.values if shown is not None else None
    if spikes is not None:
        length = None if time is None else float(time[-1] - time[0])
        given = SpikesInput(spikes=str(spikes), trials=trials, **cut.words())
        found["spikes"], own, more = read_session(given, length=length)
        remarks = [*remarks, *more]
        if own is not None:
            found["trials"] = own
    elif (table := cut.words()["trial_table"]) is not None:
        found["trials"] = read_trials(table)
    if shown is not None and found["stimulus"].attrs.get("clock") == SESSION and "trials" in found:
        found["stimulus"], more = cut_stimulus(found["stimulus"], found["trials"], shown.stimulus)
        remarks = [*remarks, *more]
    return found, [in_options(line) for line in remarks]


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
