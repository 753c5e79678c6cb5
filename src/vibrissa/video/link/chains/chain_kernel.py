"""One whisker over time, given where the pad is: probabilities of its lines by the forward-backward algorithm.

The deviation of a whisker from its place in the pad is a stationary process that forgets: over g frames its
correlation is ρ^g. A whisker is seen as one line, is missed for up to ``REACH − 1`` frames, or is lost, and then
comes back anywhere in its stationary distribution.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.loops import njit
from vibrissa.video.link.pad.common_swing import REACH

Values = NDArray[np.float64]
Places = NDArray[np.int64]
Steps = tuple[Places, Places, Values]  # of :func:`edges`
TAILS = 6.0  # degrees of freedom of Student's t: pads do not keep to a Gaussian
LOSE, RETURN = np.log(0.01), np.log(0.1)  # chance per frame that a whisker is lost, and that a lost one is back
STAY = np.log(0.9)  # that it stays lost
LEAVES = 4.0  # negative logarithm of the chance that a name leaves a plain stretch of lines, or comes into one
TINY = 1e-300  # probability that counts as 0
AT_MIDDLE = (2 * np.pi) ** -1.5  # of the density, times the root of the covariance's determinant


@njit(cache=True)
def _density(x: float, y: float, z: float, a: float, b: float, c: float, d: float, e: float, f: float) -> float:
    """Student's t of three dimensions at (x, y, z), whose covariance has the rows (a, b, c), (b, d, e), (c, e, f)."""
    aa, bb, cc = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * aa + b * bb + c * cc
    far = x * x * aa + y * y * (a * f - c * c) + z * z * (a * d - b * b)
    far += 2 * (x * y * bb + x * z * cc + y * z * (b * c - a * e))
    return AT_MIDDLE / np.sqrt(det) * (1 + far / det / TAILS) ** (-0.5 * (TAILS + 3))


@njit(cache=True)
def near(x: Values, cov: Values, spread: Values, gate: float) -> tuple[Places, Values]:
    """Deviations (n, 3) of covariance (n, 3, 3) that are near a whisker in its stationary distribution.

    Those whose log density is less than ``gate`` below that of the mean: which, and that log density.
    """
    far = 1.001 * TAILS * (np.exp(2 * gate / (TAILS + 3)) - 1)  # square of a deviation beyond which none is
    s, which, value = spread, [], []
    for i in range(x.shape[0]):
        m = cov[i]
        if x[i, 1] * x[i, 1] > far * (m[1, 1] + s[1, 1]):
            continue
        first = m[0, 0] + s[0, 0], m[0, 1] + s[0, 1], m[0, 2] + s[0, 2]
        rest = m[1, 1] + s[1, 1], m[1, 2] + s[1, 2], m[2, 2] + s[2, 2]
        here = np.log(_density(x[i, 0], x[i, 1], x[i, 2], *first, *rest))
        if here > np.log(_density(0.0, 0.0, 0.0, *first, *rest)) - gate:
            which.append(i)
            value.append(here)
    return np.array(which, np.int64), np.array(value, np.float64)


@njit(cache=True)
def edges(
    seen: Places, when: Places, x: Values, cov: Values, spread: Values, keep: float, before: Places, after: Places
) -> tuple[Places, Places, Values]:
    """Steps between candidates up to ``REACH`` frames apart: from, to, density; sorted by the latter.

    ``seen`` are the candidates, ``when`` the frames of all segments, ``before`` and ``after`` the segments that plainly
    precede and follow each candidate, −1 for none. A line in between, of a frame that the plain link skips, is free.
    """
    frame, rare, s = when[seen], np.exp(-LEAVES), spread
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
            u, v, p, q = 1 - k * k, k * k, cov[i], cov[j]
            off = x[j, 0] - k * x[i, 0], x[j, 1] - k * x[i, 1], x[j, 2] - k * x[i, 2]
            first = (
                u * s[0, 0] + v * p[0, 0] + q[0, 0],
                u * s[0, 1] + v * p[0, 1] + q[0, 1],
                u * s[0, 2] + v * p[0, 2] + q[0, 2],
            )
            rest = (
                u * s[1, 1] + v * p[1, 1] + q[1, 1],
                u * s[1, 2] + v * p[1, 2] + q[1, 2],
                u * s[2, 2] + v * p[2, 2] + q[2, 2],
            )
            there = _density(*off, *first, *rest)
            if after[i] != seen[j]:
                there *= rare if after[i] >= 0 and frame[j] >= when[after[i]] else 1.0
                there *= rare if before[j] >= 0 and frame[i] <= when[before[j]] else 1.0
            start.append(i)
            stop.append(j)
            value.append(there)
    return np.array(start), np.array(stop), np.array(value)


@njit(cache=True)
def _forward(
    frames: int, frame: Places, worth: Values, back: Values, gone: Values, skip: Values, steps: Steps
) -> tuple[Values, Values, Values, float]:
    """Chances up to each candidate, and to be lost all through each frame; logarithms of divisors, and of all ways."""
    start, stop, step = steps
    forward, away, divided = np.zeros(frame.size), np.zeros(frames), np.zeros(frames + 1)
    ratio = np.ones(REACH + 1)  # of what frame t − g and frame t have been divided by, at g
    lost, c, e = 1.0, 0, 0  # up to frame t − 1
    for t in range(frames):
        out, total = lost * np.exp(STAY), 0.0
        away[t] = out
        while c < frame.size and frame[c] == t:
            best = lost * back[c]
            while e < stop.size and stop[e] == c:
                g = t - frame[start[e]]
                best += forward[start[e]] * ratio[g] * skip[g] * step[e]
                e += 1
            forward[c] = best * worth[c]
            out += forward[c] * gone[c]
            total += forward[c]
            c += 1
        total += out
        ratio[2:] = ratio[1:-1] / total
        ratio[1] = 1 / total
        lost, divided[t + 1] = out / total, divided[t] + np.log(total)
    return forward, away, divided, np.log(lost) + divided[frames]


@njit(cache=True)
def _backward(
    frames: int, frame: Places, worth: Values, back: Values, gone: Values, skip: Values, steps: Steps
) -> tuple[Values, Values, Values]:
    """Chances from each candidate on, from each frame on if lost before, and logarithms of what they are divided by."""
    start, stop, step = steps
    backward, coming, divided = np.zeros(frame.size), np.ones(frames + 1), np.zeros(frames + 1)
    rest, c, e = 1.0, frame.size - 1, stop.size - 1  # from frame t on, lost before
    for t in range(frames - 1, -1, -1):
        out, total = rest * np.exp(STAY), 0.0
        while c >= 0 and frame[c] == t:
            backward[c] += rest * gone[c]
            out += back[c] * worth[c] * backward[c]
            while e >= 0 and stop[e] == c:
                g = t - frame[start[e]]
                backward[start[e]] += skip[g] * step[e] * worth[c] * backward[c]
                e -= 1
            total += backward[c]
            c -= 1
        total += out
        k = c
        while k >= 0 and frame[k] >= t - REACH:  # what has come to earlier frames already
            backward[k] /= total
            k -= 1
        rest, divided[t] = out / total, divided[t + 1] + np.log(total)
        coming[t] = rest
    return backward, coming, divided


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
) -> tuple[Values, Values]:
    """Probability of each candidate to be this whisker's line, and its log odds.

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
    (n,) array, (n,) array
        Probabilities; of a frame they add up to 1 less that of no line. And their log odds, also where these are so
        large that the probability is 1.
    """
    skip = np.exp(missed * np.maximum(np.arange(REACH + 1) - 1, 0))
    steps = (start, stop, step)
    worth = np.exp(gain)
    given = frames, frame, worth, np.exp(RETURN + again), np.exp(leaves), skip, steps
    # the values of each frame are divided by their sum; the logarithms of these divisors add up
    forward, away, ahead, whole = _forward(*given)
    backward, coming, behind = _backward(*given)
    none = away * coming[1:] * np.exp(ahead[:-1] + behind[1:] - whole)
    for e in range(stop.size):
        i, j = start[e], stop[e]
        if frame[j] - frame[i] > 1:
            way = forward[i] * skip[frame[j] - frame[i]] * step[e] * worth[j] * backward[j]
            if way > 0:
                way *= np.exp(ahead[frame[i]] + behind[frame[j] + 1] - whole)
                for t in range(frame[i] + 1, frame[j]):
                    none[t] += way
    chance = forward * backward * np.exp(ahead[frame] + behind[frame + 1] - whole)
    return chance, _log_odds(frame, chance, none)


@njit(cache=True)
def log_chance(
    frames: int,
    frame: Places,
    gain: Values,
    again: Values,
    leaves: Values,
    start: Places,
    stop: Places,
    step: Values,
    missed: float,
) -> float:
    """Logarithm of all ways together that :func:`chances` looks at."""
    skip = np.exp(missed * np.maximum(np.arange(REACH + 1) - 1, 0))
    steps = (start, stop, step)
    return _forward(frames, frame, np.exp(gain), np.exp(RETURN + again), np.exp(leaves), skip, steps)[3]


@njit(cache=True)
def _log_odds(frame: Places, chance: Values, none: Values) -> Values:
    """Log odds of candidates from their probabilities and those of no line in each frame: of all others together."""
    out, first = np.zeros(frame.size), 0
    for c in range(frame.size):
        if frame[c] != frame[first]:
            first = c
        rest, k = none[frame[c]], first
        while k < frame.size and frame[k] == frame[c]:
            rest += chance[k] if k != c else 0.0
            k += 1
        out[c] = np.log(chance[c] + TINY) - np.log(rest + TINY)
    return out
