"""A sweep of 1e5 cells on a Dask scheduler and two workers over TCP, as separate processes of this machine.

Run: python benchmarks/cluster.py [SEEDS]    three minutes with 50 seeds; 2000 cells for each seed

rms of mode 1 of random gratings of 20 mm, exact response: 25 base angles, 20 contacts, 4 speeds, 50 seeds. The whole
call is timed, the wait for its last answer included. Ideal is the processor time that one process needs for the same,
the least of two, over two. Where others use the machine too, wall-clock time says little: the processor time, also that
of the workers, and what it is over two of the wall-clock time, are printed beside it. All maps must be equal to the
last bit.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager

ONE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
os.environ.update(ONE)  # before NumPy is there

import numpy as np  # noqa: E402
import xarray as xr  # noqa: E402

from vibrissa.sweep.engine import Engine  # noqa: E402
from vibrissa.sweep.gratings import Gratings  # noqa: E402
from vibrissa.sweep.grid import Grid, Measure  # noqa: E402
from vibrissa.sweep.maps import sweep  # noqa: E402
from vibrissa.whisker import Whisker  # noqa: E402

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
GRID = Grid(contact=np.linspace(0.15, 0.4, 20), base_angle=np.linspace(0.8, 1.4, 25), speed=[0.05, 0.1, 0.15, 0.2])
WORKERS = 2


@contextmanager
def cluster() -> Iterator[tuple[str, list[int]]]:
    """Address of a scheduler, and the processes of its workers."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port = one.getsockname()[1]
    address, processes = f"tcp://127.0.0.1:{port}", []
    with tempfile.TemporaryDirectory() as folder:

        def start(part: str, *words: str) -> None:
            command = [sys.executable, "-m", f"distributed.cli.{part}", *words, "--no-dashboard"]
            processes.append(subprocess.Popen(command, cwd=folder, stderr=subprocess.DEVNULL))

        try:
            start("dask_scheduler", "--host", "127.0.0.1", "--port", str(port))
            for _ in range(WORKERS):
                start("dask_worker", address, "--nthreads", "1", "--no-nanny")
            _wait(address)
            yield address, [process.pid for process in processes[1:]]
        finally:
            for process in processes[::-1]:
                process.terminate()
            for process in processes:
                process.wait()


def _wait(address: str) -> None:
    from distributed import Client

    with Client(address, timeout=60, set_as_default=False) as client:
        client.wait_for_workers(WORKERS, timeout=60)


def _spent(pids: list[int] | None) -> float:
    """Processor time [s] of this process, of those that it has waited for, and of those given."""
    import psutil

    return sum(os.times()[:4]) + sum(sum(psutil.Process(pid).cpu_times()[:2]) for pid in pids or [])


def timed(engine: Engine, seeds: int, pids: list[int] | None = None) -> tuple[xr.Dataset, float, float]:
    """The map, wall-clock time [s] and processor time [s]."""
    wall, before = time.perf_counter(), _spent(pids)
    gratings = Gratings(seed=np.arange(seeds), length=0.02)
    found = sweep(WHISKER, gratings, GRID, Measure(quantity="rms"), engine=engine)
    return found, time.perf_counter() - wall, _spent(pids) - before


def main(seeds: int = 50) -> None:
    timed(Engine(scheduler="synchronous"), 2)  # compiles
    alone, wall, first = timed(Engine(scheduler="synchronous"), seeds)
    print(f"{alone.mode_rms.size} cells, {int(alone.cells_with_value)} with a value, on {os.cpu_count()} cores\n")
    lines = [("one after the other, this process", wall, first)]
    with cluster() as (address, pids):
        for name in ("TCP, two workers, just started", "TCP, two workers, again", "TCP, two workers, again"):
            lines.append(_line(name, alone, *timed(Engine(scheduler=address), seeds, pids)))
    engine = Engine(scheduler="processes", workers=WORKERS)
    lines.append(_line("two processes, their start included", alone, *timed(engine, seeds)))
    again, wall, last = timed(Engine(scheduler="synchronous"), seeds)
    lines.append(_line("one after the other, this process", alone, again, wall, last))
    ideal = min(first, last) / WORKERS
    print("| | wall [s] | processor [s] | ideal over wall | processor / 2 over wall |\n|---|---|---|---|---|")
    for name, wall, cpu in lines:
        shares = "– | –" if name.startswith("one") else f"{ideal / wall:.2f} | {cpu / WORKERS / wall:.2f}"
        print(f"| {name} | {wall:.1f} | {cpu:.1f} | {shares} |")
    print(f"\nideal: {ideal:.1f} s; all maps equal to the last bit")


def _line(name: str, known: xr.Dataset, found: xr.Dataset, wall: float, cpu: float) -> tuple[str, float, float]:
    if not found.identical(known):
        sys.exit(f"{name}: another map")
    return name, wall, cpu


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
