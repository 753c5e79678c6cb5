"""How often tests that take every sweep for its own draw find an effect where there is none.

.venv/bin/python benchmarks/clustered_tests.py [REPEATS]

Sweeps as in the paper: 6 animals with 13 whiskers, 582 sweeps. A sweep's value is its animal's (a third of the share
between whiskers) + its whisker's + its own, normal, without any effect of the term tested. Prints, for a level of 5 %,
"the term tested | share of the variance between whiskers | rate of false positives of each test". Seed 1.
"""

import sys

import numpy as np
from scipy import stats

from vibrissa.stats import clustered_model, linear_model

ANIMAL = np.array([0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 5])  # of each whisker
NAME = np.array(["β", "C1", "C2", "β", "C1", "C2", "β", "C1", "C2", "β", "β", "C1", "C2"])
SWEEPS = 582
SHARES = (0.0, 0.1, 0.3, 0.6)
TERMS = ("speed, each whisker at all", "speed, its effect another in each whisker", "ε, half of it the whisker's",
         "θ_b, the whisker's alone", "speed, each whisker at one", "identity (β, C1, C2)")  # fmt: skip
TESTS = ("least squares", "ANOVA", "Kruskal–Wallis", "gated", "two-sample KS", "by whisker", "by animal")


def main(repeats: int) -> None:
    print(f"the term | share between whiskers | {' | '.join(TESTS)} | least squares below 1e-6 | below 1e-15")
    for term in TERMS:
        for share in SHARES:
            rng = np.random.default_rng(1)
            p = np.array([one(term, share, rng) for _ in range(repeats)])
            rates = " | ".join(f"{rate:.3f}" if np.isfinite(rate) else "–" for rate in rate_below(p))
            tiny = [np.mean(p[:, 0] < limit) for limit in (1e-6, 1e-15)]
            print(f"{term} | {share:.1f} | {rates} | {tiny[0]:.4f} | {tiny[1]:.4f}", flush=True)
    rng = np.random.default_rng(2)
    for n in (25, 60, 600):
        p = np.array([normality(rng.normal(size=n)) for _ in range(repeats)])
        print(f"gate, normal values, n = {n} | rejected | {np.mean(p < 0.05):.4f}")
        heavy = np.array([normality(rng.gamma(4, size=n)) for _ in range(repeats)])
        print(f"gate, skewed values (γ of shape 4), n = {n} | rejected | {np.mean(heavy < 0.05):.4f}")


def rate_below(p: np.ndarray) -> np.ndarray:
    made = np.isfinite(p)
    return np.where(made.any(axis=0), (p < 0.05).sum(axis=0) / np.maximum(made.sum(axis=0), 1), np.nan)


def one(term: str, share: float, rng: np.random.Generator) -> list[float]:
    """p-values of one simulated experiment, in the order of the tests; NaN where a test does not apply."""
    whisker = np.sort(rng.integers(0, 13, SWEEPS))
    animal = ANIMAL[whisker]
    speed = rng.choice([0.1, 0.2], SWEEPS)
    y = np.sqrt(share / 3) * rng.normal(size=6)[animal] + np.sqrt(2 * share / 3) * rng.normal(size=13)[whisker]
    y += np.sqrt(1 - share) * rng.normal(size=SWEEPS)
    if term == TERMS[1]:
        y += np.sqrt(share) * rng.normal(size=13)[whisker] * (speed - 0.15) / 0.05
    values = value_of(term, whisker, speed, rng)
    groups = cut(values)
    samples = [y[groups == name] for name in np.unique(groups)]
    return [
        linear_model(y, {term: values})[0].p,
        stats.f_oneway(*samples).pvalue,
        stats.kruskal(*samples).pvalue,
        gated(samples),
        stats.ks_2samp(*samples).pvalue if len(samples) == 2 else np.nan,
        *(clustered_model(y, {term: values}, clusters)[0].p for clusters in (whisker, animal)),
    ]


def normality(x: np.ndarray) -> float:
    """The paper's test of normality: Shapiro–Wilk below 30 values, else Kolmogorov–Smirnov.

    The second compares with the normal distribution of the values' own mean and spread, as if these had been known.
    """
    if len(x) < 30:
        return float(stats.shapiro(x).pvalue)
    return float(stats.kstest(x, stats.norm(x.mean(), x.std(ddof=1)).cdf).pvalue)


def gated(samples: list[np.ndarray]) -> float:
    """The paper's procedure: ANOVA where every group passes for normal, else Kruskal–Wallis."""
    test = stats.f_oneway if all(normality(sample) >= 0.05 for sample in samples) else stats.kruskal
    return float(test(*samples).pvalue)


def value_of(term: str, whisker: np.ndarray, speed: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    own = rng.normal(size=13)[whisker]
    return {
        TERMS[0]: speed,
        TERMS[1]: speed,
        TERMS[2]: (own + rng.normal(size=SWEEPS)) / np.sqrt(2),
        TERMS[3]: own,
        TERMS[4]: np.where(rng.permutation(13) < 6, 0.1, 0.2)[whisker],
        TERMS[5]: NAME[whisker],
    }[term]


def cut(values: np.ndarray) -> np.ndarray:
    """Groups: names as they are, numbers below and above their median."""
    if values.dtype.kind == "U":
        return values
    return np.where(values <= np.median(np.unique(values)), "low", "high")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
