"""The command line: one command per verb. Heavy imports stand inside the commands."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter

from vibrissa import __version__
from vibrissa.cli.coding import demodulation, drives, information
from vibrissa.cli.discriminate import discriminate
from vibrissa.cli.explore import explore
from vibrissa.cli.export import export
from vibrissa.cli.geometry import atlas, whisker
from vibrissa.cli.mechanics import gap, modes, profile
from vibrissa.cli.neural import neural
from vibrissa.cli.options import Json, Scheduler, Workers
from vibrissa.cli.output import progress_bars, show, stoppable, tell
from vibrissa.cli.pick import pick
from vibrissa.cli.replay import replay
from vibrissa.cli.results import base, figure, posture, sweeps
from vibrissa.cli.robustness import robustness
from vibrissa.cli.scan import scan, whisk
from vibrissa.cli.sort import sort
from vibrissa.cli.study import leave, plan_run
from vibrissa.cli.study import study as study_file
from vibrissa.cli.sweep import sweep
from vibrissa.cli.tracks import tracks
from vibrissa.cli.trials_needed import trials_needed
from vibrissa.cli.usage import usage_line
from vibrissa.cli.video import decompose, track
from vibrissa.cli.whisker_maps import glm, surround
from vibrissa.errors import ConvergenceError, InputError

app = App(
    name="vibrissa",
    help="From surface to spikes: how a rat's whisker feels fine texture.",
    version=__version__,
    default_parameter=Parameter(negative_iterable=()),
)


@app.command
def run(
    study: Path | None = None,
    *,
    out: Path = Path("vibrissa-out"),
    scale: Literal["small", "paper"] | None = None,
    scheduler: Scheduler = "processes",
    workers: Workers = None,
    dry_run: Annotated[bool, Parameter(negative="")] = False,
    json: Json = False,
) -> None:
    """Run a study: the main job. Without one, the built-in virtual experiment.

    A run that was stopped, by Ctrl-C or anything else, goes on where it was by the same command. Exit code 2: the input
    is bad, and nothing was made; 3: a part, or a sweep, could not be analysed, which report and screen tell, and the
    rest is there.

    Parameters
    ----------
    study
        Study file (TOML).
    out
        Folder for datasets and report; made if absent.
    scale
        Of the built-in experiment: small, the default, or the paper's (582 sweeps, 514 units; more than an hour).
    dry_run
        Do nothing, but say what would be done: stages, sizes, time, inputs, figures.
    """
    from vibrissa.study.settings import read_study
    from vibrissa.study.study import run_study
    from vibrissa.sweep.engine import Engine

    if study is not None and scale is not None:
        raise InputError("--scale", "must be left out where a study is given", scale, "it is the built-in experiment's")
    engine, told = Engine(scheduler=scheduler, workers=workers), read_study(study, scale or "small")
    if dry_run:
        return plan_run(told, out, engine.at_once, json)
    with stoppable(out), progress_bars() as progress:
        verdict = run_study(told, out, engine=engine, progress=progress)
    tell(f"the report is {out / 'report.html'}")
    show(verdict, None, json, None)
    leave(verdict)


for verb in (pick, track, tracks, decompose, modes, profile, gap, scan, whisk, whisker, atlas, sweep, replay, neural):
    app.command(verb)
app.command(sweeps)
app.command(base)
app.command(posture)
app.command(figure)
app.command(surround)
app.command(glm)
app.command(demodulation)
app.command(drives)
app.command(information)
app.command(discriminate)
app.command(sort)
app.command(robustness)
app.command(trials_needed)
app.command(explore)
app.command(export)
app.command(study_file, name="study")


def main() -> None:
    """Run the command line; bad input is one line on stderr and exit code 2."""
    try:
        app(sys.argv[1:], print_error=False, exit_on_error=False)
    except CycloptsError as error:
        _refuse(usage_line(error, sys.argv[1:]))
    except InputError as error:
        _refuse(f"{_as_typed(error.thing, sys.argv[1:])} {error.said}")
    except ConvergenceError as error:
        _refuse(str(error))
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # who reads our output has heard enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)


def _refuse(line: str) -> None:
    tell(line)
    sys.exit(2)


def _as_typed(thing: str, words: list[str]) -> str:
    """The option that was typed, where the package's own name of a thing (``Posture.base_angle``) is that of one."""
    name = thing.rpartition(".")[2].removesuffix("[0]").replace("_", "-").replace(" ", "-")
    typed = {word.partition("=")[0] for word in words}
    options = ("--count",) if name == "number-of-modes" else (f"--{name}", f"--scan-{name}", f"--whisker.{name}")
    return next((option for option in options if option in typed), thing)
