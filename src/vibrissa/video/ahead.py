"""Work on one thing while the next is being made: decoding beside tracking."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from queue import Empty, Queue
from threading import Event, Thread
from typing import TypeVar

Made = TypeVar("Made")


class _Last:
    """End of what is made, with what went wrong, if anything."""

    def __init__(self, error: BaseException | None = None) -> None:
        self.error = error


def ahead(source: Iterator[Made]) -> Generator[Made, None, None]:
    """Take from an iterator in another thread, one thing ahead of whoever consumes them.

    At most three things exist at once: one in use, one waiting, one being made. What the source raises arrives at
    the consumer after the things made before it; when the consumer stops, the source is closed and its thread ends.

    Parameters
    ----------
    source : iterator
        Does its work where the interpreter's lock is released, or the thread gains nothing. Nothing is taken from
        it before the first thing is asked for.

    Yields
    ------
    object
        What the source gives, in its order.
    """
    waiting: Queue[Made | _Last] = Queue(maxsize=1)
    stopped = Event()
    thread = Thread(target=_make, args=(source, waiting, stopped), daemon=True)
    thread.start()
    try:
        while not isinstance(made := waiting.get(), _Last):
            yield made
        if made.error is not None:
            raise made.error
    finally:
        stopped.set()
        _empty(waiting)  # the thread may wait for room; after the stop it puts nothing more
        thread.join()


def _make(source: Iterator[Made], waiting: Queue[Made | _Last], stopped: Event) -> None:
    last = _Last()
    try:
        for made in source:
            waiting.put(made)
            if stopped.is_set():
                break
    except BaseException as error:  # whatever it is, it is the consumer's
        last = _Last(error)
    finally:
        if isinstance(source, Generator):
            source.close()
    if not stopped.is_set():
        waiting.put(last)


def _empty(waiting: Queue[Made | _Last]) -> None:
    try:
        while True:
            waiting.get_nowait()
    except Empty:
        pass
