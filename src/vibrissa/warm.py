"""Compile, once after installing, the loops that the commands call: ``python -m vibrissa.warm``.

The commands are run in small, with the types that they have in earnest, in two processes: one for mechanics, the other
for movies and spikes, which have no loop in common. The study, which comes last, finds those of the movies there.
"""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread
from time import perf_counter
from typing import TextIO

COMPILING = "compiling loops, once"
EVERY = 10.0  # [s] from one line to the next, where there is no bar

POSTURE = "--contact 0.29 --base-angle 1.2"
SCAN = f"{POSTURE} --speed 0.1 --atlas C2"
MAP = "map --texture gaps.csv --contact 0.25:0.35:2 --base-angle 1.0:1.2:2 --speed 0.1 --atlas C2"
CONE = "--whisker.length 0.04 --whisker.cone-angle 1.5e-3"
LANES = {
    "mechanics": (
        f"scan gaps.csv {SCAN} --out scan.nc",
        f"scan gaps.csv {SCAN} --response linear --jump paper2014 --simulate-units 3 --trials 2",
        f"scan heights.csv {SCAN}",
        f"{MAP} --quantity peak --scheduler synchronous --out peak.nc",
        f"{MAP} --quantity rms --response linear --scheduler synchronous --out rms.nc",
        f"gap {POSTURE} --gap-width 0.015",
        f"gap {POSTURE} {CONE} --gap-width 0.4mm --model free-end",
        f"gap {POSTURE} {CONE} --gap-width 0.4mm --model rod",
        f"whisking gaps.csv path.csv --speed 0.1 {CONE}",
        f"modes --contact 0.3 --about profile --base-angle 1.2 {CONE}",
        "run study.toml --out study --scheduler synchronous",
    ),
    "movies": (
        "track movie.mkv --frame-rate 2000 --pixel-size 9.5e-5 --out tracked.nc",
        "track movie.mkv --frame-rate 2000 --pixel-size 9.5e-5 --seed-point 60,33 --skin 6,32 --out skin.nc",
        "track movie.mkv --frame-rate 2000 --pixel-size 9.5e-5 --tracking link --out linked.nc",
        "neural --spikes spikes.csv --stimulus stimulus.csv --trials 20",
        "information --spikes spikes.csv --window 0 4 --trials 20",
    ),
}
STUDY = """
name = "Small"

[whisker]
length = 0.040
cone_angle = 1.5e-3
tip = 0.05

[posture]
contact = 0.29
base_angle = 1.2

[scan]
speed = 0.1
damping = 0.11

[texture]
length = 0.06
seed = 1

[film]
n_frames = 600
subframes = 2
camera = { frame_rate = 2000.0, pixel_size = 2e-4, width = 220, height = 80 }

[recording]
n_trials = 5
unit = { threshold = 8e-6, slope = 2.5e6, baseline = 5.0, latency = 0.012 }
"""


def main() -> None:
    """Compile what is not compiled yet, and report how far it is."""
    if sys.argv[1:]:
        work(sys.argv[1])
    else:
        warm()


def warm() -> None:
    """Compile in both processes at once, with a bar where stderr is a terminal, elsewhere a line every few seconds."""
    from vibrissa.cli.shared.display.output import tell
    from vibrissa.cli.shared.display.progress import progress_bars

    count, done, begin = loops(), set[str](), perf_counter()
    with progress_bars() as progress:
        progress(COMPILING, 0, count)
        last = begin
        for name in compiled():
            done.add(name)
            progress(COMPILING, len(done), count)
            if not sys.stderr.isatty() and perf_counter() - last > EVERY:
                last = perf_counter()
                tell(f"{len(done)} of at most {count} loops compiled")
    if done:
        tell(f"{len(done)} loops compiled in {perf_counter() - begin:.0f} s; they are kept")


def loops() -> int:
    """How many loops of this package are kept once they are compiled."""
    sources = Path(__file__).parent.rglob("*.py")
    return sum(len(re.findall(r"^@(?:numba\.)?njit\(cache=True", path.read_text("utf-8"), re.M)) for path in sources)


def compiled() -> Iterator[str]:
    """Names of the loops, as the processes compile them."""
    command = [sys.executable, "-P", "-m", "vibrissa.warm"]
    lanes = [subprocess.Popen([*command, lane], stdout=subprocess.PIPE, text=True) for lane in LANES]
    try:
        yield from _lines(lanes)
        if any(lane.wait() for lane in lanes):
            sys.exit(1)  # its traceback says why
    finally:
        for lane in lanes:
            lane.kill()
            lane.wait()


def _lines(lanes: list[subprocess.Popen[str]]) -> Iterator[str]:
    """Lines of several processes as they come."""
    from queue import SimpleQueue

    lines: SimpleQueue[str | None] = SimpleQueue()

    def read(lane: subprocess.Popen[str]) -> None:
        for line in lane.stdout or ():
            lines.put(line.strip())
        lines.put(None)

    for lane in lanes:
        Thread(target=read, args=(lane,), daemon=True).start()
    reading = len(lanes)
    while reading:
        line = lines.get()
        if line is None:
            reading -= 1
        else:
            yield line


def work(lane: str) -> None:
    """Run the commands of one lane in a folder of their own, and print the name of each loop that is compiled."""
    names = sys.stdout
    with TemporaryDirectory() as folder, _printed(names):
        os.chdir(folder)
        _write_inputs(lane)
        for words in LANES[lane]:
            _run(words)


@contextmanager
def _printed(names: TextIO) -> Iterator[None]:
    from numba.core.caching import NullCache
    from numba.core.event import Event, Listener, install_listener

    class Compiled(Listener):
        def on_start(self, event: Event) -> None:
            pass

        def on_end(self, event: Event) -> None:
            loop = event.data["dispatcher"]
            if loop.__module__.startswith("vibrissa.") and not isinstance(loop._cache, NullCache):
                print(f"{loop.__module__}.{loop.__qualname__}", file=names, flush=True)

    with install_listener("numba:compile", Compiled()):
        yield


def _run(words: str) -> None:
    """Run a command without its output."""
    from vibrissa.cli import app

    heard = io.StringIO()
    with redirect_stdout(heard), redirect_stderr(heard):
        try:
            app(words.split(), print_error=False, exit_on_error=False)
        except SystemExit as end:
            if end.code:
                raise RuntimeError(f"vibrissa {words}\n{heard.getvalue()}") from end


def _write_inputs(lane: str) -> None:
    """Files that the commands read."""
    here = Path()
    here.joinpath("gaps.csv").write_text("position,width\n1e-3,3e-4\n2e-3,5e-4\n3.5e-3,2e-4\n5e-3,4e-4\n")
    heights = "".join(f"{step / 50:.2f},{20 * (step // 10 % 2)}\n" for step in range(200))
    here.joinpath("heights.csv").write_text(f"position_mm,height_um\n{heights}")
    here.joinpath("path.csv").write_text("time,base_angle,contact\n0,1.2,0.29\n0.05,1.19,0.3\n0.1,1.2,0.29\n")
    here.joinpath("study.toml").write_text(STUDY)
    if lane == "movies":
        _write_movie(here / "movie.mkv")
        _write_spikes(here)


def _write_movie(path: Path) -> None:
    """Two whiskers that swing."""
    import numpy as np

    from vibrissa.video.camera.camera import Camera, exposure_times
    from vibrissa.video.camera.rendering import render
    from vibrissa.video.io.movie import write_movie

    camera = Camera(width=160, height=100)
    time, s = exposure_times(camera, 60, 2), np.linspace(0, 1, 120)
    along = np.linspace(5e-4, 13e-3, 120)
    swing = 2e-4 * np.sin(2 * np.pi * 40 * time)[:, None] * s
    x = np.broadcast_to(along, (2, time.size, 120))
    y = np.stack([3e-3 + 1e-3 * s**2 + swing, 6e-3 + 1e-3 * s**2 - swing])
    write_movie(path, render(x, y, camera, seed=0, subframes=2, diameter=1e-4 * (1 - s)))


def _write_spikes(folder: Path) -> None:
    import numpy as np

    rng, time = np.random.default_rng(0), np.arange(8000) / 2000
    moved = 2e-5 * (1 + np.sin(2 * np.pi * 3 * time)) * np.sin(2 * np.pi * 100 * time)
    rows = "".join(f"{t:.5f},{value:.6g}\n" for t, value in zip(time, moved, strict=True))
    (folder / "stimulus.csv").write_text(f"time,displacement\n{rows}")
    spikes = "".join(f"one,{trial},{t:.5f}\n" for trial in range(20) for t in np.sort(rng.uniform(0, 4, 60)))
    (folder / "spikes.csv").write_text(f"unit,trial,spike_time\n{spikes}")


if __name__ == "__main__":
    main()
