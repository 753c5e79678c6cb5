"""Time to refuse junk: python benchmarks/junk.py [--size MB] [VERB ...].

Every reader verb of ``malformed.py`` is given a file of its suffix that holds nothing but commas, digits, letters,
newlines, zeros, rows of two numbers or random bytes, without and with the first kilobyte of a whole file. The processor
time of the same junk at a hundredth of the size is subtracted. A case fails above 0.1 s per MB, or as in
``malformed.py``; numbers that are read as data cost what data cost.
"""

from __future__ import annotations

import argparse
import os
import random
import shlex
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import malformed

MOST = 0.1  # [s/MB]
JUNK = {
    "commas": b",",
    "digits": b"1234567890",
    "letters": b"whisker",
    "newlines": b"\n",
    "zeros": b"\0",
    "numbers": b"1,2\n",
    "noise": b"",
}


def junk(kind: str, size: int) -> bytes:
    """So many bytes of a kind."""
    unit = JUNK[kind]
    return (unit * (size // len(unit) + 1))[:size] if unit else random.Random(size).randbytes(size)


def seconds(command: str, suffix: str, content: bytes) -> malformed.Ending:
    """How a verb ends on a content."""
    path = Path(f"junk{suffix}")
    path.write_bytes(content)
    end = malformed.ended(shlex.split(command.replace("{}", str(path))))
    for left in (path, Path("out.nc"), Path("out")):
        shutil.rmtree(left) if left.is_dir() else left.unlink(missing_ok=True)
    return end


def main() -> None:
    """Print the time of each verb and kind, and what fails."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("verbs", nargs="*")
    asked.add_argument("--size", type=float, default=10.0, help="MB of junk")
    given = asked.parse_args()
    size, slow, worst = int(given.size * 1e6), 0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        malformed.whole_files(Path(folder))
        for command, name in malformed.VERBS:
            if given.verbs and command.split()[0] not in given.verbs:
                continue
            suffix, head = Path(name).suffix, Path(name).read_bytes()[:1000]
            for kind in JUNK:
                for start in (b"", head):
                    little = seconds(command, suffix, start + junk(kind, size // 100))
                    end = seconds(command, suffix, start + junk(kind, size))
                    cost = (end.processor - little.processor) / (0.99 * given.size)
                    wrong = cost > MOST or end.code not in (0, 2) or end.peak > malformed.MOST
                    slow, worst = slow + wrong, max(worst, cost)
                    last = (end.said.strip().splitlines() or [""])[-1][:110]
                    what = f"{command.split()[0]:<14} {name:<16} {kind:<9}{' after a head' if start else '':<14}"
                    print(f"{'SLOW ' if wrong else '     '}{what}{cost:7.3f} s/MB  code {end.code}  {last}", flush=True)
    print(f"{slow} beyond {MOST} s per MB; the slowest took {worst:.3f}")


if __name__ == "__main__":
    main()
