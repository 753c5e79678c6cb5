"""The common motion of the whiskers of one pad from each frame to the next, δ(φ) = a + b (φ − φ₀)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.loops import njit

Values = NDArray[np.float64]
SHIFTS = np.arange(-16.0, 16.5, 0.5)  # a: common motion between two frames at the middle of the fan [°]
SPREADS = np.arange(-0.24, 0.25, 0.06)  # b: its growth along the fan
ALIKE = np.array([1.2, 3.0, 0.5])  # angle [°], offset [px], log density by which the same line may differ
CHANGE = np.array([3.5, 0.08])  # standard deviations of the changes of a [°] and b between frames
KEEP = 0.8  # share of the common motion that is expected again in the next frame
USUAL = 0.15  # standard deviation of b


@njit(cache=True)
def _agreement(here: Values, there: Values, shift: float, spread: float, centre: float) -> float:
    """How many lines, weighted by their density, are found again after a common motion."""
    total = 0.0
    for i in range(here.shape[0]):
        if not here[i, 2] > 0:
            break
        best = 0.0
        for j in range(there.shape[0]):
            if not there[j, 2] > 0:
                break
            u = (there[j, 0] - here[i, 0] - shift - spread * (here[i, 0] - centre)) / ALIKE[0]
            if abs(u) < 2.5:
                v = (there[j, 1] - here[i, 1]) / ALIKE[1]
                w = np.log(there[j, 2] / here[i, 2]) / ALIKE[2]
                best = max(best, np.exp(-0.5 * (u * u + v * v + w * w)))
        total += best * min(here[i, 2], 0.2) / 0.1
    return total


@njit(cache=True)
def common_motion(lines: Values, centre: float) -> Values:
    """Common motion from each frame to the next, a [°] and b: (T − 1, 2), by Viterbi over all frames.

    Parameters
    ----------
    lines : (T, n, 3) array
        Of :func:`vibrissa.video.identity.whisker_fan.fan_lines`.
    centre : float
        Middle of the fan φ₀ [°].

    Returns
    -------
    (T − 1, 2) array
        a [°] and b.
    """
    steps, m, n = lines.shape[0] - 1, SHIFTS.size, SPREADS.size
    score = np.zeros((m, n))
    came = np.zeros((steps, m, n, 2), np.int8)
    # best score of all motions up to each frame that end in (a, b), and the (a, b) of the frame before it
    for t in range(steps):
        before = score.copy()
        for i in range(m):
            for j in range(n):
                best = -np.inf if t else 0.0
                for k in range(m if t else 0):
                    du = (SHIFTS[i] - KEEP * SHIFTS[k]) / CHANGE[0]
                    for h in range(n if abs(du) < 3 else 0):
                        dv = (SPREADS[j] - KEEP * SPREADS[h]) / CHANGE[1]
                        value = before[k, h] - 0.5 * (du * du + dv * dv)
                        if value > best:
                            best = value
                            came[t, i, j, 0], came[t, i, j, 1] = k, h
                score[i, j] = best - 0.5 * (SPREADS[j] / USUAL) ** 2
                score[i, j] += _agreement(lines[t], lines[t + 1], SHIFTS[i], SPREADS[j], centre)
    motion = np.zeros((steps, 2))
    # back from the best end, each time to where its score came from
    best_of_all = int(np.argmax(score))
    i, j = best_of_all // n, best_of_all % n
    for t in range(steps - 1, -1, -1):
        motion[t] = SHIFTS[i], SPREADS[j]
        i, j = came[t, i, j]
    return motion
