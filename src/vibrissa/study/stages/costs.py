"""What the stages of a study cost, from its sizes and the prices: processor time, memory and disk."""

from __future__ import annotations

from typing import NamedTuple

from vibrissa.neural.simulated.population import COUNTS
from vibrissa.study.forward.surface import SAMPLING_RATE
from vibrissa.study.spec.parts import every_by_modes
from vibrissa.study.spec.textures import Grating
from vibrissa.study.stages import prices
from vibrissa.study.stages.sizes import Sizes
from vibrissa.study.sweeps.repeats import RUNS


class Cost(NamedTuple):
    """What one stage costs.

    Attributes
    ----------
    tasks, frames : int
        Pieces of work, and frames of movies.
    seconds : float
        Processor time [s].
    memory, written : float
        In one process, and on disk when done [bytes].
    shared : bool
        Whether processes share the tasks.
    """

    tasks: int
    frames: int
    seconds: float
    memory: float
    written: float
    shared: bool = False


def start(sizes: Sizes) -> Cost:
    """Cost of loading the program.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    return Cost(1, 0, prices.START, prices.LOADED, 0)


def base_signals(sizes: Sizes) -> Cost:
    """Cost of the base signals of a study.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    count = len(sizes.study.base_signal)
    return Cost(count, 0, prices.BASE * count, prices.LOADED, 1e5 * count)


def surface(sizes: Sizes) -> Cost | None:
    """Cost of the scan of a surface.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost or None
        Tasks, frames, time, memory and disk; None where there is nothing to do.
    """
    study = sizes.study
    if study.scan is None:
        return None
    length = study.texture.length if isinstance(study.texture, Grating) else 0.05  # a file's is known when it is read
    samples = SAMPLING_RATE * (length / study.scan.speed + 0.1)
    held = prices.SAMPLE * samples
    return Cost(1, 0, prices.SCAN_SAMPLE * samples, prices.LOADED + held, held)


def sweeps(sizes: Sizes) -> Cost | None:
    """Cost of the sweeps that are not stored yet, of mean length.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost or None
        Tasks, frames, time, memory and disk; None where there is nothing to do.
    """
    each, seconds = sizes.sweeps
    if not sizes.left:
        return None
    share, frames = max(0.0, 1 - sizes.kept / len(each)), sum(each)
    held = prices.LOADED + prices.HELD_FRAME * sizes.longest
    return Cost(
        sizes.left, round(share * frames), share * seconds, held, share * prices.SERIES_FRAME * frames, shared=True
    )


def comparison(sizes: Sizes) -> Cost | None:
    """Cost of prediction against measurement.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost or None
        Tasks, frames, time, memory and disk; None where there is nothing to do.
    """
    if not sizes.left:
        return None
    cost = prices.COMPARE * (1 + sizes.study.comparison.gratings) / 40
    tasks = sizes.left + min(sizes.of_rod, sizes.left)  # what is measured, and what is true
    return Cost(tasks, 0, cost * tasks, prices.LOADED, prices.COMPARED * tasks, shared=True)


def repeats(sizes: Sizes) -> Cost:
    """Cost of sweeps that are run again and again.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    count, held = sizes.study.comparison.repeats, prices.LOADED + prices.HELD_FRAME * sizes.longest
    frames = RUNS * count * sizes.longest
    seconds = prices.REPEAT_FRAME * frames * (2 if every_by_modes(sizes.study) else 1) + sizes.rod_time(frames)
    return Cost(count, frames, seconds, held, 32.0 * frames, shared=True)


def jitter(sizes: Sizes) -> Cost:
    """Cost of predictions that are disturbed.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    count = sizes.study.comparison.jitter
    return Cost(count, 0, prices.JITTER * count, prices.LOADED, 1e4 * count)


def sweep_shown(sizes: Sizes) -> Cost:
    """Cost of the sweep that the figures show.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    held = prices.LOADED + prices.HELD_FRAME * sizes.longest
    return Cost(1, sizes.longest, prices.SHOWN, 1e8 + held, prices.PROFILE_FRAME * sizes.longest)


def model_figures(sizes: Sizes) -> Cost:
    """Cost of the figures of the model.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    return Cost(1, 0, prices.MODEL, prices.LOADED, 5e5)


def predicting(sizes: Sizes) -> Cost:
    """Cost of the motion that is filmed.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    return Cost(1, 0, 1.5, prices.LOADED, 220.0 * sizes.movie[0])


def filming(sizes: Sizes) -> Cost:
    """Cost of rendering and encoding a virtual movie.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    frames, pixels = sizes.movie
    cost = frames * (prices.FILM_FRAME + prices.FILM_PIXEL * pixels)
    return Cost(1, frames, cost, prices.LOADED + prices.HELD_FRAME * frames, prices.MOVIE_PIXEL * frames * pixels)


def tracking(sizes: Sizes) -> Cost | None:
    """Cost of decoding a movie and following its whiskers.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost or None
        Tasks, frames, time, memory and disk; None where there is nothing to do.
    """
    (frames, pixels), movie = sizes.movie, sizes.study.movie
    if not frames:
        return None
    whiskers = 1 if movie is None else max(1, len(movie.seeds), len(movie.whisking.marks) if movie.whisking else 0)
    held, size = prices.LOADED + prices.HELD_FRAME * frames * whiskers, prices.PROFILE_FRAME * frames * whiskers
    return Cost(whiskers, frames, whiskers * prices.tracking_time(frames, pixels), held, size)


def fitting(sizes: Sizes) -> Cost | None:
    """Cost of decomposing a profile and fitting its modes.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost or None
        Tasks, frames, time, memory and disk; None where there is nothing to do.
    """
    frames, tracked = sizes.movie[0], tracking(sizes)
    if tracked is None:
        return None
    written = 5e5 if sizes.study.film is not None else 3e3 * frames
    return Cost(1, frames, prices.FIT_FRAME * frames, 1e8 + tracked.memory, written)


def stimulator(sizes: Sizes) -> Cost:
    """Cost of the motion that a simulated population is given.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    return Cost(1, 0, prices.SESSION, prices.LOADED, 0)


def simulated_units(sizes: Sizes) -> Cost | None:
    """Cost of a simulated population.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost or None
        Tasks, frames, time, memory and disk; None where there is nothing to do.
    """
    cortex = sizes.study.cortex
    if cortex is None:
        return None
    units = -(-sum(count for count, _ in COUNTS[cortex.counts].values()) // cortex.every)
    seconds = units * (prices.UNIT + prices.UNIT_TRIAL * cortex.n_trials)
    return Cost(units, 0, seconds, prices.LOADED, prices.UNITS + prices.UNIT_SIZE * units, shared=True)


def recorded_neurons(sizes: Sizes) -> Cost:
    """Cost of recorded neurons.

    Parameters
    ----------
    sizes : Sizes
        Of the study.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    count = len(sizes.study.neural)
    return Cost(count, 0, prices.RECORDING * count, prices.LOADED, prices.UNITS * count)


def report(figures: int) -> Cost:
    """Cost of a report with a number of figures.

    Parameters
    ----------
    figures : int
        Number of figures.

    Returns
    -------
    Cost
        Tasks, frames, time, memory and disk.
    """
    return Cost(figures, 0, 0.5 + prices.FIGURE * figures, prices.LOADED + 1e8, 1e5 + prices.REPORT_FIGURE * figures)
