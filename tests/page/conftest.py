"""The page, served for the tests as `vibrissa explore` serves it."""

import threading
import time
from types import SimpleNamespace

import pytest

pytest.importorskip("starlette", reason="the extra page is not installed")
import uvicorn

from vibrissa.page.application import Page
from vibrissa.page.server import listening, settings


@pytest.fixture(scope="session")
def served():
    """Give the page's address (up to its token), its origin and the page."""
    with listening(0) as listener:
        port = listener.getsockname()[1]
        page = Page(port)
        server = uvicorn.Server(settings(page.application()))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
        thread.start()
        while not server.started:
            assert thread.is_alive()
            time.sleep(0.01)
        origin = f"http://127.0.0.1:{port}"
        yield SimpleNamespace(page=page, origin=origin, root=f"{origin}/{page.token}/", host=f"127.0.0.1:{port}")
        server.should_exit = True
        thread.join(5)
