"""Do intervals of posture and first resonance hold the truth where fur or a shadow hides an end of the shaft?

Run: python benchmarks/fur_coverage.py FOLDER [SEED [SWEEPS [CELLS]]]   (default: seed 1, 73 sweeps, cells 00,10,01,11)

The sweeps are those of the paper's experiment at its scale, one grating in each of its 73 conditions, with postures and
gratings drawn from SEED, and 1,000 frames each. Every sweep is filmed in four cells: with and without fur (first digit)
and with and without 3 mm of the shaft in the substrate's shadow (second digit). Motion and pixel noise are the same in
the four. The intervals allow half a pixel for either point of the substrate's line, so both are marked with such an
error here (``vibrissa run`` gives the line as it is). A sweep takes about 5 s for each cell on one core. Sweeps in
FOLDER are not made again; the table is of all that are there. Intervals of the posture are 1.96 standard errors, as in
the report; z is error / standard error.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.quantities import dataset
from vibrissa.stats import wilson_interval
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.spec.settings import read_study
from vibrissa.study.store.result_store import StoredWork, finish, kept_row
from vibrissa.study.sweeps.laboratory import VirtualSweep, plan
from vibrissa.study.sweeps.sweep_analysis import Line, analyse_sweep
from vibrissa.study.sweeps.sweeps import laboratory_jobs
from vibrissa.study.sweeps.virtual_sweep import Filmed, filmed_sweep
from vibrissa.sweep.engine import Engine

ONE = Engine(scheduler="synchronous")
FRAMES = 1000
CELLS = "00", "10", "01", "11"
NAMES = {"00": "neither", "10": "fur", "01": "shadow", "11": "fur and shadow"}


def laboratory(seed: int, cell: str) -> Laboratory:
    """The paper's laboratory, one grating in each condition, in one cell."""
    paper = read_study(scale="paper").laboratory
    hidden = paper.shadow if cell[1] == "1" else 0.0
    return replace(paper, truth="modes", textures=1, n_frames=FRAMES, seed=seed, fur=cell[0] == "1", shadow=hidden)


def analysed(lab: Laboratory, sweep: VirtualSweep) -> tuple[dict[str, Any], xr.Dataset]:
    """Row of a filmed sweep with its truth; no series."""
    filmed = filmed_sweep(lab, sweep)
    known = replace(filmed.known, substrate=_marked(filmed, np.random.default_rng([lab.seed, *sweep.key])))
    truth = {
        "contact_true": sweep.posture.contact,
        "base_angle_true": sweep.posture.base_angle,
        "resonant_frequency_true": filmed.motion.resonances[:3],
        "damping_true": np.full(3, sweep.scan.damping),
    }
    return analyse_sweep(filmed.profile, known)[0] | truth, dataset()


def _marked(filmed: Filmed, rng: np.random.Generator) -> Line:
    """The substrate's line as marked by hand: either point off across it by a normal error of half a pixel."""
    first, last = np.array(filmed.known.substrate)
    along = (last - first) / np.hypot(*(last - first))
    off = filmed.film.camera.pixel_size / 2 * rng.standard_normal((2, 1)) * np.array([-along[1], along[0]])
    (a, b), (c, d) = np.stack([first, last]) + off
    return (float(a), float(b)), (float(c), float(d))


def jobs(seed: int, cell: str) -> list[StoredWork]:
    """Sweeps of one cell."""
    lab = laboratory(seed, cell)
    pairs = zip(laboratory_jobs(lab)[0], plan(lab)[0], strict=True)
    return [replace(job, work=partial(analysed, lab, sweep)) for job, sweep in pairs]


def main(folder: Path, seed: int, count: int, cells: Sequence[str]) -> None:
    """Make what is missing, sweep by sweep, then print the table."""
    made = {cell: jobs(seed, cell)[:count] for cell in cells}
    for number, one in enumerate(zip(*made.values(), strict=True)):
        finish(one, folder, "sweeps", ONE)
        print(f"{number + 1} of {count} sweeps", file=sys.stderr, flush=True)
    show(folder, made)


def show(folder: Path, made: dict[str, list[StoredWork]]) -> None:
    """Print the coverage of each cell over what is in the folder."""
    print("| cell | quantity | sweeps | mean error | SD over sweeps | z | intervals that hold the truth |")
    print("|---|---|---|---|---|---|---|")
    for cell, planned in made.items():
        rows = [row for job in planned if (row := kept_row(folder, job.address)) is not None]
        for name, found in _errors([row for row in rows if row["accepted"]]).items():
            print(f"| {NAMES[cell]} | {name} | {_cells(*found)} |")
        for row in rows:
            if not row["accepted"]:
                print(f"{NAMES[cell]}: refused: {row['rejected']}", file=sys.stderr)


def _errors(rows: list[dict[str, Any]]) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray, str]]:
    """Error, z and whether the interval holds the truth, of every quantity, with its unit."""
    out = {}
    for name, words, unit in (("contact", "ε", ""), ("base_angle", "θ_b", " rad")):
        error, se = (np.array([row[name] - row[f"{name}_true"] for row in rows]), _column(rows, f"{name}_se"))
        out[words] = error, error / se, np.abs(error) <= 1.96 * se, unit
    for name, words in (("resonant_frequency", "ω₁"), ("damping", "ζ₁")):
        found, low, high, true = (_column(rows, name + end)[:, 0] for end in ("", "_low", "_high", "_true"))
        known = np.isfinite(low)
        error, half = np.log(found / true)[known], np.log(high / low)[known] / (2 * 1.96)
        out[words] = 100 * error, error / half, ((low <= true) & (true <= high))[known], " %"
    return out


def _column(rows: list[dict[str, Any]], name: str) -> np.ndarray:
    return np.array([row[name] for row in rows])


def _cells(error: np.ndarray, z: np.ndarray, held: np.ndarray, unit: str) -> str:
    n, digits = error.size, 5 if unit == "" else 4 if unit == " rad" else 3
    low, high = wilson_interval(int(held.sum()), n)
    share = f"{100 * held.mean():.0f} % ({100 * low:.0f}–{100 * high:.0f})"
    scatter = f"{error.mean():+.{digits}f} ± {error.std() / n**0.5:.{digits}f}{unit} | {error.std():.{digits}f}{unit}"
    return f"{n} | {scatter} | {z.mean():+.2f} ± {z.std():.2f} | {share}"


if __name__ == "__main__":
    given = sys.argv[2:]
    which = given[2].split(",") if len(given) > 2 else list(CELLS)
    main(Path(sys.argv[1]), int(given[0]) if given else 1, int(given[1]) if len(given) > 1 else 73, which)
