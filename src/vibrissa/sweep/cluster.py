"""Work on the workers of a Dask cluster, through its scheduler."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any, TypeVar

from vibrissa import __version__
from vibrissa.errors import InputError

Item = TypeVar("Item")
Result = TypeVar("Result")

_CONNECT = 15.0  # [s]
_AHEAD = 4  # tasks in flight for each thread of the workers
_MOST_DEATHS = 10  # of workers, at the same task
_LOST = "start it again, and the same command: what is done is kept"


def on_cluster(
    function: Callable[[Item], Result], items: Sequence[Item], address: str, count: Callable[[int, Result], None]
) -> None:
    """Have each item done by the cluster; ``count`` is told number and result as they come.

    A task whose worker dies is done by another. Only a few tasks are in flight at a time, so that a stop is quick.

    Raises
    ------
    InputError
        See :func:`vibrissa.sweep.engine.each`.
    """
    if not items:
        return
    with _client(address) as client:
        _check(client, address)
        _flow(client, function, items, count, address)


@contextmanager
def _client(address: str) -> Iterator[Any]:
    try:
        from distributed import Client
    except ImportError as error:
        remedy = "install the extra: pip install 'vibrissa[cluster]'"
        raise InputError("--scheduler tcp://…", "needs distributed", remedy=remedy) from error
    try:
        client = Client(address, timeout=_CONNECT, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        remedy = "start one: dask scheduler --host 127.0.0.1 --port 8786"
        raise InputError(address, "must be the address of a Dask scheduler that runs", remedy=remedy) from error
    try:
        yield client
    finally:
        client.close(timeout=2)  # type: ignore[no-untyped-call]


def _check(client: Any, address: str) -> None:
    """Wait for a worker, and refuse workers of another version."""
    try:
        client.wait_for_workers(1, timeout=_CONNECT)
        versions = client.run(version)
    except (OSError, TimeoutError) as error:
        remedy = f"start some: dask worker {address} --nthreads 1"
        raise InputError(address, "must have workers", "none within 15 s", remedy) from error
    other = {worker: one for worker, one in versions.items() if one != __version__}
    if other:
        worker, one = next(iter(other.items()))
        raise InputError(f"worker {worker}", f"must have version {__version__}", one, "install the same everywhere")


def version() -> str:
    """Version of this package, where it is called."""
    return __version__


def alone(function: Callable[[Item], Result], item: Item) -> Result:
    """Call it on one thread: sums of several differ in the last bit."""
    _one_thread()
    return function(item)


@cache
def _one_thread() -> None:
    """For the rest of this process, a worker of the cluster."""
    from vibrissa.sweep.engine import single_threaded

    single_threaded()


def _flow(
    client: Any,
    function: Callable[[Item], Result],
    items: Sequence[Item],
    count: Callable[[int, Result], None],
    address: str,
) -> None:
    """Keep a few tasks for each thread in flight until all are done."""
    from concurrent.futures import CancelledError

    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    numbers: dict[str, int] = {}
    deaths = dict.fromkeys(range(len(items)), 0)
    flow = as_completed([], loop=client.loop)  # type: ignore[no-untyped-call]
    waiting = list(range(len(items)))[::-1]

    def send() -> None:
        room = _AHEAD * max(1, sum(client.nthreads().values())) - len(numbers)
        for _ in range(min(room, len(waiting))):
            number = waiting.pop()
            future = client.submit(alone, function, items[number], pure=False, retries=0)
            numbers[future.key] = number
            flow.add(future)  # type: ignore[no-untyped-call]

    try:
        send()
        while numbers:
            future = next(flow)
            number = numbers.pop(future.key)
            try:
                count(number, future.result())
            except KilledWorker as error:
                deaths[number] += 1
                if deaths[number] >= _MOST_DEATHS:
                    raise InputError("workers", "must stay alive", str(error), "is their memory full?") from error
                waiting.append(number)
            future.release()
            send()
    except (CancelledError, OSError, TimeoutError, StopIteration) as error:
        raise InputError(f"scheduler {address}", "must stay alive", "it was lost", _LOST) from error
