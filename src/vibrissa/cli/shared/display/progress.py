"""Progress on stderr: bars on a terminal, elsewhere a line when a stage starts and every half minute of it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Lock, RLock, Timer, get_ident, main_thread
from time import perf_counter
from typing import TYPE_CHECKING, Any

from vibrissa.cli.shared.display.output import tell

if TYPE_CHECKING:
    from vibrissa.quantities.kinds import Progress

COMPILING = "compiling, in a first run only"
PATIENCE = 1.0  # [s]
BETWEEN = 30.0  # [s] at least, from one line of a stage to its next
_FEWEST, _STAGE = 60, 30  # columns of a terminal on which the bar itself is shown; of the name of a stage


@contextmanager
def progress_bars(whole: bool = False) -> Iterator[Progress]:
    """Report stages on stderr: each has a bar on a terminal; elsewhere a line when it starts.

    A stage whose number of parts is known has a line every half minute too. Work that ends within a second has no
    lines, unless the ``whole`` of its stages is wanted.

    Parameters
    ----------
    whole : bool
        Whether short work has lines too.

    Returns
    -------
    iterator of callable
        Takes (stage, done, total).
    """
    from rich.console import Console

    console = Console(file=sys.stderr)  # this stream itself: what the code of a stage prints does not reach it
    with _bars(console) if console.is_terminal else _lines(whole) as progress, _compiling(progress):
        yield progress


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Report work of one stage whose length is not known.

    Parameters
    ----------
    name : str
        The stage.

    Returns
    -------
    iterator of None
        For ``with``.
    """
    with progress_bars() as progress:
        progress(name, 0, 0)
        yield


@contextmanager
def _compiling(progress: Progress) -> Iterator[None]:
    """Report the loops that Numba compiles: those of a first run after installing, which then takes longer."""
    from numba.core.event import Listener, install_listener

    class Compiled(Listener):
        count = 0

        def on_start(self, event: Any) -> None:
            progress(COMPILING, self.count, 0)

        def on_end(self, event: Any) -> None:
            self.count += 1
            progress(COMPILING, self.count, 0)

    with install_listener("numba:compile", Compiled()):
        yield


@contextmanager
def _lines(whole: bool) -> Iterator[Progress]:
    """A line when a stage starts and now and then; those of the first second wait, so that a refusal is one line."""
    begin, latest, held, printed, lock = perf_counter(), dict[str, float](), list[str](), Event(), RLock()

    def release() -> None:
        printed.set()
        with lock:  # of the timer's thread and of those that report
            while held:
                tell(held.pop(0))

    def report(stage: str, done: int, total: int) -> None:
        with lock:
            now = perf_counter()
            if stage not in latest or (total and now - latest[stage] >= BETWEEN):
                latest[stage] = now
                count = f" ({done} of {total})" if total else ""
                held.append(f"{_clock(now - begin)} {stage}{count}")
                if printed.is_set():
                    release()

    watch = Timer(PATIENCE, release)
    watch.daemon = True
    watch.start()
    try:
        yield report
    finally:
        watch.cancel()
    if whole:
        release()


@contextmanager
def _bars(console: Any) -> Iterator[Progress]:
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = [
        TextColumn(f"{{task.description:<{_STAGE}}}"),
        TextColumn("{task.fields[count]:>9}"),
        TimeElapsedColumn(),
    ]
    if console.width >= _FEWEST:
        columns.insert(1, BarColumn(bar_width=None))
    with Progress(*columns, console=console, expand=True) as bars:
        stages: dict[str, Any] = {}
        latest: dict[int | None, Any] = {}  # stage of each thread
        lock = Lock()

        def end(task: Any) -> None:
            whole = bars.tasks[task].completed or 1
            bars.update(task, total=whole, completed=whole)

        def begin(stage: str) -> Any:
            """Begin a stage; that of this thread ends, and that of the main one, which waits while others work."""
            if stage != COMPILING:  # which is part of another
                for thread in (get_ident(), main_thread().ident):
                    if thread in latest:
                        end(latest.pop(thread))
            task = bars.add_task(stage, total=None, count="")
            if stage != COMPILING:
                latest[get_ident()] = task
            return task

        def report(stage: str, done: int, total: int) -> None:
            with lock:
                if stage not in stages:
                    stages[stage] = begin(stage)
                count = f"{done}/{total}" if total else f"{done}" if done else ""
                bars.update(stages[stage], completed=done, total=total or None, count=count)

        yield report
        for task in stages.values():
            end(task)


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 3600}:{int(seconds) // 60 % 60:02}:{int(seconds) % 60:02}"
