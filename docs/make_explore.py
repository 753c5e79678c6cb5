"""Make docs/explore.png, the page of `vibrissa explore` in a browser, and docs/explore-whole.png, its whole whisker.

    .venv/bin/python docs/make_explore.py

Needs chromium and the group dev.
"""

import shutil
import threading
import time
from pathlib import Path

import uvicorn
from playwright.sync_api import sync_playwright

from vibrissa.page.application import Page
from vibrissa.page.server import listening, settings

HERE = Path(__file__).parent


def main():
    """Serve the page, take a picture of it."""
    with listening(0) as listener:
        port = listener.getsockname()[1]
        page = Page(port)
        server = uvicorn.Server(settings(page.application()))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
        thread.start()
        with sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
            view = browser.new_page(
                viewport={"width": 1280, "height": 1330}, color_scheme="light", reduced_motion="reduce"
            )
            view.goto(f"http://127.0.0.1:{port}/{page.token}/")
            while not view.evaluate("Boolean(globalThis.vibrissa?.other?.())"):
                time.sleep(0.1)
            time.sleep(1)
            view.screenshot(path=HERE / "explore.png")
            view.get_by_role("button", name="Long free end", exact=True).click()
            while not view.evaluate("vibrissa.data().model === 'rod' && !vibrissa.busy()"):
                time.sleep(0.1)
            view.locator("#bridge").screenshot(path=HERE / "explore-whole.png")
            browser.close()
        server.should_exit = True
        thread.join(5)


if __name__ == "__main__":
    main()
