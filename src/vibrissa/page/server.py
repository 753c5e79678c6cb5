"""The page's server: on this machine alone, for who knows the address, for pages of its own alone."""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from vibrissa.errors import ConvergenceError, InputError, install
from vibrissa.page.answers import ANSWERS, answer
from vibrissa.page.bench import Bench
from vibrissa.page.controls import as_table
from vibrissa.page.export import KINDS, exported
from vibrissa.page.picture import palette
from vibrissa.page.shelf import LARGEST, Shelf
from vibrissa.page.state import read_state

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
STATIC = {
    "": ("index.html", "text/html"),
    "page.css": ("page.css", "text/css"),
    **{
        name: (name, "text/javascript")
        for name in ("page.js", "controls.js", "plots.js", "views.js", "whisker.js", "sound.js")
    },
    "icon.svg": ("icon.svg", "image/svg+xml"),
}
LARGEST_MESSAGE = 16 << 20  # bytes: longer ones end the connection, long ones are answered with a line


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
        self.shelf = Shelf()
        self.bench = Bench(self.shelf.get)
        self._limiter: CapacityLimiter | None = None

    def warm_up(self, given: Mapping[str, Any]) -> None:
        """Answer everything once: what is loaded by the first answers takes a second or two, and no hand waits yet."""
        for want in ANSWERS:
            answer(self.bench, json.dumps({"want": want, "state": dict(given)}))

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

    async def _work(self, function: Callable[..., Any], *what: Any) -> Any:
        """Call in a thread, one at a time: compiled loops may themselves be parallel."""
        from anyio import CapacityLimiter, to_thread

        self._limiter = self._limiter or CapacityLimiter(1)
        return await to_thread.run_sync(function, *what, limiter=self._limiter)

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
            return _told(404, "not here")
        file, kind = STATIC[name]
        return _given((files("vibrissa.page") / "static" / file).read_bytes(), kind)

    async def _controls(self, request: Request) -> Response:
        if self._stranger(request, needs_origin=False):
            return _told(404, "not here")
        told = {"controls": as_table(), "palette": palette()}
        return _given(json.dumps(told).encode(), "application/json")

    async def _drop(self, request: Request) -> Response:
        if self._stranger(request, needs_origin=True):
            return _told(403, "only the page itself may drop a file")
        length = request.headers.get("content-length", "")
        if not length.isdecimal() or int(length) > LARGEST:
            return _told(413, f"a dropped file must have at most {LARGEST >> 20} MB")
        settled = dict(request.query_params)
        content = await request.body()
        return await self._answered(lambda: self._shelve(settled, content))

    def _shelve(self, settled: Mapping[str, str], content: bytes) -> Response:
        key, notes = self.shelf.put(settled.get("name", ""), content, settled)
        return _given(json.dumps({"key": key, "notes": notes}).encode(), "application/json")

    async def _export(self, request: Request) -> Response:
        letter, name = request.path_params["letter"], request.path_params["name"]
        if self._stranger(request, needs_origin=False) or letter not in ("a", "b") or name not in KINDS:
            return _told(404, "not here")
        given = dict(request.query_params)
        return await self._answered(
            lambda: _given(exported(Bench(self.shelf.get), read_state(given), letter, name), KINDS[name], name)
        )

    async def _answered(self, work: Callable[[], Response]) -> Response:
        """Do the work; bad input is answered with its one line."""
        try:
            return await self._work(work)
        except (InputError, ConvergenceError) as error:
            return _told(422, str(error))

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
                told = await self._work(answer, self.bench, message, coming.done)
                await (socket.send_text(told) if isinstance(told, str) else socket.send_bytes(told))
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


def _given(content: bytes, kind: str, file: str | None = None) -> Response:
    from starlette.responses import Response

    named = {"Content-Disposition": f'attachment; filename="vibrissa-{file}"'} if file else {}
    return Response(content, media_type=kind, headers={**GUARD, **named})


def _told(code: int, line: str) -> Response:
    from starlette.responses import PlainTextResponse

    return PlainTextResponse(line, code, headers=GUARD)


def serve(
    given: Mapping[str, Any],
    *,
    port: int = 0,
    tell: Callable[[str], None],
    opened: Callable[[str], object] | None = None,
) -> None:
    """Serve the page until Ctrl-C.

    Parameters
    ----------
    given : mapping
        What the page starts with, see :func:`vibrissa.page.state.read_state`.
    port : int
        On 127.0.0.1; a free one by default.
    tell : callable
        Called with the address, in a line; only who knows it can open the page.
    opened : callable, optional
        Called with the address alone, to open it.

    Raises
    ------
    InputError
        If what is given is no state, the extra ``page`` is not installed, or the port is taken.
    """
    from urllib.parse import urlencode

    from threadpoolctl import threadpool_limits

    read_state(given)
    uvicorn = _uvicorn()
    with listening(port) as listener:
        page = Page(listener.getsockname()[1])
        page.warm_up(given)
        address = f"http://127.0.0.1:{listener.getsockname()[1]}/{page.token}/" + (
            f"#{urlencode(given)}" if given else ""
        )
        tell(f"explore on the page {address} (Ctrl-C ends it)")
        server = uvicorn.Server(settings(page.application()))
        if opened is not None:
            threading.Thread(target=opened, args=(address,), daemon=True).start()
        with suppress(KeyboardInterrupt), threadpool_limits(1):  # small sums: threads would only wait for one another
            server.run(sockets=[listener])
        tell("the page is closed")


def settings(application: Starlette) -> Any:
    """How uvicorn serves it: no log, bounded messages, no waiting for open pages at the end."""
    return _uvicorn().Config(
        application,
        log_level="critical",
        access_log=False,
        ws_max_size=LARGEST_MESSAGE,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=1,
        server_header=False,
        lifespan="off",
    )


def listening(port: int) -> socket.socket:
    """A socket on this machine alone; a free port for 0."""
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("127.0.0.1", port))
        listener.listen()  # who is told the address may come at once
    except (OSError, OverflowError) as error:
        listener.close()
        raise InputError("--port", "must be free on this machine, 0 to 65535", port, "0 takes any free one") from error
    return listener


def _uvicorn() -> Any:
    try:
        import starlette  # noqa: F401
        import uvicorn
        import websockets  # noqa: F401
    except ImportError as error:
        raise InputError("explore", "needs the extra page", remedy=install("page")) from error
    return uvicorn
