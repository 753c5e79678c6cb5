"""Stops by a signal: those that a run knows, and work that none of them cuts in two."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread

TO_END = 5.0  # [s] that threads have, once a run is stopped, to end what they do
STOPS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextmanager
def without_stops() -> Iterator[None]:
    """Do what must not be cut in two: a stop that comes meanwhile takes effect after it.

    In other threads than the main one nothing is to be done: no signal interrupts them.

    Returns
    -------
    iterator of None
        For ``with``.
    """
    heard: list[int] = []
    stops = STOPS if current_thread() is main_thread() else ()
    handlers = {stop: handler for stop in stops if callable(handler := signal.getsignal(stop))}
    for stop in handlers:
        signal.signal(stop, lambda number, _: heard.append(number))
    try:
        yield
    finally:
        for stop, handler in handlers.items():
            signal.signal(stop, handler)
        if heard:
            signal.raise_signal(heard[0])


def time_to_end(error: BaseException) -> float | None:
    """How long to wait for threads that still work when an error ends what they work for.

    Parameters
    ----------
    error : BaseException
        The error, or the interruption.

    Returns
    -------
    float or None
        ``TO_END`` seconds at a stop; without end at an error, since the process may go on after it.
    """
    return None if isinstance(error, Exception) else TO_END
