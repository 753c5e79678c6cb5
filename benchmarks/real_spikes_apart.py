"""Calculations beside the verdicts of `vibrissa` on real recordings; none of them uses `vibrissa`."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import statsmodels.api as sm
from scipy.optimize import minimize
from scipy.stats import false_discovery_control

LATEST = 0.03  # [s]


def correlations(counts: np.ndarray, level: np.ndarray, lags: Sequence[int]) -> np.ndarray:
    """Correlation of the counts with the level each of some bins before."""
    first, last = max(0, *lags), min(0, *lags)
    kept = slice(first, counts.size + last or None)
    shifted = [np.roll(level, lag)[kept] for lag in lags]
    return np.array([np.corrcoef(counts[kept], one)[0, 1] for one in shifted])


def by_shift(counts: np.ndarray, level: np.ndarray, width: float) -> tuple[float, float, float]:
    """Largest correlation over lags of 0 to 30 ms, its lag [s], and the share of circular shifts that do as well."""
    n_lags = round(LATEST / width) + 1
    x, y = (counts - counts.mean()) / counts.std(), (level - level.mean()) / level.std()
    at_shift = np.fft.irfft(np.fft.rfft(x) * np.conj(np.fft.rfft(y)), x.size) / x.size  # level s bins before
    best = np.max([np.roll(at_shift, -lag) for lag in range(n_lags)], axis=0)  # over the lags after each shift
    guard = round(0.06 / width)
    others = best[guard + n_lags : -guard]
    p_value = (1 + np.sum(others >= best[0])) / (1 + others.size)
    return float(best[0]), float(np.argmax(at_shift[:n_lags]) * width), p_value


def adjusted(p_values: Sequence[float]) -> np.ndarray:
    """Benjamini and Hochberg's."""
    return np.asarray(false_discovery_control(p_values))


def bin_means(time: np.ndarray, values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Means of a sampled function over bins."""
    area = np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time))])
    return np.diff(np.interp(edges, time, area)) / np.diff(edges)


def hinge(counts: np.ndarray, time: np.ndarray, signal: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Threshold, slope, latency [s] and baseline of greatest Poisson likelihood."""
    width, found = edges[1] - edges[0], []
    start = [np.median(signal), np.log(counts.mean() / width / signal.std()), np.log(counts.mean() / width / 2)]
    for latency in np.arange(0.004, 0.0095, 0.0005):

        def cost(p: np.ndarray, latency: float = latency) -> float:
            above = bin_means(time, np.maximum(signal - p[0], 0), edges - latency)
            expected = width * (np.exp(p[2]) + np.exp(p[1]) * above)
            return float(np.sum(expected - counts * np.log(expected)))

        fit = minimize(cost, start, method="Nelder-Mead", options={"xatol": 1e-3, "fatol": 1e-2, "maxiter": 300})
        found.append((fit.fun, fit.x[0], np.exp(fit.x[1]), latency, np.exp(fit.x[2])))
        start = list(fit.x)
    return np.array(min(found)[1:])


def bits_of_a_spike(counts: np.ndarray) -> float:
    """Bits for each spike of counts (trial, bin): direct, extrapolated over all trials, halves and quarters."""

    def plain(some: np.ndarray) -> float:
        share = some.sum(0) / max(some.sum(), 1)
        return float(np.sum(share[share > 0] * np.log2(share[share > 0] * share.size)))

    rng, n = np.random.default_rng(0), len(counts)
    parts = [n, n // 2, n // 4]
    means = [np.mean([plain(counts[rng.permutation(n)[:k]]) for _ in range(40)]) for k in parts]
    return float(np.polynomial.Polynomial.fit(1 / np.array(parts), means, 2)(0))


def read_by_centroid(counts: np.ndarray, names: np.ndarray, width: float) -> tuple[float, float]:
    """Share of trials given their own name by the nearest mean of the others, and 95 % of 200 random assignments."""
    kernel = np.exp(-0.5 * (np.arange(-5, 6) * width / (1.5 * width)) ** 2)
    smooth = np.array([np.convolve(one, kernel, "same") for one in counts])
    rng = np.random.default_rng(0)

    def share(labels: np.ndarray) -> float:
        known = np.array([labels == name for name in np.unique(labels)], float)  # (name, trial)
        total, number = known @ smooth, known.sum(1)
        right = 0
        for one, own in zip(smooth, known.T, strict=True):
            means = (total - own[:, None] * one) / (number - own)[:, None]  # of all trials but this
            right += int(own[np.argmin(np.sum((means - one) ** 2, axis=1))])
        return right / len(smooth)

    return share(names), float(np.quantile([share(rng.permutation(names)) for _ in range(200)], 0.95))


def explained(
    counts: np.ndarray, signal: np.ndarray, lags: int, past: int, block: int | None = None
) -> tuple[float, float]:
    """Share of the deviance of every other trial that a Poisson model by statsmodels explains: signal, and with past.

    Counts (trial, bin), the signal (bin); as many bins of either before, the past in sums of 1, 1, 2, 4, … bins. With
    ``block``, every other block of so many bins takes the place of every other trial.
    """
    heard = np.array([np.roll(signal, lag) for lag in range(lags)]).T
    ends = [0, 1, 2, 4, 8, 16]
    ends = [*(end for end in ends if end < past), past]
    total = np.cumsum(np.pad(counts, ((0, 0), (past + 1, 0))), 1)
    k = np.arange(counts.shape[1]) + past
    fired = np.array([total[:, k - a] - total[:, k - b] for a, b in pairwise(ends)])
    valid = k - past >= past
    place = np.arange(len(counts))[:, None] if block is None else (k - past)[None] // block
    odd = np.broadcast_to(place % 2 == 1, counts.shape)[:, valid]
    shares = []
    for with_past in (False, True):
        columns = np.broadcast_to(heard, (len(counts), *heard.shape))
        columns = np.concatenate([columns, fired.transpose(1, 2, 0)], 2) if with_past else columns
        columns, own = columns[:, valid], counts[:, valid]
        design = [sm.add_constant(columns[side]) for side in (odd, ~odd)]
        seen = [own[side] for side in (odd, ~odd)]
        rate = sm.GLM(seen[0], design[0], family=sm.families.Poisson()).fit().predict(design[1])
        family = sm.families.Poisson()
        shares.append(1 - family.deviance(seen[1], rate) / family.deviance(seen[1], np.full(rate.size, seen[0].mean())))
    return shares[0], shares[1]


def trials_for(
    time: np.ndarray, signal: np.ndarray, edges: np.ndarray, unit: Sequence[float], half: Sequence[float]
) -> float:
    """Trials until 1.96 standard errors of threshold and slope are at most the halves; derivatives by differences.

    ``unit`` is (threshold, slope, latency, baseline), all four to be estimated.
    """
    base, width = np.array(unit, float), edges[1] - edges[0]
    steps = np.array([1e-3 * base[0], 1e-3 * base[1], 5e-5, 1e-3 * base[3]])

    def expected(p: np.ndarray) -> np.ndarray:
        above = bin_means(time, np.maximum(signal - p[0], 0), edges - p[2])
        return np.asarray(width * (p[3] + p[1] * above))

    slopes = np.array([(expected(base + h) - expected(base - h)) / (2 * h.sum()) for h in np.diag(steps)])
    error = np.sqrt(np.diag(np.linalg.inv(slopes / expected(base) @ slopes.T)))
    return float(np.max([(1.96 * error[k] / one) ** 2 for k, one in enumerate(half)]))


def lead(counts: np.ndarray, level: np.ndarray) -> float:
    """Lag of the largest correlation within 50 ms, in bins of 10 ms; below 0 the rate leads [s]."""
    lags = list(range(-5, 6))
    return 0.01 * lags[int(np.argmax(correlations(counts, level, lags)))]


def unseen_bits(counts: np.ndarray, drives: np.ndarray) -> float:
    """Bits for each spike, beyond a steady rate, of every other block of 500 bins by a Poisson fit to the rest.

    The drive (latency, bin) is taken at the latency that fits best; ln(rate) is a line bent at five of its quantiles.
    """
    block, fits = np.arange(counts.size) // 500 % 2 == 0, []
    for one in drives:
        knots = np.quantile(one, [0, 0.25, 0.5, 0.75, 0.9])
        design = sm.add_constant(np.maximum(one[:, None] - knots, 0) / one.std())
        model = sm.GLM(counts[block], design[block], family=sm.families.Poisson()).fit()
        fits.append((model.deviance, model.predict(design[~block])))
    rate, unseen = min(fits, key=lambda one: one[0])[1], counts[~block]
    steady = counts[block].mean()
    return float(np.sum(unseen * np.log2(rate / steady) - (rate - steady) / np.log(2)) / unseen.sum())
