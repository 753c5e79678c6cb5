"""The whole whisker in MuJoCo beside the rod: one gap and a random grating, both ever finer.

python benchmarks/peers/whole_run.py [CASE …] [--quick]

Cases: the keys of CASES; all without a name. Needs the dependency group ``peers``. Takes a quarter of an hour on a
quiet machine, ``--quick`` two minutes. Each row: the ratio of rms and the correlation of the three pinned modes, as a
movie shows them, over the finest rod's; processor seconds per simulated second; and over the cost of the default rod.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from whole import Seen, Whole, alike, finer, ours, theirs

from vibrissa.mechanics.rod.mesh import Fineness
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.texture.surface import Gaps, random_grating

QUICK = "--quick" in sys.argv
GAP = Gaps(np.array([0.0]), np.array([0.6e-3]), 35e-6)
SHORT, LONG = (random_grating(length, rng=1) for length in (0.022, 0.03))
CASES = {
    "gap-tip": Whole(tip=0.289, surface=GAP, duration=30e-3),
    "gap-free-end": Whole(tip=0.25, surface=GAP, duration=30e-3),
    "grating-tip": Whole(tip=0.289, surface=SHORT, duration=0.2),
    "grating-free-end": Whole(tip=0.15, surface=LONG, duration=0.3),
}
COARSE = Fineness(0.004, 0.05, 0.25)
REPEATS = 3


@dataclass(frozen=True)
class Chain:
    """Mesh, step and softness of the contact [s] of one run of MuJoCo."""

    fineness: Fineness
    step: float
    softness: float


CHAINS = (
    Chain(COARSE, 1e-6, 5e-6),
    Chain(COARSE, 0.5e-6, 2e-6),
    Chain(Fineness(), 0.5e-6, 2e-6),
    Chain(Fineness(), 0.25e-6, 1e-6),
    Chain(Fineness().refined(2), 0.25e-6, 1e-6),
)
RODS = (Rod(fineness=COARSE, step=50e-6), Rod(), finer(Rod(), 2), finer(Rod(), 4))


def chains(name: str) -> tuple[Chain, ...]:
    """As fine as patience with a case reaches."""
    if name == "grating-free-end":
        return CHAINS[2:3]
    return CHAINS[: 3 if QUICK else 4 if name == "grating-tip" else 5]


def rows(name: str, case: Whole) -> Iterator[str]:
    """Table of one case."""
    yield f"\n| {name}, tip {case.tip}: smallest cell, step | nodes | mode 1 | mode 2 | mode 3 | cost | ratio |"
    yield 7 * "|---" + "|"
    rods = [cheapest(case, settings) for settings in RODS]
    finest, usual = rods[-1], rods[1]
    for settings, seen in zip(RODS, rods, strict=True):
        yield row("rod", settings.fineness, seen, finest, usual)
    yield row("rod, sharp edges", RODS[2].fineness, ours(case, RODS[2], sharp=True), finest, usual)
    for chain in chains(name):
        seen = theirs(case, chain.fineness, chain.step, chain.softness)
        yield row("MuJoCo", chain.fineness, seen, finest, usual)


def cheapest(case: Whole, settings: Rod) -> Seen:
    """Our rod at the least cost of several runs."""
    return min((ours(case, settings) for _ in range(REPEATS)), key=lambda seen: seen.cost)


def row(what: str, fineness: Fineness, seen: Seen, finest: Seen, usual: Seen) -> str:
    """One line of a table."""
    modes = " | ".join(f"{ratio:.3f}, {r:.4f}" for ratio, r in alike(seen.modes, finest.modes))
    how = f"{what}, {fineness.finest:g} L, {1e6 * seen.step:g} µs"
    return f"| {how} | {seen.nodes} | {modes} | {seen.cost:.3g} | {seen.cost / usual.cost:.2g} |"


def main() -> None:
    chosen = [word for word in sys.argv[1:] if not word.startswith("--")] or list(CASES)
    for name in chosen:
        for line in rows(name, CASES[name]):
            print(line, flush=True)


if __name__ == "__main__":
    main()
