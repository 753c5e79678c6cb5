"""How right sorters are on simulated recordings of known truth, and how long they take.

python benchmarks/sorting.py [RECORDINGS [SORTER ...]]

Each recording: 20 s, 8 electrodes 20 µm apart, 6 units (see ``vibrissa.neural.sorting.simulated.generate``). Times are
of the second recording on: the first call of a sorter compiles it.
"""

import sys
import time
from tempfile import TemporaryDirectory

import numpy as np

from vibrissa.neural.io.formats.traces import open_traces
from vibrissa.neural.sorting.simulated import generate
from vibrissa.neural.sorting.sorters import accuracy, sort

CLASSES = ((0.0, 5.0), (5.0, 8.0), (8.0, np.inf))  # of the units' signal to noise


def one(sorter, seed):
    """Give the scores of a sorter on one recording, and its seconds of processor."""
    with TemporaryDirectory() as folder:
        path, how, truth = generate(folder, seed=seed)
        traces, begun = open_traces(path, how), time.process_time()
        found = sort(traces, sorter, seed=seed)
        return accuracy(found, truth), time.process_time() - begun


def report(sorter, n):
    """Print accuracy, recall and precision by signal to noise."""
    scores, seconds = zip(*(one(sorter, seed) for seed in range(n)), strict=True)
    snr = np.concatenate([one.true_snr for one in scores])
    extra = sum(int(one.units_unmatched) for one in scores)
    print(f"{sorter}: first {seconds[0]:.0f} s, then {np.mean(seconds[1:]):.1f} s; {extra} units that match none")
    for low, high in CLASSES:
        here = (low <= snr) & (snr < high)
        lines = []
        for name in ("accuracy", "recall", "precision"):
            value = np.concatenate([one[f"sorting_{name}"] for one in scores])[here]
            lines.append(f"{name} {np.nanmean(value):.3f} (least {np.nanmin(value):.2f})")
        found = (np.concatenate([one.sorting_accuracy for one in scores])[here] >= 0.8).sum()
        print(
            f"  SNR {low:g} to {high:g}: {here.sum()} units, {found} with accuracy 0.8 or more; {', '.join(lines)}",
            flush=True,
        )


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for name in sys.argv[2:] or ("spykingcircus2", "tridesclous2", "simple"):
        report(name, count)
