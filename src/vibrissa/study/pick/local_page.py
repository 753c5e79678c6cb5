"""A page served on this machine alone: for those who know its address, and for its own requests only."""

from __future__ import annotations

import json
import secrets
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from time import monotonic
from typing import Any

LARGEST = 1 << 20  # bytes of what a page sends: some hundred points are a hundredth of it
MOST_DIGITS = 12  # of a length
PATIENCE = 20.0  # [s] in which a request must have come


class LocalServer(ThreadingHTTPServer):
    """Loopback server of one page, on a free port, below a secret part of the address."""

    def __init__(self, handler: type[LocalHandler], policy: str) -> None:
        super().__init__(("127.0.0.1", 0), handler)
        self.token = secrets.token_urlsafe(16)
        self.policy = policy
        self.hosts = {f"{name}:{self.server_address[1]}" for name in ("127.0.0.1", "localhost")}

    @property
    def address(self) -> str:
        """Address of the page; only who knows it can open it."""
        return f"http://127.0.0.1:{self.server_address[1]}/{self.token}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of connections that the other side broke off."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)

    def end(self) -> None:
        """Stop serving, from another thread: the one that serves must not wait for itself."""
        threading.Thread(target=self.shutdown, daemon=True).start()


class LocalHandler(BaseHTTPRequestHandler):
    """Answers with headers that keep the page to itself."""

    server: LocalServer
    timeout = PATIENCE  # of each wait for the other side

    def get(self, place: str) -> None:
        """Answer a request for what is at a place below the secret part of the address."""
        raise NotImplementedError

    def post(self, place: str) -> None:
        """Answer a request that sends something to a place below the secret part of the address."""
        raise NotImplementedError

    def do_GET(self) -> None:
        """Answer who knows the address."""
        place = self.place()
        if place is None:
            self.not_here()
        else:
            self.get(place)

    def do_POST(self) -> None:
        """Answer who knows the address."""
        place = self.place()
        if place is None:
            self.close_connection = True  # what follows is not read
            self.not_here()
        else:
            self.post(place)

    def not_here(self) -> None:
        """Answer that there is nothing."""
        self.answer(404, "text/plain", b"not here")

    def place(self) -> str | None:
        """Path below the secret part; None for a stranger, a foreign host name or a foreign page."""
        origin, prefix = self.headers.get("Origin"), f"/{self.server.token}/"
        if self.headers.get("Host", "") not in self.server.hosts or not self.path.startswith(prefix):
            return None
        if origin is not None and origin.removeprefix("http://") not in self.server.hosts:
            return None
        return self.path.removeprefix(prefix)

    def content(self) -> dict[str, Any] | None:
        """What was posted by the page itself, a JSON object.

        Returns
        -------
        dict or None
            Its values; None where it was refused, which is answered already.
        """
        length = self.headers.get("Content-Length", "")
        if "Origin" not in self.headers:
            return self._refuse(403, "must be sent by the page itself")
        if "Transfer-Encoding" in self.headers or not _is_length(length) or int(length) > LARGEST:
            return self._refuse(400, f"must have one length, at most {LARGEST} bytes")
        if (body := self._body(int(length))) is None:
            return self._refuse(408, f"must come whole, within {PATIENCE:g} s")
        try:
            values = json.loads(body)
        except (ValueError, RecursionError) as error:
            return self._refuse(400, f"must be JSON: {error}")
        return values if isinstance(values, dict) else self._refuse(400, "must be an object")

    def _refuse(self, code: int, rule: str) -> dict[str, Any] | None:
        self.close_connection = True  # what follows is not read
        self.answer_json(code, {"error": f"what is sent {rule}"})
        return None

    def _body(self, length: int) -> bytes | None:
        """Body of this number of bytes; None where it breaks off, or is too slow."""
        end, body = monotonic() + PATIENCE, b""
        with suppress(TimeoutError):
            while len(body) < length and monotonic() < end and (part := self.rfile.read1(length - len(body))):
                body += part
        return body if len(body) == length else None

    def answer_json(self, code: int, content: Mapping[str, Any]) -> None:
        """Answer with a JSON object.

        Parameters
        ----------
        code : int
            HTTP status.
        content : mapping
            Plain values.
        """
        self.answer(code, "application/json", json.dumps(content).encode())

    def answer(self, code: int, kind: str, content: bytes) -> None:
        """Answer a request.

        Parameters
        ----------
        code : int
            HTTP status.
        kind : str
            Media type.
        content : bytes
            The answer.
        """
        self.send_response(code)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Content-Security-Policy", self.server.policy)
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Cache-Control", "no-store")
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing of single requests."""


def _is_length(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) <= MOST_DIGITS
