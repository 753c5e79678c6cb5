"""Whether intervals of `vibrissa glm` hold the truth where trials are few and blocks of the stimulus are the draws.

.venv/bin/python benchmarks/few_trials.py [GROUPS of 20 units, 10] [poisson|trials|within …]

Three whiskers, 10 s, 2, 5, 9 and, with trials as the draws, 20 presentations; units of the kernels of
`tests/neural/glm/test_one_presentation.py`, Poisson, and with a gain of 30 % (SD of its logarithm) from presentation to
presentation (`trials`), which blocks cannot show, or within them, over 0.3 s (`within`).
Printed: share of the 95 % intervals of kernels and of effects that hold the truth; with Wilson's interval for the
effects, one for each unit and whisker.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

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

SECONDS, GAIN = 10.0, 0.3


def logarithm_of_gain(kind, shape, rng):
    """Of each unit, trial and bin."""
    if kind == "within":
        keep = np.exp(-HOW.bin_width / 0.3)
        noise = rng.standard_normal((*shape[:2], shape[2] + 400))
        return GAIN * lfilter([np.sqrt(1 - keep**2)], [1, -keep], noise)[..., 400:]
    return {"poisson": 0.0, "trials": GAIN}[kind] * rng.standard_normal(shape[:2])[..., None] + np.zeros(shape)


def recorded(columns, trials, kind, rng):
    """Spikes of units of known kernels in some trials."""
    drive = np.zeros(len(columns.valid))
    drive[columns.valid] = columns.shared[:, 1:] @ np.outer(SHARE, kernel()).ravel()
    gain = logarithm_of_gain(kind, (UNITS, trials, len(drive)), rng)
    counts = np.zeros((UNITS, trials, len(drive)))
    for k in range(len(drive)):
        before = counts[:, :, max(k - len(PAST), 0) : k][:, :, ::-1]
        held_off = before @ PAST[: before.shape[2]]
        counts[:, :, k] = rng.poisson(HOW.bin_width * RATE * np.exp(drive[k] + held_off + gain[:, :, k]))
    fired = np.nonzero(counts)
    unit, trial, column = (np.repeat(one, counts[fired].astype(int)) for one in fired)
    return spike_table((column + 0.5) * HOW.bin_width, unit, [f"u{k}" for k in range(UNITS)], trial=trial)


def held(seed, trials, kind):
    """Whether the intervals of kernels and of effects hold the truth."""
    command = stimulus(seed, SECONDS)
    columns = Columns.of(command, HOW)
    spikes = recorded(columns, trials, kind, np.random.default_rng([seed, trials, 3 * (kind != "poisson")]))
    found = whisker_kernels(spikes, command, trials, HOW)
    truth = np.outer(SHARE, raised_cosines(HOW.lags()[0], HOW.shapes) @ kernel()) / columns.spread
    whole = truth.sum(1)
    kernels = (found.whisker_kernel_low <= truth) & (truth <= found.whisker_kernel_high)
    effects = (found.whisker_effect_low <= whole) & (whole <= found.whisker_effect_high)
    return kernels.values, effects.values


if __name__ == "__main__":
    groups = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for kind in sys.argv[2:] or ("poisson", "trials", "within"):
        for trials in (2, 5, 9, 20):
            kernels, effects = zip(*(held(seed, trials, kind) for seed in range(groups)), strict=True)
            within = np.concatenate(effects)
            low, high = wilson_interval(int(within.sum()), within.size)
            row = f"{kind:8}{trials:3} trials  {len(within)} units  kernels {100 * np.mean(kernels):.1f} %"
            print(f"{row}  effects {100 * within.mean():.1f} % [{100 * low:.1f}, {100 * high:.1f}]", flush=True)
