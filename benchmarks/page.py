"""From slider to picture, in a browser: `python benchmarks/page.py`. Needs chromium and the group dev.

Each move is one step of an arrow key on a slider, from its event to after the frame in which what is in sight was
drawn. Beside it the processor time of the server and of the browser per move, which other load inflates less.
"""

import os
import shutil
import subprocess
import sys
import time

import numpy as np
from playwright.sync_api import sync_playwright

MOVES = 40
CONTROLS = {"height": "Left", "base_angle": "Left", "friction": "Right", "speed": "Right", "damping": "Right"}
CONTROLS |= {"a.period": "Right", "threshold": "Right"}
ROUGH = "#a.kind=rough&a.length=0.02&b.kind=rough&b.length=0.02&a.rms=2e-6&b.rms=2e-6&hold=contact&contact=0.35"


def main():
    """Serve the page in a process of its own, move every slider, print a table."""
    command = [sys.executable, "-m", "vibrissa", "explore", "--no-browser"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server, sync_playwright() as driver:
        address = next(word for word in server.stderr.readline().split() if word.startswith("http"))
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        print(f"{'':<24}{'median':>8}{'p95':>8}{'largest':>9}{'server':>9}{'browser':>9}   [ms]")
        for title, state, controls in (("", "#", CONTROLS), ("rough, ", ROUGH, ("base_angle", "speed", "damping"))):
            for control in controls:
                page.goto("about:blank")
                page.goto(address + state)
                until(page, "Boolean(globalThis.vibrissa?.other?.())")
                page.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true; })")
                print(f"{title + control:<24}" + moved(page, control, server.pid), flush=True)
        browser.close()
        server.terminate()


def moved(page, control, server):
    """Move one slider; latencies and processor times as a line."""
    page.evaluate("vibrissa.latencies.length = 0")
    before = spent(descendants(server)), spent(browsers())
    for _ in range(MOVES):
        shown = page.evaluate("vibrissa.shown()")
        page.locator(f"[id='c-{control}-slider']").press(f"Arrow{CONTROLS[control]}")
        until(page, f"vibrissa.shown() > {shown}")
    took = np.array(page.evaluate("vibrissa.latencies"))
    after = spent(descendants(server)), spent(browsers())
    work = [(now - then) / MOVES * 1e3 for now, then in zip(after, before, strict=True)]
    return f"{np.median(took):8.0f}{np.quantile(took, 0.95):8.0f}{took.max():9.0f}{work[0]:9.0f}{work[1]:9.0f}"


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
    main()
