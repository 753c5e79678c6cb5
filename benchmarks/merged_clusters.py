"""How often `vibrissa sort` flags a cluster as merged that holds one neuron, and one that holds two.

sorting/bin/python benchmarks/merged_clusters.py [RECORDINGS, 50]

Each recording: 20 s, 8 electrodes, 6 units (see ``vibrissa.neural.sorting.simulated.generate``). The true units are
looked at in place of sorted ones, so that a cluster is known to hold one neuron; then the units of each pair that share
their largest electrode, as one cluster. Printed: share flagged by signal to noise, with Wilson's interval.
"""

import sys
from itertools import combinations
from tempfile import TemporaryDirectory

import numpy as np

from vibrissa.neural.io.formats.traces import open_traces
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.sorting.simulated import generate
from vibrissa.neural.sorting.sorters import labelled, numbered
from vibrissa.stats import wilson_interval


def flagged(traces, table):
    """Whether each unit of a table is flagged, and its electrode."""
    rate = traces.get_sampling_frequency()
    found = labelled(traces, numbered(table, rate), {"sorter": "truth", "sorter_seed": 0})
    return found.merged.values, found.unit_electrode.values


def one(seed):
    """Flags of single units and of pairs, and the signal to noise: of pairs the smaller one."""
    with TemporaryDirectory() as folder:
        path, how, truth = generate(folder, seed=seed)
        traces = open_traces(path, how)
        single, electrode = flagged(traces, truth)
        snr = truth.snr_mean.values
        near = [(a, b) for a, b in combinations(range(len(snr)), 2) if electrode[a] == electrode[b]]
        trains = [truth.spike_time.values[truth.spike_unit.values == k] for k in range(len(snr))]
        joined = [np.sort(np.concatenate([trains[a], trains[b]])) for a, b in near]
        units = np.repeat(np.arange(len(near)), [times.size for times in joined])
        if not near:
            return single, snr, [], []
        table = spike_table(np.concatenate(joined), units, [f"{a}+{b}" for a, b in near])
        return single, snr, flagged(traces, table)[0], [min(snr[a], snr[b]) for a, b in near]


def report(what, flags, snr):
    for low, high in ((0, 3.1), (3.1, 8), (8, np.inf), (3.1, np.inf)):
        here = (np.array(snr) >= low) & (np.array(snr) < high)
        k, n = int(np.array(flags)[here].sum()), int(here.sum())
        if n:
            least, most = wilson_interval(k, n)
            row = f"{what}, {low:g} to {high:g}: {k} of {n}, {100 * k / n:.1f} %"
            print(f"{row} [{100 * least:.1f}, {100 * most:.1f}]", flush=True)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    single, snr, pairs, least = (np.concatenate(part) for part in zip(*map(one, range(count)), strict=True))
    report("one neuron", single, snr)
    report("two neurons", pairs, least)
