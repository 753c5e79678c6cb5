"""Simulate what `vibrissa discriminate` reads: spikes of 12 units in trials of four gratings, and which was when.

python docs/make_discrimination.py [FOLDER]

writes spikes.csv and textures.csv. A long whisker scans four random gratings; its predicted motion 5 mm from the base
is scaled so that the mean envelope of the first is 55 µm, and drives units as the paper found them. Gratings A, B and C
have the same mean period and differ in the order of their gaps alone; D is coarser. The order of the trials is random.
"""

import sys
from pathlib import Path

import numpy as np

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.neural.simulated.driven import draw_driven, fire
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.055, cone_angle=1.2e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)
SCAN = Scan(speed=0.1, damping=0.11)
PERIODS = {"A": 0.6e-3, "B": 0.6e-3, "C": 0.6e-3, "D": 0.8e-3}  # [m]
LENGTH, DISTANCE, RATE = 0.062, 5e-3, 4000.0  # [m], [m], [Hz]
UNITS, TRIALS, MEAN_ENVELOPE = 12, 30, 55e-6  # [1], [1] of each grating, [m]


def motion(period, rng, time):
    """Displacement near the base while one grating passes."""
    prediction = predict(WHISKER, POSTURE, random_grating(LENGTH, rng=rng, mean_period=period), SCAN, n_modes=4)
    point = np.array([1 - DISTANCE / WHISKER.length])
    return WHISKER.length * prediction.displacement(time, point)[:, 0]


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    rng = np.random.default_rng(1)
    time = np.arange(0, LENGTH / SCAN.speed, 1 / RATE)
    moved = {name: motion(period, rng, time) for name, period in PERIODS.items()}
    scale = MEAN_ENVELOPE / analytic_envelope(moved["A"])[0].mean()
    order = rng.permutation(np.arange(TRIALS * len(PERIODS)) % len(PERIODS))
    units, rows = draw_driven(UNITS, rng=rng), []
    for k, name in enumerate(PERIODS):
        spikes = fire(units, time, scale * moved[name], TRIALS, seed=10 + k)
        trial = np.flatnonzero(order == k)[spikes.spike_trial.values]
        unit = spikes.unit_name.values[spikes.spike_unit.values]
        rows += zip(unit, trial, spikes.spike_time.values, strict=True)
    lines = [f"{unit},{trial},{when:.6f}" for unit, trial, when in sorted(rows, key=lambda row: row[1:])]
    (folder / "spikes.csv").write_text("\n".join(["unit,trial,spike_time", *lines, ""]))
    names = [f"{trial},{list(PERIODS)[k]}" for trial, k in enumerate(order)]
    (folder / "textures.csv").write_text("\n".join(["trial,texture", *names, ""]))
