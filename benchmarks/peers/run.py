"""One gap and a short grating in MuJoCo and Exudyn, beside the prediction.

python benchmarks/peers/run.py

Needs the dependency group ``peers`` beside vibrissa. Prints the tables, writes them to docs/validation/peers-*.csv and
draws docs/peers.png; takes about three minutes.
"""

from __future__ import annotations

import csv
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cable
import chain
import numpy as np
from case import SETTLE, STEP, Array, Case, ring
from chain import Grain, Ground, PredictedMotion
from edge import clamped, limit
from picture import draw
from speed import table as speeds

from vibrissa.exact import cone_kappa
from vibrissa.mechanics.modes.basis import Modes
from vibrissa.mechanics.modes.curved import curved_modes

RESONANCE, ALIKE = 0.01, 0.98  # gates
SAG = 2e-6  # [m] by which the edge must hold the shaft off the land for MuJoCo's links to know it
PERIODS = 1.2  # of the first mode, in less than which no resonance is read
TABLES = ("trials", "held", "modes", "mujoco", "speed")  # in the order in which they are printed
HEAD = "| trial | κ₁ theirs | κ₁ ours | off | ζ₁ theirs | ζ₁ ours | alike | size | gate |\n" + 9 * "|---" + "|"
FINER = Grain(fine=0.06e-3, coarse=0.5e-3)  # for Exudyn's elements


@dataclass(frozen=True)
class Trial:
    """Results of one case.

    ``kappa`` and ``zeta`` of the peer's ring-down and ours, NaN where it is too short to be read; ``alike`` the
    correlation of the motions ``theirs`` and ``ours``, over L, at ``time`` [s] from the jump or the release; ``size``
    the ratio of their standard deviations.
    """

    name: str
    gated: bool
    kappa: tuple[float, float]
    zeta: tuple[float, float]
    time: Array
    theirs: Array
    ours: Array

    @property
    def off(self) -> float:
        return self.kappa[0] / self.kappa[1] - 1

    @property
    def alike(self) -> float:
        return float(np.corrcoef(self.theirs, self.ours)[0, 1])

    @property
    def size(self) -> float:
        return float(np.std(self.theirs) / np.std(self.ours))

    def row(self) -> str:
        passed = self.alike >= ALIKE and not abs(self.off) >= RESONANCE
        verdict = ("pass" if passed else "FAIL") if self.gated else "–"
        read = "| – | " if np.isnan(self.off) else f"| {self.kappa[0]:.2f} | "
        off = "– | – |" if np.isnan(self.off) else f"{100 * self.off:+.1f} % | {self.zeta[0]:.3f} |"
        like = f"{self.alike:.4f} | {self.size:.2f} | {verdict} |"
        return f"| {self.name} {read}{self.kappa[1]:.2f} | {off} {self.zeta[1]:.3f} | {like}"


def plucked(name: str, case: Case, ground: Ground, gated: bool) -> Trial:
    """Ring-down after a pluck, beside the free decay of the first mode from where it was let go."""
    motion = chain.simulate(case, ground=ground)
    here = case.time >= SETTLE - STEP / 2
    time = case.time[here] - SETTLE
    theirs = case.seen(motion.s, motion.x, motion.y, (motion.x[-1], motion.y[-1]))[here]
    omega, zeta = case.prediction.omega[0], case.zeta[0]
    Omega = omega * np.sqrt(1 - zeta**2)
    ours = (
        theirs[0] * np.exp(-zeta * omega * time) * (np.cos(Omega * time) + zeta * omega / Omega * np.sin(Omega * time))
    )
    return compared(name, gated, case, (time, theirs, ours), (time, theirs))


def crossed(name: str, case: Case, motion: PredictedMotion, rest: tuple[Array, Array], gated: bool) -> Iterator[Trial]:
    """One gap from its jump on, while its edge holds the contact; then with the flat after it, where the peer has one.

    The resonance on the edge is that of the motion without our quasi-static part, beside κ₁ where the edge holds the
    contact, in the mean; that on the flat, of the motion. The flat is no pin, and not gated.
    """
    theirs = case.seen(motion.s, motion.x, motion.y, rest)
    ours, quasi_static = case.ours(case.time), case.prediction.mode_drive(case.time)[0]
    _, jump, flat = case.prediction.events.time[:3]
    on_edge, after = (case.time > jump) & (case.time < flat - STEP), case.time > jump
    since, free = case.time - jump, theirs - quasi_static
    motions = since[on_edge], theirs[on_edge], ours[on_edge]
    yield compared(f"{name}, on the edge", gated, case, motions, (since[on_edge], free[on_edge]), case.held_kappa)
    if case.after > 0:
        on_flat = case.time > flat
        motions = since[after], theirs[after], ours[after]
        yield compared(f"{name}, all; κ₁ on the flat", False, case, motions, (since[on_flat], theirs[on_flat]))


def left_alone(name: str, case: Case) -> Iterator[Trial]:
    """From a land onto a ridge with nothing after it, from its own jump on until the contact is back at ε.

    Then beside what is no prediction yet: our mode ringing at the frequency that drifts with the contact.
    """
    motion = chain.simulate(case, ground="ridge")
    theirs = case.seen(motion.s, motion.x, motion.y, resting(case, motion))
    _, jump, flat = case.prediction.events.time[:3]
    late = motion.left - jump
    here = (case.time > motion.left) & (case.time < flat - STEP)
    time = case.time[here] - late
    free = theirs[here] - case.prediction.mode_drive(case.time[here])[0]
    named = f"{name}, {1e6 * late * case.speed:.0f} µm late"
    for ours, what, gated in ((case.ours, "", True), (case.drifting, ", drifting", False)):
        motions = time - jump, theirs[here], ours(time)
        yield compared(named + what, gated, case, motions, (time - jump, free), case.held_kappa)


def grating(name: str, case: Case, gated: bool) -> Trial:
    """Several gaps, from the first jump to the end of the last; no resonance is read."""
    motion = chain.simulate(case)
    jump = case.prediction.events.time[1]
    here = (case.time > jump) & (case.time < case.prediction.end)
    theirs = case.seen(motion.s, motion.x, motion.y, resting(case, motion))[here]
    since = case.time[here] - jump
    return compared(name, gated, case, (since, theirs, case.ours(case.time[here])), (since[:1], theirs[:1]))


def resting(case: Case, motion: PredictedMotion) -> tuple[Array, Array]:
    """MuJoCo's own profile on the flat, just before the first gap."""
    before = np.searchsorted(case.time, SETTLE) - 2
    return motion.x[before], motion.y[before]


def compared(
    name: str,
    gated: bool,
    case: Case,
    motions: tuple[Array, Array, Array],
    free: tuple[Array, Array],
    kappa: float | None = None,
) -> Trial:
    """A trial from time and both motions; the resonance from time and the part of the peer's that rings freely.

    It is compared with ``kappa``, by default that of ε.
    """
    ours = float(case.prediction.kappa[0]) if kappa is None else kappa
    found = np.nan, np.nan
    if np.ptp(free[0]) > PERIODS * 2 * np.pi / case.prediction.omega[0]:
        found = ring(*free, case.prediction.omega[0], case.zeta[0])
    return Trial(name, gated, (found[0] * case.whisker.timescale, ours), (found[1], float(case.zeta[0])), *motions)


def in_mujoco(name: str, case: Case, gated: bool, *others: tuple[str, Modes]) -> Iterator[Trial]:
    """One gap, seen in the modes of the case; then the same motion seen in other modes."""
    motion = chain.simulate(case)
    rest = resting(case, motion)
    yield from crossed(f"MuJoCo: {name}", case, motion, rest, gated)
    for other, modes in others:
        yield from crossed(f"MuJoCo: {other}", replace(case, modes=modes), motion, rest, gated)


def in_exudyn(name: str, case: Case, gated: bool) -> Iterator[Trial]:
    case = replace(case, damped="stiffness", after=0.0)
    motion = cable.simulate(case, FINER)
    x, y = case.flat.position(motion.s)
    foot = np.array(case.flat.position(np.array([case.contact]))).ravel()
    return crossed(f"Exudyn: {name}", case, motion, (x - foot[0], y - foot[1]), gated)


def trials() -> Iterator[Trial]:
    """Every case."""
    low = Case(base_angle=0.3, speed=0.3, beyond=0.0, after=80e-3)
    high = replace(low, base_angle=1.2, modes="curved-coulomb")
    slipping = replace(high, modes="curved-edge", beyond=0.4e-3)
    yield plucked("MuJoCo: pluck, cut end on the flat, 0.3 rad", low, "tip", True)
    yield plucked("MuJoCo: pluck, cut end on the flat, 1.2 rad", high, "tip", True)
    yield plucked("MuJoCo: pluck, on an edge, 0.3 rad", replace(low, beyond=0.4e-3), "roller", True)
    yield plucked("MuJoCo: pluck, on an edge, 1.2 rad", slipping, "roller", True)
    for contact in (0.302, 0.3037, 0.305):
        up = replace(low, contact=contact, beyond=0.4e-3)
        yield plucked(f"MuJoCo: pluck, on an edge at ε = {contact}, 0.3 rad", up, "roller", False)
    for width, speed in ((0.15e-3, 0.01), (0.3e-3, 0.02), (0.6e-3, 0.04)):
        case = Case(base_angle=0.3, gap=width, speed=speed)
        name = f"gap {1e3 * width:.2f} mm, 0.3 rad"
        yield from in_mujoco(name, case, float(case.held.sag_height[0]) > SAG)
        yield from in_exudyn(name, case, True)
    lone = Case(base_angle=0.3, speed=0.02, after=0.0)
    yield from left_alone("MuJoCo: ridge, gap 0.30 mm, 0.3 rad", lone)
    high = replace(lone, base_angle=1.2, modes="curved-edge")
    yield from left_alone("MuJoCo: ridge, gap 0.30 mm, 1.2 rad", high)
    yield from left_alone("MuJoCo: ridge, gap 0.30 mm, 1.2 rad, half as fast", replace(high, speed=0.01))
    yield from left_alone("MuJoCo: ridge, gap 0.15 mm, 1.2 rad", replace(high, gap=0.15e-3, speed=0.01))
    for land in (0.05e-3, 0.3e-3):
        name = f"MuJoCo: six gaps of 0.30 mm, lands of {1e3 * land:.2f} mm, 0.3 rad"
        yield grating(name, Case(base_angle=0.3, gap=0.3e-3, period=0.3e-3 + land, gaps=6, speed=0.1), True)
    steep = Case(base_angle=1.2, modes="curved-edge", speed=0.1)
    name = "gap 0.30 mm, 1.2 rad"
    yield from in_mujoco(f"{name}, modes of an edge", steep, False, (f"{name}, modes of a point", "curved-coulomb"))
    yield from in_exudyn(f"{name}, modes of an edge", steep, False)
    for angle, modes in ((0.3, "straight"), (1.2, "curved-edge")):
        whole = Case(base_angle=angle, modes=modes, speed=0.1, gap=0.6e-3, beyond=0.29 * 40e-3)
        yield from in_mujoco(f"full length, gap 0.60 mm, {angle} rad", whole, False)


def linearised() -> str:
    """Table of κ₁ by what holds the contact, in the modes by Coulomb's law and in chains of ever more links."""
    head = "| θ_b [rad] | point: modes | point: chain | edge: modes | edge: chain | flat: modes | flat: with free end |"
    rows = [head + "\n" + 7 * "|---" + "|"]
    for angle in (0.3, 0.8, 1.2, 1.4):
        case = Case(base_angle=angle)
        point, edge, flat = (
            float(curved_modes(case.flat, 1, condition=how, law="coulomb").kappa[0])
            for how in ("slide", "edge", "flat")
        )
        chains = limit(case, False), limit(case, True)
        cells = (point, chains[0], edge, chains[1], flat, laid(case))
        rows.append(f"| {angle} | " + " | ".join(f"{kappa:.3f}" for kappa in cells) + " |")
    straight = f"Straight shaft at ε = 0.3: κ₁ = {cone_kappa(0.3, 1)[0]:.3f} pinned, {clamped(0.3):.3f} clamped.  "
    return "\n".join([*rows, "", straight])


def laid(case: Case) -> float:
    """κ₁ on the flat with the mass of the whole free end, which slides as the contact does, by Rayleigh's quotient."""
    modes = curved_modes(case.flat, 1, condition="flat", law="coulomb")
    here = np.array([case.contact])
    slide, dual = modes.displacement(here)[0, 0, 0], modes.adjoint(here)[0, 0, 0]
    return float(modes.kappa[0] / np.sqrt(1 + case.contact**3 / 3 * slide * dual))


def drawn_up(angle: float, width: float) -> str:
    """What our model says of the edge that holds the contact after a jump."""
    case = Case(
        base_angle=angle, gap=width, speed=0.02 * width / 0.3e-3, modes="straight" if angle < 1 else "curved-edge"
    )
    held, ring = case.held, case.held_kappa
    cells = f"{float(held.held_contact[0]):.4f} | {ring:.2f} | {1e2 * (ring / case.prediction.kappa[0] - 1):+.1f} %"
    sag = f"{1e6 * float(held.sag_height[0]):.1f} | {float(held.held_share[0]):.2f}"
    return f"| {1e3 * width:.2f}, {angle} | {cells} | {sag} |"


def drawings() -> str:
    """Table of them."""
    head = (
        "| gap [mm], θ_b [rad] | mean contact ε | κ₁ there | over that at ε = 0.3 | sag [µm] | share of the time held |"
    )
    rows = [drawn_up(angle, width) for angle in (0.3, 1.2) for width in (0.15e-3, 0.3e-3, 0.6e-3)]
    return "\n".join([head + "\n" + 6 * "|---" + "|", *rows])


def tables(text: str) -> Iterator[list[list[str]]]:
    """Rows of each table of a text, its header first."""
    for is_table, lines in itertools.groupby(text.splitlines(), lambda line: line.startswith("|")):
        if is_table:
            head, _, *rows = ([cell.strip() for cell in line[1:-1].split("|")] for line in lines)
            yield [head, *rows]


def main() -> None:
    docs = Path(__file__).parents[2] / "docs"
    print(HEAD)
    found = []
    for trial in trials():
        found.append(trial)
        print(trial.row(), flush=True)
    draw(found).savefig(docs / "peers.png", dpi=150)
    rest = [drawings(), linearised(), speeds()]
    print("\n".join(rest))
    trials_table = "\n".join([HEAD, *(trial.row() for trial in found)])
    for name, rows in zip(TABLES, tables("\n\n".join([trials_table, *rest])), strict=True):
        with (docs / "validation" / f"peers-{name}.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    main()
