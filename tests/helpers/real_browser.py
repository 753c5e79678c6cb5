"""A browser of this machine for tests of pages; they skip where there is none."""

import os
import shutil
from contextlib import contextmanager

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "msedge")
MAC = "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome"


def missing(reason):
    """Skip with a word; fail where a browser must be."""
    if os.environ.get("VIBRISSA_REQUIRE_BROWSER"):
        pytest.fail(reason)
    pytest.skip(reason)


@contextmanager
def real_browser(home, *flags):
    """Start a browser that settles in a home of the test, with these flags."""
    found = [shutil.which(name) for name in (os.environ.get("VIBRISSA_BROWSER", ""), *BROWSERS) if name]
    found = [path for path in [*found, MAC] if path and os.path.exists(path)]
    if not found:
        missing(f"no browser: the page is not tested in one; install one of {', '.join(BROWSERS)}")
    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError:
        missing("playwright is not installed")
    try:
        with sync_playwright() as driver:
            env = {**os.environ, "HOME": str(home)}
            browser = driver.chromium.launch(executable_path=found[0], args=["--no-sandbox", *flags], env=env)
            yield browser
            browser.close()
    except Error as error:
        missing(f"playwright's driver does not start (Debian: apt-get install libatomic1): {str(error)[:200]}")
