"""The process that computes the whole whisker; a scan that is no longer wanted is given up."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.mechanics.rod.rod_prediction import RodPrediction
from vibrissa.mechanics.rod.rod_scan import RodRun
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.page.shaft_table import NODE
from vibrissa.page.signals import POSITIONS, RATE, ScanRecord, quick_count
from vibrissa.page.whole.job import WholeJob, WholeScan
from vibrissa.sweep.processes import end_with_parent
from vibrissa.texture.surface import Gaps

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    import xarray as xr

    from vibrissa.arrays import Array

IDLE = 60.0  # [s] without work after which the process ends, so that its memory is free again
SAMPLED = 20_000.0  # [Hz] of a dataset, as `vibrissa scan`
MODES = 3


class UnwantedError(Exception):
    """Another scan is wanted."""


def serve(line: Connection) -> None:
    """Compute scan after scan, in its own process, until the other end of the pipe is closed or nothing is asked.

    Parameters
    ----------
    line : Connection
        Takes a number and a job; gives, with the same number, shares of what is done, and the scan or the error.
    """
    import signal

    from threadpoolctl import threadpool_limits

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process of the page
    end_with_parent()
    with suppress(EOFError, OSError), threadpool_limits(1):
        while line.poll(IDLE):
            number, job = line.recv()
            line.send((number, _answer(line, number, job)))


def _answer(line: Connection, number: int, job: WholeJob) -> Any:
    """The scan, the error, or None if it was given up."""

    def progress(done: int, every: int) -> None:
        line.send((number, done / every))
        if line.poll():
            raise UnwantedError

    try:
        return computed(job, progress)
    except UnwantedError:
        return None
    except Exception as error:  # the next one may go well
        return error


def computed(job: WholeJob, progress: Callable[[int, int], None] | None = None) -> Any:
    """One scan.

    Parameters
    ----------
    job : WholeJob
        What is wanted.
    progress : callable, optional
        Takes the records that are done, and all of them.

    Returns
    -------
    WholeScan or Dataset
        As the job says.

    Raises
    ------
    InputError, ConvergenceError
        As of :meth:`vibrissa.mechanics.rod.rod_prediction.RodPrediction.run`.
    """
    prediction = RodPrediction(job.whisker, job.posture, job.surface, job.scan, MODES)
    if job.sampled:
        return prediction.sampled(SAMPLED, [NODE], progress=progress)
    distance, last = np.array([NODE]), quick_count(len(prediction.times(RATE))) - 1
    points = 1 - distance / job.whisker.length
    run = prediction.run(RATE, points, duration=last / RATE, shapes=True, progress=progress)
    data = prediction.labelled(run, distance)
    return WholeScan(_record(prediction, run, data), _facts(prediction, run), str(data.verdict))


def _record(prediction: RodPrediction, run: RodRun, data: xr.Dataset) -> ScanRecord:
    length, moved = prediction.whisker.length, data.displacement.to_numpy()[:, 0]
    s, at = run.rod.shaft.s, run.record.shapes[:, :-1].reshape(run.time.size, -1, 2)  # from the contact on the flat
    some = slice(None, None, -(-len(run.time) // POSITIONS))
    x, y = np.moveaxis(length * (at[some] - at[0, -1]), 2, 0)
    return ScanRecord(
        excursion=-length * _contact(run, s, at[..., 0]),
        modes=data.mode_displacement.to_numpy() * length,
        curvature=data.base_curvature.to_numpy(),
        moment=data.base_moment.to_numpy(),
        displacement=moved - moved.mean(),
        shaft={"shaft": s, "shaft_x": x, "shaft_y": y, "shaft_time": run.time[some]},
    )


def _contact(run: RodRun, s: Array, x: Array) -> Array:
    """Where along the ground the contact nearest to the base is, over L (T,); NaN without contact."""
    place, count = run.record.contact[3], run.record.contact[4]
    after = np.clip(np.searchsorted(s, place), 1, s.size - 1)
    share, row = (place - s[after - 1]) / (s[after] - s[after - 1]), np.arange(len(x))
    return np.where(count > 0, (1 - share) * x[row, after - 1] + share * x[row, after], np.nan)


def _facts(prediction: RodPrediction, run: RodRun) -> dict[str, Any]:
    flat, length, surface = on_the_flat(prediction.posture), prediction.whisker.length, prediction.texture
    troughs = {"gaps": len(surface.width), "gap_depth": surface.depth} if isinstance(surface, Gaps) else {"gaps": 0}
    return {
        "model": "rod",
        "rate": RATE,
        "speed": prediction.scan.speed,
        "length": length,
        "contact": prediction.posture.contact,
        "tip": prediction.whisker.tip,
        "height": flat.base[1] * length,
        "distance": flat.base[0] * length,
        "frequency": prediction.resonances.tolist(),
        "rod_frequency": (run.rod.modes.kappa[:MODES] / (2 * np.pi * prediction.whisker.timescale)).tolist(),
        "timescale": prediction.whisker.timescale,
        **troughs,
    }
