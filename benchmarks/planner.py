"""Whether the trials that are planned give the intervals that were wanted, on simulated units.

.venv/bin/python benchmarks/planner.py [REPEATS, 200]

Every row is one unit. The trials it needs for its interval are planned from the stimulus; then so many are drawn again
and again and fitted. `within`: share of the fits that err by no more than was wanted (95 % if the plan is right);
`half`: median half width of the intervals found by resampling trials, over that wanted; `hold`: share of these
intervals that hold the truth. In the last rows the gain of each trial varies, and the plan knows by how much.
"""

import sys
from pathlib import Path

import numpy as np

from vibrissa.neural.coding.planner import Wanted, plan_trials
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.neural.coupling.threshold_linear import HingeGrid
from vibrissa.neural.coupling.tuning import ENDS, bootstrap_fits, forward_fit, predicted
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
from vibrissa.quantities import dataset
from vibrissa.stats import wilson_interval

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))
import populations  # the stimuli of the tests

WIDTH = 0.01  # [s]
CASES = [
    (ThresholdLinearUnit(), Wanted(threshold=4e-6), 0.0),
    (ThresholdLinearUnit(), Wanted(threshold=3e-6), 0.0),
    (ThresholdLinearUnit(), Wanted(slope=0.1), 0.0),
    (ThresholdLinearUnit(), Wanted(latency=1e-3), 0.0),
    (ThresholdLinearUnit(baseline=1.0), Wanted(threshold=3e-6), 0.0),
    (ThresholdLinearUnit(threshold=70e-6), Wanted(threshold=5e-6), 0.0),
    (ThresholdLinearUnit(slope=1e5), Wanted(threshold=6e-6), 0.0),
    (ThresholdLinearUnit(slope=1e5), Wanted(slope=0.2), 0.0),
    (ThresholdLinearUnit(), Wanted(slope=0.1), 0.3),
    (ThresholdLinearUnit(), Wanted(threshold=4e-6), 0.3),
]


def drive(seed):
    """Stimulus of the tests, as the analysis sees it."""
    time, displacement = populations.ringing(np.random.default_rng(seed))
    return Presentation.of(dataset(time=time, point_displacement=displacement)).drive()


def simulated(grid, unit, n_trials, gain_sd, rng):
    """Fit and interval of one experiment, (4,) and (2, 4)."""
    rate = predicted(grid.drive, unit) * WIDTH
    sigma = np.sqrt(np.log1p(gain_sd**2))
    gain = np.exp(sigma * rng.standard_normal((n_trials, 1)) - sigma**2 / 2)
    counts = rng.poisson(rate * gain).astype(float)
    fit = forward_fit(grid, counts.sum(0), n_trials * WIDTH)
    samples = bootstrap_fits(grid, counts, WIDTH, fit, n_resamples=200, rng=rng)
    return np.array(fit), np.quantile(samples, ENDS, axis=1)


if __name__ == "__main__":
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    grid = HingeGrid.of(drive(1))
    for unit, wanted, gain_sd in CASES:
        plan = plan_trials(grid.drive, [unit], wanted, gain_sd=gain_sd)
        n = int(plan.trials_needed.item())
        name, k = next((name, k) for k, name in enumerate(("threshold", "slope", "latency")) if getattr(wanted, name))
        target = getattr(wanted, name) * (unit.slope if name == "slope" else 1)
        runs = [simulated(grid, unit, n, gain_sd, np.random.default_rng([7, seed])) for seed in range(repeats)]
        error = np.array([fit[k] for fit, _ in runs]) - getattr(unit, name)
        low, high = np.array([ends[:, k] for _, ends in runs]).T
        hold = int(np.sum((low <= getattr(unit, name)) & (getattr(unit, name) <= high)))
        within = int(np.sum(np.abs(error) <= target))
        shares = [
            "{:.0f} % [{:.0f}, {:.0f}]".format(*(100 * x for x in (one / repeats, *wilson_interval(one, repeats))))
            for one in (within, hold)
        ]
        print(
            f"{1e6 * unit.threshold:5.1f} µm {1e-6 * unit.slope:.2f}/(s µm) {unit.baseline:3.0f} Hz "
            f"gain ±{gain_sd:.1f}  {name} within {getattr(wanted, name):g}: {n} trials; within {shares[0]}, "
            f"half {np.median(high - low) / 2 / target:.2f}, hold {shares[1]}, "
            f"bias {error.mean() / target:+.2f}, 1.96 SD {1.96 * error.std(ddof=1) / target:.2f}",
            flush=True,
        )
