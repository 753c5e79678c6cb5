"""How often `glm` and `surround` name a whisker where none drives the unit, in every trial alike, and where one does.

.venv/bin/python benchmarks/shift_nulls.py [UNITS of each of 4 stimuli, 25] [rolled|feature|driven|once …]

Eight whiskers, 40 trials of 6 s, level 1 %. `rolled`: the unit is driven by a motion that was not played; `feature`: by
something slow; `driven`: by whiskers of the stimulus. `once`: one presentation of 25 s on three whiskers, rolled by a
fifth, two, three and four fifths; four times as many units. Printed: share of units for which some whisker is called,
with Wilson's interval, by glm, by Wald's test alone, and by surround; share of all whiskers that glm and surround call.
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
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "neural" / "io"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "neural" / "coupling"))
from test_one_presentation import UNITS, rolled, summed
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


def presented_once(n_units):
    """Spikes of one presentation, and it rolled, a part of the units at each of four shifts."""
    for k in range(4 * n_units // UNITS):
        yield summed(k), rolled(k, 0.2 + 0.2 * (k % 4)), 1


def recordings(what, n_units):
    """Spikes, command and trials of each stimulus."""
    if what == "once":
        yield from presented_once(4 * n_units)
        return
    for stimulus in range(4):
        yield *recorded(what, stimulus, n_units), TRIALS


def share(called):
    low, high = wilson_interval(int(np.sum(called)), np.size(called))
    return f"{100 * np.mean(called):.2f} % [{100 * low:.2f}, {100 * high:.2f}]"


if __name__ == "__main__":
    n_units = int(sys.argv[1]) if len(sys.argv) > 1 else 25
    for what in sys.argv[2:] or ("rolled", "feature", "driven", "once"):
        glm, wald, surround = [], [], []
        for spikes, command, trials in recordings(what, n_units):
            kernels = whisker_kernels(spikes, command, trials, KernelAnalysis(level=LEVEL))
            weights = surround_map(spikes, command, trials, SurroundAnalysis(level=LEVEL))
            glm += kernels.whisker_matters.values.tolist()
            wald += [adjusted_p_values(one) <= LEVEL for one in kernels.whisker_trial_p_value.values]
            surround += np.isin(weights.surround_verdict.values, ["drives", "suppresses"]).tolist()
        by_unit, by_wald, by_map = (share(np.any(one, axis=1)) for one in (glm, wald, surround))
        print(f"{what:8s} n {len(glm)}  units: glm {by_unit}; Wald alone {by_wald}; surround {by_map}")
        print(f"    of {np.size(glm)} whiskers: glm {share(glm)}; surround {share(surround)}", flush=True)
