"""CPU time of a short grating: MuJoCo, as coarse as it may be, against the prediction.

.venv/bin/python benchmarks/peers/speed.py

Needs the dependency group ``peers``.
"""

from __future__ import annotations

from itertools import count
from time import process_time

import chain
import numpy as np
from case import SETTLE, Case
from chain import Grain

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.gap import jump_table
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.surface import Gaps

ALIKE, FASTER, REPEATS = 0.98, 1000.0, 9
GRATING = Case(base_angle=0.3, gap=0.3e-3, period=0.6e-3, gaps=10, speed=0.1, after=40e-3)
GRAINS = (
    Grain(),
    Grain(fine=0.25e-3, step=1.25e-6),
    Grain(fine=0.5e-3, coarse=2e-3, step=2.5e-6, softness=5e-6),
    Grain(fine=0.5e-3, coarse=3e-3, step=5e-6, softness=1e-5),
)


def best(run) -> float:
    """Least CPU time [s] of several runs, the first, which compiles, not counted."""
    run()
    taken = []
    for _ in range(REPEATS):
        start = process_time()
        run()
        taken.append(process_time() - start)
    return min(taken)


def peers() -> list[tuple[Grain, int, float, float, float]]:
    """Grain, links, CPU seconds per simulated second, correlation with the finest and with ours."""
    found, finest, ours = [], None, GRATING.ours(GRATING.time)
    after = GRATING.time > SETTLE
    for grain in GRAINS:
        motion = chain.simulate(GRATING, grain)
        before = np.searchsorted(GRATING.time, SETTLE) - 2
        seen = GRATING.seen(motion.s, motion.x, motion.y, (motion.x[before], motion.y[before]))[after]
        finest = seen if finest is None else finest
        alike = [float(np.corrcoef(seen, other)[0, 1]) for other in (finest, ours[after])]
        found.append((grain, len(motion.s), motion.cost, *alike))
    return found


def predicted(gaps: int, tables: bool, form: str) -> float:
    """CPU seconds per simulated second of three modes at 20 kHz, with or without the posture's tables at hand."""
    case = GRATING
    position = case.period * np.arange(gaps)
    texture = Gaps(position=position, width=np.full(gaps, case.gap), depth=35e-6)
    scan = Scan(speed=case.speed, damping=case.damping, response=form)
    time = np.arange(0, position[-1] / case.speed + case.after, 5e-5)
    made = predict(case.whisker, case.posture, texture, scan, n_modes=3)
    jumps = jump_table(case.posture, texture.width / case.whisker.length)
    given = {"response": made.response, "jumps": jumps} if tables else {}
    postures = (Posture(contact=case.contact + 1e-9 * (not tables) * i, base_angle=case.base_angle) for i in count())

    def run() -> None:
        """A posture never seen before, unless its tables are given."""
        predict(case.whisker, next(postures), texture, scan, n_modes=3, **given).amplitudes(time)

    return best(run) / time[-1]


def table() -> str:
    """Both tables, and the gate."""
    rows = ["| MuJoCo | links | ms CPU per ms | like its finest | like ours |\n" + 5 * "|---" + "|"]
    found = peers()
    for grain, links, cost, finest, ours in found:
        how = f"links of {1e3 * grain.fine:.2f} mm at the contact, steps of {1e6 * grain.step:.2f} µs"
        rows.append(f"| {how} | {links} | {cost:.3g} | {finest:.4f} | {ours:.4f} |")
    cheapest = min(cost for _, _, cost, finest, _ in found if finest >= ALIKE)
    rows.append("\n| prediction | ms CPU per ms | MuJoCo over it |\n|---|---|---|")
    verdicts = []
    for form in ("exact", "linear"):
        for gaps in (GRATING.gaps, 600):
            for tables in (False, True):
                cost = predicted(gaps, tables, form)
                name = f"{form}, {gaps} gaps, tables of the posture {'at hand' if tables else 'made anew'}"
                rows.append(f"| {name} | {cost:.2g} | {cheapest / cost:,.0f} |")
                if form == "exact":
                    verdicts.append("pass" if cheapest / cost >= FASTER else "FAIL")
    few, some = f"{verdicts[1]} with the tables at hand, {verdicts[0]} where they are made anew", verdicts[2]
    gate = f"\nGate, {FASTER:,.0f} times the cheapest MuJoCo, exact form: on the short grating {few}; "
    rows.append(gate + f"on 600 gaps {some} with all made anew.")
    return "\n".join(rows)


if __name__ == "__main__":
    print(table())
