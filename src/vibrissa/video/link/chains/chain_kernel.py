"""One whisker over time, given where the pad is: probabilities of its lines by the forward-backward algorithm.

The deviation of a whisker from its place in the pad is a stationary process that forgets: over g frames its
correlation is ρ^g. A whisker is seen as one line, is missed for up to ``REACH − 1`` frames, or is lost, and then
comes back anywhere in its stationary distribution.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vibrissa.video.link.pad.common_swing import REACH, _inverse

Values = NDArray[np.float64]
Places = NDArray[np.int64]
TAILS = 6.0  # degrees of freedom of Student's t: pads do not keep to a Gaussian
LOSE, RETURN = np.log(0.01), np.log(0.1)  # chance per frame that a whisker is lost, and that a lost one is back
STAY = np.log(0.9)  # that it stays lost
LEAVES = 4.0  # negative logarithm of the chance that a name leaves a plain stretch of lines, or comes into one


@njit(cache=True)
def log_density(x: Values, cov: Values) -> float:
    """Logarithm of Student's t of three dimensions."""
    w = _inverse(cov)
    det = (
        cov[0, 0] * (cov[1, 1] * cov[2, 2] - cov[1, 2] ** 2)
        - cov[0, 1] * (cov[0, 1] * cov[2, 2] - cov[1, 2] * cov[0, 2])
        + cov[0, 2] * (cov[0, 1] * cov[1, 2] - cov[1, 1] * cov[0, 2])
    )
    far = x @ (w @ x)
    return -0.5 * np.log(det) - 1.5 * np.log(2 * np.pi) - 0.5 * (TAILS + 3) * np.log(1 + far / TAILS)


@njit(cache=True)
def stationary(x: Values, cov: Values, spread: Values) -> Values:
    """Log density of each deviation (n, 3) of covariance (n, 3, 3) in the stationary distribution."""
    out = np.empty(x.shape[0])
    for i in range(x.shape[0]):
        out[i] = log_density(x[i], cov[i] + spread)
    return out


@njit(cache=True)
def edges(
    seen: Places, when: Places, x: Values, cov: Values, spread: Values, keep: float, before: Places, after: Places
) -> tuple[Places, Places, Values]:
    """Steps between candidates up to ``REACH`` frames apart: from, to, log density; sorted by the latter.

    ``seen`` are the candidates, ``when`` the frames of all segments, ``before`` and ``after`` the segments that plainly
    precede and follow each candidate, −1 for none. A line in between, of a frame that the plain link skips, is free.
    """
    frame = when[seen]
    start, stop, value = [], [], []
    low = 0
    for j in range(frame.size):
        while frame[low] < frame[j] - REACH:
            low += 1
        for i in range(low, j):
            g = frame[j] - frame[i]
            if g == 0:
                break
            k = keep**g
            there = log_density(x[j] - k * x[i], spread * (1 - k * k) + cov[j] + k * k * cov[i])
            if after[i] != seen[j]:
                there -= LEAVES * (after[i] >= 0 and frame[j] >= when[after[i]])
                there -= LEAVES * (before[j] >= 0 and frame[i] <= when[before[j]])
            start.append(i)
            stop.append(j)
            value.append(there)
    return np.array(start), np.array(stop), np.array(value)


@njit(cache=True)
def _plus(a: float, b: float) -> float:
    """Logarithm of the sum of two exponentials."""
    if a < b:
        a, b = b, a
    return a + np.log1p(np.exp(b - a)) if b > -np.inf else a


@njit(cache=True)
def chances(
    frames: int,
    frame: Places,
    gain: Values,
    again: Values,
    leaves: Values,
    start: Places,
    stop: Places,
    step: Values,
    missed: float,
) -> Values:
    """Probability of each candidate to be this whisker's line.

    Parameters
    ----------
    frames : int
        Frames of the movie.
    frame : (n,) array
        Frame of each candidate, ascending.
    gain : (n,) array
        Logarithm of what each candidate is worth against a line that is no whisker, but for its place.
    again : (n,) array
        Log density in the stationary distribution, where it comes back.
    leaves : (n,) array
        Logarithm of the chance that the name is lost after each candidate.
    start, stop, step : (m,) arrays
        Of :func:`edges`.
    missed : float
        Logarithm of the chance that a whisker has no line in a frame.

    Returns
    -------
    (n,) array
        Probabilities; of a frame they add up to 1 less that of no line.
    """
    n = frame.size
    forward, backward = np.full(n, -np.inf), np.full(n, -np.inf)
    lost = np.zeros(frames + 1)  # up to frame t − 1
    c, e = 0, 0
    for t in range(frames):
        out = lost[t] + STAY
        while c < n and frame[c] == t:
            best = lost[t] + RETURN + again[c]
            while e < stop.size and stop[e] == c:
                i = start[e]
                best = _plus(best, forward[i] + (t - frame[i] - 1) * missed + step[e])
                e += 1
            forward[c] = best + gain[c]
            out = _plus(out, forward[c] + leaves[c])
            c += 1
        lost[t + 1] = out
    rest = np.zeros(frames + 1)  # from frame t on, lost before
    c, e = n - 1, stop.size - 1
    for t in range(frames - 1, -1, -1):
        out = rest[t + 1] + STAY
        while c >= 0 and frame[c] == t:
            backward[c] = _plus(backward[c], rest[t + 1] + leaves[c])
            out = _plus(out, RETURN + again[c] + gain[c] + backward[c])
            while e >= 0 and stop[e] == c:
                i = start[e]
                backward[i] = _plus(backward[i], (t - frame[i] - 1) * missed + step[e] + gain[c] + backward[c])
                e -= 1
            c -= 1
        rest[t] = out
    return np.exp(forward + backward - rest[0])
