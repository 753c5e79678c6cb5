"""The whole whisker: how far it is refined, its energy, what it costs, and what it says of gaps and gratings.

.venv/bin/python benchmarks/rod.py [PART …] [--quick]

Parts: convergence, energy, failures, stiff, cost, relief, swing, ends, postures; all of them without a name. The
whisker of docs/validation.md, on a random grating (seed 1) for 1.2 s at 0.1 m/s and in one gap. Prints tables;
``cost`` also draws docs/rod-cost.png. ``--quick`` takes 0.3 s of the grating and leaves the finest out. Times are
processor time of one core, so that others on the machine count little; they are to be compared within one run. Six
minutes, or half a minute.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator

from vibrissa.errors import ConvergenceError
from vibrissa.figures.canvas import FOUND, OTHER, house_style, new_figure
from vibrissa.mechanics.rod.equilibrium import resting_rod
from vibrissa.mechanics.rod.mesh import Fineness
from vibrissa.mechanics.rod.rod_gap import gap_prediction, rod_gap
from vibrissa.mechanics.rod.rod_scan import RodRun, drag, fine_reach
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.base_path import BasePath
from vibrissa.mechanics.whisking.swing import swing as swing_run
from vibrissa.signals.correlation import best_correlation
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps, random_grating
from vibrissa.whisker import Whisker

Array = np.ndarray
POSTURE, SPEED, DAMPING = Posture(contact=0.29, base_angle=1.2), 0.1, 0.11
SHORT, LONG = 0.289, 0.15  # tips: the contact's own, and a free end of 5.6 mm
RATE, SEED, LAG = 5e3, 1, 50e-3
QUICK = "--quick" in sys.argv
DURATION = 0.3 if QUICK else 1.2  # [s] of the grating
REPEATS = 2 if QUICK else 5
SERIES: dict[str, tuple[Rod, ...]] = {  # the last one is what the others are compared with
    "cells × {:g}": tuple(Rod(fineness=Fineness().refined(n)) for n in (0.5, 1, 2, 4, 8)),
    "steps of {:g} µs": tuple(Rod(step=h) for h in (50e-6, 25e-6, 12.5e-6, 6.25e-6, 3.125e-6)),
    "ground of {:.0e}": tuple(Rod(ground=k, step=12.5e-6) for k in (1e5, 1e6, 1e7, 1e8)),
}
FINEST = Rod(fineness=Fineness().refined(2 if QUICK else 4), step=6.25e-6, ground=1e7)
CHOICES = (  # from coarse to fine
    Rod(fineness=Fineness(0.006, 0.08, 0.4), step=100e-6),
    Rod(fineness=Fineness(0.004, 0.05, 0.25), step=100e-6),
    Rod(fineness=Fineness(0.004, 0.05, 0.25), step=50e-6),
    Rod(fineness=Fineness(0.003, 0.04, 0.2), step=50e-6),
    Rod(step=50e-6),
    Rod(),
    Rod(step=12.5e-6),
    Rod(fineness=Fineness().refined(2), step=25e-6),
    Rod(fineness=Fineness().refined(2), step=12.5e-6),
    FINEST,
)


class Cost(NamedTuple):
    """What one choice of mesh and step costs and gives.

    ``nodes``; ``seconds`` of a core per simulated second; ``error``, the rms of the first mode's difference from the
    finest, over its rms; ``alike``, their correlation.
    """

    tip: float
    rod: Rod
    nodes: int
    seconds: float
    error: float
    alike: float


def cone(tip: float) -> Whisker:
    return Whisker(length=0.04, cone_angle=1.5e-3, tip=tip)


@cache
def grating(speed: float = SPEED) -> Gaps:
    return random_grating(DURATION * speed, rng=SEED)


def scanned(tip: float, rod: Rod, posture: Posture = POSTURE, speed: float = SPEED) -> RodRun:
    """The grating under a rod."""
    return drag(
        cone(tip), posture, grating(speed), speed=speed, damping=DAMPING, duration=DURATION, sampling_rate=RATE,
        settings=rod,
    )  # fmt: skip


def compared(q: Array, finest: Array) -> str:
    """Cells of a table: ratio of rms and correlation of each mode."""
    ratios = q.std(axis=1) / finest.std(axis=1)
    alike = [np.corrcoef(one, other)[0, 1] for one, other in zip(q, finest, strict=True)]
    return " | ".join(f"{ratio:.3f}, {r:.4f}" for ratio, r in zip(ratios, alike, strict=True))


def convergence() -> Iterator[str]:
    """Mesh, step and stiffness of the ground, one at a time, then all together."""
    for tip in (SHORT, LONG):
        yield f"\n| tip {tip}: rms over that of the finest, correlation | mode 1 | mode 2 | mode 3 |\n|---|---|---|---|"
        for name, series in SERIES.items():
            *coarser, finest = series[: -1 if QUICK else None]
            reference = scanned(tip, finest).mode_displacement
            for rod in coarser:
                cells = compared(scanned(tip, rod).mode_displacement, reference)
                yield f"| {label(name, rod)} (against {label(name, finest)}) | {cells} |"
        cells = compared(scanned(tip, Rod()).mode_displacement, finest_motion(tip))
        yield f"| the default (against {named(FINEST)}) | {cells} |"


def label(name: str, rod: Rod) -> str:
    """Name of a member of a series."""
    value = {"cells": rod.fineness.finest / Fineness().finest, "steps": 1e6 * rod.step, "ground": rod.ground}
    return name.format(value[name.split()[0]])


def named(rod: Rod) -> str:
    """Name of all of its fineness."""
    return ", ".join(label(name, rod) for name in SERIES)


@cache
def finest_motion(tip: float) -> Array:
    return scanned(tip, FINEST).mode_displacement


def energy() -> Iterator[str]:
    """Work of the ground over one gap, and what is neither stored nor dissipated of it."""
    yield "\n| one gap, tip, step, ground | friction | viscous | stored | remainder | at most, over the elastic swing |"
    yield "|---|---|---|---|---|---|"
    usual = [Rod(step=step, tolerance=1e-10) for step in (50e-6, 25e-6, 12.5e-6, 6.25e-6)]
    for tip in (0.285, 0.25):
        for rod in [*usual, *(replace(usual[2], ground=ground) for ground in (1e5, 1e7))]:
            cells = " | ".join(f"{100 * share:+.4f} %" for share in balance(tip, rod))
            yield f"| {tip}, {1e6 * rod.step:g} µs, {rod.ground:.0e} | {cells} |"


def balance(tip: float, rod: Rod) -> tuple[float, ...]:
    """Parts of the work of the ground; largest remainder on the way over the elastic energy's range."""
    gap = Gaps(np.array([0.0]), np.array([0.6e-3]), 35e-6)
    run = drag(
        cone(tip), POSTURE, gap, speed=SPEED, damping=DAMPING, start=-1e-3, duration=0.06,
        sampling_rate=1 / rod.step, settings=rod,
    )  # fmt: skip
    kinetic, elastic, power, ground, _, friction = run.record.energy
    stored = kinetic + elastic + run.record.contact[6]
    viscous = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2)]) * rod.step / cone(tip).timescale
    work, rubbed, kept = (part - part[0] for part in (ground, friction, stored))
    left = work - kept - viscous - rubbed
    ends = np.array([rubbed[-1], viscous[-1], kept[-1], left[-1]]) / work[-1]
    return *ends, np.abs(left).max() / np.ptp(elastic)


def cost() -> Iterator[str]:
    """Mesh and step against what they cost; draws the figure."""
    yield "\n| tip, smallest cell, step | nodes | s of a core per s | s per s of a core | error of mode 1 | alike |"
    yield "|---|---|---|---|---|---|"
    found = []
    for tip in (SHORT, LONG):
        for rod in CHOICES[: -1 if QUICK else None]:
            cells = "does not converge | | | |"
            with suppress(ConvergenceError):
                one = priced(tip, rod)
                found.append(one)
                price = f"{one.nodes} | {one.seconds:.2f} | {1 / one.seconds:.2f}"
                cells = f"{price} | {100 * one.error:.2g} % | {one.alike:.4f}"
            yield f"| {tip}, {rod.fineness.finest:g} L, {1e6 * rod.step:g} µs | {cells} |"
    if not QUICK:
        draw(found).savefig(Path(__file__).parents[1] / "docs" / "rod-cost.png", dpi=150)


def priced(tip: float, rod: Rod) -> Cost:
    """Cost and error of one choice; its equilibrium is not counted."""
    finest, motion, taken = finest_motion(tip), np.empty(0), []
    for _ in range(1 if rod is FINEST else REPEATS):
        start = process_time()
        run = scanned(tip, rod)
        seconds = process_time() - start
        taken.append(seconds - settling(tip, rod))
        motion = run.mode_displacement
    error = (motion[0] - finest[0]).std() / finest[0].std()
    alike = float(np.corrcoef(motion[0], finest[0])[0, 1])
    return Cost(tip, rod, run.rod.shaft.s.size, min(taken) / DURATION, error, alike)


def settling(tip: float, rod: Rod) -> float:
    """Time of the equilibrium and its modes [s]."""
    start = process_time()
    resting_rod(cone(tip), POSTURE, damping=DAMPING, settings=rod, reach=fine_reach(grating(), 0.04))
    return process_time() - start


def ends() -> Iterator[str]:
    """One gap of 0.6 mm, by where the shaft ends."""
    yield "\n| tip | free end [mm] | largest q₁ + Q₁ [10⁻³ L] | cells and steps halved |\n|---|---|---|---|"
    for tip, curvature in [*((tip, 0.0) for tip in (0.289, 0.285, 0.28, 0.27, 0.25, 0.15)), (0.15, 15.0)]:
        found = [largest(tip, curvature, refined) for refined in ((2,) if QUICK else (2, 4))]
        name = f"{tip}, {curvature:+g} /m" if curvature else f"{tip}"
        yield f"| {name} | {40 * (0.29 - tip):.2f} | " + " | ".join(f"{1e3 * q:.3g}" for q in found) + " |"


def largest(tip: float, curvature: float, refined: float) -> float:
    """Largest |q₁ + Q₁| over L in one gap."""
    rod = Rod(intrinsic_curvature=curvature, fineness=Fineness().refined(refined), step=25e-6 / refined)
    data = rod_gap(gap_prediction(cone(tip), POSTURE, width=0.6e-3, speed=SPEED, damping=DAMPING, settings=rod))
    return float(data.largest_mode_displacement[0])


def postures() -> Iterator[str]:
    """Random gratings at several postures, beside the prediction of the single-contact model."""
    yield "\n| tip | θ_b | v [m/s] | rms q₁ rod, prediction [10⁻³ L] | envelopes, modes 1, 2 | modes of the rod |"
    yield "|---|---|---|---|---|---|"
    cases = [(SHORT, angle, SPEED) for angle in (0.8, 1.0, 1.2, 1.4)] + [(SHORT, 1.2, 0.2)]
    for tip, angle, speed in cases + [(LONG, angle, SPEED) for angle in (0.8, 1.2, 1.4)]:
        posture = replace(POSTURE, base_angle=angle)
        run = scanned(tip, Rod(), posture, speed)
        single = predict(cone(tip), posture, grating(speed), Scan(speed=speed, damping=DAMPING))
        ours = single.amplitudes(run.time) + single.mode_drive(run.time)
        size = f"{1e3 * run.mode_displacement[0].std():.3f}, {1e3 * ours[0].std():.3f}"
        alike = ", ".join(f"{likeness(run.mode_displacement[k], ours[k]):.2f}" for k in (0, 1))
        variance = run.mode_displacement.var(axis=1)
        shares = ", ".join(f"{100 * share:.1f}" for share in variance / variance.sum())
        yield f"| {tip} | {angle} | {speed} | {size} | {alike} | {shares} % |"


def likeness(one: Array, other: Array) -> float:
    """Correlation of two envelopes at the best lag of at most 50 ms, either way."""
    a, b = (analytic_envelope(signal[None])[0][0] for signal in (one, other))
    return float(best_correlation(a, b, round(LAG * RATE))[1])


def failures() -> Iterator[str]:
    """Random whiskers on random gratings of 40 mm: steps that do not converge even in parts, and runs that are lost."""
    rng, most, lost, runs, redone = np.random.default_rng(0), 0.0, 0, 15 if QUICK else 150, 0
    for seed in range(runs):
        posture = replace(POSTURE, base_angle=rng.uniform(0.4, 1.4))
        tip, speed = float(rng.choice([0.289, 0.287, 0.28, 0.2])), float(rng.choice([0.05, 0.1, 0.2, 0.4]))
        surface = random_grating(0.04, rng=seed)
        held = {"speed": speed, "damping": DAMPING, "duration": 0.04 / speed, "sampling_rate": RATE}
        try:
            record = drag(cone(tip), posture, surface, **held).record
            most, redone = max(most, record.unconverged / record.steps), redone + (record.redone > 0)
        except ConvergenceError:
            lost += 1
    yield f"\n{lost} of {runs} random runs were lost; {redone} had steps that were redone in parts;"
    yield f"at most {1e6 * most:.0f} parts in a million steps did not converge"


def stiff() -> Iterator[str]:
    """Grounds and steps with which steps fail: the grating again, against a ground of 1e7 and steps of 12.5 µs."""
    finest = scanned(SHORT, Rod(ground=1e7, step=12.5e-6)).mode_displacement
    yield "\n| ground, step | steps redone | parts that failed | mode 1 | mode 2 | mode 3 |\n|---|---|---|---|---|---|"
    for rod in (Rod(), *(Rod(step=step) for step in (50e-6, 100e-6, 200e-6)), Rod(ground=1e8), Rod(ground=1e9)):
        run = scanned(SHORT, rod)
        counts = f"{run.record.redone} of {run.record.steps} | {run.record.unconverged}"
        yield f"| {rod.ground:.0e}, {1e6 * rod.step:g} µs | {counts} | {compared(run.mode_displacement, finest)} |"


def relief() -> Iterator[str]:
    """Reliefs with a point every micrometre: what they cost."""
    rng, x = np.random.default_rng(1), 1e-6 * np.arange(40_001)
    once = np.convolve(rng.standard_normal(x.size), np.ones(30), "same")
    rough = np.convolve(once, np.ones(30), "same")
    heights = {
        "rough, 3 µm rms over 30 µm": 3e-6 * rough / rough.std(),
        "sine of 10 µm, period 0.6 mm": 10e-6 * np.sin(2 * np.pi * x / 0.6e-3),
        "white, 0.3 µm rms": 0.3e-6 * rng.standard_normal(x.size),
    }
    yield "\n| relief, tip | convex corners | s of a core per s |\n|---|---|---|"
    for name, height in heights.items():
        for tip in (SHORT, LONG):
            taken, run = [], None
            for _ in range(REPEATS):
                start = process_time()
                run = drag(
                    cone(tip), POSTURE, HeightProfile(x, height), speed=SPEED, damping=DAMPING, duration=0.2,
                    sampling_rate=RATE,
                )  # fmt: skip
                taken.append((process_time() - start) / 0.2)
            yield f"| {name}, {tip} | {run.ground.edge.size} | {min(taken):.2f} |"


def swing_energy(path: BasePath, step: float) -> float:
    """Largest remainder of the energy of a swing, over the range of what is stored."""
    rod = Rod(step=step, tolerance=1e-13)
    how = {"speed": 0.05, "damping": DAMPING, "sampling_rate": 1 / step, "settings": rod}
    record = swing_run(cone(0.25), path, Gaps(np.array([10.0]), np.array([1e-4])), **how).record
    kinetic, elastic, power, ground, base, friction = record.energy
    stored = kinetic + elastic + record.contact[6]
    viscous = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2)]) * step / cone(0.25).timescale
    left = ground + base - stored - friction
    return float(np.abs(left - left[0] - viscous).max() / np.ptp(stored))


def swing() -> Iterator[str]:
    """Energy of a base that moves: in the air, and where the shaft strikes the ground."""
    time = np.linspace(0, 0.15, 151)
    turn = 0.9 + 0.3 * np.cos(2 * np.pi * 8 * time)
    travel = 2e-3 * np.sin(2 * np.pi * 5 * time)
    lowered = 0.65 + 0.15 * np.cos(2 * np.pi * time / 0.15)
    paths = {
        "in the air": BasePath(time=time, base_angle=turn, base_distance=np.full(151, 1.3), travel=travel),
        "onto the ground": BasePath(time=time, base_angle=np.full(151, 1.1), base_distance=lowered),
    }
    yield "\n| swing, step | largest remainder, over the range of what is stored |\n|---|---|"
    for name, path in paths.items():
        for step in (50e-6, 25e-6, 12.5e-6, 6.25e-6):
            yield f"| {name}, {1e6 * step:g} µs | {100 * swing_energy(path, step):.2g} % |"


@house_style
def draw(found: list[Cost]):
    """Error of the first mode against cost, each choice a point."""
    figure, axes = new_figure(6.5, 4.0)
    axis = axes[0, 0]
    for tip, colour, name in ((SHORT, OTHER, "tip at the contact"), (LONG, FOUND, "free end of 5.6 mm")):
        here = [one for one in found if one.tip == tip and one.rod is not FINEST]
        price, error = np.array([(one.seconds, 100 * one.error) for one in here]).T
        usual = [one.rod == Rod() for one in here]
        axis.loglog(price, error, "o", color=colour, ms=5, label=name)
        for one, x, y in zip(here, price, error, strict=True):
            choice = f"{one.rod.fineness.finest:g} L\n{1e6 * one.rod.step:g} µs"
            axis.annotate(choice, (x, y), xytext=(0, 8), textcoords="offset points", fontsize=6, ha="center")
        axis.loglog(price[usual], error[usual], "o", color=colour, ms=12, mfc="none")
    axis.set(xlabel="processor time per simulated time", ylabel="error of mode 1 [% of its rms]")
    for part, ticks in ((axis.xaxis, (0.2, 0.5, 1, 2)), (axis.yaxis, (1, 2, 5, 10, 20))):
        part.set_major_locator(FixedLocator(ticks))
        part.set_minor_locator(NullLocator())
        part.set_major_formatter(FormatStrFormatter("%g"))
    axis.margins(0.12)
    axis.legend(title="ringed: the default")
    return figure


PARTS: dict[str, Callable[[], Iterator[str]]] = {
    part.__name__: part for part in (convergence, energy, failures, stiff, cost, relief, swing, ends, postures)
}


def main() -> None:
    chosen = [word for word in sys.argv[1:] if not word.startswith("--")] or list(PARTS)
    for name in chosen:
        for line in PARTS[name]():
            print(line, flush=True)


if __name__ == "__main__":
    main()
