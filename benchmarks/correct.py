"""From key to picture on the page to correct tracks: `python benchmarks/correct.py`. Needs chromium, the group bench.

A simulated pad of 12 whiskers in 1,000 frames of 640 × 480 pixels, drawn as a movie. In a browser: steps to the next
frame and jumps of 50, from the key to after the frame that was drawn, and the processor time of server and browser
together, which other load inflates less; edits of lines at random, from the key to the picture in which they hold and
the names about them are put right; undo and redo. About two minutes, most of them for the movie.
`python benchmarks/correct.py large` has 24 whiskers in 2,000 frames; `python benchmarks/correct.py answers` takes no
browser: the server's answers alone.
"""

import json
import shutil
import sys
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))

from corrected_pad import make_pad, served_pad

FRAMES, WHISKERS, MOVES = 1000, 12, 30


KINDS = {"name": "n", "mark": "m", "join": "j", "split": "s", "swap": "x", "delete": "d"}


def random_edit(rng: np.random.Generator, served, kind: str | None = None) -> dict:
    """A request of an edit that makes sense, of a line with a name."""
    named = served.session.correction.named
    line = int(rng.choice(np.flatnonzero(named.whisker >= 0)))
    k, other = (int(x) for x in rng.choice(np.unique(named.whisker[named.whisker >= 0]), 2, replace=False))
    frames = int(served.opened.movie.frames)
    kinds = {
        "name": {"do": "name", "at": line, "whisker": k},
        "mark": {"do": "mark", "at": line, "whisker": k},
        "join": {"do": "join", "at": int(rng.choice(np.flatnonzero(named.whisker == -1))), "to": line},
        "split": {"do": "split", "at": line},
        "swap": {"do": "swap", "frame": int(rng.integers(frames // 2)), "whiskers": [k, other]},
        "delete": {"do": "delete", "at": line},
    }
    return kinds[kind or rng.choice(list(kinds))]


def row(name: str, milliseconds: list[float], processor: float = np.nan) -> None:
    """Print median, 95th percentile, processor time of each and number."""
    some = np.array(milliseconds)
    each = "" if np.isnan(processor) else f"{1e3 * processor / some.size:.0f}"
    print(f"{name:<34}{np.median(some):>8.0f}{np.quantile(some, 0.95):>8.0f}{each:>10}{some.size:>8}", flush=True)


def processor_time() -> float:
    """Processor time of the server, which runs in this process, and of the browser [s]."""
    import psutil

    own = psutil.Process()
    return sum(sum(one.cpu_times()[:2]) for one in (own, *own.children(recursive=True)))


def answers(served) -> None:
    """Time and processor time of the server, which runs in this process."""
    rng, spent = (
        np.random.default_rng(0),
        {name: [] for name in ("edit", "edit, cpu", "undo")},
    )

    def post(place: str, values: dict) -> tuple[float, float]:
        begin, cpu = time.perf_counter(), time.process_time()
        origin = {"Origin": "/".join(served.root.split("/")[:3])}
        request = urllib.request.Request(served.root + place, json.dumps(values).encode(), origin)
        with urllib.request.urlopen(request) as reply:
            reply.read()
        return 1e3 * (time.perf_counter() - begin), 1e3 * (time.process_time() - cpu)

    for _ in range(MOVES):
        try:
            edit = post("edit", random_edit(rng, served))
        except urllib.error.HTTPError as error:
            if error.code != 422:
                raise
            continue  # a split of the first frame of a piece
        for name, value in zip(spent, edit, strict=False):
            spent[name].append(value)
        if rng.random() < 0.3:
            spent["undo"].append(post("undo", {})[0])
    for name, values in spent.items():
        row(name, values)


def in_browser(served) -> None:
    """Time from the key to the picture."""
    from playwright.sync_api import sync_playwright

    rng = np.random.default_rng(0)
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.goto(served.root)
        until(page, "Boolean(globalThis.correct) && !correct.busy()")
        for name, key, count in (("next frame", "ArrowRight", 100), ("jump of 50 frames", "PageDown", 15)):
            page.evaluate("correct.times.scrub.length = 0")
            begin = processor_time()
            for _ in range(count):
                page.keyboard.press(key)
                until(page, "!correct.busy()")
            row(name, page.evaluate("correct.times.scrub"), processor_time() - begin)
        every, steps = [], {"u": [], "r": []}
        for kind in KINDS:
            of_kind = []
            for _ in range(MOVES // 3):
                page.evaluate("correct.times.move.length = 0")
                by_keyboard(page, random_edit(rng, served, kind))
                of_kind += page.evaluate("correct.times.move")
                if page.evaluate("correct.tracks.edits"):  # not one that was refused
                    for key in "uru":  # the next edit is made on the same names
                        page.evaluate("correct.times.move.length = 0")
                        page.keyboard.press(key)
                        until(page, "!correct.busy()")
                        steps[key] += page.evaluate("correct.times.move")
            row(kind, of_kind)
            every += of_kind
        row("undo", steps["u"])
        row("redo", steps["r"])
        row("every edit", every)
        browser.close()


def by_keyboard(page, edit: dict) -> None:
    """Make an edit by the keys that a user presses once the line is selected."""
    if edit["do"] == "join":
        page.evaluate(f"correct.select({edit['at']})")
        until(page, "!correct.busy()")
        page.keyboard.press("j")
        edit = {**edit, "at": edit["to"]}
    line = edit.get("at")
    if line is None:
        line = page.evaluate(f"correct.tracks.whisker.indexOf({edit['whiskers'][0]})")
    page.evaluate(f"correct.select({line})")
    until(page, "!correct.busy()")
    page.keyboard.press(KINDS[edit["do"]])
    number = edit.get("whisker", edit.get("whiskers", [None])[-1])
    if number is not None:
        page.keyboard.type(str(number))
        page.keyboard.press("Enter")
        page.keyboard.press("Escape")
    until(page, "!correct.busy()")


def until(page, condition: str) -> None:
    """Wait for a condition, asking rarely: each question takes the browser some milliseconds."""
    while not page.evaluate(condition):
        time.sleep(0.1)


def main() -> None:
    """Make the movie, serve it, print a table."""
    frames, whiskers = (2 * FRAMES, 2 * WHISKERS) if "large" in sys.argv else (FRAMES, WHISKERS)
    with tempfile.TemporaryDirectory() as folder:
        pad = make_pad(Path(folder), frames, whiskers)
        with served_pad(pad, Path(folder) / "out.nc") as served:
            print(f"{'[ms]':<34}{'median':>8}{'p95':>8}{'processor':>10}{'moves':>8}")
            if "answers" in sys.argv:
                answers(served)
            else:
                in_browser(served)


if __name__ == "__main__":
    main()
