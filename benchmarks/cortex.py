"""How often the neural statistics keep their word, on units whose truth is known.

.venv/bin/python benchmarks/cortex.py false [UNITS of each population, 2000] [POPULATION …]
.venv/bin/python benchmarks/cortex.py power [UNITS, 500]
.venv/bin/python benchmarks/cortex.py fit [UNITS, 100]
.venv/bin/python benchmarks/cortex.py population
.venv/bin/python benchmarks/cortex.py speed

`false`: share of units that do not answer the envelope yet are found at p ≤ 0.01, with Wilson's 95 % interval; every
unit has its own stimulus. `power`: the same for weak units (slope 0.02 per s and µm, 60 trials). `fit`: error of
threshold, slope and latency, and how often the 95 % intervals hold the truth. `population`: 170 units of which 45 are
driven, with the paper's spread of thresholds and slopes, from spikes to the table of units. `speed`: time of the exact
test over that of one Fourier transform of the same length, and time of a fit.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vibrissa.neural.coupling.analysis import analyse_units
from vibrissa.neural.coupling.envelope_coupling import Null, envelope_coupling
from vibrissa.neural.coupling.nulls import BinnedRecord, Circular, Paper2014
from vibrissa.neural.coupling.threshold_linear import BinnedDrive, Hinge, HingeGrid
from vibrissa.neural.coupling.tuning import ENDS, bootstrap_fits, forward_fit, predicted
from vibrissa.neural.io.tables.spikes import join_units
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.stats import wilson_interval

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))
import populations  # the simulated units of the tests

bins = np.arange(populations.BINS)
DELAYS = tuple(populations.BETWEEN_WHISKERS * whisker for whisker in range(1, 24))
SEED = 20140821
SLOW = {"pseudo-texture": 300, "paper2014": 1000, "paper2014, skip 1 s": 300}  # as many units are enough


def p_values(rates: np.ndarray, envelopes: np.ndarray, null: Null, lags: tuple[int, int], skip: int) -> np.ndarray:
    """p-value of each unit against its own envelope."""
    ends, settled = (bins >= 5) & (bins < bins.size - 5), bins >= skip
    records = (
        BinnedRecord(rates=rate[None], envelope=envelope, rate_valid=settled, envelope_valid=ends)
        for rate, envelope in zip(rates, envelopes, strict=True)
    )
    return np.array([envelope_coupling(record, null, lags=lags).p_value[0] for record in records])


def tests(rng: np.random.Generator) -> dict[str, tuple[Null, tuple[int, int], int]]:
    """Name, null, lags and bins skipped."""
    return {
        "circular": (Circular(), (0, 3), 100),
        "circular, delays left out": (Circular(delays=DELAYS), (0, 3), 100),
        "pseudo-texture": (populations.PseudoTexture(envelopes=populations.envelopes(499, rng)), (0, 3), 100),
        "paper2014": (Paper2014(), (-1, 1), 0),
        "paper2014, skip 1 s": (Paper2014(), (-1, 1), 100),
    }


def false_positives(n_units: int, names: list[str], n_trials: int = 40) -> None:
    for name in names or populations.UNCOUPLED:
        rng = np.random.default_rng([SEED, list(populations.UNCOUPLED).index(name)])
        envelopes = populations.envelopes(n_units, rng)
        rates = populations.UNCOUPLED[name](envelopes, n_trials, rng).astype(float)
        report(name, rates, envelopes, tests(rng))


def power(n_units: int) -> None:
    for lag in (0, 1, 2, 3):
        rng = np.random.default_rng([SEED, lag])
        envelopes = populations.envelopes(n_units, rng)
        rates = populations.driven(envelopes, 60, rng, slope=2e4, lag=lag).astype(float)
        report(f"driven, {10 * lag} ms", rates, envelopes, tests(rng))


def report(name: str, rates: np.ndarray, envelopes: np.ndarray, chosen: dict[str, tuple]) -> None:
    for test, (null, lags, skip) in chosen.items():
        n = min(len(rates), SLOW.get(test, len(rates)))
        found = int(np.sum(p_values(rates[:n], envelopes[:n], null, lags, skip) <= 0.01))
        low, high = wilson_interval(found, n)
        print(f"{name:16s} {test:28s} {100 * found / n:6.2f} % [{100 * low:.2f}, {100 * high:.2f}]  n {n}", flush=True)


def fits(n_units: int) -> None:
    for n_trials, slope in ((40, 2.5e5), (100, 2.5e5), (40, 5e4)):
        rng = np.random.default_rng([SEED, n_trials])
        errors, held = [], []
        for _ in range(n_units):
            drive = presented(rng)
            truth = Hinge(42.3e-6, slope, rng.uniform(0.006, 0.022), 5.0)
            counts = rng.poisson(predicted(drive, truth) * populations.WIDTH, (n_trials, int(drive.valid.sum())))
            grid = HingeGrid.of(drive)
            fit = forward_fit(grid, counts.sum(0).astype(float), n_trials * populations.WIDTH)
            samples = bootstrap_fits(grid, counts, populations.WIDTH, fit, rng=rng)
            low, high = np.quantile(samples, ENDS, axis=1)
            errors.append(np.array(fit) - truth)
            held.append((low <= truth) & (truth <= high))
        print(f"{n_trials} trials, slope {slope:g} per s and m, {n_units} units")
        for k, name in enumerate(Hinge._fields):
            error, inside = np.array(errors)[:, k], int(np.array(held)[:, k].sum())
            low, high = wilson_interval(inside, n_units)
            print(
                f"  {name:10s} error {error.mean():+.3g} ± {error.std():.3g}, largest {np.abs(error).max():.3g};"
                f" interval holds {inside / n_units:.2f} [{low:.2f}, {high:.2f}]"
            )


def presented(rng: np.random.Generator) -> BinnedDrive:
    moment, displacement = populations.ringing(rng)
    edges = populations.WIDTH * np.arange(populations.BINS + 1)
    valid = (bins >= 100) & (bins < bins.size - 5)
    return BinnedDrive(time=moment, envelope=analytic_envelope(displacement)[0], edges=edges, valid=valid)


def population(n_units: int = 170, n_driven: int = 45, n_trials: int = 60) -> None:
    rng = np.random.default_rng(SEED)
    moment, displacement = populations.ringing(rng)
    envelope = analytic_envelope(displacement)[0]
    threshold = np.abs(rng.normal(42.3e-6, 14.1e-6, n_units))
    slope = np.where(np.arange(n_units) < n_driven, 1e6 * rng.lognormal(-1.9, 1.014, n_units), 0.0)
    baseline, latency = rng.uniform(2, 10, n_units), rng.uniform(0.006, 0.022, n_units)
    spikes = {}
    for k in range(n_units):
        unit = ThresholdLinearUnit(threshold=threshold[k], slope=slope[k], baseline=baseline[k], latency=latency[k])
        spikes[str(k)] = simulate_spikes(unit, moment, envelope, n_trials, rng=rng)
    found = analyse_units(join_units(spikes), dataset(time=moment, point_displacement=displacement), n_trials)
    significant, identified = found.significant.values, found.identified.values
    inside = (found.threshold_low.values <= threshold) & (threshold <= found.threshold_high.values)
    print(
        f"driven units found: {significant[:n_driven].sum()} of {n_driven}; idle ones: {significant[n_driven:].sum()}"
    )
    held = inside[identified].mean()
    print(f"threshold estimated for {identified.sum()}; its interval holds the truth in {held:.2f} of them")
    mean = 1e6 * found.threshold.values[identified].mean()
    print(f"their mean threshold {mean:.1f} µm, true {1e6 * threshold[identified].mean():.1f} µm")


def speed() -> None:
    rng = np.random.default_rng(SEED)
    envelope, rates = populations.envelopes(1, rng)[0], rng.poisson(5, (200, populations.BINS)).astype(float)
    record = BinnedRecord.whole(rates, envelope)
    test = best(lambda: envelope_coupling(record, Circular(), lags=(0, 3))) / len(rates)
    transform = best(lambda: [np.fft.rfft(rate) for rate in rates]) / len(rates)
    print(f"exact test {1e3 * test:.3f} ms for each unit, {test / transform:.0f} transforms of its length")
    drive = presented(rng)
    grid = HingeGrid.of(drive)
    counts = rng.poisson(predicted(drive, Hinge(42.3e-6, 2.5e5, 0.012, 5.0)) * 0.01, (60, int(drive.valid.sum())))
    total = counts.sum(0).astype(float)
    fit = forward_fit(grid, total, 0.6)
    print(f"table of hinges {1e3 * best(lambda: HingeGrid.of(drive)):.0f} ms for each stimulus")
    print(f"fit {1e3 * best(lambda: forward_fit(grid, total, 0.6)):.0f} ms for each unit")
    print(f"400 resamples {1e3 * best(lambda: bootstrap_fits(grid, counts, 0.01, fit, rng=rng)):.0f} ms for each unit")


def best(job: Callable[[], object], repeats: int = 5) -> float:
    """Shortest time of a few runs [s]."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        job()
        times.append(time.perf_counter() - start)
    return min(times)


if __name__ == "__main__":
    what, rest = (sys.argv[1] if len(sys.argv) > 1 else "speed"), sys.argv[2:]
    match what:
        case "false":
            false_positives(int(rest[0]) if rest else 2000, rest[1:])
        case "power":
            power(int(rest[0]) if rest else 500)
        case "fit":
            fits(int(rest[0]) if rest else 100)
        case "population":
            population()
        case "speed":
            speed()
        case _:
            sys.exit(f"cortex.py: must be false, power, fit, population or speed, got {what!r}")
