"""Kills at random moments: a study on a cluster of this machine loses workers, scheduler or itself, and ends the same.

Real processes over TCP. In each round one of them is killed (SIGKILL); what was killed is started anew, and the same
command is given until it ends well. Each file is held against that of a run that nothing disturbed, as soon as it
appears under its name and again in the end. Several rounds share a folder of results, since the end of a study, its
figures, costs the most.
Run: python benchmarks/kills.py [ROUNDS [SEED]]
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

STUDY = """
name = "small"
[laboratory]
truth = "modes"
animals = 1
whiskers = ["C1", "C2"]
conditions = 1
textures = 3
n_frames = 400
speeds = [0.15]
seed = 3
[comparison]
gratings = 19
"""
ALONE = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--memory-limit", "0")
ROUNDS_A_FOLDER = 5
MOST_COMMANDS = 8  # for one folder, beyond its kills
Command = Callable[[Path, str], list[str]]


class Cluster:
    """A scheduler and two workers, each a process."""

    def __init__(self, folder: Path, path: str = "") -> None:
        self.folder, self.path, self.workers = folder, path, []
        with socket.socket() as one:
            one.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{one.getsockname()[1]}"
        self.start()

    def _process(self, *words: str) -> subprocess.Popen[bytes]:
        env = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, [self.path, os.environ.get("PYTHONPATH")]))}
        with open(self.folder / "cluster.log", "ab") as log:
            start = [sys.executable, "-W", "ignore", "-m", *words]
            return subprocess.Popen(start, env=env, cwd=self.folder, stdout=log, stderr=log)

    def start(self) -> None:
        host, _, port = self.address.removeprefix("tcp://").partition(":")
        where = ("--host", host, "--port", port, "--no-dashboard")
        self.scheduler = self._process("distributed.cli.dask_scheduler", *where)
        self.workers = [self.worker() for _ in range(2)]

    def worker(self) -> subprocess.Popen[bytes]:
        return self._process("distributed.cli.dask_worker", self.address, *ALONE)

    def kill_worker(self, which: int) -> None:
        end(self.workers[which])
        self.workers[which] = self.worker()

    def kill_scheduler(self) -> None:
        self.end()
        self.start()

    def end(self) -> None:
        for process in (self.scheduler, *self.workers):
            end(process)


def end(process: subprocess.Popen[bytes]) -> None:
    process.send_signal(signal.SIGKILL)
    process.wait()


def results(folder: Path) -> dict[str, bytes]:
    """Every file of results under its name."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not path.name.startswith(".")
    }


@dataclass
class Watch:
    """Look at every file that appears in a folder, at once."""

    folder: Path
    known: dict[str, bytes]
    seen: dict[str, float] = field(default_factory=dict)
    wrong: set[str] = field(default_factory=set)
    done: bool = False

    def look(self) -> None:
        while not self.done:
            for path in list(self.folder.rglob("*")) if self.folder.is_dir() else []:
                self._see(path)
            time.sleep(0.02)

    def _see(self, path: Path) -> None:
        name = str(path.relative_to(self.folder))
        if path.name.startswith(".") or path.is_dir():
            return
        written = path.stat().st_mtime
        if self.seen.get(name) != written and path.read_bytes() != self.known.get(name):
            self.wrong.add(name)
        self.seen[name] = written


@dataclass
class Folder:
    """One folder of results, and what is killed while it is made."""

    place: Path
    cluster: Cluster
    command: Command
    rng: np.random.Generator
    span: float
    commands: int = 0
    rows: list[tuple[str, float, str]] = field(default_factory=list)
    runs: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def close(self) -> None:
        """Wait for every run, and close what it was heard by."""
        for run in self.runs:
            run.wait()
            if run.stderr:
                run.stderr.close()

    def run(self) -> subprocess.Popen[bytes]:
        self.commands += 1
        words = self.command(self.place, self.cluster.address)
        self.runs.append(subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE))
        return self.runs[-1]

    def kill(self, kind: str, run: subprocess.Popen[bytes]) -> str:
        """Kill one, and give what the run said of it, if it ended."""
        if kind == "run":
            end(run)
        elif kind == "scheduler":
            self.cluster.kill_scheduler()
        else:
            self.cluster.kill_worker(int(self.rng.integers(2)))
        if kind == "scheduler" or run.poll() is not None:
            run.wait()
        return said(run)

    def disturbed(self, kinds: list[str]) -> list[str]:
        """Kill one after the other, then let it end; gives those for which the run had ended before."""
        run, late = self.run(), []
        for kind in kinds:
            moment = float(self.rng.uniform(0, self.span / max(1, len(kinds) - 1)))
            deadline = time.monotonic() + moment
            while run.poll() is None and time.monotonic() < deadline:
                time.sleep(0.01)
            if run.poll() == 0:
                late.append(kind)
                continue
            self.rows.append((kind, moment, self.kill(kind, run)))
            if run.poll() is not None and run.returncode != 0:
                run = self.run()
        for _ in range(MOST_COMMANDS):
            run.wait()
            if run.returncode == 0:
                return late
            run = self.run()
        raise SystemExit(f"{self.place}: not ended after {self.commands} commands: {said(run)}")


def said(run: subprocess.Popen[bytes]) -> str:
    """Exit code and last line of a run that ended."""
    if run.poll() is None:
        return "went on"
    lines = run.stderr.read().decode().strip().splitlines() if run.stderr else []
    return f"{run.returncode}: {len(lines)} lines, {lines[-1]}" if lines else f"{run.returncode}"


def study_command(study: Path) -> Command:
    """Words that run a study."""
    return lambda out, scheduler: [
        sys.executable, "-W", "ignore", "-m", "vibrissa", "run", str(study), "--out", str(out), "--scheduler", scheduler
    ]  # fmt: skip


def try_out(
    work: Path, cluster: Cluster, command: Command, kinds: list[str], rng: np.random.Generator, span: float
) -> tuple[list[tuple[str, float, str]], list[str], list[str]]:
    """Kill in one folder; rows of the table, faults, and the kinds that came too late."""
    known = results(work / "undisturbed")
    folder = Folder(work / f"killed-{rng.integers(1 << 30)}", cluster, command, rng, span)
    watch = Watch(folder.place, known)
    thread = threading.Thread(target=watch.look)
    thread.start()
    try:
        late = folder.disturbed(kinds)
    finally:
        watch.done = True
        thread.join()
        folder.close()
    found = results(folder.place)
    faults = [f"{name}: not as undisturbed" for name in sorted(known) if found.get(name) != known[name]]
    faults += [f"{name}: seen half-written or other" for name in sorted(watch.wrong)]
    faults += [f"{name}: not in the undisturbed run" for name in sorted(set(found) - set(known))]
    hidden = [*folder.place.rglob(".*"), *work.glob(f".{folder.place.name}*")]
    return folder.rows, faults + [f"{path}: left over" for path in hidden], late


def main(rounds: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds = [("worker", "scheduler", "run")[i % 3] for i in range(rounds)]
    kinds = [kinds[i] for i in rng.permutation(rounds)]
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        (work / "study.toml").write_text(STUDY)
        command = study_command(work / "study.toml")
        begin = time.monotonic()
        subprocess.run(command(work / "undisturbed", "synchronous"), check=True, stdout=subprocess.DEVNULL)
        span = time.monotonic() - begin
        print(f"undisturbed: {span:.0f} s, {len(results(work / 'undisturbed'))} files", flush=True)
        cluster, count, faults = Cluster(work), 0, []
        try:
            while kinds:
                now, kinds = kinds[:ROUNDS_A_FOLDER], kinds[ROUNDS_A_FOLDER:]
                rows, wrong, late = try_out(work, cluster, command, now, rng, span)
                kinds, faults = late + kinds, faults + wrong
                for kind, moment, outcome in rows:
                    count += 1
                    print(f"{count:3d}  {kind:<10}{moment:7.1f} s after the last  {outcome}", flush=True)
                print(f"     ended: {len(wrong)} files that differ {wrong[:5]}", flush=True)
        finally:
            cluster.end()
    print(f"{count} kills, {len(faults)} faults")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main(*[int(given) for given in [*sys.argv[1:], *("20", "0")[len(sys.argv) - 1 :]]])
