"""Which texture was it: from the mean rate, the variance of the rate, or its time course, on trials not seen before."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.neural.decoder import CODES, Labels, held_out_scores, stratified_folds
from vibrissa.neural.response import bin_edges, psth
from vibrissa.neural.sensitivity import d_prime, roc_area, roc_area_interval
from vibrissa.quantities import dataset, require
from vibrissa.stats import adjusted_p_values, bootstrap_interval, wilson_interval

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]
Window = tuple[float, float]

TELLS, CANNOT = "tells the textures apart", "cannot tell"


@dataclass(frozen=True, kw_only=True)
class Discrimination:
    """How trials are read.

    Attributes
    ----------
    codes : (str, ...)
        What is read of the spikes, of :data:`vibrissa.neural.decoder.CODES`: ``mean rate`` (spikes of each unit in the
        trial), ``rate variance`` (of its counts over bins, Poisson noise taken away), ``time course`` (counts in every
        bin), ``pattern`` (when the spikes came, given how many).
    bin_width : float
        Width of the bins [s].
    n_folds, n_partitions : int
        Every trial is read by decoders taught on the other folds, in so many random partitions.
    n_permutations : int
        Random assignments of textures to trials, each decoded the same way, for the level of chance.
    level : float
        Largest p-value, adjusted over codes, at which textures count as told apart.
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
            raise InputError("codes", f"must be some of {', '.join(CODES)}, each once", ", ".join(self.codes))
        if not 0 < self.bin_width < np.inf:
            raise InputError("bin width", "must be positive (s)", self.bin_width)
        if self.n_folds < 2 or self.n_partitions < 1:
            found = f"{self.n_folds}, {self.n_partitions}"
            raise InputError("folds and partitions", "must be at least 2 and 1", found)
        if not 0 < self.level < 1:
            raise InputError("level", "must lie between 0 and 1", self.level)
        if self.seed < 0:
            raise InputError("seed", "must be zero or positive", self.seed)
        if (self.n_permutations + 1) * self.level < len(self.codes):
            least = int(np.ceil(len(self.codes) / self.level)) - 1
            rule = f"must be at least {least} for a level of {self.level:g} over {len(self.codes)} codes"
            raise InputError("permutations", rule, self.n_permutations)


def trial_counts(spikes: xr.Dataset, n_trials: int, window: Window, bin_width: float) -> tuple[Array, list[str]]:
    """Counts of every unit that was observed in all trials; (T, U, B), and the names of these units.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.spikes.spike_table`, times from each trial's onset.
    n_trials : int
        Trials presented, silent ones included.
    window : (start, stop)
        Part of each trial that is read [s].
    bin_width : float
        Width of the bins, a part of the window [s].

    Raises
    ------
    InputError
        If no unit was observed in all trials, fewer than two bins fit, or no spike lies in the window.
    """
    require(spikes, "spike_time", "spike_trial", "spike_unit", "unit_name")
    if not -np.inf < window[0] < window[1] < np.inf:
        raise InputError("window", "must start before it stops (s)", window)
    edges = bin_edges(*window, bin_width)
    if len(edges) < 3:
        raise InputError("bin width", "must be at most half the window", bin_width)
    counts = psth(spikes, edges, n_trials=n_trials).spike_count.transpose("trial", "unit", "bin").values
    names = [str(name) for name in spikes.unit_name.values]
    if "unit_observed" in spikes:
        whole = spikes.unit_observed.transpose("unit", "trial").values.all(1)
        counts, names = counts[:, whole], [name for name, one in zip(names, whole, strict=True) if one]
    if not names:
        raise InputError("units", "must include one that was observed in all trials", 0)
    if not counts.any():
        raise InputError("window", "must hold a spike", window, "times count in seconds from each trial's onset")
    return counts.astype(float), names


def discriminate(
    counts: Array, textures: list[str], how: Discrimination | None = None, *, progress: Progress | None = None
) -> xr.Dataset:
    """Which texture each trial was, by decoders that have not seen it, and how sure that is.

    Parameters
    ----------
    counts : (T, U, B) array
        Spikes of each trial, unit and bin, as of :func:`trial_counts`.
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
    told: dict[str, Any] = {name: np.array([one[name] for one in results]) for name in results[0]}
    rights = told.pop("right")
    adjusted = adjusted_p_values(told["code_p_value"])
    return dataset(
        {**_told(how), "n_trials": label.size, "n_units": counts.shape[1], "chance": 1 / len(names)}
        | {"changes_of_texture": int(np.sum(np.diff(label) != 0)), "blocked": _blocked(label)},
        code=list(how.codes),
        presented=names,
        answered=names,
        contrast=[f"{a} | {b}" for a, b in combinations(names, 2)],
        trial_texture=np.array(textures, str),
        code_adjusted_p_value=adjusted,
        code_verdict=np.where(adjusted <= how.level, TELLS, CANNOT),
        **told,
        **_gains(rights, label, how),
    )


def _labels(counts: Array, textures: list[str]) -> tuple[list[str], Labels]:
    if counts.ndim != 3 or len(textures) != len(counts):
        found = f"{len(textures)} for counts of shape {counts.shape}"
        raise InputError("textures", "must be one for each trial", found)
    names, label = np.unique(np.array(textures, str), return_inverse=True)
    if len(names) < 2:
        raise InputError("textures", "must be two different ones at least", ", ".join(names))
    return [str(name) for name in names], label


def _told(how: Discrimination) -> dict[str, Any]:
    names = ("bin_width", "n_folds", "n_partitions", "n_permutations", "level", "seed")
    return {name: getattr(how, name) for name in names}


def _blocked(label: Labels) -> int:
    """Whether textures came in blocks, so that a slow drift would be taken for them: 1 or 0.

    The changes of texture from trial to trial are fewer than those of 999 in 1,000 random orders.
    """
    rng = np.random.default_rng(0)
    by_chance = [np.sum(np.diff(rng.permutation(label)) != 0) for _ in range(999)]
    return int(np.sum(np.diff(label) != 0) < min(by_chance))


def _one_code(
    code: str, counts: Array, label: Labels, folds: Labels, orders: Labels, progress: Progress | None
) -> dict[str, Any]:
    """Everything about one code."""
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
        if progress:
            progress(f"chance: {code}", k + 1, len(orders))
    low, high = wilson_interval(round(accuracy * label.size), label.size)
    n_classes = int(label.max()) + 1
    answered = np.eye(n_classes)[scores.argmax(1)]
    return {
        "accuracy": accuracy,
        "accuracy_low": low,
        "accuracy_high": high,
        "chance_accuracy": chance.mean(),
        "chance_accuracy_high": np.quantile(chance, 0.95),
        "code_p_value": (1 + np.sum(chance >= accuracy - 1e-12)) / (1 + len(chance)),
        "confusion": np.array([answered[label == k].mean(0) for k in range(n_classes)]),
        "held_out_score": scores,
        "right": right,
        **_contrasts(each, folds, label),
    }


def _mean_over_textures(right: NDArray[np.bool_], label: Labels) -> float:
    return float(np.mean(np.bincount(label, right) / np.bincount(label)))


def _contrasts(scores: Array, folds: Labels, label: Labels) -> dict[str, Any]:
    """Area under the ROC curve and d′ of every two textures, by the log likelihood ratio.

    Trials are compared within folds: the decoder of another fold has learnt from the trial itself, or from one more of
    its kind, and trials that are alike would come out in the wrong order.
    """
    rows = []
    for a, b in combinations(range(scores.shape[2]), 2):
        ratio, areas = scores[..., a] - scores[..., b], []
        for one, fold in zip(ratio, folds, strict=True):
            own = fold == np.arange(fold.max() + 1)[:, None]
            areas += [roc_area(one[held & (label == a)], one[held & (label == b)]) for held in own]
        area = float(np.mean(areas))
        rows.append((area, *roc_area_interval(area, int(np.sum(label == a)), int(np.sum(label == b)))))
    names = ("", "_low", "_high")
    found = {f"auc{name}": np.array([row[i] for row in rows]) for i, name in enumerate(names)}
    return found | {f"d_prime{name}": np.array([d_prime(row[i]) for row in rows]) for i, name in enumerate(names)}


def _gains(rights: NDArray[np.bool_], label: Labels, how: Discrimination) -> dict[str, Any]:
    """Accuracy of each code less that of the mean rate, trial by trial; NaN without the mean rate and of itself."""
    found = np.full((3, len(how.codes)), np.nan)
    weight = label.size / (np.bincount(label)[label] * (label.max() + 1))
    for k, code in enumerate(how.codes):
        if "mean rate" in how.codes and code != "mean rate":
            gain = (rights[k].astype(float) - rights[how.codes.index("mean rate")]) * weight
            rng = np.random.default_rng([how.seed, 1])
            found[:, k] = gain.mean(), *bootstrap_interval(gain, rng=rng)
    return dict(zip(("accuracy_gain", "accuracy_gain_low", "accuracy_gain_high"), found, strict=True))


def accuracy_by_units(
    counts: Array,
    textures: list[str],
    numbers: list[int],
    how: Discrimination | None = None,
    *,
    n_draws: int = 20,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Accuracy of decoders that read so many units, drawn at random among those there are.

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
    """
    how, n_units = how or Discrimination(), counts.shape[1]
    if not numbers or min(numbers) < 1 or max(numbers) > n_units:
        raise InputError("numbers of units", f"must lie between 1 and {n_units}", numbers)
    _, label = _labels(counts, textures)
    rng = np.random.default_rng([how.seed, 2])
    folds = np.array([stratified_folds(label, how.n_folds, rng=rng) for _ in range(how.n_partitions)])
    found = np.empty((3, len(how.codes), len(numbers)))
    for j, number in enumerate(numbers):
        draws = [rng.choice(n_units, number, replace=False) for _ in range(n_draws if number < n_units else 1)]
        for i, code in enumerate(how.codes):
            read, reader = CODES[code]
            scores = [held_out_scores(read(counts[:, draw]), label, folds, reader).mean(0) for draw in draws]
            shares = [_mean_over_textures(one.argmax(1) == label, label) for one in scores]
            found[:, i, j] = np.mean(shares), *np.quantile(shares, [0.1, 0.9])
        if progress:
            progress("units", j + 1, len(numbers))
    names = (f"accuracy_by_units{end}" for end in ("", "_low", "_high"))
    curves: dict[str, Any] = dict(zip(names, found, strict=True))
    return dataset(
        {**_told(how), "n_draws": n_draws},
        code=list(how.codes),
        units_used=numbers,
        **curves,
    )
