"""How often `discriminate` keeps its word, on Poisson units whose truth is known.

.venv/bin/python benchmarks/discrimination.py [REPEATS, 400]

`best`: one unit with mean counts of 4, 7 and 11 in trials of three textures; the share of right answers of the best
decoder there is, and the area under the ROC curve of the first two, are sums over Poisson counts. Printed: means of
what is found, and how often the 95 % intervals hold the truth. `course`: eight units whose rates change in time; the
best decoder knows them and is asked 200,000 simulated trials. `chance`: units that answer all textures alike; how often
any of four codes is said to discriminate them, and the mean p-value.
"""

import sys

import numpy as np
from scipy.stats import poisson

from vibrissa.neural.coding.discrimination import TELLS, Discrimination, discriminate
from vibrissa.stats import wilson_interval

RATES = np.array([4.0, 7.0, 11.0])


def presented(rng, n_textures, n_each):
    """Textures in random order."""
    return rng.permutation(np.arange(n_textures * n_each) % n_textures)


def share_held(held, repeats):
    """Share with its interval, in per cent."""
    low, high = wilson_interval(int(held), repeats)
    return f"{100 * held / repeats:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def one_unit(repeats, n_each):
    """Mean rates of one unit, against sums over Poisson counts."""
    n = np.arange(80)
    best = poisson.pmf(n[:, None], RATES).max(1).sum() / 3
    area = np.sum(poisson.pmf(n, 7) * (poisson.cdf(n - 1, 4) + poisson.pmf(n, 4) / 2))
    found, held = np.empty((repeats, 2)), np.zeros(2)
    how = Discrimination(codes=("mean rate",), n_permutations=19)
    for seed in range(repeats):
        rng = np.random.default_rng([1, seed])
        label = presented(rng, 3, n_each)
        counts = rng.poisson(np.repeat(RATES[label][:, None, None] / 5, 5, axis=2)).astype(float)
        data = discriminate(counts, [f"{k}" for k in label], how)
        found[seed] = data.accuracy.item(), data.auc[0, 0].item()
        held += (
            data.accuracy_low.item() <= best <= data.accuracy_high.item(),
            (data.auc_low[0, 0].item() <= area <= data.auc_high[0, 0].item()),
        )
    accuracy, shares = found.mean(0)[0], share_held(held[0], repeats)
    print(f"best, {n_each} trials of each texture: accuracy {accuracy:.3f} of {best:.3f}, held {shares};")
    print(f"  area {found[:, 1].mean():.3f} of {area:.3f}, held {share_held(held[1], repeats)}", flush=True)


def course(repeats, n_each):
    """Time courses of eight units, against the decoder that knows them."""
    rng = np.random.default_rng(2)
    rates = rng.gamma(4.0, 0.05, (3, 8, 20))
    label = presented(rng, 3, 200_000 // 3)
    seen = rng.poisson(rates[label].astype(np.float32)).reshape(label.size, -1)
    scores = seen @ np.log(rates.reshape(3, -1)).T - rates.sum((1, 2))
    best = np.mean(scores.argmax(1) == label)
    found = []
    for seed in range(repeats):
        rng = np.random.default_rng([3, seed])
        label = presented(rng, 3, n_each)
        how = Discrimination(codes=("time course",), n_permutations=19)
        found.append(
            discriminate(rng.poisson(rates[label]).astype(float), [f"{k}" for k in label], how).accuracy.item()
        )
    print(
        f"course, {n_each} trials of each texture: accuracy {np.mean(found):.3f}, best there is {best:.3f}", flush=True
    )


def chance(repeats):
    """Units that answer all textures alike."""
    said, p_values, shares = 0, [], []
    for seed in range(repeats):
        rng = np.random.default_rng([4, seed])
        label = presented(rng, 3, 15)
        how = Discrimination(n_permutations=199, n_partitions=1, seed=seed)
        data = discriminate(rng.poisson(0.4, (45, 4, 15)).astype(float), [f"{k}" for k in label], how)
        said += np.any(data.code_verdict == TELLS).item()
        p_values.append(data.code_p_value.values)
        shares.append(data.accuracy.values)
    print(f"chance: any of four codes said to discriminate: {share_held(said, repeats)}, at 5 %")
    print(f"  mean p-values {np.mean(p_values, axis=0)}")
    print(f"  mean accuracies {np.mean(shares, axis=0)} of 0.333")


if __name__ == "__main__":
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    for n_each in (20, 60):
        one_unit(repeats, n_each)
    for n_each in (10, 40, 160):
        course(max(repeats // 10, 2), n_each)
    chance(repeats // 2)
