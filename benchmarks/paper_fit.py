"""Bias of the paper's binned fit, over the latency within a bin and over stimuli: thresholds and slopes found.

.venv/bin/python benchmarks/paper_fit.py [STIMULI, 20]

Rates without noise of a unit of threshold 42.3 µm, slope 0.25 AP/s/µm and baseline 5 Hz, in bins of 10 ms; two segments
at the best whole shift of −1 to 1 bin, as `--fit paper2014` fits them. Means over STIMULI of each kind: kicks of equal
size and one sign (`one`), of either sign (`either`), of random size and sign (`random`). With a lag of 2 bins at most,
too (`wide`), as a latency above 15 ms is nearer to that than to one bin.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from vibrissa.neural.coupling.segments import two_segments
from vibrissa.neural.coupling.threshold_linear import BinnedDrive
from vibrissa.signals.envelope import analytic_envelope

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))
import populations  # bins of the tests

THRESHOLD, SLOPE, BASELINE = 42.3e-6, 2.5e5, 5.0
LATENCIES = (0.0, 5e-3, 8e-3, 10e-3, 12e-3, 15e-3, 18e-3, 20e-3)  # [s]
KINDS = ("one", "either", "random")


def ringing(kind, rng, rate=2000.0, frequency=70.0, damping=0.11):
    """A ringing motion of 10 s with a mean envelope of 55 µm, kicked 167 times a second."""
    time = np.arange(round(10 * rate)) / rate
    at = rng.integers(0, time.size, rng.poisson(1670))
    size = {"one": 1.0, "either": rng.choice([-1, 1], at.size), "random": rng.standard_normal(at.size)}[kind]
    kicks = np.bincount(at, np.broadcast_to(size, at.shape), minlength=time.size)
    omega = 2 * np.pi * frequency
    pole = np.exp((-damping + 1j * np.sqrt(1 - damping**2)) * omega / rate)
    x = lfilter([0, pole.imag], [1, -2 * pole.real, abs(pole) ** 2], kicks)
    return time, (x - x.mean()) * 55e-6 / analytic_envelope(x)[0].mean()


def found(kind, seed, latency, most):
    """Threshold, slope and R² at the best whole shift up to `most` bins."""
    time, displacement = ringing(kind, np.random.default_rng([7, KINDS.index(kind), seed]))
    bins = np.arange(populations.BINS)
    drive = BinnedDrive(
        time=time,
        envelope=analytic_envelope(displacement)[0],
        edges=populations.WIDTH * np.arange(populations.BINS + 1),
        valid=(bins >= 5) & (bins < bins.size - 5),
    )
    envelope = drive.seen(drive.envelope, 0.0)
    rate = BASELINE + SLOPE * drive.hinged(THRESHOLD, latency)
    lag = max(range(-1, most + 1), key=lambda one: np.corrcoef(np.roll(envelope, one)[5:-5], rate[5:-5])[0, 1])
    segments = two_segments(np.roll(envelope, lag)[5:-5], rate[5:-5])
    return segments.threshold, segments.slope, segments.r_squared, lag


if __name__ == "__main__":
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    print("| latency [ms] | kicks | lag at most [bins] | threshold [µm] | slope [AP/s/µm] | R² |")
    print("|---|---|---|---|---|---|")
    for latency in LATENCIES:
        for kind in KINDS:
            for most in (1, 2) if latency > 0.01 else (1,):
                values = np.array([found(kind, seed, latency, most)[:3] for seed in range(n)])
                (theta, slope, explained), (spread, by, _) = values.mean(0), values.std(0, ddof=1)
                print(
                    f"| {1e3 * latency:g} | {kind} | {most} | {1e6 * theta:.1f} ± {1e6 * spread:.1f} "
                    f"| {1e-6 * slope:.3f} ± {1e-6 * by:.3f} | {explained:.2f} |",
                    flush=True,
                )
