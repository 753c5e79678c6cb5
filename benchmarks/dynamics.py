"""Speed of the event-driven engine on a random grating: 608 gaps, 3.5 s at 20 kHz, three modes, one core.

.venv/bin/python benchmarks/dynamics.py

A sample is one mode at one instant; the limit is the speed at which an array of that size is made and written. n is the
number of coefficients of Q between events. Best of many runs; the first call is timed in a process of its own.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from time import perf_counter

import numpy as np
from numpy.polynomial import Polynomial
from scipy.signal import hilbert

from vibrissa.mechanics.vibration.dynamics import Drive, amplitudes, vibrate

OMEGA, ZETA = np.array([770.0, 2180.0, 4360.0]), 0.11  # those of ε = 0.29, L = 40 mm
GAPS, DURATION, RATE = 608, 3.5, 20e3

FIRST_CALL = """
from time import perf_counter
import numpy as np
from vibrissa.mechanics.vibration.dynamics import Drive, amplitudes
t, drive = np.arange(100) / 20e3, Drive([0.001], [[[0.0, 1.0, 2.0]]], [0.0])
start = perf_counter()
amplitudes(t, drive, 770.0, 0.11)
print(perf_counter() - start)
"""


def grating(terms: int) -> Drive:
    """Every gap in turn: Q, a polynomial of d, grows from 0 at t₁, jumps back at t₂, is at 0 again from t₃."""
    rng = np.random.default_rng(0)
    pace = 2.5  # v/L [1/s] at 0.1 m/s
    start = (np.arange(GAPS) + rng.uniform(0, 0.2, GAPS)) * DURATION / GAPS
    width = rng.uniform(0.1, 0.75, GAPS) * DURATION / GAPS
    coefficients = np.zeros((OMEGA.size, GAPS, 3, terms))
    for mode in coefficients:
        shape = Polynomial(np.append(0, rng.normal(size=terms - 1) / 0.03 ** np.arange(1, terms)))
        for gap in range(GAPS):
            for e, excursion in enumerate((0.0, -0.9 * width[gap] * pace)):
                mode[gap, e] = shape(Polynomial([excursion, pace])).coef
    time = np.stack([start, start + 0.1 * width, start + width], axis=1).ravel()
    return Drive(time, coefficients.reshape(OMEGA.size, -1, terms), np.zeros(OMEGA.size))


def best(run: Callable[[], object], times: int = 50) -> float:
    """Shortest time of a call [s]."""
    run()
    found = np.inf
    for _ in range(times):
        start = perf_counter()
        run()
        found = min(found, perf_counter() - start)
    return found


def first_calls() -> tuple[float, float]:
    """First call of a process [s]: compiling, then loading what an earlier process compiled."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", FIRST_CALL]
        found = [
            float(subprocess.check_output(command, env=os.environ | {"NUMBA_CACHE_DIR": folder})) for _ in range(2)
        ]
    return found[0], found[1]


def main() -> None:
    """Print the table."""
    t = np.arange(round(DURATION * RATE)) / RATE
    uneven = t + 1e-6 * np.random.default_rng(1).uniform(size=t.size)
    coarse = t[::10]
    q = np.empty((OMEGA.size, t.size))
    fresh = best(lambda: np.full(q.shape, 1.0))
    print("case | ours | limit | ratio")
    print(f"write the array, in place | {q.size / best(lambda: q.fill(1.0)) / 1e6:.0f} Msample/s | |")
    for terms in (2, 4, 12):
        drive = grating(terms)
        for name, run in {
            "q": lambda drive=drive: amplitudes(t, drive, OMEGA, ZETA),
            "q and its rate": lambda drive=drive: vibrate(t, drive, OMEGA, ZETA),
            "q, uneven grid": lambda drive=drive: amplitudes(uneven, drive, OMEGA, ZETA),
            "Q itself": lambda drive=drive: drive(t),
        }.items():
            taken = best(run)
            ours, limit = q.size / taken / 1e6, q.size / fresh / 1e6
            print(f"{name}, n = {terms} | {ours:.0f} Msample/s | {limit:.0f} (fresh memory) | {ours / limit:.2f}")
    drive = grating(2)
    motion = amplitudes(coarse, drive, OMEGA, ZETA)
    envelope, alone = best(lambda: np.abs(hilbert(motion))), best(lambda: amplitudes(coarse, drive, OMEGA, ZETA))
    print(f"envelope at 2 kHz | {1e3 * envelope:.2f} ms | {1e3 * alone:.2f} ms (q there) | {envelope / alone:.1f}")
    compiled, loaded = first_calls()
    print(f"first call | {loaded:.2f} s, loaded | {compiled:.2f} s, compiled | {loaded / compiled:.3f}")


if __name__ == "__main__":
    main()
