"""Where work is done: threads or processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from vibrissa.errors import RangeError, UnknownError
from vibrissa.sweep.stops import time_to_end
from vibrissa.sweep.threads import single_threaded

if TYPE_CHECKING:
    from vibrissa.sweep.processes import Crew

Item = TypeVar("Item")
Result = TypeVar("Result")
Tell = Callable[[int, int], None]

LOCAL = ("threads", "processes", "synchronous")
_ADDRESS = re.compile(r"(tcp|tls)://[^\s/]+:\d+|.+\.json")


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
    crew : Crew, optional
        Processes that stay; see :func:`staffed`.
    """

    scheduler: str = "processes"
    workers: int | None = None
    crew: Crew | None = None

    def __post_init__(self) -> None:
        if self.scheduler not in LOCAL and not _ADDRESS.fullmatch(self.scheduler):
            raise UnknownError(
                "scheduler", f"must be one of {', '.join(LOCAL)}, tcp://HOST:PORT or FILE.json", repr(self.scheduler)
            )
        if self.workers is not None and not 1 <= self.workers <= 10_000:
            raise RangeError("workers", "must lie between 1 and 10000", self.workers)

    @property
    def on_cluster(self) -> bool:
        """Whether the workers are processes that others have started."""
        return self.scheduler not in LOCAL

    @property
    def at_once(self) -> int:
        """How many tasks this machine does at a time."""
        return 1 if self.scheduler == "synchronous" else self.workers or os.cpu_count() or 1


@contextmanager
def staffed(engine: Engine, ahead: tuple[str, ...] | None = None) -> Iterator[Engine]:
    """Let the processes of this machine stay from one piece of work to the next.

    Parameters
    ----------
    engine : Engine
        Who does the work; one that is staffed already stays as it is.
    ahead : (str, ...), optional
        Names of modules that the processes import while this one goes on; by default they start with the first work.

    Returns
    -------
    iterator of Engine
        For ``with``, at whose end the processes end.
    """
    if engine.scheduler != "processes" or engine.at_once == 1 or engine.crew is not None:
        yield engine
        return
    from vibrissa.sweep.processes import Crew

    crew, at_once = Crew(engine.at_once, ahead or ()), True
    try:
        if ahead is not None:
            crew.hire_all()
        yield replace(engine, crew=crew)
        at_once = False
    finally:
        crew.dismiss(at_once)


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

    Returns
    -------
    list
        The results, in order.

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
        if engine.crew is None:
            with staffed(engine) as here:
                return each(function, items, here, tell)
        from vibrissa.sweep.processes import in_processes

        in_processes(function, items, count, engine.crew)
    else:
        with single_threaded():
            _here(function, items, count, engine.at_once if engine.scheduler == "threads" else 1)
    return [done[number] for number in range(len(items))]


def _here(
    function: Callable[[Item], Result], items: Sequence[Item], count: Callable[[int, Result], None], threads: int
) -> None:
    """Have each item done in this process."""
    if threads == 1:
        for number, item in enumerate(items):
            count(number, function(item))
        return
    pool = ThreadPoolExecutor(threads)
    futures = [pool.submit(function, item) for item in items]
    try:
        for number, future in enumerate(futures):
            count(number, future.result())
    except BaseException as error:
        for future in futures:
            future.cancel()
        wait(futures, time_to_end(error))
        raise
    finally:
        pool.shutdown(wait=False)
