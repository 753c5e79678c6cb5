"""Kills and stops at random moments of a study that runs in processes of this machine: it ends the same.

    python benchmarks/stops.py [KILLS [STOPS [SEED]]]

The run is killed (SIGKILL) or stopped (SIGINT, SIGINT twice, SIGTERM, SIGHUP, in turn; four by four sent to the run
alone, and to the whole group of processes, as a terminal does), and the same command is given again, until it ends
well. After each, no process of it may be left within ten seconds; a stop must end within 20 s in one line, with its
exit code, and must leave no temporary file. Ten of them share a folder; in the end each of its files is compared with
that of an undisturbed run.
"""

from __future__ import annotations

import os
import platform
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vibrissa.cli.shared.stoppable import KEPT

STUDY = """
name = "small"
[laboratory]
truth = "modes"
animals = 1
whiskers = ["C1", "C2"]
conditions = 1
textures = 2
n_frames = 400
speeds = [0.15]
seed = 3
[comparison]
gratings = 19
"""
TEN = 10  # of a folder
SOON, IN_TIME = 10.0, 20.0  # [s]
BEGUN = b" start\n"  # the line after which a stop is heard by the run, not by Python's own start
STOPS = {"SIGINT": 130, "SIGINT, SIGINT": 130, "SIGTERM": 143, "SIGHUP": 129}  # exit codes


@dataclass
class Disturbed:
    """One folder of results, the runs that make it, and what was wrong."""

    study: Path
    out: Path
    rows: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)

    def start(self) -> subprocess.Popen[bytes]:
        """A run in a session of its own, as that of a terminal."""
        words = [sys.executable, "-m", "vibrissa", "run", str(self.study), "--workers", "2", "--out", str(self.out)]
        with open(self.log, "wb") as log:
            return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=log, start_new_session=True)

    @property
    def log(self) -> Path:
        return self.out.with_suffix(".log")

    def kill(self, moment: float) -> bool:
        """Kill a run; whether it had not ended before."""
        run = self.start()
        if not self.still_at_work(run, moment):
            return False
        run.kill()
        run.wait()
        self.note("SIGKILL", moment, left(run))
        return True

    def stop(self, how: str, group: bool, moment: float) -> bool:
        """Stop a run; whether it had not ended before."""
        before, run = hidden(self.out), self.start()
        if not self.still_at_work(run, moment):
            return False
        begin = time.monotonic()
        for name in how.split(", "):
            (os.killpg if group else os.kill)(run.pid, getattr(signal, name))
            time.sleep(0.05)
        wrong = []
        try:
            run.wait(IN_TIME + SOON)
        except subprocess.TimeoutExpired:
            run.kill()
            wrong.append("had to be killed")
        if run.wait() == 0:  # it had said its last word
            return False
        took, last = time.monotonic() - begin, self.log.read_bytes().decode().splitlines()[-1:]
        wrong += [] if run.returncode == STOPS[how] else [f"exit code {run.returncode}"]
        wrong += [] if last and last[0].startswith(f"vibrissa: stopped; {KEPT}") else [f"said {last}"]
        wrong += [] if took < IN_TIME else [f"took {took:.0f} s"]
        wrong += [f"left {path.name}" for path, _ in hidden(self.out) - before]
        self.note(f"{how}{' to all' if group else ''}", moment, [*wrong, *left(run)], f"{took:4.1f} s to its end")
        return True

    def still_at_work(self, run: subprocess.Popen[bytes], moment: float) -> bool:
        """Wait for a moment after its first line."""
        while run.poll() is None and BEGUN not in self.log.read_bytes():
            time.sleep(0.01)
        end = time.monotonic() + moment
        while run.poll() is None and time.monotonic() < end:
            time.sleep(0.01)
        if run.poll() not in (None, 0):
            self.faults.append(f"undisturbed, it ended with {run.returncode}: {self.log.read_text()[-300:]}")
        return run.poll() is None

    def note(self, kind: str, moment: float, wrong: list[str], more: str = "") -> None:
        self.rows.append(f"{kind:<22}{moment:6.1f} s after its start  {more}  {'; '.join(wrong)}")
        self.faults += wrong

    def end(self, known: dict[str, bytes]) -> None:
        """Let it end, and compare every file."""
        run = self.start()
        if run.wait() != 0:
            self.faults.append(f"ended with {run.returncode}: {self.log.read_text()[-300:]}")
        found = results(self.out)
        self.faults += [f"{name}: not as undisturbed" for name in sorted(known) if found.get(name) != known[name]]
        self.faults += [f"{name}: not in the undisturbed run" for name in sorted(found.keys() - known.keys())]
        self.faults += [f"left {path.name}" for path, _ in hidden(self.out)]


def results(folder: Path) -> dict[str, bytes]:
    """Every file of results under its name."""
    files = (path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def hidden(out: Path) -> set[tuple[Path, int]]:
    """Temporary files in a folder of results and beside it, and when they were written: a killed run leaves some."""
    return {(path, path.stat().st_mtime_ns) for path in (*out.rglob(".*"), *out.parent.glob(f".{out.name}.*"))}


def left(run: subprocess.Popen[bytes]) -> list[str]:
    """Processes of its session that have not ended soon after it."""
    end = time.monotonic() + SOON
    while (found := of_session(run.pid)) and time.monotonic() < end:
        time.sleep(0.05)
    return [f"process {number} is left" for number in found]


def of_session(session: int) -> list[int]:
    """Processes of a session that are there and no zombies."""
    found = []
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, of = place.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(of) == session and state != "Z":
            found.append(int(place.parent.name))
    return found


def hear_all() -> None:
    """Let the runs hear every signal, also where this process was started to ignore some (``nohup``, ``&``)."""
    for number in (signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)


def main(kills: int, stops: int, seed: int) -> None:
    """Disturb folder after folder, and print what came of it."""
    hear_all()
    rng = np.random.default_rng(seed)
    kinds = [("kill", False)] * kills + [(list(STOPS)[k % 4], bool(k // 4 % 2)) for k in range(stops)]
    kinds = [kinds[k] for k in rng.permutation(len(kinds))]
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        (work / "study.toml").write_text(STUDY)
        undisturbed = Disturbed(work / "study.toml", work / "undisturbed")
        begin = time.monotonic()
        undisturbed.start().wait()
        span, known, faults = time.monotonic() - begin, results(undisturbed.out), 0
        print(f"Python {platform.python_version()}, undisturbed: {span:.0f} s, {len(known)} files", flush=True)
        while kinds:
            now, kinds = kinds[:TEN], kinds[TEN:]
            one = Disturbed(work / "study.toml", work / f"disturbed-{len(kinds)}")
            for kind, group in now:
                moment = float(rng.uniform(0, span / 4))
                done = one.kill(moment) if kind == "kill" else one.stop(kind, group, moment)
                kinds += [] if done else [(kind, group)]
            one.end(known)
            faults += len(one.faults)
            print("\n".join([*one.rows, f"     ended: {one.faults or 'all files as undisturbed'}"]), flush=True)
    print(f"{kills} kills, {stops} stops, {faults} faults")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main(*[int(given) for given in [*sys.argv[1:], *("20", "20", "0")[len(sys.argv) - 1 :]]])
