"""Correlation of envelopes against the jitter of the tip along the texture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.across.comparison import LARGEST_LAG
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict, predict_all
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Progress
from vibrissa.signals.correlation import best_correlation
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.sweeps.nuisance import slow_motion, wandered
from vibrissa.texture.surface import Gaps

if TYPE_CHECKING:
    import xarray as xr

RUNS = 5  # of the paper's Fig. 3E
JITTERS = (0.0, 25e-6, 50e-6, 100e-6, 200e-6, 400e-6, 800e-6, 1.2e-3, 1.6e-3)  # [m]
JITTER_TIMES = (0.2, 0.5, 1.0)  # [s]


def jittered(
    predictions: Sequence[Prediction],
    time: Array,
    *,
    rng: np.random.Generator,
    jitters: Sequence[float] = JITTERS,
    jitter_times: Sequence[float] = JITTER_TIMES,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Envelope of mode 1 of runs whose tip wanders along the texture, against the prediction without it.

    The paper explains ρ = 0.25 ± 0.15 by the phase that a minute displacement of the tip in the plane shifts. It also
    repeats runs: one correlates at 0.96 ± 0.05 with the mean of five. Jitter that differs from run to run shows in
    both.

    Parameters
    ----------
    predictions : sequence of Prediction
        What is disturbed, five runs each.
    time : (T,) array
        Even grid within the textures [s].
    rng : Generator
        Draws the motions.
    jitters : sequence of float
        Standard deviations of the motion [m].
    jitter_times : sequence of float
        Its shortest periods [s].
    progress : callable, optional
        Called with ("jitter", done, total).

    Returns
    -------
    Dataset
        ``jittered_correlation`` (jitter_time, jitter), with lags up to 50 ms, its standard deviation over runs and
        predictions, and ``jittered_repeat``: of the displacement of mode 1 of each run with the mean of the five. NaN
        where the tip would meet edges out of turn, or a gap that the posture cannot cross.
    """
    shape = len(jitter_times), len(jitters), len(predictions)
    rho, repeat = np.full((*shape, RUNS), np.nan), np.full((*shape, RUNS), np.nan)
    report = progress or (lambda *_: None)
    for k, prediction in enumerate(predictions):
        report("jitter", k, len(predictions))
        met: dict[tuple[int, int], list[Gaps]] = {}
        for cell in np.ndindex(*shape[:2]):
            runs = _met(prediction, jitters[cell[1]], jitter_times[cell[0]], rng)
            if runs is not None:
                met[cell[0], cell[1]] = runs
        motions = _motions(prediction, [texture for runs in met.values() for texture in runs], time)
        steady = analytic_envelope(prediction.mode_displacement(time)[0])[0]
        for cell, motion in zip(met, motions, strict=True):
            rho[*cell, k], repeat[*cell, k] = _agreement(motion, steady, (len(time) - 1) / (time[-1] - time[0]))
    report("jitter", len(predictions), len(predictions))
    flat = rho.reshape(*shape[:2], -1)
    return dataset(
        {"largest_lag": LARGEST_LAG, "runs": RUNS, "predictions": len(predictions)},
        jitter_time=np.array(jitter_times),
        jitter=np.array(jitters),
        jittered_correlation=flat.mean(axis=2),
        jittered_correlation_sd=flat.std(axis=2),
        jittered_repeat=repeat.reshape(*shape[:2], -1).mean(axis=2),
    )


def _met(prediction: Prediction, sd: float, shortest: float, rng: np.random.Generator) -> list[Gaps] | None:
    """Texture as each run meets it; none where that is out of turn, or a gap gets too wide for the posture."""
    span = prediction.end + shortest
    wanders = [slow_motion(sd, shortest, 2 * span, rng) for _ in range(RUNS)]
    try:
        met = [wandered(prediction.texture, prediction.scan.speed, wander) for wander in wanders]
        widest = np.array([max(float(one.width.max()) for one in met)])
        lone = Gaps(position=np.array([1e-3]), width=widest)
        predict(prediction.whisker, prediction.posture, lone, prediction.scan, n_modes=1)
    except (InputError, ConvergenceError):
        return None
    return met


def _motions(prediction: Prediction, met: list[Gaps], time: Array) -> Array:
    """Displacement of mode 1 of every run, (cells, runs, T), from tables made once."""
    many = predict_all(prediction.whisker, prediction.posture, met, prediction.scan, n_modes=1)
    return np.array([one.mode_displacement(time)[0] for one in many]).reshape(-1, RUNS, len(time))


def _agreement(motion: Array, steady: Array, rate: float) -> tuple[Array, Array]:
    """Correlations of each run's envelope with the prediction's, and of its motion with the mean of the runs."""
    max_lag, mean = int(LARGEST_LAG * rate + 1e-9), motion.mean(axis=0)
    rho = [best_correlation(one, steady, max_lag)[1] for one in analytic_envelope(motion)[0]]
    return np.array(rho), np.array([np.corrcoef(one, mean)[0, 1] for one in motion])


def reached(data: xr.Dataset, correlation: float = 0.25) -> Array:
    """Least jitter at which the correlation has fallen to a value [m], by straight lines, (jitter_time,); or NaN.

    Parameters
    ----------
    data : Dataset
        From :func:`jittered`.
    correlation : float
        The value.

    Returns
    -------
    (K,) array
        [m].
    """
    found = []
    for curve in data.jittered_correlation.values:
        below = np.flatnonzero(curve <= correlation)
        if not below.size or below[0] == 0:
            found.append(np.nan)
            continue
        pair = slice(below[0] - 1, below[0] + 1)
        found.append(float(np.interp(-correlation, -curve[pair], data.jitter.values[pair])))
    return np.array(found)
