"""Discrimination of textures by mean rate, variance of the rate, or its time course, on trials not seen before."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import bootstrap

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import (
    RangeError,
    ShapeError,
    UnknownError,
    require_fraction,
    require_not_negative,
    require_positive,
)
from vibrissa.neural.coding.decoder import CODES, held_out_scores, stratified_folds
from vibrissa.neural.coding.sensitivity import d_prime, roc_area, roc_area_interval
from vibrissa.quantities import dataset, stacked
from vibrissa.quantities.quantity import estimate
from vibrissa.stats import adjusted_p_values, wilson_interval

Progress = Callable[[str, int, int], None]

MOST_PERMUTATIONS = 1_000_000
TELLS, CANNOT = "tells the textures apart", "cannot tell"


@dataclass(frozen=True, kw_only=True)
class Discrimination:
    """Settings of the decoders.

    Attributes
    ----------
    codes : (str, ...)
        Features of the spikes, of ``vibrissa.neural.coding.decoder.CODES``: ``mean rate`` (spikes of each unit
        in the trial), ``rate variance`` (of its counts over bins, Poisson noise taken away), ``time course`` (counts
        in every bin), ``pattern`` (when the spikes came, given how many).
    bin_width : float
        Width of the bins [s].
    n_folds, n_partitions : int
        Every trial is read by decoders taught on the other folds, in so many random partitions.
    n_permutations : int
        Random assignments of textures to trials, each decoded the same way, for the level of chance.
    level : float
        Largest p-value, adjusted over codes, at which textures count as discriminated.
    seed : int
        Of folds and permutations.
    """

    codes: tuple[str, ...] = tuple(CODES)
    bin_width: float = 0.02
    n_folds: int = 5
    n_partitions: int = 2
    n_permutations: int = 400
    level: float = 0.05
    seed: int = 0

    def __post_init__(self) -> None:
        unknown = set(self.codes) - set(CODES)
        if unknown or not self.codes or len(set(self.codes)) < len(self.codes):
            raise UnknownError("codes", f"must be some of {', '.join(CODES)}, each once", ", ".join(self.codes))
        require_positive("bin width", self.bin_width, "s")
        for name, least in (("n_folds", 2), ("n_partitions", 1)):
            if getattr(self, name) < least:
                raise RangeError(name, f"must be at least {least}", getattr(self, name))
        require_fraction("level", self.level)
        require_not_negative("seed", self.seed)
        if self.n_permutations > MOST_PERMUTATIONS:
            raise RangeError("permutations", f"must be at most {MOST_PERMUTATIONS:,}", self.n_permutations)
        if (self.n_permutations + 1) * self.level < len(self.codes):
            least = int(np.ceil(len(self.codes) / self.level)) - 1
            rule = f"must be at least {least} for a level of {self.level:g} over {len(self.codes)} codes"
            raise RangeError("permutations", rule, self.n_permutations)


def discriminate(
    counts: Array, textures: list[str], how: Discrimination | None = None, *, progress: Progress | None = None
) -> xr.Dataset:
    """Texture of each trial by decoders that have not seen it, with accuracy, chance and intervals.

    Parameters
    ----------
    counts : (T, U, B) array
        Spikes of each trial, unit and bin, as of :func:`vibrissa.neural.coupling.response.trial_counts`.
    textures : (T,) list of str
        Texture of each trial: two different ones at least.
    how : Discrimination, optional
        Codes, folds and permutations.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    Dataset
        For each ``code``: ``accuracy`` with Wilson's interval, every texture counted alike; the level of chance by
        permutation and ``code_p_value``, ``code_adjusted_p_value``; ``code_verdict``; ``accuracy_gain`` over the mean
        rate on the same trials; ``confusion`` (presented, answered); for each ``contrast`` of two textures ``auc`` and
        ``d_prime`` with intervals; ``held_out_score``. Intervals are of 95 % and take trials for independent. They are
        of decoders taught by as many trials as here.

    Raises
    ------
    InputError
        If textures and trials differ in number, there are fewer than two textures, or fewer trials of one than folds.
    """
    how = how or Discrimination()
    names, label = _labels(counts, textures)
    rng = np.random.default_rng(how.seed)
    folds = np.array([stratified_folds(label, how.n_folds, rng=rng) for _ in range(how.n_partitions)])
    orders = np.array([rng.permutation(label.size) for _ in range(how.n_permutations)]).reshape(-1, label.size)
    results = [_one_code(code, counts, label, folds, orders, progress) for code in how.codes]
    found = stacked(results)
    rights = found.pop("right")
    adjusted = adjusted_p_values(found["code_p_value"])
    return dataset(
        {**_settings(how), "n_trials": label.size, "n_units": counts.shape[1], "chance": 1 / len(names)}
        | {"changes_of_texture": int(np.sum(np.diff(label) != 0)), "blocked": _blocked(label)},
        code=list(how.codes),
        presented=names,
        answered=names,
        contrast=[f"{a} | {b}" for a, b in combinations(names, 2)],
        trial_texture=np.array(textures, str),
        code_adjusted_p_value=adjusted,
        code_verdict=np.where(adjusted <= how.level, TELLS, CANNOT),
        **found,
        **_gains(rights, label, how),
    )


def _labels(counts: Array, textures: list[str]) -> tuple[list[str], Integers]:
    if counts.ndim != 3 or len(textures) != len(counts):
        found = f"{len(textures)} for counts of shape {counts.shape}"
        raise ShapeError("textures", "must be one for each trial", found)
    names, label = np.unique(np.array(textures, str), return_inverse=True)
    if len(names) < 2:
        raise ShapeError("textures", "must be at least two different ones", ", ".join(names))
    return [str(name) for name in names], label


def _settings(how: Discrimination) -> dict[str, Any]:
    return {name: value for name, value in vars(how).items() if name != "codes"}


def _blocked(label: Integers) -> int:
    """Whether textures came in blocks, so that a slow drift would be mistaken for them: 1 or 0.

    The changes of texture from trial to trial are fewer than those of 999 in 1,000 random orders.
    """
    rng = np.random.default_rng(0)
    by_chance = [np.sum(np.diff(rng.permutation(label)) != 0) for _ in range(999)]
    return int(np.sum(np.diff(label) != 0) < min(by_chance))


def _one_code(
    code: str, counts: Array, label: Integers, folds: Integers, orders: Integers, progress: Progress | None
) -> dict[str, Any]:
    """Everything about one code."""
    report = progress or (lambda *_: None)
    report(f"chance: {code}", 0, len(orders))
    read, reader = CODES[code]
    features = read(counts)
    each = held_out_scores(features, label, folds, reader)
    scores = each.mean(0)
    right = scores.argmax(1) == label
    accuracy, chance = _mean_over_textures(right, label), np.empty(len(orders))
    for k, order in enumerate(orders):
        # folds go with the labels, so that they stay stratified
        permuted = held_out_scores(features, label[order], folds[:, order], reader).mean(0)
        chance[k] = _mean_over_textures(permuted.argmax(1) == label[order], label[order])
        report(f"chance: {code}", k + 1, len(orders))
    classes = np.arange(label.max() + 1)
    answered = np.eye(classes.size)[scores.argmax(1)]
    return {
        **estimate("accuracy", accuracy, *_accuracy_interval(right, label)),
        "chance_accuracy": chance.mean(),
        "chance_accuracy_high": np.quantile(chance, 0.95),
        "code_p_value": (1 + np.sum(chance >= accuracy - 1e-12)) / (1 + len(chance)),
        "confusion": np.array([answered[label == k].mean(0) for k in classes]),
        "held_out_score": scores,
        "right": right,
        **_contrasts(each, folds, label),
    }


def _accuracy_interval(right: Mask, label: Integers) -> tuple[float, float]:
    """Wilson's, of as many trials as a share of that variance has: fewer than all where textures differ in number."""
    accuracy, number = _mean_over_textures(right, label), np.bincount(label)
    share = (np.bincount(label, right) + 0.5) / (number + 1)  # none is sure
    variance = float(np.mean(share * (1 - share) / number)) / number.size
    middle = float(share.mean())
    trials = min(label.size, middle * (1 - middle) / variance)
    return wilson_interval(accuracy * trials, trials)


def _mean_over_textures(right: Mask, label: Integers) -> float:
    return float(np.mean(np.bincount(label, right) / np.bincount(label)))


def _contrasts(scores: Array, folds: Integers, label: Integers) -> dict[str, Any]:
    """Area under the ROC curve and d′ of every two textures, by the log likelihood ratio.

    Trials are compared within folds: the decoder of another fold has learnt from the trial itself, or from one more of
    its kind, and trials that are alike would be ranked in the wrong order.
    """
    rows = []
    for a, b in combinations(range(scores.shape[2]), 2):
        ratio, areas = scores[..., a] - scores[..., b], []
        for one, fold in zip(ratio, folds, strict=True):
            own = fold == np.arange(fold.max() + 1)[:, None]
            areas += [roc_area(one[held & (label == a)], one[held & (label == b)]) for held in own]
        area = float(np.mean(areas))
        rows.append((area, *roc_area_interval(area, int(np.sum(label == a)), int(np.sum(label == b)))))
    found = np.array(rows).T
    return estimate("auc", *found) | estimate("d_prime", *(np.array([d_prime(one) for one in end]) for end in found))


def _gains(rights: Mask, label: Integers, how: Discrimination) -> dict[str, Any]:
    """Accuracy of each code less that of the mean rate, trial by trial; NaN for the mean rate, or without it."""
    found = np.full((3, len(how.codes)), np.nan)
    weight = label.size / (np.bincount(label)[label] * (label.max() + 1))
    for k, code in enumerate(how.codes):
        if "mean rate" in how.codes and code != "mean rate":
            gain = (rights[k].astype(float) - rights[how.codes.index("mean rate")]) * weight
            rng = np.random.default_rng([how.seed, 1])
            ends = bootstrap((gain,), np.mean, n_resamples=2000, method="percentile", rng=rng).confidence_interval
            found[:, k] = gain.mean(), *ends
    return estimate("accuracy_gain", *found)


def accuracy_by_units(
    counts: Array,
    textures: list[str],
    numbers: list[int],
    how: Discrimination | None = None,
    *,
    n_draws: int = 20,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Accuracy of decoders that read this number of units, drawn at random among those there are.

    Parameters
    ----------
    counts, textures, how, progress
        As in :func:`discriminate`; nothing is permuted.
    numbers : list of int
        Numbers of units, at most as many as there are.
    n_draws : int
        Draws of units for each number; where all are taken, one.

    Returns
    -------
    Dataset
        ``accuracy_by_units``, ``accuracy_by_units_low``, ``accuracy_by_units_high`` (code, units_used): mean, first
        and last decile over the draws.

    Raises
    ------
    InputError
        If a number of units is below 1 or above those there are; as :func:`discriminate`.
    """
    how, n_units, report = how or Discrimination(), counts.shape[1], progress or (lambda *_: None)
    if not numbers or min(numbers) < 1 or max(numbers) > n_units:
        raise RangeError("numbers of units", f"must lie between 1 and {n_units}", numbers)
    _, label = _labels(counts, textures)
    rng = np.random.default_rng([how.seed, 2])
    folds = np.array([stratified_folds(label, how.n_folds, rng=rng) for _ in range(how.n_partitions)])
    found = np.empty((3, len(how.codes), len(numbers)))
    report("units", 0, len(numbers))
    for j, number in enumerate(numbers):
        draws = [rng.choice(n_units, number, replace=False) for _ in range(n_draws if number < n_units else 1)]
        for i, code in enumerate(how.codes):
            read, reader = CODES[code]
            scores = [held_out_scores(read(counts[:, draw]), label, folds, reader).mean(0) for draw in draws]
            shares = [_mean_over_textures(one.argmax(1) == label, label) for one in scores]
            found[:, i, j] = np.mean(shares), *np.quantile(shares, [0.1, 0.9])
        report("units", j + 1, len(numbers))
    attrs = {**_settings(how), "n_draws": n_draws}
    return dataset(attrs, code=list(how.codes), units_used=numbers, **estimate("accuracy_by_units", *found))
