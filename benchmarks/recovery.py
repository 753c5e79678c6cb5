"""Run the built-in experiment over many seeds: are the errors of the estimates compatible with zero?

.venv/bin/python benchmarks/recovery.py [SEEDS, at least 2] [OUT.csv]

Each seed makes a new texture and new pixel noise, films it, tracks it, decomposes it and fits it. Seeds already in
OUT.csv are not run again; two run at a time, for about 25 s. The table at the end is mean error, its standard error,
and their ratio.
"""

import csv
import dataclasses
import sys
import tempfile
from pathlib import Path

import dask
import numpy as np

from vibrissa.study.run.study import run_study
from vibrissa.study.spec.settings import read_study

BATCH = 2


def one_seed(seed: int) -> dict[str, float]:
    """Errors of one seed: found against truth, relative, and whether the interval holds the truth."""
    study = read_study()
    study = dataclasses.replace(
        study,
        laboratory=None,
        cortex=None,
        texture=dataclasses.replace(study.texture, seed=seed),
        film=dataclasses.replace(study.film, seed=seed),
    )
    with tempfile.TemporaryDirectory() as folder:
        verdict = run_study(study, Path(folder) / "out")
    row = {"seed": seed}
    for i, name in enumerate(verdict.quantity.values):
        truth, found, low, high = (float(verdict[key][i]) for key in ("truth", "found", "found_low", "found_high"))
        row[f"{name} [relative error]"] = found / truth - 1
        if "[" not in name and ("frequency" in name or "damping" in name) and "true signal" not in name:
            row[f"{name} [inside]"] = float(low <= truth <= high) if np.isfinite(low) else np.nan
    return row


def main(n_seeds: int, path: Path) -> None:
    """Run what is missing in batches of two processes, then print the table."""
    done = list(csv.DictReader(path.open())) if path.is_file() else []
    missing = sorted(set(range(n_seeds)) - {int(float(row["seed"])) for row in done})
    for start in range(0, len(missing), BATCH):
        jobs = [dask.delayed(one_seed)(seed) for seed in missing[start : start + BATCH]]
        done += dask.compute(*jobs, scheduler="processes", num_workers=BATCH)
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, fieldnames=list(done[0]))
            writer.writeheader()
            writer.writerows(done)
        print(f"{len(done)} of {n_seeds} seeds", file=sys.stderr, flush=True)
    for name in list(done[0])[1:]:
        values = np.array([float(row[name]) for row in done])
        values = values[np.isfinite(values)]  # a fit without a maximum gives none; the count shows it
        spread = values.std(ddof=1)
        error = spread / np.sqrt(len(values))
        if name.endswith("[inside]"):
            print(f"{name:70s} {values.mean():8.3f}  n {len(values)}")
        else:
            ratio = values.mean() / error
            print(f"{name:70s} {values.mean():+.6f} ± {error:.6f}  sd {spread:.6f}  {ratio:+.2f}  n {len(values)}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 50, Path(sys.argv[2] if len(sys.argv) > 2 else "recovery.csv"))
