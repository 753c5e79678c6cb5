"""Statistics of many tests and few animals: the paper's tests, and estimates that know their clusters."""

from vibrissa.stats.groups import GroupTests, Pair, compare_groups, gated_comparison, normality
from vibrissa.stats.intervals import adjusted_p_values, bootstrap_interval, jackknife_interval, wilson_interval
from vibrissa.stats.linear import Effect, clustered_model, linear_model

__all__ = [
    "Effect",
    "GroupTests",
    "Pair",
    "adjusted_p_values",
    "bootstrap_interval",
    "clustered_model",
    "compare_groups",
    "gated_comparison",
    "jackknife_interval",
    "linear_model",
    "normality",
    "wilson_interval",
]
