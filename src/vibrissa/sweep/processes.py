"""Work shared among processes of this machine, each with its own pipe.

In a pool with one queue for all, a process that dies while the pipe of that queue is full leaves the thread that fills
it waiting for a reader that is gone, and the pool waiting for that thread, for ever (``concurrent.futures`` before
CPython's gh-94777 was mended). Here the ends of a pipe take turns: a process is given a task only when its last answer
has been read, and a pipe breaks when either end dies. No thread, lock or queue is shared.
"""

from __future__ import annotations

import os
import pickle
import signal
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import connection, get_context, parent_process, resource_tracker
from multiprocessing.context import SpawnProcess
from threading import Thread, current_thread, main_thread
from typing import Any, TypeVar

from vibrissa.errors import MachineError
from vibrissa.sweep.threads import one_thread_each

Item = TypeVar("Item")
Result = TypeVar("Result")

_MOST_DEATHS = 3  # of processes at the same task
_PATIENCE = 5.0  # [s] in which a process that has nothing left to do may end


class Crew:
    """Processes that stay from one piece of work to the next: each imports what it needs once."""

    def __init__(self) -> None:
        self.idle: list[Any] = []  # pipes to the processes that have nothing to do
        self.processes: list[SpawnProcess] = []

    def hire(self) -> Any:
        """Pipe to a new process, whose first answer is empty: it is there."""
        if os.name == "posix":  # else it starts with the first process, and lets Ctrl-C through to that one
            resource_tracker.ensure_running()
        context = get_context("spawn")
        line, far = context.Pipe()
        process = context.Process(target=_serve, args=(far,), daemon=True)
        self.processes.append(process)
        with _undisturbed(), one_thread_each():
            process.start()
        far.close()
        return line

    def dismiss(self, at_once: bool = False) -> None:
        """End all processes, and wait until they have ended.

        Parameters
        ----------
        at_once : bool
            Whether those at work are killed.
        """
        while self.idle:
            self.idle.pop().close()
        started = [process for process in self.processes if process.pid is not None]
        self.processes.clear()
        if at_once:
            for process in started:
                process.kill()
        for process in started:
            process.join(_PATIENCE)
            if process.is_alive():
                process.kill()


def in_processes(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    workers: int,
    count: Callable[[int, Result], None],
    crew: Crew | None = None,
) -> None:
    """Have each item done in a process; where one dies, a new one does its item.

    The processes end with the work, or with their crew, and with this process, whatever ends it.

    Parameters
    ----------
    function : callable
        Of a module, so that the processes find it. What it raises is raised here, and ends the work.
    items : sequence
        What it is called with; plain data.
    workers : int
        How many processes.
    count : callable
        Called with the number of an item and its result as they come.
    crew : Crew, optional
        Processes that are there already, and stay.

    Raises
    ------
    InputError
        If processes die again and again at the same item.
    """
    own = crew or Crew()
    work = _Work(own, function, items, count)
    try:
        work.do(workers)
    except BaseException:
        work.leave()
        own.dismiss(at_once=True)
        raise
    if crew is None:
        own.dismiss()


class _Work:
    """What is to be done, and which task each process has."""

    def __init__(
        self, crew: Crew, function: Callable[[Any], Any], items: Sequence[Any], count: Callable[[int, Any], None]
    ) -> None:
        self.crew, self.function, self.items, self.count = crew, function, items, count
        self.waiting = list(range(len(items)))[::-1]
        self.deaths: Counter[int] = Counter()  # of processes, by the number of the task they had
        self.tasks: dict[Any, int] = {}  # number of the task, by the pipe to the process that has it

    def do(self, workers: int) -> None:
        """Do all."""
        for _ in range(min(workers, len(self.items))):
            if self.crew.idle:
                self._give(self.crew.idle.pop(), self.waiting.pop())
            else:
                self.tasks[self.crew.hire()] = self.waiting.pop()
        while self.tasks:
            for line in connection.wait(list(self.tasks)):
                self._hear(line)

    def leave(self) -> None:
        """Close the pipes to those at work."""
        for line in self.tasks:
            line.close()

    def _give(self, line: Any, number: int) -> None:
        self.tasks[line] = number
        with suppress(BrokenPipeError, ConnectionResetError):  # it died: the pipe will say so
            line.send_bytes(pickle.dumps((self.function, self.items[number])))

    def _hear(self, line: Any) -> None:
        """Take what a process answers, and give it the next task; where it died, have another do its task."""
        answer = None
        with suppress(EOFError, OSError):
            answer = line.recv_bytes()
        if answer is None:
            self._replace(line)
            return
        if not answer:  # the process is there
            self._give(line, self.tasks[line])
            return
        worked, result = pickle.loads(answer)
        if not worked:
            raise result
        self.count(self.tasks.pop(line), result)
        if self.waiting:
            self._give(line, self.waiting.pop())
        else:
            self.crew.idle.append(line)

    def _replace(self, line: Any) -> None:
        line.close()
        number = self.tasks.pop(line)
        self.deaths[number] += 1
        if self.deaths[number] == _MOST_DEATHS:
            found = f"the death of {_MOST_DEATHS} at the same task, number {number + 1} of {len(self.items)}"
            raise MachineError(
                "the worker processes", "must stay alive", found, "is the memory full? try fewer `workers`"
            )
        self.tasks[self.crew.hire()] = number


def _serve(line: Any) -> None:
    """Do task after task, in its own process, until the other end of the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that started this one
    Thread(target=_watch, daemon=True).start()
    with suppress(EOFError, OSError):
        line.send_bytes(b"")
        while True:
            line.send_bytes(_answer(line.recv_bytes()))


def _watch() -> None:
    """Do not outlive the process that started this one."""
    parent = parent_process()
    if parent is not None:
        parent.join()
    os._exit(1)


def _answer(task: bytes) -> bytes:
    """(True, result), or (False, error)."""
    try:
        function, item = pickle.loads(task)
        return pickle.dumps((True, function(item)))
    except Exception as error:
        error.add_note(f"In a process of vibrissa:\n{traceback.format_exc()}")
        with suppress(Exception):
            answer = pickle.dumps((False, error))
            pickle.loads(answer)
            return answer
        return pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}")))


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let a process start whole, where a terminal's Ctrl-C does not reach it; a stop takes effect after."""
    heard: list[int] = []
    stops = (signal.SIGINT, signal.SIGTERM) if current_thread() is main_thread() else ()
    handlers = {stop: handler for stop in stops if callable(handler := signal.getsignal(stop))}
    for stop in handlers:
        signal.signal(stop, lambda number, _: heard.append(number))
    masks = hasattr(signal, "pthread_sigmask")  # not on Windows
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()  # the new process inherits it
    try:
        yield
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for stop, handler in handlers.items():
            signal.signal(stop, handler)
        if heard:
            signal.raise_signal(heard[0])
