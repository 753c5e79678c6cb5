"""What a run of a study would do, without doing it: stages, sizes, time, inputs and figures.

Times are those of one machine: seconds of processor time (``time.process_time`` around the stages of runs, compiled
code at hand, one core of 2.6 GHz) of the built-in experiment's film in images of 440 × 140 and of 880 × 280 pixels; of
four virtual sweeps of 3,500 frames over gratings of 0.35 m; of ``examples/robot.csv``; of surfaces of 0.35 and 1 m; of
13 and 26 simulated units with 40 trials, 26 with 100. Sixty virtual sweeps of 3,500 frames took 8 min 34 s, which
the plan meets within 3 %. Memory is the largest resident set of the same processes, sizes are those of their files.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from vibrissa.errors import InputError
from vibrissa.neural.population import COUNTS
from vibrissa.study.gallery import ONLY_WHERE_MADE, SURFACE, best_entry, missing, numbers
from vibrissa.study.laboratory import plan as planned_sweeps
from vibrissa.study.parts import Input, absent, expected, given, inputs, table_of
from vibrissa.study.recorded_sweeps import RecordedSweep
from vibrissa.study.repeated import RUNS
from vibrissa.study.settings import Film, MovieFile, Study
from vibrissa.study.surface import SAMPLING_RATE
from vibrissa.study.textures import Grating
from vibrissa.video.movie import open_movie

# What things cost, in seconds of processor time.
START = 2.0  # to load the program
TRACK_FRAME, TRACK_PIXEL = 0.35e-3, 16e-9  # decode and follow, per frame and per pixel of it
FILM_FRAME, FILM_PIXEL = 0.85e-3, 23e-9  # render and encode
FIT_FRAME = 0.5e-3  # decompose a profile and fit its modes
SWEEP_FRAME = 7.8 / 3500  # a virtual sweep: filmed, tracked, fitted by both forcings, posture and its errors
COMPARE = 0.5  # one sweep against its prediction and those of 39 new gratings
JITTER = 2.8  # one sweep whose prediction is disturbed
REPEAT_FRAME = 1.3e-3  # one more run of a sweep: filmed and tracked
SHOWN = 10.0  # the sweep that the figures show, and the figures of the model
MODEL = 3.0  # the figures of the model alone
BASE = 0.4  # one base signal
UNIT, UNIT_TRIAL = 0.125, 0.9e-3  # a simulated unit recorded and analysed, and each of its trials
SESSION = 5.0  # the motion that a simulated population is given
RECORDING = 5.0  # a recording of some twenty units
SCAN_SAMPLE = 2.2e-6  # one sample of a surface's scan
FIGURE = 0.9  # one figure of the report

# Sizes in bytes, of the same runs.
LOADED = 360e6  # a process with the program in it, at work
HELD_FRAME = 20e3  # a process holds per frame
MOVIE_PIXEL = 0.5  # of a lossless movie, with noise of 3 grey levels
PROFILE_FRAME = 8e3  # profile and modes of one whisker
SERIES_FRAME = 165.0  # the time series kept of a sweep
COMPARED = 20e3  # a comparison
SAMPLE = 281.0  # one sample of a surface's scan
REPORT_FIGURE = 0.2e6
UNITS, UNIT_SIZE = 0.15e6, 12e3  # a population, and each of its units

TRACKS = 3500  # frames that a track file is taken to have: only a movie tells its own


class Stage(NamedTuple):
    """One stage of a run: ``seconds`` of processor time; bytes in memory in one process, and on disk when done."""

    name: str
    tasks: int
    frames: int
    seconds: float
    memory: float
    written: float
    shared: bool = False


@dataclass(frozen=True)
class Plan:
    """What a run would do.

    Attributes
    ----------
    name : str
        The study's.
    given, absent : list of str
        Its parts, and those that it could have besides.
    inputs : list of Input
        Files that it reads.
    stages : list of Stage
        In the order of the work; of many sweeps those that are still to be done.
    figures, left_out : list of (str, str)
        Number, if it is the paper's, and heading of each figure; number and reason of each that cannot be.
    kept : int
        Sweeps that are there already.
    workers : int
        Processes that share the stages that can be shared.
    unstored : float
        What the movies would take that are filmed and tracked in memory [bytes].
    """

    name: str
    given: list[str]
    absent: list[str]
    inputs: list[Input]
    stages: list[Stage]
    figures: list[tuple[str, str]]
    left_out: list[tuple[str, str]]
    kept: int
    workers: int
    unstored: float

    @property
    def seconds(self) -> float:
        """Time by the clock [s]."""
        return sum(one.seconds / (min(self.workers, max(1, one.tasks)) if one.shared else 1) for one in self.stages)

    @property
    def memory(self) -> float:
        """Memory of all processes at once [bytes], at worst."""
        return max(one.memory * (min(self.workers, max(1, one.tasks)) if one.shared else 1) for one in self.stages)

    @property
    def written(self) -> float:
        """What is on disk in the end of this run [bytes]."""
        return sum(one.written for one in self.stages)


def plan_study(study: Study, *, kept: int = 0, workers: int = 1) -> Plan:
    """Plan a run; nothing is done and nothing written.

    Parameters
    ----------
    study : Study
        From :func:`vibrissa.study.settings.read_study`.
    kept : int
        Sweeps that are in the folder of results already.
    workers : int
        Processes.

    Raises
    ------
    InputError
        If the table of sweeps, or the laboratory, is bad.
    """
    figures, left_out = _figures(study)
    return Plan(
        name=study.name,
        given=given(study),
        absent=absent(study),
        inputs=inputs(study),
        stages=[*_stages(study, kept), _report(len(figures))],
        figures=figures,
        left_out=left_out,
        kept=kept,
        workers=workers,
        unstored=_unstored(study),
    )


def _unstored(study: Study) -> float:
    """Size of a laboratory's movies, a byte per pixel of its camera's field [bytes]."""
    if study.laboratory is None:
        return 0.0
    camera = study.laboratory.camera
    return float(sum(_sweeps(study)[0])) * camera.width * camera.height


def _figures(study: Study) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    results = dict.fromkeys(expected(study))
    made: list[tuple[str, str]] = []
    left_out: list[tuple[str, str]] = []
    for number in numbers():
        entry = best_entry(number, results)  # type: ignore[arg-type]
        reason = missing(entry, results)  # type: ignore[arg-type]
        if not reason:
            made.append((number, entry.heading))
        elif number not in ONLY_WHERE_MADE:
            left_out.append((number, reason))
    made += [("", SURFACE)] if study.only_surface else []
    return made + [("", f"Base signal: {one.label}") for one in study.base_signal], left_out


def _stages(study: Study, kept: int) -> list[Stage]:
    stages = [Stage("start", 1, 0, START, LOADED, 0)]
    if study.base_signal:
        count = len(study.base_signal)
        stages.append(Stage("base signals", count, 0, BASE * count, LOADED, 1e5 * count))
    if study.only_surface:
        stages.append(_scan(study))
    if study.laboratory is not None or study.sweeps is not None:
        stages += _many(study, kept)
    if study.film is not None:
        stages += _filmed(study.film)
    elif study.movie is not None:
        stages += _tracked(study, study.movie)
    return stages + _neurons(study)


def _neurons(study: Study) -> list[Stage]:
    stages = []
    if study.cortex is not None:
        units = -(-sum(count for count, _ in COUNTS[study.cortex.counts].values()) // study.cortex.every)
        seconds = units * (UNIT + UNIT_TRIAL * study.cortex.n_trials)
        stages = [
            Stage("stimulator", 1, 0, SESSION, LOADED, 0),
            Stage("simulated units", units, 0, seconds, LOADED, UNITS + UNIT_SIZE * units, shared=True),
        ]
    if count := len(study.neural):
        stages.append(Stage("recorded neurons", count, 0, RECORDING * count, LOADED, UNITS * count))
    return stages


def _scan(study: Study) -> Stage:
    if study.scan is None:
        raise ValueError("a surface needs a scan")
    length = study.texture.length if isinstance(study.texture, Grating) else 0.05  # a file's is known when it is read
    samples = SAMPLING_RATE * (length / study.scan.speed + 0.1)
    held = LOADED + SAMPLE * samples
    return Stage("scan of the surface", 1, 0, MODEL + SCAN_SAMPLE * samples, held, SAMPLE * samples + 5e5)


def _many(study: Study, kept: int) -> list[Stage]:
    """Sweeps that are still to be done, of mean length, and what follows of all."""
    each, seconds = _sweeps(study)
    count, frames = len(each), sum(each)
    share = max(0.0, 1 - kept / count) if count else 0.0
    left, longest = count - min(kept, count), max(each, default=0)
    compared = 0 if "comparison" not in expected(study) else left
    jitter = study.comparison.jitter if "jitter" in expected(study) else 0
    again = study.comparison.repeats if "repeats" in expected(study) else 0
    frames_again, held = RUNS * again * longest, LOADED + HELD_FRAME * longest
    cost = COMPARE * (1 + study.comparison.gratings) / 40
    stages = [
        Stage("sweeps", left, round(share * frames), share * seconds, held, share * SERIES_FRAME * frames, shared=True),
        Stage("comparison", compared, 0, cost * compared, LOADED, COMPARED * compared, shared=True),
        Stage(
            "repeated runs", again, frames_again, REPEAT_FRAME * frames_again, held, 16.0 * frames_again, shared=True
        ),
        Stage("jitter", jitter, 0, JITTER * jitter, LOADED, 1e4 * jitter),
        Stage("one sweep shown", 1, longest, SHOWN, 1e8 + held, PROFILE_FRAME * longest),
    ]
    return [one for one in stages if one.tasks]


def _sweeps(study: Study) -> tuple[list[int], float]:
    """Frames of each sweep, and processor time of all [s]."""
    if study.laboratory is not None:
        each = [study.laboratory.frames(one.scan.speed) for one in planned_sweeps(study.laboratory)[0]]
        return each, SWEEP_FRAME * sum(each)
    sizes = [_size_of(one) for one in table_of(study)]
    return [frames for frames, _ in sizes], sum(_tracking(*size) + FIT_FRAME * size[0] for size in sizes)


def _size_of(sweep: RecordedSweep) -> tuple[int, int]:
    """Frames of a sweep and pixels of one; of a track file, which has no pixels, a usual number of frames."""
    if sweep.movie is None:
        return TRACKS, 0
    try:
        about = open_movie(sweep.folder / sweep.movie)
    except InputError:  # the run will say so, and go on
        return 0, 0
    return about.frame_count, about.width * about.height


def _tracking(frames: int, pixels: int) -> float:
    return frames * (TRACK_FRAME + TRACK_PIXEL * pixels) if pixels else 0.0


def _filmed(film: Film) -> list[Stage]:
    frames, pixels = film.n_frames, film.camera.width * film.camera.height
    cost = frames * (FILM_FRAME + FILM_PIXEL * pixels)
    held = LOADED + HELD_FRAME * frames
    return [
        Stage("predicting", 1, 0, 1.5, LOADED, 220.0 * frames),
        Stage("filming", 1, frames, cost, held, MOVIE_PIXEL * frames * pixels),
        Stage("tracking", 1, frames, _tracking(frames, pixels), held, PROFILE_FRAME * frames),
        Stage("decomposing and fitting", 1, frames, FIT_FRAME * frames, 1e8 + held, 5e5),
    ]


def _tracked(study: Study, movie: MovieFile) -> list[Stage]:
    whiskers = max(1, len(movie.seeds), len(movie.whisking.marks) if movie.whisking else 0)
    try:
        about = open_movie(study.folder / movie.path)
    except InputError:  # told among the inputs
        return []
    frames, pixels = about.frame_count, about.width * about.height
    held, size = LOADED + HELD_FRAME * frames * whiskers, PROFILE_FRAME * frames * whiskers
    stages = [Stage("tracking", whiskers, frames, whiskers * _tracking(frames, pixels), held, size)]
    if study.whisker is not None and study.posture is not None:
        stages.append(Stage("decomposing and fitting", 1, frames, FIT_FRAME * frames, 1e8 + held, 3e3 * frames))
    return stages


def _report(figures: int) -> Stage:
    return Stage("report", figures, 0, 0.5 + FIGURE * figures, LOADED + 1e8, 1e5 + REPORT_FIGURE * figures)
