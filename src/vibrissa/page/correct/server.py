"""The server of the page to correct linked whiskers, on this machine alone."""

from __future__ import annotations

import threading
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

from vibrissa.errors import InputError
from vibrissa.page.correct.session import CorrectionSession
from vibrissa.study.pick.local_page import LocalHandler, LocalServer

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
TYPES = {".html": "text/html; charset=utf-8", ".css": "text/css", ".js": "text/javascript"}
OWN = ("correct.css", "correct.js", "drawing.js", "frames.js", "keys.js", "overview.js", "state.js")
STATIC = {"": "correct/static/index.html", "messages.js": "static/messages.js"}
STATIC |= {name: f"correct/static/{name}" for name in OWN}
BINARY = "application/octet-stream"


class CorrectionServer(LocalServer):
    """Server of the page.

    Parameters
    ----------
    session : CorrectionSession
        The movie.
    """

    def __init__(self, session: CorrectionSession) -> None:
        super().__init__(_Handler, POLICY)
        self.session = session


def serve(
    session: CorrectionSession, *, tell: Callable[[str], None], opened: Callable[[str], object] | None = None
) -> None:
    """Serve the page until it is ended there, or by Ctrl-C.

    Parameters
    ----------
    session : CorrectionSession
        The movie.
    tell : callable
        Called with a line that gives the address; only who knows it can open the page.
    opened : callable, optional
        Called with the address alone, to open it.
    """
    with CorrectionServer(session) as server:
        tell(f"correct on the page {server.address} (Ctrl-C ends it)")
        if opened is not None:
            threading.Thread(target=opened, args=(server.address,), daemon=True).start()
        try:
            server.serve_forever(poll_interval=0.1)
        except KeyboardInterrupt:
            tell("the page is closed")


class _Handler(LocalHandler):
    server: CorrectionServer
    protocol_version = "HTTP/1.1"  # a connection stays open: a move costs no new one
    disable_nagle_algorithm = True  # else head and body of an answer are 40 ms apart
    wbufsize = -1

    def get(self, place: str) -> None:
        """Give a file of the page, all lines, or a frame."""
        if place in STATIC:
            file = files("vibrissa.page") / STATIC[place]
            self.answer(200, TYPES[Path(STATIC[place]).suffix], file.read_bytes())
        elif place == "lines":
            self.answer(200, BINARY, self.server.session.start())
        elif place.startswith("frame/") and place[6:].isdecimal() and len(place) < 20:
            self._attempt(lambda: (BINARY, self.server.session.frames.frame(int(place[6:]))))
        else:
            self.not_here()

    def post(self, place: str) -> None:
        """Do what is asked for; an error is answered with its one line."""
        session = self.server.session
        if (values := self.content()) is None:
            return
        if place == "end":
            self.answer_json(200, {})
            self.server.end()
        elif place == "save":
            self._attempt(lambda: ("text/plain; charset=utf-8", session.save().encode()))
        else:
            self._attempt(lambda: (BINARY, session.answer(place, values)))

    def _attempt(self, work: Callable[[], tuple[str, bytes]]) -> None:
        """Answer with what is made, or with the line of an error."""
        try:
            kind, content = work()
        except InputError as error:
            self.answer_json(422, {"error": str(error)})
            return
        self.answer(200, kind, content)
