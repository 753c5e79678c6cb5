"""The virtual laboratory: sweeps of two animals, filmed in memory, to the table, and how near it comes to the truth.

Run: python benchmarks/laboratory.py [FRAMES [CONDITIONS [TEXTURES [WORKERS]]]]
"""

from __future__ import annotations

import sys
import tempfile
import time

import numpy as np

from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.sweeps.sweeps import run_laboratory
from vibrissa.sweep.engine import Engine


def main(frames: int = 3500, conditions: int = 2, textures: int = 5, workers: int = 2) -> None:
    laboratory = Laboratory(truth="modes", n_frames=frames, conditions=conditions, textures=textures)
    with tempfile.TemporaryDirectory() as folder:
        wall = time.perf_counter()
        table = run_laboratory(laboratory, folder, engine=Engine(workers=workers))
        print(
            f"{laboratory.n_sweeps} sweeps of {frames} frames in {time.perf_counter() - wall:.0f} s on {workers} cores"
        )
    print({name: table.attrs[name] for name in table.attrs if name.startswith("impossible")})
    for reason in set(table.rejected.values[~table.accepted.values]):
        print("  rejected:", reason)
    good = table.isel(sweep=table.accepted.values)
    for name in ("contact", "base_angle"):
        error = (good[name] - good[f"{name}_true"]).values
        print(f"{name}: error {error.mean():+.5f} ± {error.std():.5f}, in standard errors {_pull(good, name)}")
    for mode in good.mode.values:
        one = good.sel(mode=mode)
        for name in ("resonant_frequency", "damping"):
            for forcing in ("", "_white"):
                print(f"mode {mode}, {name}{forcing}: {_told(one, name, forcing)}")
        print(f"mode {mode}: share of the variance {100 * float(one.variance_explained.mean()):.2f} %")


def _pull(table, name: str) -> str:
    pull = ((table[name] - table[f"{name}_true"]) / table[f"{name}_se"]).values
    return f"{np.median(pull):+.1f} (median)"


def _told(table, name: str, forcing: str) -> str:
    found, truth = table[name + forcing].values, table[f"{name}_true"].values
    low, high = table[f"{name}{forcing}_low"].values, table[f"{name}{forcing}_high"].values
    made = np.isfinite(found)
    error = 100 * (found / truth - 1)[made]
    covered = 100 * np.mean((low <= truth)[made] & (truth <= high)[made])
    return f"bias {np.median(error):+.2f} % (median), {error.std():.2f} % (SD), covers {covered:.0f} % of {made.sum()}"


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
