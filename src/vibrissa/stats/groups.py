"""The paper's tests between groups, which take every value for an independent draw."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from vibrissa.errors import InputError

Array = NDArray[np.float64]

SMALL = 30  # values from which the paper goes over from Shapiro–Wilk to Kolmogorov–Smirnov


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Difference of two groups' means by Tukey's test, for all pairs at once.

    Attributes
    ----------
    first, second : str
        The groups.
    difference, low, high : float
        Mean of the first less mean of the second, and its 95 % interval, in the unit of the values.
    p : float
        p-value, adjusted for the number of pairs.
    """

    first: str
    second: str
    difference: float
    low: float
    high: float
    p: float


@dataclass(frozen=True, kw_only=True)
class GroupTests:
    """Tests of the same values between the same groups.

    Attributes
    ----------
    n : int
        Values measured.
    anova_f, anova_p : float
        One-way ANOVA: equal means, of normal values of equal spread.
    kruskal_h, kruskal_p : float
        Kruskal–Wallis: equal distributions, by ranks.
    ks_d, ks_p : float
        Kolmogorov–Smirnov of two samples; NaN unless there are two groups.
    pairs : tuple of Pair
        Tukey's test of every pair.
    """

    n: int
    anova_f: float
    anova_p: float
    kruskal_h: float
    kruskal_p: float
    ks_d: float
    ks_p: float
    pairs: tuple[Pair, ...]


def normality(values: ArrayLike) -> tuple[str, float]:
    """The paper's test of normality, for what it is worth: Shapiro–Wilk below 30 values, else Kolmogorov–Smirnov.

    The second holds the values against the normal distribution of their own mean and spread, as if these had been
    known beforehand. It then hardly ever rejects: at a level of 5 %, samples of normal values in fewer than 1 of
    1000. The paper says N < 30 and N > 30; 30 itself counts here with the larger.

    Parameters
    ----------
    values : (N,) array
        NaN, not measured, is left out.

    Returns
    -------
    name : {"Shapiro–Wilk", "Kolmogorov–Smirnov"}
        The test made.
    p : float
        Its p-value.

    Raises
    ------
    InputError
        If there are fewer than 3 values or all are equal.
    """
    x = np.asarray(values, float)
    x = x[np.isfinite(x)]
    if x.size < 3 or np.ptp(x) == 0:
        raise InputError("values", "must be at least 3 that are not all equal", f"{x.size} values")
    if x.size < SMALL:
        return "Shapiro–Wilk", float(stats.shapiro(x).pvalue)
    return "Kolmogorov–Smirnov", float(stats.kstest(x, "norm", args=(x.mean(), x.std(ddof=1))).pvalue)


def compare_groups(values: ArrayLike, groups: ArrayLike) -> GroupTests:
    """Every test between groups that the paper names, side by side and without a test that chooses among them.

    All take the values for independent draws. Sweeps of one whisker are not: see :func:`clustered_model`.

    Parameters
    ----------
    values : (N,) array
        NaN, not measured, is left out.
    groups : (N,) array
        Group of each value.

    Raises
    ------
    InputError
        If the two differ in number, or there are fewer than two groups of at least two values.
    """
    names, samples = _samples(values, groups)
    anova, kruskal = stats.f_oneway(*samples), stats.kruskal(*samples)
    two = stats.ks_2samp(*samples) if len(samples) == 2 else None
    tukey = stats.tukey_hsd(*samples)
    ends = tukey.confidence_interval(0.95)
    pairs = tuple(
        Pair(
            first=names[i],
            second=names[j],
            difference=float(tukey.statistic[i, j]),
            low=float(ends.low[i, j]),
            high=float(ends.high[i, j]),
            p=float(tukey.pvalue[i, j]),
        )
        for i, j in combinations(range(len(names)), 2)
    )
    return GroupTests(
        n=sum(map(len, samples)),
        anova_f=float(anova.statistic),
        anova_p=float(anova.pvalue),
        kruskal_h=float(kruskal.statistic),
        kruskal_p=float(kruskal.pvalue),
        ks_d=float(two.statistic) if two else np.nan,
        ks_p=float(two.pvalue) if two else np.nan,
        pairs=pairs,
    )


def gated_comparison(values: ArrayLike, groups: ArrayLike, *, level: float = 0.05) -> tuple[str, float]:
    """The paper's procedure: ANOVA where every group passes for normal, else Kruskal–Wallis.

    To be set beside :func:`compare_groups`, not instead of it: what a test of normality lets pass depends on how many
    values there are more than on how they are distributed.

    Returns
    -------
    name : {"ANOVA", "Kruskal–Wallis"}
        The test chosen.
    p : float
        Its p-value.
    """
    _, samples = _samples(values, groups)
    normal = all(normality(sample)[1] >= level for sample in samples)
    chosen = stats.f_oneway if normal else stats.kruskal
    return ("ANOVA" if normal else "Kruskal–Wallis"), float(chosen(*samples).pvalue)


def _samples(values: ArrayLike, groups: ArrayLike) -> tuple[list[str], list[Array]]:
    x, labels = np.asarray(values, float), np.asarray(groups)
    if x.shape != labels.shape or x.ndim != 1:
        raise InputError("groups", "must be as many as the values", f"{labels.shape}, {x.shape}")
    made = np.isfinite(x)
    names = np.unique(labels[made])
    samples = [x[made & (labels == name)] for name in names]
    if len(samples) < 2 or min(map(len, samples)) < 2:
        raise InputError("groups", "must be at least two, of at least two values", [len(one) for one in samples])
    return [str(name) for name in names], samples
