"""How often `glm` and `surround` name a whisker where none drives the unit, in every trial alike, and where one does.

.venv/bin/python benchmarks/shift_nulls.py [UNITS of each of 4 stimuli, 25]

Eight whiskers, 40 trials of 6 s, level 1 %. `rolled`: the unit is driven by a motion that was not played; `feature`: by
something slow; `driven`: by whiskers of the stimulus. Printed: share of units for which some whisker is called, with
Wilson's interval, by glm, by Wald's test alone, and by surround; share of all whiskers that glm calls.
"""

import sys
from pathlib import Path

import numpy as np

from vibrissa.neural.glm.kernel_columns import KernelAnalysis
from vibrissa.neural.glm.poisson_model import whisker_kernels
from vibrissa.neural.glm.surround import SurroundAnalysis, surround_map
from vibrissa.neural.io.tables.spikes import join_units
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes
from vibrissa.neural.simulated.wandering import unrelated_feature
from vibrissa.stats import adjusted_p_values, wilson_interval

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "neural" / "glm"))
from test_surround import TRIALS, TRUTH, Sum, copies  # the stimuli and units of the tests

LEVEL = 0.01


def recorded(what, stimulus, n_units):
    """Spikes of units, and the command that is held against them."""
    command, envelopes = copies(stimulus)
    time, tables = command.time.values, {}
    for k in range(n_units):
        rng, unit, drive = np.random.default_rng([7, stimulus, k]), ThresholdLinearUnit(), envelopes
        if what == "rolled":
            drive = copies(100 + k + 17 * stimulus)[1][0]
        elif what == "feature":
            drive = unrelated_feature(time, mean=55e-6, timescale=0.05, rng=rng)
        else:
            unit = Sum(TRUTH)
        tables[f"u{k}"] = simulate_spikes(unit, time, drive, TRIALS, rng=rng)
    return join_units(tables), command


def share(called):
    low, high = wilson_interval(int(np.sum(called)), len(called))
    return f"{100 * np.mean(called):.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


if __name__ == "__main__":
    n_units = int(sys.argv[1]) if len(sys.argv) > 1 else 25
    for what in ("rolled", "feature", "driven"):
        glm, wald, surround = [], [], []
        for stimulus in range(4):
            spikes, command = recorded(what, stimulus, n_units)
            kernels = whisker_kernels(spikes, command, TRIALS, KernelAnalysis(level=LEVEL))
            weights = surround_map(spikes, command, TRIALS, SurroundAnalysis(level=LEVEL))
            glm += kernels.whisker_matters.values.tolist()
            wald += [adjusted_p_values(one) <= LEVEL for one in kernels.whisker_trial_p_value.values]
            surround += np.isin(weights.surround_verdict.values, ["drives", "suppresses"]).tolist()
        any_of = [np.any(one, axis=1) for one in (glm, wald, surround)]
        print(f"{what:8s} n {len(glm)}  glm {share(any_of[0])}, of whiskers {100 * np.mean(glm):.2f} %;"
              f" Wald alone {share(any_of[1])}; surround {share(any_of[2])}", flush=True)  # fmt: skip
