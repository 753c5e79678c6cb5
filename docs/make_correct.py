"""Picture of the page to correct tracks: `python docs/make_correct.py`. Needs chromium and the group bench."""

import shutil
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))

from corrected_pad import make_pad, served_pad

DOCS = Path(__file__).parent
KEYS = ("PageDown", "PageDown", "ArrowDown", "ArrowDown", "ArrowDown", "s")


def until(page, condition: str) -> None:
    """Wait for a condition; the page's policy forbids the driver's own waiting."""
    while not page.evaluate(condition):
        time.sleep(0.02)


def main() -> None:
    """Open the page on a simulated pad, split a piece, and take the picture."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        pad = make_pad(Path(folder), 400, 12)
        with served_pad(pad, Path(folder) / "out.nc") as served:
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1280, "height": 900}, color_scheme="light")
            page.goto(served.root)
            until(page, "Boolean(globalThis.correct) && !correct.busy()")
            for key in KEYS:
                page.keyboard.press(key)
                until(page, "!correct.busy()")
            page.wait_for_timeout(500)
            page.screenshot(path=DOCS / "correct.png")
            browser.close()


if __name__ == "__main__":
    main()
