from __future__ import annotations

import threading
import time

import pytest

from vibrissa.video.io.prefetch import prefetched


class Source:
    """Counts what is taken from it, and says when it is closed."""

    def __init__(self, count: int, fails_at: int = -1) -> None:
        self.count, self.fails_at, self.made, self.closed = count, fails_at, 0, False

    def things(self):
        try:
            for i in range(self.count):
                if i == self.fails_at:
                    raise ValueError("broken")
                self.made = i + 1
                yield i
        finally:
            self.closed = True


def settled(source: Source) -> int:
    """Things made once nothing more is made for a while."""
    made = -1
    while made != source.made:
        made = source.made
        time.sleep(0.05)
    return made


def test_everything_arrives_in_order_and_the_thread_ends():
    before = threading.active_count()
    source = Source(100)
    assert list(prefetched(source.things())) == list(range(100))
    assert source.closed
    assert threading.active_count() == before


def test_nothing_is_made_before_it_is_asked_for():
    source = Source(3)
    things = prefetched(source.things())
    time.sleep(0.05)
    assert source.made == 0
    assert next(things) == 0


def test_at_most_three_things_exist_at_once():
    source = Source(50)
    things = prefetched(source.things())
    for i in range(10):
        next(things)
        assert settled(source) == i + 3  # in use, waiting, made and waiting for room
    things.close()


def test_an_error_arrives_after_what_was_made_before_it():
    things = prefetched(Source(10, fails_at=4).things())
    assert [next(things) for _ in range(4)] == [0, 1, 2, 3]
    with pytest.raises(ValueError, match="broken"):
        next(things)


@pytest.mark.parametrize("taken", [1, 2, 5, 99])
def test_a_consumer_that_stops_closes_the_source_and_ends_the_thread(taken):
    before = threading.active_count()
    source = Source(100)
    things = prefetched(source.things())
    for _ in range(taken):
        next(things)
    things.close()
    assert source.closed
    assert threading.active_count() == before
    assert source.made <= taken + 3


def test_the_next_is_made_while_the_last_is_in_use():
    made, release = threading.Event(), threading.Event()

    def things():
        yield 0
        made.set()
        release.wait(10)
        yield 1

    consumed = prefetched(things())
    assert next(consumed) == 0
    assert made.wait(10)  # without a thread of its own the source would not go on before the next is asked for
    release.set()
    assert next(consumed) == 1
