"""Speed of a whole simulated population: 514 units, 24 whiskers, 100 presentations of 10 s at 2 kHz.

.venv/bin/python benchmarks/population.py

Measured on one core of a shared machine: 6.2 million spikes in 4 to 6 s, below 1 µs a spike.
"""

from time import perf_counter

import numpy as np

from vibrissa.neural.simulated.population import draw_population, record_population
from vibrissa.neural.simulated.wandering import unrelated_feature

RATE, DURATION, TRIALS, WHISKERS = 2000.0, 10.0, 100, 24


def main() -> None:
    time = np.arange(0, DURATION, 1 / RATE)
    rng = np.random.default_rng(1)
    ringing = unrelated_feature(time, mean=55e-6, timescale=0.02, rng=rng) * np.cos(2 * np.pi * 70 * time)
    motion = np.array([np.roll(ringing, k * time.size // WHISKERS) for k in range(WHISKERS)])
    truth = draw_population(n_whiskers=WHISKERS, rng=rng)
    record_population(truth.isel(unit=slice(10)), time, motion, 2, rng=rng)  # compiles
    start = perf_counter()
    spikes = record_population(truth, time, motion, TRIALS, rng=rng)
    took = perf_counter() - start
    n = spikes.sizes["spike"]
    print(f"{truth.sizes['unit']} units: {n:,} spikes in {took:.1f} s, {1e6 * took / n:.2f} µs a spike")


if __name__ == "__main__":
    main()
