"""What resonances of one whisker say of Young's modulus and of its follicle together.

.venv/bin/python benchmarks/follicle.py [--seeds N] [--bent]

Simulated measurements of a cone of 40 mm whose truth is known: frequencies, damping ratios and displacements 5 mm from
the base, with independent errors. Prints for each truth and each set of measurements the share of 20 seeds in which a
parameter is identified, and the median ratio of its interval's ends. Then the same without errors for a clamped, bent
whisker: modes about the curved profile, which the fit takes for those of a straight shaft. --bent: these alone. Three
minutes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import product

import numpy as np

from vibrissa.mechanics.inverse.follicle_fit import Resonances, follicle_fit, predicted
from vibrissa.mechanics.modes.curved import curved_modes
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
SEEDS = int(sys.argv[sys.argv.index("--seeds") + 1]) if "--seeds" in sys.argv else 20
TRUTHS = {
    "3 EI/L, 100 EI/L³": (3.0, 100.0), "30, 1000": (30.0, 1000.0), "3, clamped": (3.0, 5e5),
    "clamped, 100": (2e4, 100.0), "clamped, clamped": (2e4, 5e5),
}  # fmt: skip
ONE, FIVE = (0.3,), (0.2, 0.25, 0.3, 0.35, 0.4)
SETS = {  # contacts, modes, relative error of frequencies, error of displacements near the base
    "1 contact, modes 1–3, 1 %": (ONE, 3, 0.01, None),
    "5 contacts, modes 1–2, 1 %": (FIVE, 2, 0.01, None),
    "5 contacts, modes 1–3, 1 %": (FIVE, 3, 0.01, None),
    "5 contacts, modes 1–3, 3 %": (FIVE, 3, 0.03, None),
    "1 contact, modes 1–3, 1 %, shape ± 0.02": (ONE, 3, 0.01, 0.02),
    "5 contacts, modes 1–3, 3 %, shape ± 0.02": (FIVE, 3, 0.03, 0.02),
    "5 contacts, modes 1–3, 1 %, shape ± 0.02": (FIVE, 3, 0.01, 0.02),
}


def simulated(springs, contacts, modes, sd, near_sd, seed: int) -> Resonances:
    rng = np.random.default_rng(seed)
    truth = np.array([WHISKER.youngs_modulus, *springs, 0.11])
    f, zeta, near = predicted(WHISKER, np.array(contacts), truth, modes, 5e-3)
    shape = {} if near_sd is None else {
        "near": near + near_sd * rng.standard_normal(f.shape), "near_sd": np.full_like(f, near_sd)
    }  # fmt: skip
    return Resonances(
        contact=contacts, frequency=f * (1 + sd * rng.standard_normal(f.shape)), frequency_sd=sd * f,
        damping=zeta + 0.02 * rng.standard_normal(f.shape), damping_sd=np.full_like(f, 0.02), **shape,
    )  # fmt: skip


def bent() -> Iterator[str]:
    """The fit to resonances of clamped, bent whiskers, without errors."""
    yield "\n| contact | θ_b | E over the truth | rotation | translation | χ² | of |\n|---|---|---|---|---|---|---|"
    for condition, angle in product(("slide", "flat"), (0.2, 0.8, 1.2)):
        modes = [
            curved_modes(Posture(contact=contact, base_angle=angle), condition=condition, law="coulomb")
            for contact in FIVE
        ]
        f = np.array([one.kappa.real for one in modes]) / (2 * np.pi * WHISKER.timescale)
        fit = follicle_fit(WHISKER, Resonances(contact=FIVE, frequency=f, frequency_sd=0.01 * f))
        spans = [f"{fit.estimate[k]:.3g} ({fit.low[k]:.3g} to {fit.high[k]:.3g})" for k in (1, 2)]
        ends = (end[0] / WHISKER.youngs_modulus for end in (fit.estimate, fit.low, fit.high))
        ratio = "{:.2f} ({:.2f} to {:.2f})".format(*ends)
        cells = " | ".join([condition, str(angle), ratio, *spans, f"{fit.chi_square:.1f}", str(fit.freedom)])
        yield f"| {cells} |"


def main() -> None:
    if "--bent" not in sys.argv:
        print_straight()
    for line in bent():
        print(line, flush=True)


def print_straight() -> None:
    print("| follicle | measured | E | rotation | translation | ζ |\n|---|---|---|---|---|---|")
    for name, springs in TRUTHS.items():
        for measured, how in SETS.items():
            fits = [follicle_fit(WHISKER, simulated(springs, *how, seed)) for seed in range(SEEDS)]
            cells = []
            for k, parameter in enumerate(fits[0].identified):
                known = [fit for fit in fits if fit.identified[parameter]]
                width = f", × {np.median([fit.high[k] / fit.low[k] for fit in known]):.2g}" if known else ""
                cells.append(f"{100 * len(known) / len(fits):.0f} %{width}")
            print(f"| {name} | {measured} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
