"""Memory and time of the envelope's test over many units, none of them driven (two minutes).

python benchmarks/many_units.py

Units of 1 spike/s in 60 presentations of 10 s, read from a dataset as `vibrissa neural` reads them; one process
for each number of units, its processor time and largest memory.
"""

import resource
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from vibrissa.netcdf import save
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.quantities import dataset
from vibrissa.study.neurons.neurons import analyse_neurons
from vibrissa.study.spec.neurons import Neurons

TRIALS, LENGTH, RATE = 60, 10.0, 1.0
MANY = (1_000, 3_000, 10_000)


def write(folder: Path, n_units: int) -> None:
    """Write a ringing stimulus and spikes at random."""
    rng = np.random.default_rng(0)
    when = np.arange(0, LENGTH, 1 / 2000)
    slow = 1 + 0.6 * np.sin(2 * np.pi * 1.3 * when) + 0.3 * np.sin(2 * np.pi * 3.1 * when)
    save(dataset(time=when, point_displacement=60e-6 * slow * np.sin(2 * np.pi * 70 * when)), folder / "stimulus.nc")
    unit = np.repeat(np.arange(n_units), rng.poisson(RATE * LENGTH * TRIALS, n_units))
    fired, trial = rng.uniform(0, LENGTH, unit.size), rng.integers(0, TRIALS, unit.size)
    names = [f"u{k}" for k in range(n_units)]
    save(spike_table(fired, unit, names, trial=trial, attrs={"n_trials": TRIALS}), folder / "spikes.nc")


def measure(folder: Path) -> None:
    begin = time.process_time()
    found = analyse_neurons(Neurons(spikes=str(folder / "spikes.nc"), stimulus=str(folder / "stimulus.nc")))
    seconds, peak = time.process_time() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    size = f"{found.units.sizes['unit']:6} units  {found.spikes.sizes['spike'] / 1e6:4.1f} million spikes"
    print(f"{size}  {peak / 1e6:5.2f} GB  {seconds:5.1f} s processor", flush=True)


def main() -> None:
    for n_units in MANY:
        with TemporaryDirectory() as folder:
            for words in (
                [folder, str(n_units)],
                [folder],
            ):  # a process begins with the memory of the one that starts it
                subprocess.run([sys.executable, __file__, *words], check=True)


if __name__ == "__main__":
    match [Path(word) for word in sys.argv[1:2]], sys.argv[2:]:
        case [], []:
            main()
        case [folder], [count]:
            write(folder, int(count))
        case [folder], _:
            measure(folder)
