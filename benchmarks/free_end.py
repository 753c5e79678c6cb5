"""The fast model with the free end beside the rod: one gap, random gratings, cost, and where it is valid.

.venv/bin/python benchmarks/free_end.py [PART …] [--store FILE]

Parts: ends, gratings, cost, map; all of them without a name. The whisker of docs/validation.md. Prints tables. What
``map`` has computed is kept in FILE (free-end-map.json), from which an interrupted run goes on; it also draws
docs/free-end-map.png. Envelopes are compared without a lag. Five minutes of one core, four of them for the map.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass
from pathlib import Path
from time import process_time

import numpy as np
from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.figures.canvas import house_style, new_figure
from vibrissa.mechanics.free_end.free_end_prediction import FreeEndPrediction
from vibrissa.mechanics.rod.rod_gap import gap_prediction, rod_gap
from vibrissa.mechanics.rod.rod_scan import drag
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.signals.correlation import best_correlation
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import Gaps, random_grating
from vibrissa.whisker import Whisker

Array = np.ndarray
LENGTH, DAMPING, RATE, LAG = 0.04, 0.11, 5e3, 50e-3
ANGLES, CONTACTS = (0.8, 1.0, 1.2, 1.4, 1.5), (0.29, 0.2, 0.15, 0.4, 0.1)
FREE_ENDS = (0.04e-3, 0.1e-3, 0.2e-3, 0.4e-3, 0.8e-3, 1.6e-3, 2.8e-3)
LOST = {(0.1, f) for f in FREE_ENDS[:4]}  # the rod does not converge there
GOOD, ALIKE = 0.95, 0.1  # least correlation of envelopes, largest error of the rms


@dataclass(frozen=True)
class Case:
    """One grating under one whisker."""

    contact: float = 0.29
    base_angle: float = 1.2
    free_end: float = 5.6e-3
    depth: float = 35e-6
    speed: float = 0.1
    curvature: float = 0.0
    friction: float = 0.4
    period: float = 0.6e-3
    duration: float = 0.6
    seed: int = 1

    @property
    def whisker(self) -> Whisker:
        tip = self.contact - self.free_end / LENGTH
        return Whisker(length=LENGTH, cone_angle=1.5e-3, tip=round(tip, 9))

    @property
    def posture(self) -> Posture:
        return Posture(contact=self.contact, base_angle=self.base_angle, friction=self.friction)

    @property
    def grating(self) -> Gaps:
        return random_grating(self.duration * self.speed, rng=self.seed, mean_period=self.period, depth=self.depth)

    @property
    def how(self) -> Scan:
        return Scan(speed=self.speed, damping=DAMPING)


def by_rod(case: Case) -> tuple[Array, Array]:
    """Times and modes of the rod."""
    run = drag(
        case.whisker, case.posture, case.grating, speed=case.speed, damping=DAMPING, duration=case.duration,
        sampling_rate=RATE, settings=Rod(curvature=case.curvature),
    )  # fmt: skip
    return run.time, run.mode_displacement


def compared(rod: Array, fast: Array) -> list[float]:
    """Of modes 1 and 2: correlation of envelopes without a lag and at the best one, rms over the rod's."""
    out = []
    for one, other in zip(rod[:2], fast[:2], strict=True):
        a, b = (analytic_envelope(signal[None])[0][0] for signal in (one, other))
        best = float(best_correlation(a, b, round(LAG * RATE))[1])
        out += [float(np.corrcoef(a, b)[0, 1]), best, float(other.std() / one.std())]
    return out


def judged(case: Case) -> list[float]:
    """Comparison of one case; nothing where one of both does not answer."""
    try:
        time, rod = by_rod(case)
        fast = FreeEndPrediction(case.whisker, case.posture, case.grating, case.how).mode_displacement(time)
    except (InputError, ConvergenceError) as error:
        print(f"  {case}: {error}", file=sys.stderr)
        return []
    return compared(rod, fast)


def valid(found: list[float]) -> bool:
    """Whether both envelopes and both rms are as asked."""
    return bool(found) and min(found[0], found[3]) >= GOOD and max(abs(found[2] - 1), abs(found[5] - 1)) <= ALIKE


def ends() -> Iterator[str]:
    """One gap of 0.6 mm, by where the shaft ends."""
    yield "\n| tip | free end [mm] | largest q₁ + Q₁, q₂ + Q₂ [10⁻³ L]: rod | free end | single contact |"
    yield "|---|---|---|---|---|"
    gap = Gaps(np.array([0.0]), np.array([0.6e-3]), 35e-6)
    posture, how, time = Posture(contact=0.29, base_angle=1.2), Scan(speed=0.1, damping=DAMPING), np.arange(2000) / 2e4
    for tip in (0.289, 0.285, 0.28, 0.27, 0.25, 0.15):
        whisker = Whisker(length=LENGTH, cone_angle=1.5e-3, tip=tip)
        rod = rod_gap(gap_prediction(whisker, posture, width=0.6e-3)).largest_mode_displacement.to_numpy()
        fast = np.abs(FreeEndPrediction(whisker, posture, gap, how).mode_displacement(time)).max(axis=1)
        single = np.abs(predict(whisker, posture, gap, how).mode_displacement(time)).max(axis=1)
        cells = " | ".join(", ".join(f"{1e3 * q:.3g}" for q in each[:2]) for each in (rod, fast, single))
        yield f"| {tip} | {40 * (0.29 - tip):.2f} | {cells} |"


def gratings() -> Iterator[str]:
    """Random gratings of 1.2 s, beside the rod and the single contact."""
    yield "\n| free end [mm] | θ_b, ε, v | envelopes, modes 1, 2 | best lag | rms over the rod's | single contact |"
    yield "|---|---|---|---|---|---|"
    cases = [Case(0.29, a, f, duration=1.2) for f in (5.6e-3, 0.4e-3, 0.2e-3, 0.04e-3) for a in (0.8, 1.0, 1.2, 1.4)]
    cases += [Case(0.29, 1.2, f, speed=0.2, duration=1.2) for f in (5.6e-3, 0.4e-3, 0.04e-3)]
    cases += [Case(e, 1.2, f, duration=1.2) for e, f in ((0.15, 4e-3), (0.2, 4e-3), (0.4, 8e-3))]
    for case in cases:
        time, rod = by_rod(case)
        a, b, c, d, e, f = compared(
            rod, FreeEndPrediction(case.whisker, case.posture, case.grating, case.how).mode_displacement(time)
        )
        single = compared(rod, predict(case.whisker, case.posture, case.grating, case.how).mode_displacement(time))
        at = f"{case.base_angle}, {case.contact}, {case.speed}"
        paper = f"{single[0]:.2f}, {single[3]:.2f}; {single[2]:.2g}"
        yield f"| {1e3 * case.free_end:.2g} | {at} | {a:.3f}, {d:.3f} | {b:.3f}, {e:.3f} | {c:.2f}, {f:.2f} | {paper} |"


def cost() -> Iterator[str]:
    """Processor time of both, tables and sampling at 5 kHz included."""
    yield "\n| free end [mm] | rod [s per s] | tables [ms] | march and samples [ms per s] | ratio | with the tables |"
    yield "|---|---|---|---|---|---|"
    for free_end in (5.6e-3, 0.4e-3, 0.04e-3):
        case = Case(free_end=free_end, duration=1.2)
        time, _ = by_rod(case)
        rod = min(timed(lambda case=case: by_rod(case)) for _ in range(3)) / case.duration

        def fresh(case: Case = case) -> FreeEndPrediction:
            return FreeEndPrediction(case.whisker, case.posture, case.grating, case.how)

        fresh().mode_displacement(time)
        table = min(timed(lambda: fresh().tables) for _ in range(10))
        whole = min(timed(lambda time=time: fresh().mode_displacement(time)) for _ in range(10))
        march = (whole - table) / case.duration
        cells = (
            f"{rod:.2f} | {1e3 * table:.0f} | {1e3 * march:.1f} | {rod / march:.0f} | {rod * case.duration / whole:.0f}"
        )
        yield f"| {1e3 * free_end:.2g} | {cells} |"


def timed(work: Callable[[], object]) -> float:
    start = process_time()
    work()
    return process_time() - start


def cases() -> dict[str, list[Case]]:
    """Of the map: by posture and free end, and one thing varied at a time."""
    some = [(a, f) for a in (0.8, 1.2, 1.4) for f in (0.2e-3, 0.4e-3, 1.6e-3)]
    return {
        "posture": [Case(e, a, f) for e in CONTACTS for a in ANGLES for f in FREE_ENDS if (e, f) not in LOST],
        "depth": [Case(0.29, a, f, depth=d) for d in (10e-6, 20e-6, 100e-6, 1e-3) for a, f in some],
        "curvature": [Case(0.29, a, f, curvature=c) for c in (1.0, 3.0, 10.0) for a, f in [*some, (1.2, 5.6e-3)]],
        "friction": [Case(0.29, a, f, friction=m) for m in (0.2, 0.6) for a, f in some],
        "period": [Case(0.29, a, f, period=p) for p in (0.3e-3, 1.2e-3) for a, f in some],
        "speed": [Case(0.29, a, f, speed=v) for v in (0.05, 0.2) for a, f in some],
    }


def computed() -> dict[Case, list[float]]:
    """All of the map, from the file as far as it is there."""
    path = Path(sys.argv[sys.argv.index("--store") + 1] if "--store" in sys.argv else "free-end-map.json")
    stored = json.loads(path.read_text()) if path.exists() else {}
    out = {}
    for case in dict.fromkeys(case for part in cases().values() for case in part):
        key = json.dumps(astuple(case))
        if key not in stored:
            stored[key] = judged(case)
            path.write_text(json.dumps(stored))
        out[case] = stored[key]
    return out


def map() -> Iterator[str]:
    """Where the fast model agrees with the rod; draws the figure."""
    found = computed()
    draw(found).savefig(Path(__file__).parents[1] / "docs" / "free-end-map.png", dpi=150)
    yield (
        "\n| ε | θ_b | " + " | ".join(f"{1e3 * f:.2g} mm" for f in FREE_ENDS) + " |\n|" + "---|" * (2 + len(FREE_ENDS))
    )
    for contact in sorted(CONTACTS):
        for angle in ANGLES:
            row = [cell(found.get(Case(contact, angle, f), [])) for f in FREE_ENDS]
            yield f"| {contact} | {angle} | " + " | ".join(row) + " |"
    for name in ("depth", "curvature", "friction", "period", "speed"):
        yield f"\n| {name} | θ_b | free end [mm] | envelopes, rms |\n|---|---|---|---|"
        for case in cases()[name]:
            yield f"| {getattr(case, name):g} | {case.base_angle} | {1e3 * case.free_end:.2g} | {cell(found[case])} |"


def cell(found: list[float]) -> str:
    """Envelopes of modes 1 and 2 and rms over the rod's; marked where all are as asked."""
    if not found:
        return "–"
    text = f"{found[0]:.2f}, {found[3]:.2f}; {found[2]:.2f}, {found[5]:.2f}"
    return f"**{text}**" if valid(found) else text


@house_style
def draw(found: dict[Case, list[float]]):
    """Lesser correlation of both envelopes against the free end, by posture."""
    figure, axes = new_figure(7.0, 2.6, columns=len(CONTACTS))
    for axis, contact in zip(axes[0], sorted(CONTACTS), strict=True):
        for k, angle in enumerate(ANGLES):
            points = [(f, found.get(Case(contact, angle, f), [])) for f in FREE_ENDS]
            there = [(1e3 * f, min(one[0], one[3])) for f, one in points if one]
            if there:
                axis.semilogx(*zip(*there, strict=True), "o-", ms=3, lw=1, color=f"C{k}", label=f"{angle} rad")
        axis.axhline(GOOD, color="0.6", lw=0.8)
        axis.set_xlim(0.03, 4)
        axis.xaxis.set_major_locator(FixedLocator((0.04, 0.2, 0.8, 2.8)))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.xaxis.set_major_formatter(FormatStrFormatter("%g"))
        axis.set(title=f"ε = {contact}", xlabel="free end [mm]", ylim=(0.3, 1.01))
    axes[0, 0].set_ylabel("correlation of envelopes")
    axes[0, 3].legend(fontsize=6)
    return figure


PARTS: dict[str, Callable[[], Iterator[str]]] = {part.__name__: part for part in (ends, gratings, cost, map)}


def main() -> None:
    words = [word for word in sys.argv[1:] if word in PARTS]
    for name in words or list(PARTS):
        for line in PARTS[name]():
            print(line, flush=True)


if __name__ == "__main__":
    main()
