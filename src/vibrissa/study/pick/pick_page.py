"""A page on this machine alone, on which points are picked in an image and saved."""

from __future__ import annotations

import secrets
import threading
from collections.abc import Callable, Mapping
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.study.pick.local_page import LocalHandler, LocalServer

POLICY = (
    "default-src 'none'; img-src 'self' data:; connect-src 'self'; style-src 'nonce-{0}'; script-src 'nonce-{0}'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


def serve(
    image: NDArray[Any],
    proposal: Mapping[str, Any],
    save: Callable[[Mapping[str, Any]], None],
    *,
    tell: Callable[[str], None],
    opened: Callable[[str], object] | None = None,
) -> bool:
    """Serve the page until it is saved or given up (its button, or Ctrl-C here).

    Parameters
    ----------
    image : (height, width) array
        Grey levels.
    proposal : mapping
        What the page starts with, and ``movie`` and ``study``, names to show.
    save : callable
        Called with what was picked; its InputError is shown on the page, which goes on.
    tell : callable
        Called with the page's address in a line; only who knows it can open the page.
    opened : callable, optional
        Called with the address alone, to open it.

    Returns
    -------
    bool
        Whether it was saved.
    """
    with _Server(image, proposal, save) as server:
        tell(f"pick on the page {server.address} (Ctrl-C gives up)")
        if opened is not None:
            threading.Thread(target=opened, args=(server.address,), daemon=True).start()
        try:
            server.serve_forever(poll_interval=0.1)
        except KeyboardInterrupt:
            tell("given up, nothing was written")
    return server.saved


class _Server(LocalServer):
    """Server of the page; ends when it is saved."""

    def __init__(
        self, image: NDArray[Any], proposal: Mapping[str, Any], save: Callable[[Mapping[str, Any]], None]
    ) -> None:
        nonce = secrets.token_urlsafe(16)
        super().__init__(_Handler, POLICY.format(nonce))
        self.save, self.saved = save, False
        self.lock = threading.Lock()
        page = render_page({**proposal, "width": image.shape[1], "height": image.shape[0]}, nonce)
        self.pages = {"": ("text/html; charset=utf-8", page.encode()), "frame.png": ("image/png", png(image))}


class _Handler(LocalHandler):
    server: _Server

    def get(self, place: str) -> None:
        """Give the page or its picture."""
        if place in self.server.pages:
            self.answer(200, *self.server.pages[place])
        else:
            self.not_here()

    def post(self, place: str) -> None:
        """Save what was picked, or give up; an error is answered with its one line."""
        if place not in ("save", "quit"):
            self.not_here()
            return
        if (picked := self.content()) is None:
            return
        if place == "quit":
            self.answer_json(200, {"saved": False})
            self.server.end()
        else:
            self._save(picked)

    def _save(self, picked: dict[str, Any]) -> None:
        with self.server.lock:
            try:
                self.server.save(picked)
            except (ValueError, TypeError) as error:
                return self.answer_json(422, {"error": str(error)})
            except Exception as error:
                line = f"it could not be saved ({type(error).__name__}: {error})"
                return self.answer_json(500, {"error": line})
            self.server.saved = True
        self.answer_json(200, {"saved": True})
        self.server.end()


def render_page(proposal: Mapping[str, Any], nonce: str) -> str:
    """HTML of the page, all in one; ``nonce`` marks the scripts and styles that may act.

    Parameters
    ----------
    proposal : mapping
        What the page starts with.
    nonce : str
        Of this page alone.

    Returns
    -------
    str
        HTML.
    """
    from jinja2 import Environment, PackageLoader, select_autoescape

    environment = Environment(loader=PackageLoader("vibrissa.study"), autoescape=select_autoescape())
    return environment.get_template("pick.html").render(proposal=dict(proposal), nonce=nonce)


def png(image: NDArray[Any]) -> bytes:
    """PNG of grey levels; more than eight bits are shown from their least to their highest level.

    Parameters
    ----------
    image : (height, width) array
        Grey levels.

    Returns
    -------
    bytes
        The file.
    """
    from matplotlib.image import imsave

    low = 0.0 if image.dtype == np.uint8 else float(image.min())
    span = 255.0 if image.dtype == np.uint8 else max(float(np.ptp(image)), 1.0)
    grey = np.rint((image - low) * (255 / span)).astype(np.uint8)
    buffer = BytesIO()
    imsave(buffer, np.repeat(grey[..., None], 3, axis=2), format="png")
    return buffer.getvalue()
