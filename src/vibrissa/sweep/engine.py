"""Where work is done: threads or processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

from vibrissa.errors import InputError

Item = TypeVar("Item")
Result = TypeVar("Result")
Tell = Callable[[int, int], None]

LOCAL = ("threads", "processes", "synchronous")
_ADDRESS = re.compile(r"(tcp|tls)://[^\s/]+:\d+|.+\.json")
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_MOST_BREAKS = 3  # of a pool in which nothing was done between


@dataclass(frozen=True, kw_only=True)
class Engine:
    """Who does the work; the results are the same.

    Attributes
    ----------
    scheduler : str
        ``threads``, ``processes`` or ``synchronous`` (one after the other, in this process) of this machine; or the
        address of a Dask scheduler, ``tcp://HOST:PORT``, or the file with its address that
        ``dask scheduler --scheduler-file FILE.json`` writes.
    workers : int, optional
        Threads or processes of this machine; one per core by default. A cluster has its own.
    """

    scheduler: str = "processes"
    workers: int | None = None

    def __post_init__(self) -> None:
        if self.scheduler not in LOCAL and not _ADDRESS.fullmatch(self.scheduler):
            raise InputError(
                "scheduler", f"must be one of {', '.join(LOCAL)}, tcp://HOST:PORT or FILE.json", repr(self.scheduler)
            )
        if self.workers is not None and not 1 <= self.workers <= 10_000:
            raise InputError("workers", "must lie between 1 and 10000", self.workers)

    @property
    def on_cluster(self) -> bool:
        """Whether the workers are processes that others have started."""
        return self.scheduler not in LOCAL

    @property
    def at_once(self) -> int:
        """How many tasks this machine does at a time."""
        return 1 if self.scheduler == "synchronous" else self.workers or os.cpu_count() or 1


def each(
    function: Callable[[Item], Result], items: Sequence[Item], engine: Engine, tell: Tell | None = None
) -> list[Result]:
    """Call a pure function with each item; the results, in order.

    Parameters
    ----------
    function : callable
        Of a module, so that other processes find it. What it raises is raised here, and ends the work.
    items : sequence
        What it is called with; plain data, some half a second of work each.
    engine : Engine
        Who does it.
    tell : callable, optional
        Called with (done, all) after each.

    Raises
    ------
    InputError
        If the scheduler is not there, is lost, has no workers or others than this version's, or if workers die again
        and again.
    """
    done: dict[int, Result] = {}

    def count(number: int, result: Result) -> None:
        done[number] = result
        if tell is not None:
            tell(len(done), len(items))

    if engine.on_cluster:
        from vibrissa.sweep.cluster import on_cluster

        on_cluster(function, items, engine.scheduler, count)
    elif engine.scheduler == "processes" and engine.at_once > 1 and len(items) > 1:
        _in_processes(function, items, engine.at_once, done, count)
    else:
        scheduler = "threads" if engine.scheduler == "threads" and engine.at_once > 1 else "synchronous"
        with single_threaded():
            _by_dask(function, dict(enumerate(items)), count, scheduler=scheduler, num_workers=engine.at_once)
    return [done[number] for number in range(len(items))]


def _by_dask(
    function: Callable[[Item], Result], items: dict[int, Item], count: Callable[[int, Result], None], **how: Any
) -> None:
    """Let one of Dask's schedulers of this machine do them."""
    from dask.base import compute
    from dask.callbacks import Callback
    from dask.delayed import delayed

    tasks = {number: delayed(function)(item) for number, item in items.items()}
    numbers = {task.key: number for number, task in tasks.items()}

    def told(key: str, result: Result, *_: object) -> None:
        count(numbers[key], result)

    with Callback(posttask=told):  # type: ignore[no-untyped-call]
        compute(*tasks.values(), **how)  # type: ignore[no-untyped-call]


def _in_processes(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    workers: int,
    done: dict[int, Result],
    count: Callable[[int, Result], None],
) -> None:
    """Do them in processes; where one was killed, go on with new ones."""
    from concurrent.futures.process import BrokenProcessPool

    breaks, before = 0, -1
    while len(done) < len(items):
        breaks, before = (0 if len(done) > before else breaks), len(done)
        left = {number: item for number, item in enumerate(items) if number not in done}
        try:
            with _pool(min(workers, len(left))) as pool:
                _by_dask(function, left, count, scheduler="processes", pool=pool, chunksize=1)
        except BrokenProcessPool as error:
            breaks += 1
            if breaks >= _MOST_BREAKS:
                raise InputError(
                    "the worker processes",
                    "must stay alive",
                    f"they were killed {breaks} times in a row, {len(left)} tasks left",
                    "is the memory full? try fewer --workers",
                ) from error


@contextmanager
def _pool(workers: int) -> Iterator[Any]:
    """Processes of one thread each, which end with this one, whatever ends it."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    class Deaf(ProcessPoolExecutor):
        """Starts processes, as work comes, that a terminal's Ctrl-C does not reach even while they start."""

        def submit(self, *words: Any, **named: Any) -> Any:
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                return super().submit(*words, **named)
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)

    strangers = set(multiprocessing.active_children())
    with one_thread():
        context = multiprocessing.get_context("spawn")
        pool = Deaf(workers, mp_context=context, initializer=_begin)
        try:
            yield pool
        except BaseException:
            for child in set(multiprocessing.active_children()) - strangers:
                child.kill()
            raise
        finally:
            pool.shutdown(cancel_futures=True)


def _begin() -> None:
    """In a worker: leave Ctrl-C to the process that started it, and do not outlive that one."""
    import multiprocessing
    import threading

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def single_threaded() -> Any:
    """Limit this process to one thread of each library: sums of several differ in the last bit; undone by ``with``."""
    import scipy.linalg  # noqa: F401 (its BLAS is another than NumPy's, and is only limited once it is there)
    from threadpoolctl import threadpool_limits

    return threadpool_limits(1)


@contextmanager
def one_thread() -> Iterator[None]:
    """Let processes that start now use one thread each: sums of several differ in the last bit."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
