"""A thousand textures in one batch: what each costs, with the posture's tables shared.

.venv/bin/python benchmarks/textures.py [TEXTURES]

Prints "case | each | limit | ratio"; the limit is the time to write the same arrays. Compilation is warm.
"""

import sys
from time import perf_counter

import numpy as np

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict_all
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.29, base_angle=1.2)
TIME = np.arange(70_000) / 20_000
MODES = 3


def main(count: int) -> None:
    textures = [random_grating(0.35, rng=np.random.default_rng(seed)) for seed in range(count)]
    for form in ("linear", "exact"):
        scan = Scan(speed=0.1, damping=0.11, response=form)
        predict_all(WHISKER, POSTURE, textures[:1], scan, n_modes=MODES)[0].amplitudes(TIME)
        start = perf_counter()
        predictions = predict_all(WHISKER, POSTURE, textures, scan, n_modes=MODES)
        tabled = perf_counter()
        drives = [prediction.mode_drive for prediction in predictions]
        driven = (perf_counter() - tabled) / len(drives)
        print(f"{form}: tables of the posture and events of {count} textures, in all | {tabled - start:.2f} s | |")
        print(f"{form}: drive of a texture | {1e3 * driven:.2f} ms | |")
        ring(form, predictions)


def ring(form: str, predictions: list[Prediction]) -> None:
    vibrated, enveloped, written = 0.0, 0.0, 0.0
    for prediction in predictions:
        t0 = perf_counter()
        q = prediction.amplitudes(TIME)
        t1 = perf_counter()
        analytic_envelope(q[:, ::10])
        t2 = perf_counter()
        np.full_like(q, 1.0)
        t3 = perf_counter()
        vibrated, enveloped, written = vibrated + t1 - t0, enveloped + t2 - t1, written + t3 - t2
    n = len(predictions)
    rate = MODES * len(TIME) * n / vibrated / 1e6
    print(
        f"{form}: 3 modes × 70,000 samples | {1e3 * vibrated / n:.2f} ms = {rate:.0f} Msample/s "
        f"| write {1e3 * written / n:.3f} ms | {written / vibrated:.2f}"
    )
    print(f"{form}: envelope, 3 × 7,000 samples at 2 kHz | {1e3 * enveloped / n:.2f} ms | |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
