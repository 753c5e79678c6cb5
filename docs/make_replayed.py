"""Simulate units that answer the command of `vibrissa replay`: the spikes of "Five minutes", 6. Cortex.

python docs/make_replayed.py command.wav examples/replayed-spikes.csv

with the command of the README. Two units follow the envelope of whisker C2 above a threshold, one follows nothing; what
is put in is in UNITS, in the order of the columns in NAMES.
"""

import csv
import sys
from pathlib import Path

from vibrissa.neural.simulated.driven import fire, read_driven
from vibrissa.study.neurons.stimuli import read_stimulus
from vibrissa.study.spec.given import StimulusInput

NAMES = ["unit", "threshold_um", "slope_per_um", "baseline", "latency_ms", "quality"]
UNITS = [["a", 6, 1.5, 2, 12, "SU"], ["b", 10, 3.0, 3, 15, "MU"], ["c", 1000, 1.0, 5, 15, "MU"]]
TRIALS = 20


def simulate(command, out):
    """Let the units hear the command, and write unit, trial and time of each spike."""
    table = Path(out).with_suffix(".units.csv")
    with table.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([NAMES, *UNITS])
    units = read_driven(table)
    table.unlink()
    stimulus, _ = read_stimulus(StimulusInput(stimulus=command, whisker="C2"))
    spikes = fire(units, stimulus.time.values, stimulus.point_displacement.values, TRIALS)
    names = units.unit_name.values[spikes.spike_unit.values]
    with Path(out).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["unit", "trial", "spike_time"])
        for name, trial, time in zip(names, spikes.spike_trial.values, spikes.spike_time.values, strict=True):
            writer.writerow([name, trial, f"{time:.4f}"])


if __name__ == "__main__":
    simulate(*sys.argv[1:])
