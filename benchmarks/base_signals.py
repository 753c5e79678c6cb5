"""Resonance and damping from a moment at the base, texture known and forcing taken for white.

.venv/bin/python benchmarks/base_signals.py [SEEDS] [filtered]

Each seed: a new grating of 16 cm at 0.1 m/s, 1.5 s of the model's moment at 4 kHz, 20 ms late, with noise of 5 % of
its rms. The fit starts 4 % off and from a prediction whose damping is 0.2 instead of 0.11: it knows texture and
posture alone. ``filtered``: sampled at 64 kHz, and filtered before it is thinned to 4 kHz, as by a converter. Prints
"mode, quantity | mean error | spread | share of 95 % intervals that hold the truth".
"""

import sys

import numpy as np
from scipy.signal import resample_poly

from vibrissa.mechanics.scan.follicle import follicle_signals
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.mechanics.sensor.base_response import analyse_base_signal
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

TIME = np.arange(6000) / 4000
DAMPING, LATE, NOISE = 0.11, 0.02, 0.05
FINER, MARGIN = 16, 250  # samples of the finer grid in one; samples at either end that the filter needs


def main(seeds: int, filtered: bool) -> None:
    found = [one(seed, filtered) for seed in range(seeds)]
    for forcing in ("resonance", "resonance_white"):
        for mode in range(2):
            for k, name in enumerate(("resonant_frequency", "damping")):
                rows = np.array([each[forcing][k][mode] for each in found])
                made = np.isfinite(rows[:, 0])
                error = 100 * rows[made, 0]
                print(
                    f"{forcing}, mode {mode + 1}, {name} | {error.mean():+.2f} % | {error.std(ddof=1):.2f} % | "
                    f"{rows[made, 1].mean():.2f} of {made.sum()}"
                )
    r = [each["correlation"] for each in found]
    print(f"correlation of the envelopes, mode 1 | {np.mean(r):.3f} | least {np.min(r):.3f}")


def one(seed: int, filtered: bool) -> dict:
    truth, rng = prediction(seed, DAMPING), np.random.default_rng(1000 + seed)
    moment = filtered_moment(truth) if filtered else follicle_signals(truth, TIME - LATE)["base_moment"]
    measured = dataset(time=TIME, base_moment=moment + NOISE * moment.std() * rng.normal(size=TIME.size))
    right = truth.omega[:2] / (2 * np.pi)
    results = analyse_base_signal(measured, 1.04 * right, prediction=prediction(seed, 0.2))
    found: dict = {"correlation": float(results["agreement"].correlation[0])}
    for forcing in ("resonance", "resonance_white"):
        fitted = results[forcing]
        found[forcing] = [
            [
                (
                    float(fitted[name][i]) / true[i] - 1,
                    float(fitted[f"{name}_low"][i]) < true[i] < float(fitted[f"{name}_high"][i]),
                )
                for i in range(2)
            ]
            for name, true in (("resonant_frequency", right), ("damping", [DAMPING] * 2))
        ]
    return found


def filtered_moment(truth: Prediction) -> np.ndarray:
    fine = TIME[1] / FINER * np.arange(-MARGIN * FINER, (TIME.size + MARGIN) * FINER)
    moment = follicle_signals(truth, fine - LATE)["base_moment"]
    return resample_poly(moment, 1, FINER, padtype="line")[MARGIN:-MARGIN]


def prediction(seed: int, damping: float) -> Prediction:
    texture = random_grating(0.16, rng=np.random.default_rng(seed))
    posture = Posture(contact=0.29, base_angle=1.2)
    return predict(
        Whisker(length=0.04, cone_angle=1.5e-3), posture, texture, Scan(speed=0.1, damping=damping), n_modes=6
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60, "filtered" in sys.argv[2:])
