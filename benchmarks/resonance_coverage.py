"""Do the intervals of the resonances hold the truth? Virtual sweeps by the hundred, with the tracker's noise or filmed.

Run: python benchmarks/resonance_coverage.py FOLDER [LABORATORIES [filmed]]

Each laboratory has two animals' three whiskers in three conditions each, 18 sweeps of 3,500 frames over a texture of
its own; E and ζ differ by 10 and 20 % from whisker to whisker, so that no guess is the truth. Without ``filmed`` the
tracker is left out: nodes of the predicted motion, averaged over the exposure, with the noise that films of these
sweeps were found to have (docs/validation.md). What is in the folder is not done again. The table is of all that is.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from vibrissa.figures.paper import fig4, fig5
from vibrissa.mechanics.across.collapse import collapse
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.netcdf import load
from vibrissa.quantities import dataset
from vibrissa.stats import wilson_interval
from vibrissa.study.movie.backward import analyse
from vibrissa.study.movie.virtual import lay_out
from vibrissa.study.spec.laboratory import SWEEP, Laboratory
from vibrissa.study.spec.settings import Film
from vibrissa.study.store.result_store import StoredWork, made_of
from vibrissa.study.sweeps.laboratory import VirtualSweep, plan
from vibrissa.study.sweeps.sweep_analysis import SweepFacts, analyse_sweep
from vibrissa.study.sweeps.sweeps import run_jobs, run_laboratory
from vibrissa.sweep.engine import Engine
from vibrissa.video.camera.camera import exposure_times
from vibrissa.whisker import YOUNGS_MODULUS

ONE = Engine(scheduler="synchronous")
SPACING = 116e-6  # [m] of the nodes
NOISE = 0.05, 0.022  # [pixels] of a node, at the contact and at the base
ALIKE = 0.15  # correlation of neighbours
CHUNK = 500  # frames at a time
SHOWN = 9  # sweep of the first laboratory that is drawn


def laboratory(seed: int) -> Laboratory:
    """Eighteen sweeps."""
    return Laboratory(
        truth="modes", animals=2, conditions=3, textures=1, youngs_modulus_spread=0.1, damping_spread=0.2, seed=seed
    )


def tracked(lab: Laboratory, sweep: VirtualSweep) -> tuple[xr.Dataset, SweepFacts, np.ndarray]:
    """What a tracker of that noise would find of a sweep, what is known of it, and its true ω [rad/s]."""
    texture, rng = lab.grating(sweep.key[3]), lab.rng(SWEEP, *sweep.key)
    motion = predict(sweep.whisker, sweep.posture, texture, sweep.scan)
    camera, length = lab.camera, sweep.whisker.length
    scene = lay_out(motion, Film(n_frames=lab.n_frames, subframes=lab.subframes, camera=camera))
    arc = SPACING * np.arange(1, int((1 - sweep.whisker.tip) * length / SPACING))
    s, t = 1 - arc / length, exposure_times(camera, lab.n_frames, lab.subframes)
    z = np.empty((lab.n_frames, len(arc)), complex)
    for first in range(0, lab.n_frames, CHUNK):
        x, y = scene.place(*motion.position(t[first * lab.subframes : (first + CHUNK) * lab.subframes], s))
        z[first : first + CHUNK] = (x + 1j * y).reshape(-1, lab.subframes, len(arc)).mean(axis=1)
    sd = camera.pixel_size * np.interp(s, [sweep.posture.contact, 1], NOISE)
    noise = rng.standard_normal((lab.n_frames, len(arc) + 1))
    noise = sd * (noise[:, 1:] + ALIKE * noise[:, :-1]) / np.hypot(1, ALIKE)
    way = np.gradient(z.mean(axis=0))
    z += 1j * way / np.abs(way) * noise
    profile = dataset(
        {"pixel_size": camera.pixel_size},
        time=np.arange(lab.n_frames) / camera.frame_rate,
        node=np.arange(len(arc)),
        arc_length=arc,
        x=z.real,
        y=z.imag,
        y_sd=np.broadcast_to(sd, z.shape),
    )
    distance, height = motion.response.flat.base
    ends = scene.place(np.array([-distance, 0.0]), np.full(2, -height))
    known = SweepFacts(
        whisker=replace(sweep.whisker, youngs_modulus=lab.youngs_modulus, density=lab.density),
        scan_speed=sweep.scan.speed,
        base_height=sweep.base_height,
        texture=texture,
        substrate=((float(ends[0][0]), float(ends[1][0])), (float(ends[0][1]), float(ends[1][1]))),
        friction=lab.friction,
        exposure=camera.exposure,
        instants=lab.subframes,
    )
    return profile, known, motion.omega


def analysed(lab: Laboratory, sweep: VirtualSweep) -> tuple[dict, xr.Dataset]:
    """Row of the table, truth beside; no series."""
    profile, known, omega = tracked(lab, sweep)
    truth = {
        "contact_true": sweep.posture.contact,
        "base_angle_true": sweep.posture.base_angle,
        "youngs_modulus_true": sweep.whisker.youngs_modulus,
        "resonant_frequency_true": omega[:3] / (2 * np.pi),
        "damping_true": np.full(3, sweep.scan.damping),
    }
    return analyse_sweep(profile, known)[0] | truth, dataset()


def job(lab: Laboratory, sweep: VirtualSweep) -> StoredWork:
    """One sweep to be done."""
    row = {
        "animal": sweep.animal,
        "whisker_name": sweep.whisker_name,
        "texture": lab.seed,
        "condition": sweep.key[2],
        "run": 0,
        "scan_speed": sweep.scan.speed,
        "base_height": sweep.base_height,
        "length": sweep.whisker.length,
        "cone_angle": sweep.whisker.cone_angle,
        "timescale": replace(sweep.whisker, youngs_modulus=lab.youngs_modulus).timescale,
    }
    return StoredWork(row, partial(analysed, lab, sweep), made_of(seed=lab.seed, sweep=sweep.number))


def main(folder: Path, count: int, filmed: bool) -> None:
    """Do what is missing, then report."""
    for seed in range(count):
        out = folder / f"{'filmed' if filmed else 'tracked'}-{seed:03d}"
        if filmed:
            run_laboratory(laboratory(seed), out, engine=ONE)
        else:
            run_jobs([job(laboratory(seed), one) for one in plan(laboratory(seed))[0]], out, {}, ONE, None)
        print(f"{seed + 1} of {count} laboratories", file=sys.stderr, flush=True)
    tables = [load(path) for path in sorted(folder.glob(f"{'filmed' if filmed else 'tracked'}-*/sweeps.nc"))]
    report(tables)
    draw(folder, tables)


def report(tables: list[xr.Dataset]) -> None:
    """Bias, spread and coverage of the resonances, the posture and E."""
    good = [one.isel(sweep=np.flatnonzero(one.accepted.values)) for one in tables]
    whole = _whole(good)
    print(f"{sum(one.sizes['sweep'] for one in tables)} sweeps, {whole.sizes['sweep']} analysed")
    for name in ("contact", "base_angle"):
        error = (whole[name] - whole[f"{name}_true"]).values
        print(f"{name}: {error.mean():+.2g} ± {error.std():.2g}, reported {float(whole[name + '_se'].median()):.2g}")
    print("| forcing | mode | found | mean error | median | spread | reported | intervals that hold the truth | R² |")
    print("|---|---|---|---|---|---|---|---|---|")
    for forcing in ("", "_white"):
        for mode in (1, 2, 3):
            for name in ("resonant_frequency", "damping"):
                print(_line(whole.sel(mode=mode), name, forcing, mode))
    for forcing in ("texture", "white"):
        _modulus(good, [collapse(one, forcing=forcing) for one in good], forcing)


def draw(folder: Path, tables: list[xr.Dataset]) -> None:
    """Figures 4 and 5 of one sweep and of all tables together, whiskers of every laboratory apart."""
    lab = laboratory(0)
    profile, known, _ = tracked(lab, plan(lab)[0][SHOWN])
    row, series = analyse_sweep(profile, known)
    apart = [
        one.assign_coords(animal=("sweep", [f"{n} {name}" for name in one.animal.values]))
        for n, one in enumerate(tables)
    ]
    sweeps = _whole(apart).assign_coords(sweep=np.arange(sum(one.sizes["sweep"] for one in apart)))
    results = analyse(profile, known.whisker, row["contact"])
    results |= {"profile": profile.expand_dims("whisker"), "sweeps": sweeps}
    results["posture"] = dataset({"sweep": SHOWN}, contact=row["contact"])
    fig4.draw(fig4.compute(results)).savefig(folder / "fig4.png", metadata={"Software": None})
    fig5.draw(fig5.compute(results, lambda _: series)).savefig(folder / "fig5.png", metadata={"Software": None})


def _whole(tables: list[xr.Dataset]) -> xr.Dataset:
    return xr.concat(tables, "sweep", data_vars="all", coords="minimal", compat="override", join="override")


def _line(one: xr.Dataset, name: str, forcing: str, mode: int) -> str:
    found, low, high = (one[f"{name}{forcing}{end}"].values for end in ("", "_low", "_high"))
    truth, made = one[f"{name}_true"].values, np.isfinite(high)
    error, n = 100 * (found / truth - 1)[made], int(made.sum())
    hold = int(np.sum((low <= truth)[made] & (truth <= high)[made]))
    least, most = wilson_interval(hold, n)
    half = 100 * np.median(np.log(high / found)[made]) / 1.96
    r2 = one[f"fit_r2{forcing}"].values[made].mean()
    what = {"resonant_frequency": "ω", "damping": "ζ"}[name]
    cells = (
        "white" if forcing else "texture",
        f"{mode}",
        f"{what}, {n}",
        f"{error.mean():+.3f} ± {error.std() / n**0.5:.3f} %",
        f"{np.median(error):+.3f} %",
        f"{error.std():.3f} %",
        f"{half:.3f} %",
        f"{100 * hold / n:.0f} % ({100 * least:.0f}–{100 * most:.0f})",
        f"{r2:.3f}",
    )
    return f"| {' | '.join(cells)} |"


def _modulus(tables: list[xr.Dataset], fits: list[xr.Dataset], forcing: str) -> None:
    """How far E is from the mean of each laboratory's own whiskers, and how often its interval holds that of all."""
    found, low, high = (np.array([float(one[f"youngs_modulus{end}"]) for one in fits]) for end in ("", "_low", "_high"))
    own = np.array([float(np.exp(np.log(one.youngs_modulus_true).mean())) for one in tables])
    error, hold = 100 * (found / own - 1), int(np.sum((low <= YOUNGS_MODULUS) & (high >= YOUNGS_MODULUS)))
    off, half = f"{error.mean():+.2f} ± {error.std() / len(error) ** 0.5:.2f} %", 50 * np.median(np.log(high / low))
    print(
        f"E, forcing {forcing}: {off} from that of its whiskers; interval ± {half:.1f} %; {hold} of {len(fits)} hold E"
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 12, "filmed" in sys.argv[3:])
