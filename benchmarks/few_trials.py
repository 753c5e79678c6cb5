"""Whether intervals of `vibrissa glm` hold the truth where trials are few and blocks of the stimulus are the draws.

.venv/bin/python benchmarks/few_trials.py [GROUPS of 20 units, 5]

Three whiskers, 10 s, 2, 5 and 9 presentations; units of the kernels of `tests/neural/glm/test_one_presentation.py`,
Poisson, and with a gain of 30 % (SD of its logarithm) from presentation to presentation, which blocks cannot show.
Printed: share of the 95 % intervals of kernels and of effects that hold the truth; with Wilson's interval for the
effects, one for each unit and whisker.
"""

import sys
from pathlib import Path

import numpy as np

from vibrissa.neural.glm.bases import raised_cosines
from vibrissa.neural.glm.kernel_columns import Columns
from vibrissa.neural.glm.poisson_model import whisker_kernels
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.stats import wilson_interval

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "neural" / "glm"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "neural" / "io"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "neural" / "coupling"))
from test_one_presentation import HOW, PAST, RATE, SHARE, UNITS, kernel, stimulus

SECONDS = 10.0


def recorded(columns, trials, gain_sd, rng):
    """Spikes of units of known kernels in some trials."""
    drive = np.zeros(len(columns.valid))
    drive[columns.valid] = columns.shared[:, 1:] @ np.outer(SHARE, kernel()).ravel()
    gain = gain_sd * rng.standard_normal((UNITS, trials))
    counts = np.zeros((UNITS, trials, len(drive)))
    for k in range(len(drive)):
        before = counts[:, :, max(k - len(PAST), 0) : k][:, :, ::-1]
        held_off = before @ PAST[: before.shape[2]]
        counts[:, :, k] = rng.poisson(HOW.bin_width * RATE * np.exp(drive[k] + held_off + gain))
    fired = np.nonzero(counts)
    unit, trial, column = (np.repeat(one, counts[fired].astype(int)) for one in fired)
    return spike_table((column + 0.5) * HOW.bin_width, unit, [f"u{k}" for k in range(UNITS)], trial=trial)


def held(seed, trials, gain_sd):
    """Whether the intervals of kernels and of effects hold the truth."""
    command = stimulus(seed, SECONDS)
    columns = Columns.of(command, HOW)
    spikes = recorded(columns, trials, gain_sd, np.random.default_rng([seed, trials, round(10 * gain_sd)]))
    found = whisker_kernels(spikes, command, trials, HOW)
    truth = np.outer(SHARE, raised_cosines(HOW.lags()[0], HOW.shapes) @ kernel()) / columns.spread
    whole = truth.sum(1)
    kernels = (found.whisker_kernel_low <= truth) & (truth <= found.whisker_kernel_high)
    effects = (found.whisker_effect_low <= whole) & (whole <= found.whisker_effect_high)
    return kernels.values, effects.values


if __name__ == "__main__":
    groups = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    for gain_sd in (0.0, 0.3):
        for trials in (2, 5, 9):
            kernels, effects = zip(*(held(seed, trials, gain_sd) for seed in range(groups)), strict=True)
            within = np.concatenate(effects)
            low, high = wilson_interval(int(within.sum()), within.size)
            row = f"gain {gain_sd:.1f}  {trials} trials  {len(within)} units  kernels {100 * np.mean(kernels):.1f} %"
            print(f"{row}  effects {100 * within.mean():.1f} % [{100 * low:.1f}, {100 * high:.1f}]", flush=True)
