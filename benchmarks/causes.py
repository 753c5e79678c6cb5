"""What the paper's numbers follow from: free end, curvature, friction, edges and follicle, alone and together.

nice -n 10 .venv/bin/python benchmarks/causes.py --out DIR

Runs of the rod over random gratings: one factor at a time about a base case, then a fractional factorial 2^(6−1) of
resolution VI, then repeats with jitter. Each run is a small file in DIR, so that a stopped series goes on.
benchmarks/causes_report.py prints the tables of docs/when-it-holds.md and draws its figures. 800 runs of 1.2 s, half an
hour of one core.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from vibrissa.errors import ConvergenceError
from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.inverse.modal_fit import variance_explained
from vibrissa.mechanics.rod.rod_scan import drag
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.signals.correlation import best_correlation, lagged_correlation
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.sweeps.nuisance import with_edges
from vibrissa.texture.surface import Gaps, random_grating
from vibrissa.whisker import Whisker

Array = np.ndarray
L, ALPHA, CONTACT, DAMPING, FRICTION = 0.04, 1.5e-3, 0.29, 0.11, 0.4
STEPS = (25e-6, 10e-6)  # [s] the rod's default, and where the rod is lost with it
RATE, DURATION, QUIET, LAG = 4e3, 1.2, 0.05, 50e-3  # [Hz], [s] of a run, [s] of it left out, [s]
NODES = np.linspace(CONTACT + 0.02, 1, 60)[:-1]  # where a movie would see the shaft, evenly
NEAR, FAR = 1 - 5e-3 / L, 1 - 15e-3 / L  # the replayed point, and the one whose runs are compared
INF = float("inf")


@dataclass(frozen=True)
class Case:
    """One whisker: the six factors. Lengths in metres, curvature in 1/m, stiffness over EI/L and EI/L³."""

    free_end: float = 0.04e-3
    curvature: float = 0.0
    friction: float = FRICTION
    edge: float = 0.0
    rotation: float = INF
    translation: float = INF


BASE = Case()
ALONE = {  # one factor at a time
    "free_end": (0.2e-3, 0.4e-3, 1.6e-3, 5.6e-3),
    "curvature": (-30.0, -15.0, 15.0, 30.0),
    "friction": (0.2, 0.6, 0.8),
    "edge": (5e-6, 10e-6, 17e-6),
    "rotation": (3.0,),
    "translation": (100.0,),
}
LEVELS = {  # of the factorial: low, high
    "free_end": (0.04e-3, 5.6e-3),
    "curvature": (-15.0, 15.0),
    "friction": (0.2, 0.8),
    "edge": (0.0, 17e-6),
    "rotation": (INF, 3.0),
    "translation": (INF, 100.0),
}
SIGNS = [row for row in product((-1, 1), repeat=6) if np.prod(row) == 1]  # 32 of 64: I = ABCDEF
DESIGN = [Case(*(LEVELS[name][(sign + 1) // 2] for name, sign in zip(LEVELS, row, strict=True))) for row in SIGNS]
ANGLES, TEXTURES = (0.8, 1.0, 1.2, 1.4), (1, 2, 3)
DRAWS = [(angle, 0.1) for angle in ANGLES] + [(angle, 0.2) for angle in (0.8, 1.4)]
CORNERS = [(angle, speed) for angle in (0.8, 1.4) for speed in (0.1, 0.2)]
RUNS, FRAME, RIPPLE, RIPPLE_RATE, CONTACT_SD = 5, 0.5e-3, 0.01, 20.0, 0.002  # of repeats: study.sweeps.jitter


def whisker(case: Case) -> Whisker:
    return Whisker(length=L, cone_angle=ALPHA, tip=CONTACT - case.free_end / L)


def rod(case: Case) -> Rod:
    return Rod(
        intrinsic_curvature=case.curvature, hold_contact=case.curvature != 0, edge_radius=case.edge,
        follicle_rotation=case.rotation, follicle_translation=case.translation,
    )  # fmt: skip


def run(case: Case, angle: float, speed: float, surface: Gaps, **more):
    """The grating under one whisker; where the rod is lost, with shorter steps."""
    posture = Posture(contact=CONTACT, base_angle=angle, friction=case.friction)
    how = {
        "speed": speed,
        "damping": DAMPING,
        "duration": DURATION,
        "sampling_rate": RATE,
        "nodes": (*NODES, NEAR, FAR),
    }
    pressed = case.curvature < 0 and case.free_end < 0.1e-3 and angle > 1.1  # mostly lost with the default
    for step in STEPS[pressed:]:
        with suppress(ConvergenceError):
            found = drag(whisker(case), posture, surface, settings=replace(rod(case), step=step), **how, **more)
            if found.record.unconverged < 0.01 * found.record.steps and np.abs(found.mode_displacement).max() < 0.05:
                return found
    raise ConvergenceError("motion of the rod", np.inf, len(STEPS))


def measured(case: Case, angle: float, speed: float, texture: int) -> dict[str, float]:
    """What the paper measures, of one run."""
    surface = random_grating(DURATION * speed, rng=texture)
    found = run(case, angle, speed, surface)
    kept = found.time > QUIET
    q, moved = found.mode_displacement[:, kept], found.displacement[:, kept]
    kappa = float(found.rod.modes.kappa[0])
    own = Whisker(length=L, cone_angle=ALPHA)
    rings = replace(own, youngs_modulus=own.youngs_modulus * (kappa / cone_kappa(CONTACT, 1)[0]) ** 2)
    single = predict(
        rings,
        Posture(contact=CONTACT, base_angle=angle, friction=FRICTION),
        surface,
        Scan(speed=speed, damping=DAMPING),
    )
    ours = (single.amplitudes(found.time) + single.mode_drive(found.time))[:3, kept]
    shapes = cone_modes(cone_kappa(CONTACT, 3), CONTACT, NODES)
    u = moved[: NODES.size] - moved[: NODES.size].mean(axis=1, keepdims=True)
    shares = 100 * variance_explained(u.T, shapes, 3)
    return {
        "rms": float(1e3 * q[0].std()),
        "share_1": float(shares[0]), "share_2": float(shares[1]), "share_3": float(shares[2]),
        "predicted_rms": float(1e3 * ours[0].std()),
        "rho": alike(q[0], ours[0])[0], "rho_0": alike(q[0], ours[0])[1],
        "rho_2": alike(q[1], ours[1])[0], "lag": alike(q[0], ours[0])[2],
        "near": 1e6 * L * float(envelope(moved[-2] - moved[-2].mean()).mean()),
        "near_over_most": float(moved[-2].std() / moved[: NODES.size].std(axis=1).max()),
        "kappa": kappa,
        "contacts": float(found.record.contact[4].mean()),
        "detached": float(np.mean(found.record.contact[4] == 0)),
    }  # fmt: skip


def envelope(signal: Array) -> Array:
    return analytic_envelope(signal[None])[0][0]


def alike(one: Array, other: Array) -> tuple[float, float, float]:
    """Correlation of envelopes: at the best lag of at most 50 ms, at lag zero; and that lag [ms]."""
    a, b = envelope(one - one.mean()), envelope(other - other.mean())
    lag, best = best_correlation(a, b, round(LAG * RATE))
    return float(best), float(lagged_correlation(a, b, 0)[1][0]), 1e3 * float(lag) / RATE


def repeated(case: Case, angle: float, speed: float, texture: int) -> dict[str, float]:
    """Correlation of each of five jittered runs with their mean, at 15 mm from the base."""
    rng, turn = np.random.default_rng(100 + texture), 2 * np.pi * RIPPLE_RATE
    heights = [on_the_flat(Posture(contact=CONTACT + d, base_angle=angle)).base[1] for d in (-1e-3, 1e-3)]
    steepness = (heights[1] - heights[0]) / 2e-3
    signals = []
    for _ in range(RUNS):
        shift, phase, bump = rng.uniform(-FRAME, FRAME) / 2 * speed, rng.uniform(0, 2 * np.pi), rng.standard_normal()

        def moved(edge: Array, shift: float = shift, phase: float = phase) -> Array:
            return edge + shift - RIPPLE * speed / turn * np.sin(turn * edge / speed + phase)

        surface = with_edges(random_grating(DURATION * speed, rng=texture), moved)
        found = run(case, angle, speed, surface, height=-L * steepness * CONTACT_SD * bump)
        signals.append(found.displacement[-1, found.time > QUIET])
    mean = np.mean(signals, axis=0)
    return {"repeats": float(np.mean([np.corrcoef(one, mean)[0, 1] for one in signals]))}


def name(case: Case) -> str:
    return "_".join(f"{value:g}" for value in asdict(case).values())


def jobs() -> Iterator[tuple[str, Case, float, float, int]]:
    """Kind, whisker, base angle, speed and texture of every run."""
    alone = [BASE] + [replace(BASE, **{key: value}) for key, values in ALONE.items() for value in values]
    springs = replace(BASE, rotation=3.0, translation=100.0)
    for texture in TEXTURES:
        for case in [*alone, springs]:
            yield from (("alone", case, *draw, texture) for draw in DRAWS)
        for case in DESIGN:
            yield from (("together", case, *draw, texture) for draw in CORNERS)
        if texture == TEXTURES[0]:
            yield from (("repeats", case, 1.2, 0.2, texture) for case in [*alone, springs])


def carry_out(folder: Path) -> None:
    """Every run that is not there yet."""
    every = list(jobs())
    for k, (kind, case, angle, speed, texture) in enumerate(every):
        path = folder / f"{kind}-{name(case)}-{angle}-{speed}-{texture}.json"
        if path.exists():
            continue
        try:
            found = (repeated if kind == "repeats" else measured)(case, angle, speed, texture)
        except (ConvergenceError, ValueError) as error:
            found = {"lost": str(error)}
        facts = {"kind": kind, **asdict(case), "angle": angle, "speed": speed, "texture": texture}
        part = path.with_suffix(".part")
        part.write_text(json.dumps(facts | found))
        part.rename(path)
        print(f"{k + 1} of {len(every)}", end="\r", file=sys.stderr, flush=True)


if __name__ == "__main__":
    out = Path(sys.argv[sys.argv.index("--out") + 1])
    out.mkdir(parents=True, exist_ok=True)
    carry_out(out)
