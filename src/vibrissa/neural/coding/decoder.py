"""Decoders of textures: likelihood of a trial's counts under the rates found in other trials."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import log_softmax

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError

Reader = Callable[[Array, Array, Array], Array]

LEAST_TRIALS, MOST_SHARE = 0.5, 10.0  # of the prior: trials at least, and at most so many times those that teach


def shrunk_rates(rate: Array, n: Array) -> Array:
    """Rates of each texture, shrunk towards their mean over textures as far as they differ by chance.

    Before any spike is seen, a rate is gamma-distributed about the mean m over textures, with the weight of a trials:
    its variance is m/a. What is found varies by m/n more, the Poisson noise, so the spread between textures, pooled
    over a unit's bins, gives a: the fewer spikes, or the more alike the textures, the more is drawn. So units that
    answer all textures alike do not drown the others in the noise of their estimates.

    Parameters
    ----------
    rate : (K, U, B) array
        Spikes per trial found in each bin.
    n : (K, U) array
        Trials that each was found in.

    Returns
    -------
    (K, U, B) array
        (n·rate + a·m)/(n + a), above 0.
    """
    common = rate.mean(0) + 0.5 / (n.sum(0)[:, None] * rate.shape[-1])  # half a spike at any time, where none was seen
    # gamma prior of weight a: Var(rate found) = m/a + m/n, so a follows from the spread less the Poisson noise
    noise = (1 / n).mean(0)
    spread = ((rate - rate.mean(0)) ** 2).sum((0, 2)) / (len(rate) - 1) / common.sum(-1)
    trials = 1 / np.clip(spread - noise, noise / MOST_SHARE, 1 / LEAST_TRIALS)
    return np.asarray((n[..., None] * rate + trials[:, None] * common) / (n + trials)[..., None], float)


def _total(seen: Array, weights: Array) -> Array:
    """Spikes of each texture, unit and bin over the trials that teach, (K, U, B)."""
    return (weights @ seen.reshape(len(seen), -1)).reshape(len(weights), *seen.shape[1:])


def mean_counts(seen: Array, weights: Array) -> Array:
    """Expected counts of each texture in a trial.

    All textures are shrunk alike, as if each were taught by the harmonic mean of their trials: else the texture of the
    trial left out, taught by one trial less, would be drawn to the mean the most, and silent trials be read below
    chance.

    Parameters
    ----------
    seen, weights
        As in :func:`poisson_scores`.

    Returns
    -------
    (K, U, B) array
        Above 0.
    """
    n = weights.sum(1)
    alike = np.full((n.size, seen.shape[1]), 1 / np.mean(1 / n))
    return shrunk_rates(_total(seen, weights) / n[:, None, None], alike)


def poisson_scores(seen: Array, weights: Array, unseen: Array, exposure: float = 1.0) -> Array:
    """Log likelihood of independent Poisson counts of known expectation, up to what all textures share.

    Parameters
    ----------
    seen : (T, U, B) array
        Counts of units in bins, of the trials that teach.
    weights : (K, T) array
        1 where a trial teaches a texture, else 0.
    unseen : (T', U, B) array
        Counts of the trials to be read.
    exposure : float
        How long their bins last, over the bins of the trials that teach.

    Returns
    -------
    (T', K) array
        Σ n log λ − λ·exposure.
    """
    expected = mean_counts(seen, weights).reshape(len(weights), -1)
    return unseen.reshape(len(unseen), -1) @ np.log(expected).T - exposure * expected.sum(1)


def pattern_scores(seen: Array, weights: Array, unseen: Array) -> Array:
    """Log likelihood of when the spikes came, given how many there were of each unit: blind to rate and gain.

    Poisson counts given their sum are multinomial: Σ n log(λ_b/Σ_b λ_b). What a texture's spikes teach counts as if
    all textures fired alike often.

    Parameters
    ----------
    seen, weights, unseen
        As in :func:`poisson_scores`.

    Returns
    -------
    (T', K) array
        Log likelihood of each texture in each trial.
    """
    total = _total(seen, weights) + 0.5 / seen.shape[-1]  # half a spike of each unit, at any time
    sums = total.sum(-1)
    usual = (sums / weights.sum(1)[:, None]).mean(0)  # spikes of a unit in a trial
    expected = shrunk_rates(total / sums[..., None] * usual[:, None], sums / usual)
    share = expected / expected.sum(-1, keepdims=True)
    return unseen.reshape(len(unseen), -1) @ np.log(share).reshape(len(weights), -1).T


def gaussian_scores(seen: Array, weights: Array, unseen: Array) -> Array:
    """Linear discriminant: normal values, one covariance for all textures, shrunk towards its diagonal's mean.

    The shrinkage is Ledoit and Wolf's, of all trials together; scikit-learn's discriminant shrinks each texture by its
    own and weighs textures by their trials. Any numbers may take the place of counts.

    Parameters
    ----------
    seen, weights, unseen
        As in :func:`poisson_scores`.

    Returns
    -------
    (T', K) array
        Log likelihood of each texture in each trial.
    """
    flat, probe = seen.reshape(len(seen), -1), unseen.reshape(len(unseen), -1)
    taught = weights.sum(0) > 0
    scale = flat[taught].std(0)
    scale = np.where(scale > 0, scale, 1.0)  # a value that never changes carries no information, whatever its scale
    flat, probe = flat / scale, probe / scale
    means = weights @ flat / weights.sum(1)[:, None]
    centred = (flat - weights.T @ means)[taught]
    axes = np.linalg.solve(_shrunk(centred), means.T)
    return probe @ axes - 0.5 * np.sum(means.T * axes, 0)


def _shrunk(centred: Array) -> Array:
    """Covariance (1 − a)·S + a·m·1 of least expected error, [Ledoit2004]_, with a small floor against a singular S."""
    from sklearn.covariance import ledoit_wolf_shrinkage  # takes a second; the other codes do without

    n, p = centred.shape
    sample, share = centred.T @ centred / n, ledoit_wolf_shrinkage(centred, assume_centered=True)
    level = np.trace(sample) / p + 1e-12
    return (1 - share) * sample + (share + 1e-9) * level * np.eye(p)


def mean_rate(counts: Array) -> Array:
    """Spikes of each unit in a trial; (T, U, 1) of (T, U, B).

    Parameters
    ----------
    counts : (T, U, B) array
        Counts of units in bins.

    Returns
    -------
    (T, U, 1) array
        Counts of whole trials.
    """
    return counts.sum(-1, keepdims=True)


def rate_variance(counts: Array) -> Array:
    """Variance of the counts over a trial's bins less their mean: what Poisson spikes add is taken away.

    Parameters
    ----------
    counts : (T, U, B) array
        B ≥ 2.

    Returns
    -------
    (T, U, 1) array
        Unbiased estimate of the variance of the expected count over the trial [1], if the spikes are Poisson; may be
        negative.
    """
    return counts.var(-1, ddof=1, keepdims=True) - counts.mean(-1, keepdims=True)


def all_bins(counts: Array) -> Array:
    """Every bin of every unit.

    Parameters
    ----------
    counts : (T, U, B) array
        Counts of units in bins.

    Returns
    -------
    (T, U, B) array
        The same.
    """
    return counts


# Features of the spikes, and the likelihood that reads them. The first three are those of the paper's Discussion.
CODES: dict[str, tuple[Callable[[Array], Array], Reader]] = {
    "mean rate": (mean_rate, poisson_scores),
    "rate variance": (rate_variance, gaussian_scores),
    "time course": (all_bins, poisson_scores),
    "pattern": (all_bins, pattern_scores),
}


def stratified_folds(label: Integers, n_folds: int, *, rng: np.random.Generator) -> Integers:
    """Fold of each trial, (T,): every texture is spread over the folds as evenly as can be.

    As scikit-learn's StratifiedKFold, which draws other folds from a seed: results of a seed would change.

    Parameters
    ----------
    label : (T,) array of int
        Texture of each trial, 0 … K − 1.
    n_folds : int
        Folds.
    rng : Generator
        Source of randomness.

    Returns
    -------
    (T,) array of int
        Fold of each trial.

    Raises
    ------
    InputError
        If a texture has fewer trials than there are folds: it would be missing from what a decoder learns or is asked.
    """
    counts = np.bincount(label)
    if n_folds < 2 or counts.min() < n_folds:
        found = f"{n_folds} folds, {counts.min()} trials of one texture"
        raise RangeError("folds", "must be 2 at least, and no more than the trials of any texture", found)
    fold = np.empty(label.size, int)
    for k in range(counts.size):
        own = rng.permutation(np.flatnonzero(label == k))
        fold[own] = (np.arange(own.size) + rng.integers(n_folds)) % n_folds
    return fold


def held_out_scores(features: Array, label: Integers, folds: Integers, reader: Reader) -> Array:
    """Log posterior of each texture for each trial, by decoders that have not seen the trial.

    Parameters
    ----------
    features : (T, U, B) array
        Features of each trial.
    label : (T,) array of int
        Texture of each trial, 0 … K − 1.
    folds : (R, T) array of int
        Fold of each trial, in R partitions.
    reader : callable
        One of the likelihoods above.

    Returns
    -------
    (R, T, K) array
        Textures equally likely beforehand.
    """
    one_hot = (label == np.arange(label.max() + 1)[:, None]).astype(float)
    found = np.empty((*folds.shape, len(one_hot)))
    for scores, fold in zip(found, folds, strict=True):
        for k in range(fold.max() + 1):
            out = fold == k
            scores[out] = log_softmax(reader(features, one_hot * ~out, features[out]), axis=1)
    return found
