"""The verbs of results: `sweeps`, `base`, `posture` and `figure`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from vibrissa.cli.options import Atlas, Json, OfWhisker, Out, Scheduler, Workers, cone_of, needed_cone
from vibrissa.cli.output import progress_bars, show, stoppable, tell
from vibrissa.cli.pictures import Picture, refuse_picture, write_picture
from vibrissa.cli.points import line_of
from vibrissa.cli.study import leave
from vibrissa.cli.video import tracked_in
from vibrissa.errors import InputError


def sweeps(
    table: Path,
    *,
    out: Path,
    gratings: int = 39,
    jitter: int = 0,
    scheduler: Scheduler = "processes",
    workers: Workers = None,
    json: Json = False,
) -> None:
    """Many recorded sweeps, listed in a table: posture, modes, resonances, prediction against measurement, report.

    A sweep that cannot be analysed is told with its reason, and the others go on; the exit code is then 3. Started
    again with the same --out it goes on where it was stopped.

    Parameters
    ----------
    table
        CSV, a line for each sweep: movie or track, animal, whisker, texture, scan_speed and what else is known; see the
        page on study files.
    out
        Folder for datasets and report; made if absent.
    gratings
        New gratings of the textures' statistics whose predictions tell what correlation chance gives.
    jitter
        Sweeps whose prediction is disturbed by jitter of the tip.
    """
    from vibrissa.study.gratings import Comparison
    from vibrissa.study.settings import Study
    from vibrissa.study.study import run_study
    from vibrissa.sweep.engine import Engine

    engine = Engine(scheduler=scheduler, workers=workers)
    how = Comparison(gratings=gratings, jitter=jitter)
    study = Study(name=f"Sweeps of {table.name}", sweeps=table.name, comparison=how, folder=table.parent)
    with stoppable(out), progress_bars() as progress:
        lines = run_study(study, out, engine=engine, progress=progress)
    tell(f"the report is {out / 'report.html'}")
    show(lines, None, json, None)
    leave(lines)


def base(
    signal: Path,
    *,
    kind: Literal["moment", "curvature", "strain", "hall", "force"],
    unit: str,
    calibration: float | None = None,
    sampling_rate: float | None = None,
    column: str | None = None,
    rest: tuple[float, float] | None = None,
    guess: Annotated[list[float] | None, Parameter(negative="")] = None,
    count: int = 2,
    texture: Path | None = None,
    scan_speed: float | None = None,
    contact: float | None = None,
    base_angle: float | None = None,
    friction: float = 0.4,
    start: float = 0.0,
    gratings: int = 39,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    picture: Picture = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """A signal measured at a whisker's base, a robot's or an isolated one: resonance, damping, envelope.

    With texture, whisker, posture and speed also what the model predicts, and how well its envelope agrees.

    Parameters
    ----------
    signal
        Table (CSV) with a header, or .wav.
    kind
        What the sensor tells.
    unit
        Unit of the numbers, or of the reading (V), which needs a calibration; full scale of integers in a .wav.
    calibration
        N m (moment, hall), 1/m, strain or N per unit of the reading.
    sampling_rate
        Samples per second of a table without times [Hz].
    column
        Column of the table, or channel of the .wav from 1.
    rest
        Start and end of a time in which nothing touches the whisker [s]: its mean is zero.
    guess
        About where a resonance stands [Hz]; once for each. By default those of the whisker in its posture, or in air.
    count
        Resonances that are looked for, if they are not guessed.
    texture
        CSV of gaps.
    scan_speed
        Speed of the texture [m/s].
    contact
        Position of the contact along the shaft, over L.
    base_angle
        Angle of the shaft at the base to the substrate [rad].
    friction
        Coefficient of friction of the substrate.
    start
        When x = 0 of the texture meets the contact, in the file's time [s].
    gratings
        Shuffled textures whose predictions tell how well chance agrees.
    """
    from vibrissa.mechanics.profile import Posture
    from vibrissa.study.base_signals import BaseSignal, analyse_signal

    refuse_picture(picture)
    if (contact is None) != (base_angle is None):
        raise InputError("posture", "must have both --contact and --base-angle, or neither")
    posture = None
    if contact is not None and base_angle is not None:
        posture = Posture(contact=contact, base_angle=base_angle, friction=friction)
    entry = BaseSignal(
        path=str(signal.absolute()), kind=kind, unit=unit, calibration=calibration, sampling_rate=sampling_rate,
        column=column, rest=rest, guess=None if guess is None else tuple(guess), modes=count,
        whisker=cone_of(whisker, atlas), posture=posture, texture=None if texture is None else str(texture.absolute()),
        scan_speed=scan_speed, start=start, gratings=gratings, name=signal.stem,
    )  # fmt: skip
    found = analyse_signal(entry, Path())
    if picture is not None:
        from vibrissa.figures import base_signal

        write_picture(base_signal.draw(base_signal.compute(found)), picture)
    if found.attrs["absent"]:
        tell(found.attrs["absent"])
    show(found, [str(name) for name in found.data_vars if found[name].dims == ("mode",)], json, out)


def posture(
    profile: Path,
    *,
    which: int = 0,
    fit_friction: Annotated[bool, Parameter(negative="")] = False,
    friction: float = 0.4,
    substrate: list[str] | None = None,
    length_sd: float = 0.0,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    picture: Picture = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Contact, base angle and height of a tracked whisker, by Eq. 1 laid on its mean profile, with 95 % intervals.

    Parameters
    ----------
    profile
        Profile (.nc) from `track` or `tracks`.
    which
        Number of the whisker in the file, from 0.
    fit_friction
        Fit the coefficient of friction too; the answer may be that the profile cannot tell it.
    friction
        Coefficient of friction, if it is not fitted.
    substrate
        COLUMN,ROW of a point of the substrate's line [pixels]; twice.
    length_sd
        Standard deviation of the whisker's length [m].
    """
    from vibrissa.mechanics.stationary import fit_profile

    refuse_picture(picture)
    cone, tracked = needed_cone(whisker, atlas), tracked_in(profile)
    if "whisker" in tracked.dims:
        if not 0 <= which < tracked.sizes["whisker"]:
            raise InputError("--which", f"must be one of 0 to {tracked.sizes['whisker'] - 1}", which)
        tracked = tracked.isel(whisker=which)
    line = line_of(substrate, "--substrate")
    if line is not None:
        if "pixel_size" not in tracked.attrs:
            raise InputError("--substrate", f"must be left out: {profile} does not tell its pixel size")
        size = float(tracked.attrs["pixel_size"])
        (a, b), (c, d) = line
        line = (a * size, b * size), (c * size, d * size)
    mu = None if fit_friction else friction
    found = fit_profile(tracked, cone, substrate=line, friction=mu, length_sd=length_sd)
    if picture is not None:
        from vibrissa.figures import fig1

        write_picture(fig1.draw(fig1.compute(tracked, found, cone)), picture)
    told = found.attrs["friction_told"]
    tell(f"friction: {told}" if fit_friction else f"friction: {told}, {friction:g}; --fit-friction asks the profile")
    show(found, [str(name) for name in found.data_vars if not found[name].dims], json, out)


def figure(number: str, results: Path, *, out: Path) -> None:
    """Draw one of the paper's figures from the results of any study.

    Parameters
    ----------
    number
        1 to 9 as in the paper; 6ab and 7e for the model's panels.
    results
        Folder that `run` or `sweeps` wrote, or one dataset of it under the name that it has there (gap.nc); of several
        recordings the table of units of one (units_2.nc), for figure 8 too; for figure 9 a table of units of any name.
    out
        Picture to write: .png, .pdf or .svg.
    """
    refuse_picture(out, "--out")
    if not results.exists():
        raise InputError(str(results), "must be an existing folder or dataset")
    from vibrissa.study.gallery import figure_of

    write_picture(figure_of(number, results), out)
    tell(f"the figure is {out}")
