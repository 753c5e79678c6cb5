"""The page's server, on this machine alone."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from vibrissa.errors import ConflictError, PackageError, install
from vibrissa.page.application import Page
from vibrissa.page.panel.presets import CLEAN
from vibrissa.page.panel.state import read_state

if TYPE_CHECKING:
    from starlette.applications import Starlette

LARGEST_MESSAGE = 16 << 20  # bytes: longer ones end the connection, long ones are answered with a line


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
        What the page starts with, see :func:`vibrissa.page.panel.state.read_state`.
    port : int
        On 127.0.0.1; a free one by default.
    tell : callable
        Called with a line that gives the address; the page opens for nobody else.
    opened : callable, optional
        Called with the address alone, to open it.

    Raises
    ------
    InputError
        If the values are no state, the extra ``page`` is not installed, or the port is taken.
    """
    from urllib.parse import urlencode

    from threadpoolctl import threadpool_limits

    read_state(given)
    uvicorn = _uvicorn()
    with listening(port) as listener:
        own = listener.getsockname()[1]
        page = Page(own)
        page.warm_up(given or CLEAN)
        address = f"http://127.0.0.1:{own}/{page.token}/" + (f"#{urlencode(given)}" if given else "")
        tell(f"explore on the page {address} (Ctrl-C ends it)")
        server = uvicorn.Server(settings(page.application()))
        if opened is not None:
            threading.Thread(target=opened, args=(address,), daemon=True).start()
        with suppress(KeyboardInterrupt), threadpool_limits(1):  # small sums: threads would only wait for one another
            server.run(sockets=[listener])
        tell("the page is closed")


def settings(application: Starlette) -> Any:
    """Settings of uvicorn: no log, bounded messages, no waiting for open pages at the end.

    Parameters
    ----------
    application : Starlette
        Of :class:`Page`.

    Returns
    -------
    uvicorn.Config
        For a server.
    """
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
    """A socket on this machine alone.

    Parameters
    ----------
    port : int
        A free one for 0.

    Returns
    -------
    socket
        Bound and listening.

    Raises
    ------
    InputError
        If the port is taken, or is none.
    """
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("127.0.0.1", port))
        listener.listen()  # whoever has the address may connect at once
    except (OSError, OverflowError) as error:
        listener.close()
        rule = "must be free on this machine, 0 to 65535"
        raise ConflictError("port", rule, port, "0 takes any free one") from error
    return listener


def _uvicorn() -> Any:
    try:
        import starlette  # noqa: F401
        import uvicorn
        import websockets  # noqa: F401
    except ImportError as error:
        raise PackageError("explore", "needs the extra page", remedy=install("page")) from error
    return uvicorn
