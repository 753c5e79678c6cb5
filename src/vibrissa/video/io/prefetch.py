"""Prefetching: decode the next block while the current one is tracked."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from typing import TypeVar

Made = TypeVar("Made")


def prefetched(source: Iterator[Made]) -> Generator[Made, None, None]:
    """Run an iterator in another thread, one item ahead of its consumer.

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

    Raises
    ------
    BaseException
        Whatever the source raises.
    """

    def make() -> list[Made]:
        return list(islice(source, 1))

    thread = ThreadPoolExecutor(1)
    try:
        ahead = deque([thread.submit(make), thread.submit(make)])
        while made := ahead.popleft().result():
            ahead.append(thread.submit(make))
            yield from made
    finally:
        thread.shutdown(cancel_futures=True)  # waits for the one that is being made
        if isinstance(source, Generator):
            source.close()
