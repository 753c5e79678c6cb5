"""The verbs that run a study: `run`, of a study file, and `recordings`, of a table of recorded sweeps."""

from __future__ import annotations

import json as json_text
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from vibrissa.cli.shared.display.output import Json, Out, say, show, tell
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.cli.shared.display.tables import hanging, wrapped
from vibrissa.cli.shared.options import Flag, Scheduler, Workers
from vibrissa.cli.shared.stoppable import stoppable
from vibrissa.errors import ConflictError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.spec.settings import Study

NOT_ALL = 3  # exit code: the rest is done
ROOM = 70  # columns of 80 that a line on stderr has for its text
STAGES = ("vibrissa.study.stages.stages",)  # what the processes of a run import while this one does
FEW = 10  # sweeps, or whiskers, of which each has a line on the screen
MAIN = {  # columns of these tables that fit a line
    "sweep": ("whisker_name", "contact", "first_resonance", "first_damping", "first_correlation"),
    "whisker": ("frames", "frames_followed", "median_length"),
}


def run(
    study: Path | None = None,
    *,
    out: Out = Path("vibrissa-out"),
    scale: Literal["small", "paper"] | None = None,
    scheduler: Scheduler = "processes",
    workers: Workers = None,
    dry_run: Flag = False,
    json: Json = False,
) -> None:
    """Run a study; without a study file, the built-in virtual experiment.

    A run that was stopped, by Ctrl-C or anything else, is continued by the same command. Exit code 2: the input is bad,
    and nothing was made; 3: a part, or a sweep, could not be analysed: report and screen give the reason, and the rest
    is there.

    Parameters
    ----------
    study
        Study file (TOML).
    out
        Folder for datasets and report; made if absent.
    scale
        Size of the built-in experiment: small, the default, or the paper's (582 sweeps, 514 units; more than an hour).
    dry_run
        Print the plan only: stages, sizes, time, inputs, figures.
    """
    if study is not None and scale is not None:
        rule = "must be left out where a study is given"
        raise ConflictError("--scale", rule, scale, "it is the built-in experiment's")
    from vibrissa.study.spec.settings import read_study
    from vibrissa.sweep.engine import Engine, staffed

    engine, settings = Engine(scheduler=scheduler, workers=workers), read_study(study, scale or "small")
    if dry_run:
        return plan_run(settings, out, engine.at_once, json)
    many = settings.laboratory or settings.sweeps or settings.cortex
    with stoppable(out), progress_bars(whole=True) as progress, staffed(engine, STAGES if many else None) as engine:
        progress("start", 0, 0)
        from vibrissa.study.run.study import run_study

        found = run_study(settings, out, engine=engine, progress=progress)
    report_end(found, out, json)


def recordings(
    table: Path,
    *,
    out: Out,
    gratings: int = 39,
    jitter: int = 0,
    scheduler: Scheduler = "processes",
    workers: Workers = None,
    json: Json = False,
) -> None:
    """Analyse the recorded sweeps of a table: posture, modes, resonances, prediction and measurement, report.

    A sweep that cannot be analysed is reported with its reason, and the others are analysed; the exit code is then 3.
    Started again with the same --out, the run continues where it was stopped.

    Parameters
    ----------
    table
        CSV, a line for each sweep: movie or track, animal, whisker, texture, scan_speed and what else is known; see the
        page on study files.
    out
        Folder for datasets and report; made if absent.
    gratings
        Number of new gratings of the textures' statistics whose predictions give the correlation by chance.
    jitter
        Number of sweeps whose prediction is disturbed by jitter of the tip.
    """
    from vibrissa.study.run.study import run_study
    from vibrissa.study.spec.comparison import Comparison
    from vibrissa.study.spec.settings import Study
    from vibrissa.sweep.engine import Engine

    engine = Engine(scheduler=scheduler, workers=workers)
    how = Comparison(gratings=gratings, jitter=jitter)
    study = Study(name=f"Sweeps of {table.name}", sweeps=table.name, comparison=how, folder=table.parent)
    with stoppable(out), progress_bars(whole=True) as progress:
        found = run_study(study, out, engine=engine, progress=progress)
    report_end(found, out, json)


def plan_run(study: Study, out: Path, workers: int, json: bool) -> None:
    """Print what a run would do; refuse it, in the end, if an input is missing. Nothing is written.

    Parameters
    ----------
    study : Study
        The study.
    out : Path
        Folder of its results.
    workers : int
        Processes or threads that it would have.
    json : bool
        As JSON, or as lines.

    Raises
    ------
    InputError
        If an input is missing, or the folder holds results of another study.
    """
    from vibrissa.study.run.plan import plan_study
    from vibrissa.study.run.plan_summary import plan_dataset, plan_lines
    from vibrissa.study.run.provenance import earlier_results
    from vibrissa.study.spec.parts import refuse_missing

    plan = plan_study(study, kept=_kept(study, out), workers=workers)
    if json:
        show(plan_dataset(plan), json=True)
    else:
        say(hanging(plan_lines(plan)))
    refuse_missing(plan.inputs)
    earlier_results(study, out)  # refuses a folder with those of another study


def _kept(study: Study, out: Path) -> int:
    """Sweeps of the study that are in the folder of results already."""
    from vibrissa.study.sweeps.sweeps import FOLDER, kept_sweeps, study_jobs

    return kept_sweeps(study_jobs(study), out) if (out / FOLDER).is_dir() else 0


def report_end(found: xr.Dataset, out: Path, json: bool) -> None:
    """Print what a run has found: its headlines, or everything as JSON; say where the rest is.

    Parameters
    ----------
    found : Dataset
        From :func:`vibrissa.study.run.study.run_study`.
    out : Path
        Folder of the results.
    json : bool
        As JSON, or as headlines and tables.
    """
    if json:
        show(found, json=True)
    else:
        done, *lines = json_text.loads(found.attrs["headlines"])
        tell(*wrapped(done, ROOM, 0))
        say(lines)
        for name in set(MAIN) & {str(dim) for dim, size in found.sizes.items() if size <= FEW}:
            show(found, MAIN[name])
    tell(f"the report is {out / 'report.html'}; --json prints its whole table")
    leave(found)


def leave(found: xr.Dataset) -> None:
    """Report what a run could not fit, and what it could not analyse; then the exit code is 3.

    Parameters
    ----------
    found : Dataset
        From :func:`vibrissa.study.run.study.run_study`.
    """
    tell(*(line[:1].lower() + line[1:].rstrip(".") for line in json_text.loads(found.attrs.get("not_fitted", "[]"))))
    lines = json_text.loads(found.attrs["not_analysed"])
    tell(*(f"not analysed: {line}" for line in lines))
    if lines:
        sys.exit(NOT_ALL)
