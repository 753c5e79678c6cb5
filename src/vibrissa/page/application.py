"""The page's routes: for users who know the address, and for its own pages alone."""

from __future__ import annotations

import asyncio
import json
import secrets
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.page.answer.answers import ANSWERS, answer, unforeseen
from vibrissa.page.answer.export import KINDS, exported
from vibrissa.page.incoming.bodies import RefusedBodyError, body_of
from vibrissa.page.incoming.upload_cache import LARGEST, UploadCache
from vibrissa.page.panel.controls import as_table
from vibrissa.page.panel.glossary import SYMBOLS
from vibrissa.page.panel.presets import as_list
from vibrissa.page.panel.state import read_state
from vibrissa.page.session import PageSession
from vibrissa.page.whole.runs import WholeRuns

if TYPE_CHECKING:
    from anyio import CapacityLimiter
    from starlette.applications import Starlette
    from starlette.requests import HTTPConnection, Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
GUARD = {
    "Content-Security-Policy": POLICY,
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
SCRIPTS = (
    "page.js",
    "controls.js",
    "messages.js",
    "plots.js",
    "views.js",
    "whisker.js",
    "bridge.js",
    "sound.js",
    "lesson.js",
    "keep.js",
    "palette.js",
)
STATIC = {"": "index.html"} | {name: name for name in ("page.css", *SCRIPTS, "icon.svg")}  # by the end of the address


class OneAtATime:
    """Calls in a thread, one after the other."""

    def __init__(self) -> None:
        self._limiter: CapacityLimiter | None = None

    async def __call__(self, function: Callable[..., Any], *what: Any) -> Any:
        """Call a function when those before it are done."""
        from anyio import CapacityLimiter, to_thread

        self._limiter = self._limiter or CapacityLimiter(1)
        return await to_thread.run_sync(function, *what, limiter=self._limiter)


class Page:
    """One page, with its files and tables.

    Parameters
    ----------
    port : int
        On which it is served: requests must name it as their host, and as their origin.
    token : str, optional
        The secret part of the address; a random one by default.
    """

    def __init__(self, port: int, token: str | None = None) -> None:
        self.token = secrets.token_urlsafe(12) if token is None else token
        self.hosts = {f"{name}:{port}" for name in ("127.0.0.1", "localhost")}
        self.uploads = UploadCache()
        self.whole = WholeRuns()
        self.session = PageSession(self.uploads.get, self.whole)
        self._works = OneAtATime()  # compiled loops may themselves be parallel
        self._drops = OneAtATime()  # while one is read, in a process apart, the page goes on

    def warm_up(self, given: Mapping[str, Any]) -> None:
        """Answer everything once: the first answers load modules for a second or two, and nobody waits yet.

        Parameters
        ----------
        given : mapping
            What the page starts with, see :func:`vibrissa.page.panel.state.read_state`.
        """
        for want in ANSWERS:
            answer(self.session, json.dumps({"want": want, "state": dict(given)}))

    def application(self) -> Starlette:
        """The routes, below the secret part of the address."""
        from starlette.applications import Starlette
        from starlette.routing import Route, WebSocketRoute

        root = f"/{self.token}/"
        return Starlette(
            routes=[
                Route(root + "controls.json", self._controls),
                Route(root + "texture", self._drop, methods=["POST"]),
                Route(root + "export/{letter}/{name}", self._export),
                WebSocketRoute(root + "live", self._live),
                Route(root + "{name:path}", self._static),
            ]
        )

    def _stranger(self, connection: HTTPConnection, *, needs_origin: bool) -> bool:
        """Whether a request names another host, or comes from a page of another."""
        origin = connection.headers.get("origin")
        if connection.headers.get("host", "") not in self.hosts:
            return True
        foreign = origin is not None and origin.removeprefix("http://") not in self.hosts
        return foreign or (needs_origin and origin is None)

    async def _static(self, request: Request) -> Response:
        name = request.path_params["name"]
        if self._stranger(request, needs_origin=False) or name not in STATIC:
            return _line(404, "not here")
        file = files("vibrissa.page") / "static" / STATIC[name]
        return _content(file.read_bytes(), TYPES[Path(STATIC[name]).suffix])

    async def _controls(self, request: Request) -> Response:
        if self._stranger(request, needs_origin=False):
            return _line(404, "not here")
        return _json({"controls": as_table(), "presets": as_list(), "symbols": SYMBOLS})

    async def _drop(self, request: Request) -> Response:
        if self._stranger(request, needs_origin=True):
            return _line(403, "only the page itself may drop a file")
        settled = dict(request.query_params)
        try:
            content = await body_of(request, LARGEST)
        except RefusedBodyError as refused:
            return _line(refused.code, refused.line)

        def keep() -> Response:
            key, notes = self.uploads.put(settled.get("name", ""), content, settled)
            return _json({"key": key, "notes": notes})

        return await self._answered(keep, self._drops)

    async def _export(self, request: Request) -> Response:
        letter, name = request.path_params["letter"], request.path_params["name"]
        if self._stranger(request, needs_origin=False) or letter not in ("a", "b") or name not in KINDS:
            return _line(404, "not here")
        given = dict(request.query_params)

        def make() -> Response:
            made = exported(PageSession(self.uploads.get, self.whole), read_state(given), letter, name)
            return _content(made, KINDS[name][0], {"Content-Disposition": f'attachment; filename="vibrissa-{name}"'})

        return await self._answered(make, self._works)

    async def _answered(self, work: Callable[[], Response], line: OneAtATime) -> Response:
        """Do the work; bad input, and what nobody foresaw, is answered with its one line."""
        try:
            return await line(work)
        except (InputError, ConvergenceError) as error:
            return _line(422, str(error))
        except Exception as error:
            return _line(500, unforeseen(error))

    async def _live(self, socket: WebSocket) -> None:
        from starlette.websockets import WebSocketDisconnect

        if self._stranger(socket, needs_origin=True):
            await socket.close(1008)
            return
        await socket.accept()
        with suppress(WebSocketDisconnect):
            await self._converse(socket)

    async def _converse(self, socket: WebSocket) -> None:
        """Answer message after message; while one is answered the next is listened for, which hurries it."""
        coming = _awaited(socket)
        try:
            while True:
                message = await coming
                coming = _awaited(socket)
                said = await self._works(answer, self.session, message, coming.done)
                await (socket.send_text(said) if isinstance(said, str) else socket.send_bytes(said))
        finally:
            coming.cancel()


def _awaited(socket: WebSocket) -> asyncio.Task[str | bytes]:
    """The next message, listened for; an end of the connection that nobody asks for is no error."""
    coming = asyncio.create_task(_message(socket))
    coming.add_done_callback(lambda one: None if one.cancelled() else one.exception())
    return coming


async def _message(socket: WebSocket) -> str | bytes:
    """Next message, text or not."""
    from starlette.websockets import WebSocketDisconnect

    event = await socket.receive()
    if event["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(event.get("code", 1000))
    text = event.get("text")
    return event.get("bytes") or b"" if text is None else text


def _content(content: bytes, kind: str, more: Mapping[str, str] | None = None) -> Response:
    from starlette.responses import Response

    return Response(content, media_type=kind, headers={**GUARD, **(more or {})})


def _json(values: dict[str, Any]) -> Response:
    return _content(json.dumps(values).encode(), "application/json")


def _line(code: int, line: str) -> Response:
    from starlette.responses import PlainTextResponse

    return PlainTextResponse(line, code, headers={**GUARD, "Connection": "close"})  # what still comes is not read
