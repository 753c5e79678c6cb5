"""A page on this machine alone, on which points are picked in an image and saved."""

from __future__ import annotations

import json
import secrets
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO
from time import monotonic
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import FormatError

LARGEST = 1 << 20  # bytes of what is saved: some hundred points are a hundredth of it
MOST_DIGITS = 12  # of a length
PATIENCE = 20.0  # [s] in which a request must have come
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
    token = secrets.token_urlsafe(16)
    with _Server(token, image, proposal, save) as server:
        address = f"http://127.0.0.1:{server.server_address[1]}/{token}/"
        tell(f"pick on the page {address} (Ctrl-C gives up)")
        if opened is not None:
            threading.Thread(target=opened, args=(address,), daemon=True).start()
        try:
            server.serve_forever(poll_interval=0.1)
        except KeyboardInterrupt:
            tell("given up, nothing was written")
    return server.saved


class _Server(ThreadingHTTPServer):
    """Loopback server of one page; ends when it is saved."""

    def __init__(
        self, token: str, image: NDArray[Any], proposal: Mapping[str, Any], save: Callable[[Mapping[str, Any]], None]
    ) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.prefix, self.save, self.saved = f"/{token}/", save, False
        self.hosts = {f"{name}:{self.server_address[1]}" for name in ("127.0.0.1", "localhost")}
        self.lock = threading.Lock()
        self.nonce = secrets.token_urlsafe(16)
        page = render_page({**proposal, "width": image.shape[1], "height": image.shape[0]}, self.nonce)
        self.pages = {"": ("text/html; charset=utf-8", page.encode()), "frame.png": ("image/png", png(image))}

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of connections that the other side broke off."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)

    def end(self) -> None:
        """Stop serving, from a thread of its own: the one that serves must not wait for itself."""
        threading.Thread(target=self.shutdown, daemon=True).start()


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    timeout = PATIENCE  # of each wait for the other side

    def do_GET(self) -> None:
        """Give the page or its picture, to who knows the address."""
        place = self._place()
        if place is None or place not in self.server.pages:
            self._answer(404, "text/plain", b"not here")
        else:
            self._answer(200, *self.server.pages[place])

    def do_POST(self) -> None:
        """Save what was picked, or give up; an error is answered with its one line."""
        place, length = self._place(), self.headers.get("Content-Length", "")
        if place not in ("save", "quit"):
            self._answer(404, "text/plain", b"not here")
        elif "Origin" not in self.headers:
            self._tell(403, {"error": "only the page itself may save or give up"})
        elif "Transfer-Encoding" in self.headers or not _is_length(length) or int(length) > LARGEST:
            self._tell(400, {"error": f"what is saved must have one length, at most {LARGEST} bytes"})
        elif (body := self._body(int(length))) is None:
            self._tell(408, {"error": f"what is saved must come whole, within {PATIENCE:g} s"})
        elif place == "quit":
            self._tell(200, {"saved": False})
            self.server.end()
        else:
            self._save(body)

    def _body(self, length: int) -> bytes | None:
        """Body of so many bytes; None where it breaks off, or is too slow."""
        end, body = monotonic() + PATIENCE, b""
        with suppress(TimeoutError):
            while len(body) < length and monotonic() < end and (part := self.rfile.read1(length - len(body))):
                body += part
        return body if len(body) == length else None

    def _save(self, body: bytes) -> None:
        with self.server.lock:
            try:
                picked = json.loads(body)
                if not isinstance(picked, dict):
                    raise FormatError("what is saved", "must be an object")
                self.server.save(picked)
            except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
                return self._tell(400, {"error": f"what is saved must be JSON: {error}"})
            except (ValueError, TypeError) as error:
                return self._tell(422, {"error": str(error)})
            except Exception as error:
                return self._tell(500, {"error": f"it could not be saved ({type(error).__name__}: {error})"})
            self.server.saved = True
        self._tell(200, {"saved": True})
        self.server.end()

    def _place(self) -> str | None:
        """Path below the secret part; None for a stranger, a foreign host name, or the page of another."""
        origin = self.headers.get("Origin")
        foreign = origin is not None and origin.removeprefix("http://") not in self.server.hosts
        if foreign or self.headers.get("Host") not in self.server.hosts:
            return None
        return self.path.removeprefix(self.server.prefix) if self.path.startswith(self.server.prefix) else None

    def _tell(self, code: int, content: Mapping[str, Any]) -> None:
        self._answer(code, "application/json", json.dumps(content).encode())

    def _answer(self, code: int, kind: str, content: bytes) -> None:
        self.send_response(code)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Content-Security-Policy", POLICY.format(self.server.nonce))
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing of single requests."""


def _is_length(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) <= MOST_DIGITS


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
