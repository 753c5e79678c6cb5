"""Work on the workers of a Dask cluster, through its scheduler."""

from __future__ import annotations

import asyncio
import json
import logging
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from vibrissa import __version__
from vibrissa.errors import FormatError, InputError, MachineError, PackageError, UnknownError, install

Item = TypeVar("Item")
Result = TypeVar("Result")

CONNECT = 15.0  # [s] to wait for the scheduler
WORKERS = 60.0  # [s] to wait for a worker where there is none
_LOOK = 2.0  # [s] between looks at who is there
_AHEAD = 4  # tasks in flight for each thread of the workers
_MOST_KILLS = 3  # times that a task is given up by the scheduler, each after the death of several workers
_START = "start one: dask scheduler --host 127.0.0.1 --port 8786"
_LOST = "start it and its workers again, and give the same command again: what a study has done is kept"


def on_cluster(
    function: Callable[[Item], Result], items: Sequence[Item], scheduler: str, count: Callable[[int, Result], None]
) -> None:
    """Have each item done by the cluster; ``count`` is called with number and result as they come.

    A task whose worker dies is done by another. Only a few tasks are in flight at a time, so that a stop is quick.

    Parameters
    ----------
    function : callable
        Of a module, so that the workers find it.
    items : sequence
        What it is called with; plain data.
    scheduler : str
        Address of the scheduler, or the file that holds it.
    count : callable
        Called with the number of an item and its result.

    Raises
    ------
    InputError
        See :func:`vibrissa.sweep.engine.each`.
    """
    if not items:
        return
    with _client(scheduler) as client:
        _check(client, scheduler)
        _Flow(client, function, items, count, scheduler).run()


@contextmanager
def _client(scheduler: str) -> Iterator[Any]:
    try:
        from distributed import Client
    except ImportError as error:
        raise PackageError("scheduler", "needs distributed", remedy=install("cluster")) from error
    with _quiet():
        address = _reached(scheduler)
        try:
            client = Client(address, timeout=CONNECT, set_as_default=False)  # type: ignore[no-untyped-call]
        except (OSError, ValueError) as error:
            raise FormatError(scheduler, "must be the address of a Dask scheduler", remedy=_START) from error
        try:
            yield client
        finally:
            client.close(timeout=2)  # type: ignore[no-untyped-call]


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the lines and tracebacks that distributed logs of connections lost: one line will say it."""
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in ("distributed", "tornado")]
    loggers = [logging.getLogger(name) for name in names]
    before = [logger.level for logger in loggers]
    try:
        for logger in loggers:
            logger.setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def _reached(scheduler: str) -> str:
    """Address of the scheduler, as soon as it answers as one: ``Client`` would wait for anything else for ever.

    Raises
    ------
    InputError
        If none answers in time.
    """
    end = time.monotonic() + CONNECT
    while True:
        try:
            address = _address(scheduler)
            with ThreadPoolExecutor(1) as apart:  # a notebook has an event loop in this thread
                apart.submit(asyncio.run, _answer_of_scheduler(address)).result()
        except Exception as error:  # what listens there may answer anything
            if time.monotonic() > end:
                kind = "scheduler file" if scheduler.endswith(".json") else "address"
                raise FormatError(
                    scheduler, f"must be the {kind} of a Dask scheduler that runs", None, _START
                ) from error
        else:
            return address
        time.sleep(0.2)


async def _answer_of_scheduler(address: str) -> None:
    """Ask what listens there who it is.

    Raises
    ------
    OSError
        If it is no scheduler; and whatever comes of bytes that are no message of Dask.
    """
    from distributed.core import rpc
    from distributed.security import Security

    secrets = Security().get_connection_args("client")  # type: ignore[no-untyped-call]
    there = rpc(address, connection_args=secrets)  # type: ignore[no-untyped-call]
    async with asyncio.timeout(CONNECT), there:
        found = (await there.identity()).get("type")
    if found != "Scheduler":
        raise OSError(f"a {found} answers")


def _address(scheduler: str) -> str:
    """The address that is given, or written in the file that ``dask scheduler --scheduler-file`` writes."""
    if not scheduler.endswith(".json"):
        return scheduler
    content = json.loads(Path(scheduler).read_text(encoding="utf-8"))
    if not isinstance(content, dict) or not isinstance(content.get("address"), str):
        raise ValueError("no address")
    return str(content["address"])


def _check(client: Any, scheduler: str) -> None:
    """Wait for a worker, and refuse workers of another version."""
    try:
        client.wait_for_workers(1, timeout=WORKERS)
    except TimeoutError as error:
        raise _deserted(scheduler) from error
    except OSError as error:
        raise _lost(scheduler) from error
    try:
        versions = client.run(version, on_error="return", callback_timeout=WORKERS)
    except TimeoutError:  # one is frozen; each is asked again with its tasks
        return
    except OSError as error:
        raise _lost(scheduler) from error
    for worker, one in versions.items():
        if isinstance(one, OSError):  # died meanwhile
            continue
        if one != __version__:
            raise _stranger(worker, one)


def _deserted(scheduler: str) -> InputError:
    how = f"--scheduler-file {scheduler}" if scheduler.endswith(".json") else scheduler
    return InputError(
        scheduler, "must have workers", f"none within {WORKERS:g} s", f"start some: dask worker {how} --nthreads 1"
    )


def _lost(scheduler: str) -> InputError:
    return MachineError(f"scheduler {scheduler}", "must stay alive", "it was lost", _LOST)


def _stranger(worker: str, found: object) -> InputError:
    return UnknownError(f"worker {worker}", f"must have vibrissa {__version__}", found, "install the same everywhere")


def version() -> str:
    """Version of this package, where it is called."""
    return __version__


def alone(function: Callable[[Item], Result], item: Item, wanted: str) -> Result:
    """Call it on one thread, for sums of several differ in the last bit; refused by a worker of another version.

    Parameters
    ----------
    function : callable
        What is called.
    item : object
        With what.
    wanted : str
        Version of Vibrissa that asks.

    Returns
    -------
    object
        The result.

    Raises
    ------
    InputError
        If this worker has another version.
    """
    if wanted != __version__:
        raise _stranger(f"on {socket.gethostname()}", __version__)
    import dask

    _one_thread()
    with dask.config.set(scheduler="synchronous"):  # else xarray writes files under a lock of the whole cluster
        return function(item)


@cache
def _one_thread() -> None:
    """For the rest of this process, a worker of the cluster."""
    from vibrissa.sweep.threads import single_threaded

    single_threaded()


class _Flow:
    """A few tasks for each thread in flight, until all are done."""

    def __init__(
        self,
        client: Any,
        function: Callable[[Any], Result],
        items: Sequence[Any],
        count: Callable[[int, Result], None],
        scheduler: str,
    ) -> None:
        self.client, self.function, self.items, self.count, self.scheduler = client, function, items, count, scheduler
        self.waiting = list(range(len(items)))[::-1]
        self.numbers: dict[str, int] = {}  # of the tasks in flight, by key
        self.kills = dict.fromkeys(range(len(items)), 0)
        self.ended: SimpleQueue[Any] = SimpleQueue()
        self.threads, self.looked, self.seen = 1, -_LOOK, time.monotonic()

    def run(self) -> None:
        """Do all."""
        from concurrent.futures import CancelledError

        from distributed.comm.core import CommClosedError

        try:
            while self.waiting or self.numbers:
                self._look()
                self._send()
                try:
                    self._take(self.ended.get(timeout=_LOOK))
                except Empty:
                    continue
        except (CancelledError, CommClosedError) as error:
            raise _lost(self.scheduler) from error
        except OSError as error:
            if self.client.status == "running":  # it is the task's own
                raise
            raise _lost(self.scheduler) from error

    def _look(self) -> None:
        """Count the threads of the workers, now and then."""
        now = time.monotonic()
        if now - self.looked < _LOOK:
            return
        try:
            threads = self.client.nthreads(callback_timeout=WORKERS)
            self.threads, self.looked = sum(threads.values()), now
        except OSError as error:
            raise _lost(self.scheduler) from error
        if self.threads:
            self.seen = now
        elif now - self.seen > WORKERS:
            raise _deserted(self.scheduler)

    def _send(self) -> None:
        room = _AHEAD * max(1, self.threads) - len(self.numbers)
        for _ in range(min(room, len(self.waiting))):
            number = self.waiting.pop()
            future = self.client.submit(alone, self.function, self.items[number], __version__, pure=False, retries=0)
            self.numbers[future.key] = number
            future.add_done_callback(self.ended.put)

    def _take(self, future: Any) -> None:
        from distributed.scheduler import KilledWorker

        number = self.numbers.pop(future.key)
        try:
            result = future.result()
        except KilledWorker as error:
            self.kills[number] += 1
            if self.kills[number] >= _MOST_KILLS:
                rule, remedy = "must stay alive", "is their memory full?"
                found = f"the death of several at the same task, number {number + 1}, {_MOST_KILLS} times"
                raise MachineError("workers", rule, found, remedy) from error
            self.waiting.append(number)
        else:
            self.count(number, result)
        future.release()
