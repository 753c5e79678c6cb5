"""A whole experiment: 514 simulated units as the paper counts them, on 24 whiskers, from spikes to the paper's numbers.

.venv/bin/python benchmarks/acceptance.py [TRIALS, 60] [SEED, 1]

One motion of 10 s is shifted around 24 whiskers. Units that its envelope does not drive do nothing, adapt, follow a
slow feature of this or another whisker; none is locked to the carrier. Each is analysed against the motion of its
own whisker, the delays of the others left out of the null, p-values adjusted over the units of each whisker. Printed
are the share of responsive units beside Wilson's 95 % interval of the paper's, and mean thresholds beside the paper's
and beside those of the same units. Then all driven units are given to a neighbouring whisker instead of their own, and
the correlation of the copies is printed for many motions.

The paper fits every responsive unit, hence "fitted". "Identified" ones leave out thresholds that may lie below what the
envelope shows for 90 % of the time, so that their mean may lie above that of all, the true one as well.

Measured with 60 trials, seeds 1 and 2: 26.5 and 27.1 % of single units (the paper's 26.5 %), 44.8 and 45.3 % of
multi-units (45.6 %), 1 and 3 of 312 idle units among them; mean threshold of identified units 47.0 and 45.9 µm (true
47.2 and 45.8; the paper's 42.3 ± 2.1), 45.0 and 43.2 µm (true 44.7 and 43.6; the paper's 43.5 ± 0.9): the first of
them just beyond 2 standard errors of the paper's, as its true mean is.
"""

import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import xarray as xr

from vibrissa.neural.simulated.population import COUNTS, THRESHOLD, draw_population
from vibrissa.stats import adjusted_p_values, wilson_interval
from vibrissa.stimulus.delays import UNCORRELATED

sys.path += [str(Path(__file__).parents[1] / "tests" / place) for place in ("helpers", "neural/coupling")]
from test_acceptance import analysed, neighbours, off, peaks, recorded, replayed, without_carriers


def shares(quality: str, truth: xr.Dataset, found: xr.Dataset) -> None:
    """Responsive units beside the paper's."""
    n, paper = COUNTS["results"][quality]
    driven, significant = (truth.driven_by == "envelope").values, found.significant.values
    missed, wrong = int((driven & ~significant).sum()), truth.driven_by.values[~driven & significant]
    whole = int((adjusted_p_values(found.p_value.values) <= found.attrs["level"]).sum())
    low, high = wilson_interval(paper, n)
    share = significant.mean()
    print(
        f"{quality}: responsive {significant.sum()} of {n}, {100 * share:.1f} %; paper {100 * paper / n:.1f} %"
        f" [{100 * low:.1f}, {100 * high:.1f}]: {verdict(low <= share <= high)}"
    )
    print(f"  missed {missed} of {paper}; wrong {wrong.size} of {n - paper} ({', '.join(wrong)})")
    print(f"  adjusted over all {quality} at once: {whole}")


def thresholds(quality: str, truth: xr.Dataset, found: xr.Dataset) -> None:
    """Mean threshold [µm] of all that are fitted and of those identified, beside the paper's and their own."""
    driven = (truth.driven_by == "envelope").values
    for name, counted in (("fitted", found.significant.values), ("identified", found.identified.values)):
        theirs = 1e6 * found.threshold.values[counted]
        mean, sem = 1e6 * THRESHOLD[quality][0], 1e6 * THRESHOLD[quality][1] / np.sqrt(COUNTS["results"][quality][1])
        away = (np.nanmean(theirs) - mean) / sem
        print(
            f"  threshold of {theirs.size} {name}: {np.nanmean(theirs):.2f} µm; paper {mean:.1f} ± {sem:.1f},"
            f" {away:+.2f} SEM: {verdict(abs(away) <= 2)}"
        )
        errors(truth.isel(unit=counted & driven), found.isel(unit=counted & driven))


def errors(truth: xr.Dataset, found: xr.Dataset) -> None:
    """Fitted thresholds of driven units beside their own [µm]."""
    fitted, own = found.threshold.values, truth.true_threshold.values
    held = (found.threshold_low.values <= own) & (own <= found.threshold_high.values)
    error = 1e6 * (fitted - own)
    n, sem = error.size, 1e6 * sem_of(fitted)
    print(
        f"    of the {n} driven {1e6 * fitted.mean():.2f} ± {sem:.2f}, true {1e6 * own.mean():.2f}:"
        f" {verdict(abs(error.mean()) <= 2 * sem)}"
    )
    print(
        f"    error {error.mean():+.2f} ± {sem_of(error):.2f}, median {np.median(error):+.2f},"
        f" largest {np.abs(error).max():.1f}; intervals hold the truth in {100 * held.mean():.0f} %"
    )


def sem_of(values: np.ndarray) -> float:
    """Standard error of the mean."""
    return float(values.std(ddof=1) / np.sqrt(values.size))


def verdict(held: bool) -> str:
    return "within" if held else "OUTSIDE"


def neighbouring(truth: xr.Dataset, command: xr.Dataset, n_trials: int, rng: np.random.Generator) -> None:
    """Units of a neighbouring whisker: where they peak, and whether they are called driven."""
    units = neighbours(truth, rng)
    spikes = recorded(units, command, n_trials, rng)
    near = np.abs(off(peaks(spikes, command), units, command)) <= 2
    called, n = int(analysed(spikes, command).significant.sum()), near.size
    low, high = wilson_interval(called, n)
    print(f"driven by a neighbouring whisker: {near.sum()} of {n} peak within 2 bins of its delay and their latency")
    print(f"  slopes of the others {np.round(1e-6 * units.true_slope.values[~near], 3)} AP/s per µm")
    print(f"  called driven by their own: {called}, {100 * called / n:.1f} % [{100 * low:.1f}, {100 * high:.1f}]")


def copies(n_motions: int = 100) -> None:
    """Largest correlation of two copies, motion by motion."""
    for delays in ("even", "least"):
        r = [float(replayed(np.random.default_rng(k), delays).largest_correlation) for k in range(n_motions)]
        above = np.mean(np.array(r) >= UNCORRELATED)
        print(
            f"largest |r| of 24 copies, {delays} delays, {n_motions} motions: median {np.median(r):.3f},"
            f" largest {max(r):.3f}; {100 * above:.0f} % not below {UNCORRELATED}"
        )


def main(n_trials: int = 60, seed: int = 1) -> None:
    start = perf_counter()
    rng = np.random.default_rng(seed)
    command = replayed(rng)
    truth = without_carriers(draw_population("results", rng=rng), draw_population("results", rng=rng))
    found = analysed(recorded(truth, command, n_trials, rng), command)
    r = float(command.largest_correlation)
    print(f"{n_trials} trials, seed {seed}, largest |r| of two copies {r:.3f}")
    for quality in ("SU", "MU"):
        those = np.flatnonzero(truth.unit_quality == quality)
        shares(quality, truth.isel(unit=those), found.isel(unit=those))
        thresholds(quality, truth.isel(unit=those), found.isel(unit=those))
    neighbouring(truth, command, n_trials, rng)
    copies()
    print(f"{perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
