"""A table of sweeps and their series, predicted and disturbed by a noise of known size; no movie."""

import numpy as np

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict_all
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.sweeps.sweep_table import sweep_table
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKERS = {"beta": (0.05, 1.5e-3), "C1": (0.042, 1.5e-3), "C2": (0.037, 1.5e-3)}
RATE, SAMPLES = 1000.0, 1000


def simulated(*, animals=2, conditions=3, textures=2, noise=1.0, seed=0):
    """Table, and series by number. ``noise``: rms of what another texture adds, over the rms of the sweep's own."""
    rng = np.random.default_rng(seed)
    gratings = [random_grating(0.25, rng=rng) for _ in range(textures)]
    time = 0.05 + np.arange(SAMPLES) / RATE
    rows, series = [], {}
    for animal in range(animals):
        for name, (length, angle) in WHISKERS.items():
            for condition in range(conditions):
                posture = Posture(contact=rng.uniform(0.18, 0.35), base_angle=rng.uniform(0.8, 1.35))
                whisker = Whisker(length=length, cone_angle=angle)
                scan = Scan(speed=(0.1, 0.15, 0.2)[condition % 3], damping=0.11)
                others = [random_grating(0.25, rng=rng) for _ in gratings]
                each = predict_all(whisker, posture, [*gratings, *others], scan, n_modes=3)
                for texture, (one, other) in enumerate(zip(each[:textures], each[textures:], strict=True)):
                    clean = one.mode_displacement(time)
                    motion = clean + noise * other.mode_displacement(time)
                    motion -= motion.mean(axis=1, keepdims=True)
                    clean -= clean.mean(axis=1, keepdims=True)
                    series[len(rows)] = dataset(
                        mode=[1, 2, 3],
                        time=time,
                        mode_displacement=motion,
                        envelope=length * analytic_envelope(motion)[0],
                        mode_displacement_model=clean,
                        envelope_model=length * analytic_envelope(clean)[0],
                    )
                    rows.append(
                        {
                            "animal": f"rat {animal}",
                            "whisker_name": name,
                            "texture": texture,
                            "condition": condition,
                            "run": 0,
                            "scan_speed": scan.speed,
                            "base_height": 0.02,
                            "length": length,
                            "cone_angle": angle,
                            "timescale": whisker.timescale,
                            "contact": posture.contact,
                            "base_angle": posture.base_angle,
                            "resonant_frequency": one.omega / (2 * np.pi),
                            "damping": np.full(3, 0.11),
                            "mode_rms": motion.std(axis=1),
                            "mode_rms_model": clean.std(axis=1),
                            "accepted": True,
                            "rejected": "",
                        }
                    )
    return sweep_table(rows), series
