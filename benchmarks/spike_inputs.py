"""Memory and time to read spikes of many units and to count them, by format (some minutes).

python benchmarks/spike_inputs.py [FORMAT ...]

10,000 units (and a tenth of them) of 1 spike/s in 60 presentations of 10 s, read as `vibrissa neural` reads them and
counted in bins of 10 ms; one process for each, its processor time and largest memory.
"""

import resource
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from vibrissa.netcdf import save
from vibrissa.neural.coupling.response import UnitCounts
from vibrissa.neural.io.formats.nwb_writer import Session, write_nwb
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.trials import trial_table
from vibrissa.quantities import dataset
from vibrissa.study.neurons.inputs import read_recording
from vibrissa.study.spec.given import SpikesInput, StimulusInput

TRIALS, LENGTH, RATE, BIN = 60, 10.0, 1.0, 0.01
MANY = (1_000, 10_000)
FORMATS = ("nc", "nwb", "npy", "csv")


def write(folder: Path, kind: str, n_units: int) -> None:
    """Write a ringing stimulus and spikes at random, in one format."""
    rng = np.random.default_rng(0)
    when = np.arange(0, LENGTH, 1 / 2000)
    slow = 1 + 0.6 * np.sin(2 * np.pi * 1.3 * when) + 0.3 * np.sin(2 * np.pi * 3.1 * when)
    save(dataset(time=when, point_displacement=60e-6 * slow * np.sin(2 * np.pi * 70 * when)), folder / "stimulus.nc")
    unit = np.repeat(np.arange(n_units), rng.poisson(RATE * LENGTH * TRIALS, n_units))
    fired, trial = rng.uniform(0, LENGTH, unit.size), rng.integers(0, TRIALS, unit.size)
    names, path = [f"u{k}" for k in range(n_units)], folder / f"spikes.{kind}"
    if kind == "nc":
        save(spike_table(fired, unit, names, trial=trial, attrs={"n_trials": TRIALS}), path)
    elif kind == "nwb":
        onset = 20.0 * np.arange(TRIALS)
        session = Session(
            identifier="s",
            description="random",
            start=datetime(2020, 1, 1, tzinfo=UTC),
            subject="a",
            age="P90D",
            sex="U",
            species="Rattus norvegicus",
        )
        table = spike_table(fired + onset[trial], unit, names)
        write_nwb(table, path, session, trials=trial_table(onset, onset + LENGTH + 0.1))
    elif kind == "npy":
        counts = np.lib.format.open_memmap(path, "w+", np.uint8, (round(LENGTH / BIN), TRIALS, n_units))
        np.add.at(counts, ((fired / BIN).astype(int), trial, unit), 1)
    else:
        with path.open("w") as file:
            file.write("unit,trial,spike_time\n")
            for start in range(0, unit.size, 10**6):
                part = slice(start, start + 10**6)
                rows = zip(unit[part].tolist(), trial[part].tolist(), fired[part].tolist(), strict=True)
                file.writelines(f"u{k},{j},{t:.6f}\n" for k, j, t in rows)


def measure(folder: Path, kind: str) -> None:
    """Read and count, and print what it took."""
    begin = time.process_time()
    known = {"counted_bin": BIN} if kind == "npy" else {}
    trials = TRIALS if kind == "csv" else None
    spikes = SpikesInput(spikes=str(folder / f"spikes.{kind}"), trials=trials, **known)
    found = read_recording(spikes, StimulusInput(stimulus=str(folder / "stimulus.nc")), bin_width=BIN)
    read = time.process_time() - begin
    counts = UnitCounts.of(found.spikes, found.n_trials, BIN * np.arange(round(LENGTH / BIN) + 1), BIN)
    seconds, peak = time.process_time() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    size = f"{kind:4} {len(counts.totals):6} units  {counts.totals.sum() / 1e6:4.1f} million spikes"
    print(f"{size}  {peak / 1e6:5.2f} GB  {read:5.1f} s to read, {seconds:5.1f} s in all, processor", flush=True)


def main(formats: list[str]) -> None:
    for kind in formats or FORMATS:
        for n_units in MANY:
            with TemporaryDirectory() as folder:  # a process begins with the memory of the one that starts it
                for words in ([folder, kind, str(n_units)], [folder, kind]):
                    subprocess.run([sys.executable, __file__, "--", *words], check=True)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["--", folder, kind, count]:
            write(Path(folder), kind, int(count))
        case ["--", folder, kind]:
            measure(Path(folder), kind)
        case formats:
            main(formats)
