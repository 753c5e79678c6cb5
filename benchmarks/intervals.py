"""Whether the intervals of `vibrissa neural` hold the truth, and whether it says where it has none.

.venv/bin/python benchmarks/intervals.py [UNITS, 200] [FILE, intervals.json] [CASE …]

Every unit has its own stimulus of 10 s and 60 trials; threshold 42.3 µm, slope 0.25 AP/s/µm, latency drawn from 6 to
22 ms. Cases: Poisson counts; a gain that wanders within and between trials; another feature that the unit answers in
every trial alike; curves that are not threshold-linear (saturating, square, logarithmic, sigmoid, adapting). Printed:
share of the 95 % intervals that hold the truth, with Wilson's interval; share identified; share of the units for which
another curve is named, and which. `agree`: share of pairs of thirds of one stimulus, of the units with another feature,
whose estimates differ by no more than their intervals allow (95 % if these are right). Units that are done are kept in
FILE, and a run that was stopped continues.
"""

import json
import sys
from collections import Counter
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from vibrissa.neural.coupling.lack_of_fit import describe
from vibrissa.neural.coupling.repeatability import r_squared_ceiling
from vibrissa.neural.coupling.threshold_linear import BinnedDrive, Hinge, HingeGrid
from vibrissa.neural.coupling.tuning import ENDS, bootstrap_fits, forward_fit, weakness
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.stats import wilson_interval

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))
import populations  # the stimuli of the tests

WIDTH, TRIALS, THRESHOLD, SLOPE, BASELINE = populations.WIDTH, 60, 42.3e-6, 2.5e5, 5.0
LINEAR = ("poisson", "gain", "feature", "thirds")
CURVED = ("saturating", "square", "logarithmic", "sigmoid", "adapting")


def presented(rng):
    """A stimulus, seen through bins after the first second."""
    time, displacement = populations.ringing(rng)
    bins = np.arange(populations.BINS)
    edges = WIDTH * np.arange(populations.BINS + 1)
    valid = (bins >= 100) & (bins < bins.size - 5)
    return BinnedDrive(time=time, envelope=analytic_envelope(displacement)[0], edges=edges, valid=valid)


def curve(case, a):
    """Rate [Hz] at an envelope [m]."""
    above = np.maximum(a - THRESHOLD, 0)
    return {
        "saturating": BASELINE + SLOPE * (above - np.maximum(a - 85e-6, 0)),
        "square": BASELINE + 5e9 * above**2,
        "logarithmic": 30 * np.log1p(a / 20e-6),
        "sigmoid": BASELINE + 25 / (1 + np.exp(-(a - 60e-6) / 12e-6)),
    }.get(case, BASELINE + SLOPE * above)


def counts_of(case, drive, latency, rng):
    """Counts of each trial in the bins that count."""
    rate = drive.seen(curve(case, drive.envelope), latency)
    if case == "adapting":  # a leaky mean of the drive over 100 ms is taken away
        hinge, keep, past = (rate - BASELINE) / SLOPE, np.exp(-WIDTH / 0.1), np.zeros(rate.size)
        for k in range(1, rate.size):
            past[k] = keep * past[k - 1] + (1 - keep) * hinge[k - 1]
        rate = np.maximum(BASELINE + SLOPE * (1.3 * hinge - past), 0)
    if case in ("feature", "thirds"):
        rate = rate * np.exp(0.4 * populations.wander((populations.BINS,), 0.05, rng)[-rate.size :] - 0.08)
    gain = np.ones((TRIALS, 1))
    if case == "gain":
        slow = populations.wander((TRIALS, populations.BINS), 0.3, rng)[:, -rate.size :]
        gain = np.exp(0.3 * rng.standard_normal((TRIALS, 1)) + 0.3 * slow - 0.09)
    return rng.poisson(rate * WIDTH * gain).astype(float)


def fitted(drive, counts, rng):
    """Fit, ends of its intervals, the curve that describes the unit, and why it is not identified."""
    grid = HingeGrid.of(drive)
    fit = forward_fit(grid, counts.sum(0), len(counts) * WIDTH)
    samples = bootstrap_fits(grid, counts, WIDTH, fit, rng=rng)
    model = describe(drive, counts.mean(0) / WIDTH, fit, r_squared_ceiling(counts)).model if fit.slope > 0 else ""
    return fit, np.quantile(samples, ENDS, axis=1), model, weakness(grid, samples)


def unit(case, k):
    """One unit: intervals that hold, its name, and whether it is identified; of thirds, the pairs that agree."""
    rng = np.random.default_rng([20261123, [*LINEAR, *CURVED].index(case), k])
    drive, latency = presented(rng), rng.uniform(0.006, 0.022)
    counts = counts_of(case, drive, latency, rng)
    if case == "thirds":
        return {"agree": thirds(drive, counts, rng)}
    if case in CURVED:  # no threshold to be held
        fit = forward_fit(HingeGrid.of(drive), counts.sum(0), TRIALS * WIDTH)
        model = describe(drive, counts.mean(0) / WIDTH, fit, r_squared_ceiling(counts)).model
        return {"model": model, "identified": model == "threshold-linear"}
    fit, (low, high), model, why = fitted(drive, counts, rng)
    truth = np.array(Hinge(THRESHOLD, SLOPE, latency, BASELINE))
    held = ((low <= truth) & (truth <= high)).tolist()
    return {"held": held, "model": model, "identified": not why and model == "threshold-linear"}


def thirds(drive, counts, rng):
    """Whether threshold, slope, latency agree between each two thirds of the stimulus."""
    found = []
    for part in np.array_split(np.flatnonzero(drive.valid), 3):
        valid = np.isin(np.arange(drive.valid.size), part)
        fit, (low, high), *_ = fitted(replace(drive, valid=valid), counts[:, valid[drive.valid]], rng)
        found.append((np.array(fit)[:3], (high - low)[:3] / 2))
    return [(np.abs(a - b) <= np.hypot(half_a, half_b)).tolist() for (a, half_a), (b, half_b) in combinations(found, 2)]


def share(values):
    """Share with its interval, in per cent."""
    n, k = len(values), int(np.sum(values))
    low, high = wilson_interval(k, n)
    return f"{100 * k / n:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def report(case, rows):
    if case == "thirds":
        agree = np.concatenate([row["agree"] for row in rows])
        print(f"{case:12s} n {len(rows)}  agree: threshold, slope, latency", *map(share, agree.T), sep="  ", flush=True)
        return
    sure = [row["identified"] for row in rows]
    name = "identified" if case in LINEAR else "threshold-linear"
    print(f"{case:12s} n {len(rows)}  {name} {share(sure)}  described by {dict(Counter(r['model'] for r in rows))}")
    if case in LINEAR:
        kept = [row["held"] for row in rows if row["identified"]]
        print(
            "    all: threshold, slope, latency, baseline",
            *(map(share, np.transpose([r["held"] for r in rows]))),
            sep="  ",
        )
        print("    identified", *(map(share, np.transpose(kept))), sep="  ", flush=True)


if __name__ == "__main__":
    n_units = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    file = Path(sys.argv[2] if len(sys.argv) > 2 else "intervals.json")
    done = json.loads(file.read_text()) if file.exists() else {}
    for case in sys.argv[3:] or (*LINEAR, *CURVED):
        rows = done.setdefault(case, [])
        while len(rows) < n_units:
            rows.append(unit(case, len(rows)))
            if len(rows) % 20 == 0 or len(rows) == n_units:
                file.write_text(json.dumps(done))
        report(case, rows[:n_units])
