"""From slider to picture, in a browser: `python benchmarks/page.py`. Needs chromium, the group bench and extra surface.

`python benchmarks/page.py answers` takes no browser: the processor time of the server's answers alone, half a minute.

Every slider of texture A, whisker, posture, scan and neuron, on a grating, a rough surface and a dropped file of a
profilometer; the posture on a smooth wave, a long grating and a coarse surface too. Each move is one step of an arrow
key. "First" is the time from its event to after the frame in which what is in sight was drawn, "all" to after the frame
with every picture. Beside them the processor time of the server and of the browser per move, which other load inflates
less. Some three minutes.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
from playwright.sync_api import sync_playwright
from threadpoolctl import threadpool_limits

from vibrissa.page.answer.answers import answer
from vibrissa.page.incoming.upload_cache import UploadCache
from vibrissa.page.panel.controls import CONTROLS
from vibrissa.page.session import PageSession

MOVES = 10
DOWN = ("height", "base_angle", "duty", "a.duty")  # the other way the whisker does not reach, or runs into its fold
RESTS = np.linspace(0.2, 0.6, MOVES)  # [s] before moves that may meet what the server does when the hands rest
SURFACES = {"grating": "hold=height", "rough": "a.kind=rough&b.kind=rough", "file": "a.kind=file"}
MORE = {"wave": "a.kind=wave&b.kind=wave", "350 mm": "a.length=0.35", "100 µm rms": "a.kind=rough&a.rms=1e-4"}
POSTURE = ("height", "base_angle", "friction", "speed")
SLIDERS = "[...document.querySelectorAll('input[type=range][id^=c-]')].filter(e => e.checkVisibility())"
SLIDERS += ".map(e => e.id.slice(2, -7)).filter(n => !n.startsWith('b.'))"
MAP = """aISO-1.0
ManufacID = vibrissa
CreateDate = 010120260000
ModDate = 010120260000
NumPoints = {nx}
NumProfiles = {ny}
Xscale = 1e-05
Yscale = 1e-05
Zscale = 1e-06
Zresolution = -1
Compression = 0
DataType = 7
CheckType = 0
*
{rows}
*
"""


def main():
    """Serve the page in a process of its own, move every slider, print a table."""
    command = [sys.executable, "-m", "vibrissa", "explore", "--no-browser"]
    with (
        subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server,
        ended(server),
        sync_playwright() as driver,
    ):
        address = next(word for word in server.stderr.readline().split() if word.startswith("http"))
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        print(f"[ms]{'':<24}{'first: median':>14}{'p95':>6}{'all: median':>13}{'p95':>6}{'server':>9}{'browser':>9}")
        for surface, state in (SURFACES | MORE).items():
            page.goto("about:blank")
            page.goto(f"{address}#{state}")
            until(page, "document.querySelectorAll('details').length > 4")
            page.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true; })")
            if surface == "file":
                drop(page)
            until(page, "Boolean(vibrissa.data()) && !vibrissa.busy()")
            every(page, surface, server.pid)
        browser.close()


@contextmanager
def ended(server):
    """End the server, whatever happened."""
    try:
        yield
    finally:
        server.terminate()


def answers():
    """Processor time of one answer after a step of every slider, median and 95 %, from a server in this process."""
    with tempfile.TemporaryDirectory() as folder:
        uploads = UploadCache()
        key, _ = uploads.put("map.sdf", rough_map(folder).read_bytes(), {"line": "x:1"})
    print(f"[ms]{'':<24}{'median':>14}{'p95':>6}")
    with threadpool_limits(1):
        for surface, words in (SURFACES | MORE).items():
            state, session = (
                dict(parse_qsl(words)) | ({"a.file": key} if surface == "file" else {}),
                PageSession(uploads.get),
            )
            for control in POSTURE if surface in MORE else sliders(state):
                took = [spent_on(session, {**state, control: value}) for value in stepped(control)]
                print(f"{surface + ', ' + control:<28}{np.median(took[2:]):14.0f}{np.quantile(took[2:], 0.95):6.0f}")


def sliders(state):
    """Numbers that the page shows as sliders."""
    value = {name: state.get(name, one.default) for name, one in CONTROLS.items()}
    number = [name for name, one in CONTROLS.items() if one.step and not one.whole and not name.startswith("b.")]
    return [name for name in number if all(value[other] in kinds for other, kinds in CONTROLS[name].only.items())]


def stepped(control):
    """Values of a slider, step by step from its default."""
    one, sign = CONTROLS[control], -1 if control in DOWN else 1
    if one.low > 0 and one.high / one.low >= 50:
        return [one.default * (one.high / one.low) ** (sign * k / 1000) for k in range(MOVES + 2)]
    return [one.default + sign * k * one.step for k in range(MOVES + 2)]


def spent_on(session, state):
    """Processor time of one answer [ms]."""
    before = time.process_time()
    if isinstance(said := answer(session, json.dumps({"id": 1, "want": "live", "state": state})), str):
        sys.exit(said)
    return (time.process_time() - before) * 1e3


def every(page, surface, server):
    """Each slider in turn, from the same state; then the base angle after rests."""
    start, all_times = page.evaluate("location.hash"), []
    for control in POSTURE if surface in MORE else page.evaluate(SLIDERS):
        said, line = moved(page, control, server)
        all_times.append(said)
        print(f"{surface + ', ' + control:<28}{line}", flush=True)
        shown = page.evaluate("vibrissa.shown()")
        page.evaluate(f"location.hash = '{start or '#'}'")
        until(page, f"vibrissa.shown() > {shown} && !vibrissa.busy()")
    said, line = moved(page, "base_angle", server, RESTS)
    print(f"{surface + ', angle after rests':<28}{line}", flush=True)
    print(f"{surface + ', all of these':<28}{as_line(np.concatenate([*all_times, said], axis=1))}\n", flush=True)


def moved(page, control, server, rests=None):
    """Move one slider; times of first and whole pictures (2, N), and a line with them and the processor times."""
    page.evaluate("vibrissa.latencies.length = vibrissa.wholes.length = 0")
    before = spent(descendants(server)), spent(browsers())
    for k in range(MOVES):
        if rests is not None:
            time.sleep(rests[k])
        drawn = page.evaluate("vibrissa.wholes.length")
        page.locator(f"[id='c-{control}-slider']").press("ArrowLeft" if control in DOWN else "ArrowRight")
        until(page, f"vibrissa.wholes.length > {drawn}")
    after = spent(descendants(server)), spent(browsers())
    said = np.array([page.evaluate(f"vibrissa.{name}")[-MOVES:] for name in ("latencies", "wholes")])
    return said, as_line(said) + "".join(f"{(b - a) / MOVES * 1e3:9.0f}" for a, b in zip(before, after, strict=True))


def as_line(said):
    """Medians and 95th percentiles."""
    numbers = [f(one) for one in said for f in (np.median, lambda one: np.quantile(one, 0.95))]
    return "".join(f"{one:{width}.0f}" for one, width in zip(numbers, (14, 6, 13, 6), strict=True))


def rough_map(folder):
    """A profilometer's map of five lines of 2,000 points, 10 µm apart, rough by some micrometres, as a file."""
    rng = np.random.default_rng(1)
    spectrum = np.fft.rfft(rng.normal(size=(5, 4000)), axis=1) / np.maximum(np.arange(2001), 10) ** 1.3
    height = np.fft.irfft(spectrum, axis=1)[:, :2000]
    height *= 3.0 / height.std()
    path = Path(folder) / "map.sdf"
    path.write_text(MAP.format(nx=2000, ny=5, rows="\n".join(" ".join(f"{z:.4f}" for z in row) for row in height)))
    return path


def drop(page):
    """Drop a map on the page, and settle which line."""
    with tempfile.TemporaryDirectory() as folder:
        page.locator("[id='c-a.file']").set_input_files(rough_map(folder))
        until(page, "document.getElementById('error').textContent.includes('is a map')")
        line = page.locator("[id='c-a.file'] ~ .open input[name=line]").first
        line.fill("x:1")
        line.blur()
        until(page, "location.hash.includes('a.file')")  # the file is read until then


def until(page, condition):
    """Wait for a condition on the page."""
    stop = time.monotonic() + 60
    while not page.evaluate(condition):
        if time.monotonic() > stop:
            sys.exit(f"{condition}: {page.inner_text('#error')}")
        time.sleep(0.02)


def descendants(pid):
    """Process and all it has started."""
    found = [pid]
    listed = subprocess.run(["ps", "-eo", "pid=,ppid="], capture_output=True, text=True, check=True).stdout
    for line in listed.splitlines():
        child, parent = map(int, line.split())
        if parent in found:
            found.append(child)
    return found


def browsers():
    """Processes that this one has started, but for the server."""
    return [pid for pid in descendants(os.getpid()) if pid != os.getpid() and "chrom" in named(pid)]


def named(pid):
    """Command line of a process."""
    try:
        with open(f"/proc/{pid}/cmdline") as file:
            return file.read()
    except OSError:
        return ""


def spent(pids):
    """Processor time of processes [s]."""
    total = 0
    for pid in pids:
        try:
            with open(f"/proc/{pid}/stat") as file:
                fields = file.read().rsplit(")", 1)[1].split()
        except OSError:
            continue
        total += int(fields[11]) + int(fields[12])
    return total / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    answers() if sys.argv[1:] == ["answers"] else main()
