"""From a texture to spikes and back, over many populations: do the intervals hold what was put in?

python benchmarks/forward.py [POPULATIONS]

Each population is new: texture, units, spikes. Rates are held against the hinge they were drawn from, and thresholds,
slopes, latencies and baselines against what ``vibrissa neural`` finds in the spikes.
"""

import sys
import time

import numpy as np

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.simulated.driven import draw_driven
from vibrissa.study.forward.forward import TrialSettings, forward
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.055, cone_angle=1.2e-3, tip=0.05)
POSTURE, SCAN = Posture(contact=0.29, base_angle=1.2), Scan(speed=0.1, damping=0.11)
UNITS, TRIALS, RATE, MEAN_ENVELOPE = 20, 40, 4000.0, 55e-6
FITTED = ("threshold", "slope", "latency", "baseline")


def one(seed):
    """Give truth, fit and spikes of one population."""
    texture, units = (make(np.random.default_rng([seed, k])) for k, make in enumerate((grating, population)))
    how = TrialSettings(n_trials=TRIALS, seed=seed, mean_envelope=MEAN_ENVELOPE)
    spikes = forward(texture, WHISKER, POSTURE, SCAN, units, how, sampling_rate=RATE)
    return spikes, analyse_units(spikes, spikes, TRIALS, EnvelopeAnalysis(skip=0.1))


def grating(rng):
    return random_grating(0.5, rng=rng)


def population(rng):
    return draw_driven(UNITS, rng=rng)


def z_of_rates(spikes):
    """Spikes of each multi-unit over all trials, less their expectation, over its Poisson deviation."""
    t, envelope = spikes.time.values, spikes.point_envelope.values
    z = []
    for k in np.flatnonzero(spikes.unit_quality.values == "MU"):
        theta, slope, late, base = (float(spikes[f"true_{name}"][k]) for name in FITTED)
        rate = base + slope * np.maximum(np.interp(t - late, t, envelope, left=0) - theta, 0)
        expected = TRIALS * np.trapezoid(rate, t)
        z.append(((spikes.spike_unit.values == k).sum() - expected) / np.sqrt(expected))
    return z


def main(n):
    inside, error, z, n_units, seconds = {name: [] for name in FITTED}, {name: [] for name in FITTED}, [], 0, 0.0
    for seed in range(n):
        begun = time.perf_counter()
        spikes, found = one(seed)
        seconds += time.perf_counter() - begun
        z += z_of_rates(spikes)
        sure = found.identified.values & found.significant.values
        n_units += spikes.sizes["unit"]
        for name in FITTED:
            true, low, high, got = (
                values[sure]
                for values in (
                    spikes[f"true_{name}"].values,
                    *(found[f"{name}{end}"].values for end in ("_low", "_high", "")),
                )
            )
            inside[name] += ((low <= true) & (true <= high)).tolist()
            error[name] += ((got - true) / true).tolist()
    print(f"{n} populations, {n_units} units, {len(inside['slope'])} identified, {seconds / n:.1f} s each")
    print(f"counts against the hinge: z = {np.mean(z):+.2f} ± {np.std(z):.2f} over {len(z)} multi-units")
    for name in FITTED:
        low, mid, high = 100 * np.percentile(error[name], [5, 50, 95])
        held, errors = 100 * np.mean(inside[name]), f"median {mid:+.2f} %, {low:+.1f} to {high:+.1f} %"
        print(f"{name:>9}: inside {held:.1f} %; error {errors}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 50)
