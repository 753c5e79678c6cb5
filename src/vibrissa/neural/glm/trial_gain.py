"""Gain of each trial: how much the rate of a unit varies as a whole from presentation to presentation."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import gammaln

from vibrissa.arrays import Array
from vibrissa.neural.glm.poisson import poisson_regression
from vibrissa.neural.glm.trial_design import TrialDesign

_LEAST, _MOST = 1e-5, 10.0  # variance of the gain that is looked for; below the least there is none
_ROUNDS = 20
_SAME = 0.02  # relative change of the variance at which the rounds end: far below its own error


def trial_gain_variance(design: TrialDesign, counts: Array, width: float, penalty: Array) -> float:
    """Variance of most likelihood of a factor on the rate of each trial, gamma distributed about 1.

    Without it the unit's own past explains the gain: a spike says that the trial is a good one. Kernels of the past
    are then too high and those of the stimulus too low, and more trials do not mend it. Coefficients and variance are
    fitted in turn.

    Parameters
    ----------
    design : TrialDesign
        Columns.
    counts : (N, K) array
        Spikes of each trial and bin.
    width : float
        Width of a bin [s].
    penalty : (P + Q,) array
        As in :func:`vibrissa.neural.glm.poisson.poisson_regression`.

    Returns
    -------
    float
        0 where trials differ no more than Poisson counts do, where there is one trial, and where the unit's past is
        not among the columns, so that no gain can be taken for it.
    """
    fired = counts.sum(1)
    if fired.size < 2 or not design.own.size:
        return 0.0
    mean = fired.mean()
    found, fit = max(float(fired.var(ddof=1) - mean) / mean**2, 0.0), None
    for _ in range(_ROUNDS):
        start = None if fit is None else fit.coefficients
        fit = poisson_regression(design, counts, width, penalty=penalty, start=start, gain_variance=found)
        before, found = found, _most_likely(fired, width * np.exp(design.log_rate(fit.coefficients)).sum(1))
        if abs(found - before) <= _SAME * found + _LEAST:
            break
    return found


def _most_likely(fired: Array, expected: Array) -> float:
    """Variance of most likelihood, given the counts expected of each trial at a gain of 1."""

    def loss(log_variance: float) -> float:
        r = np.exp(-log_variance)
        each = gammaln(fired + r) - gammaln(r) - fired * np.log(r) - (r + fired) * np.log1p(expected / r)
        return -float(each.sum())

    steady = float((expected).sum())  # the same, of a gain of 1
    best = minimize_scalar(loss, bounds=(np.log(_LEAST), np.log(_MOST)), method="bounded")
    return float(np.exp(best.x)) if best.fun < steady - 1e-6 else 0.0
