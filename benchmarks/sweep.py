"""Maps of Figure 7E, 100 × 100 cells, beside the same cells predicted one at a time (two minutes).

python benchmarks/sweep.py

Wall-clock and processor time of the whole map, best of several after a first run that compiles; the peer is `predict`
with its displacement at s = 0.9, on a sample of cells, times ten thousand.
"""

import time
from collections.abc import Callable

import numpy as np

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.sweep.engine import Engine
from vibrissa.sweep.grid import Grid, Measure
from vibrissa.sweep.maps import sweep
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
GAP = Gaps(position=np.zeros(1), width=np.array([1e-3]))
GRID = Grid(contact=np.linspace(0.1, 0.4, 100), base_angle=np.linspace(0.8, 1.5, 100), speed=[0.1])
SAMPLE = [(0.16, 1.0), (0.2, 1.4), (0.29, 1.2), (0.38, 0.9)]
T = np.linspace(0, 0.03, 3001)


def best(call: Callable[[], object], count: int) -> tuple[float, float]:
    """Least wall-clock and least processor time [s]."""
    times = []
    for _ in range(count + 1):  # the first compiles
        wall, cpu = time.perf_counter(), time.process_time()
        call()
        times.append((time.perf_counter() - wall, time.process_time() - cpu))
    return tuple(np.min(times[1:], axis=0))


def alone(form: str) -> None:
    for contact, angle in SAMPLE:
        scan = Scan(speed=0.1, damping=0.11, response=form)
        predict(WHISKER, Posture(contact=contact, base_angle=angle), GAP, scan).displacement(T, np.array([0.9]))


def main() -> None:
    for form, count in (("linear", 7), ("exact", 2)):
        for scheduler in ("threads", "synchronous"):
            measure = Measure(response=form)
            engine = Engine(scheduler=scheduler)
            wall, cpu = best(lambda e=engine, m=measure: sweep(WHISKER, GAP, GRID, m, engine=e), count)
            print(f"{form:6}  {scheduler:11}  map {wall:6.2f} s wall  {cpu:6.2f} s processor", flush=True)
        _, cpu = best(lambda f=form: alone(f), 2)
        print(f"{form:6}  one by one   {cpu / len(SAMPLE) * 1e4:6.0f} s processor for as many cells", flush=True)


if __name__ == "__main__":
    main()
