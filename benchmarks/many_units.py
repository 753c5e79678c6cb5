"""Memory and time of `vibrissa neural` over many units, none of them driven (some minutes).

python benchmarks/many_units.py [FORMAT ...]

Units of 1 spike/s in 60 presentations of 10 s, in a file of each format (nwb, npy, nc, csv): the verb itself, as it is
typed, in a process of its own for each number of units. Printed: largest memory, time by the wall's clock and of the
processor, start of the program and table on the terminal included.
"""

import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from spike_inputs import TRIALS

MANY = (2_500, 5_000, 10_000)
GIVEN = {"nwb": [], "nc": [], "npy": ["--counted-bin", "10ms"], "csv": ["--trials", str(TRIALS)]}


def measure(folder: str, kind: str, n_units: int) -> None:
    """Run the verb on one file, and print what it took."""
    files = ["--spikes", f"{folder}/spikes.{kind}", "--stimulus", f"{folder}/stimulus.nc"]
    words = [sys.executable, "-m", "vibrissa", "neural", *files, *GIVEN[kind], "--out", f"{folder}/units.nc"]
    begin = time.perf_counter()
    child = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    wall, cpu = time.perf_counter() - begin, used.ru_utime + used.ru_stime
    if os.waitstatus_to_exitcode(status):
        sys.exit(f"{' '.join(words)} failed")
    size = Path(folder, f"spikes.{kind}").stat().st_size / 1e6
    row = f"{kind:4} {n_units:6} units  file {size:5.0f} MB  {used.ru_maxrss / 1e6:5.2f} GB"
    print(f"{row}  {wall:5.1f} s wall, {cpu:5.1f} s processor", flush=True)


def main(formats: list[str]) -> None:
    for kind in formats or GIVEN:
        for n_units in MANY:
            with TemporaryDirectory() as folder:  # written by another process: one that starts others stays small
                write = [sys.executable, str(Path(__file__).with_name("spike_inputs.py")), "--", folder, kind]
                subprocess.run([*write, str(n_units)], check=True)
                measure(folder, kind, n_units)


if __name__ == "__main__":
    main(sys.argv[1:])
