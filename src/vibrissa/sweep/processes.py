"""Work shared among processes of this machine, each with its own pipe.

In a pool with one queue for all, a process that dies while the pipe of that queue is full leaves the thread that fills
it waiting for a reader that is gone, and the pool waiting for that thread, for ever (``concurrent.futures`` before
CPython's gh-94777 was mended). Here the ends of a pipe take turns: a process is given a task only when its last answer
has been read, and a pipe breaks when either end dies. Processes share no thread, lock or queue.
"""

from __future__ import annotations

import os
import pickle
import signal
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from multiprocessing import connection, get_context, parent_process, resource_tracker
from multiprocessing.context import SpawnProcess
from threading import Event, RLock, Thread
from time import sleep
from typing import Any, TypeVar

from vibrissa.errors import MachineError
from vibrissa.sweep import frozen
from vibrissa.sweep.stops import without_stops
from vibrissa.sweep.threads import one_thread_each

Item = TypeVar("Item")
Result = TypeVar("Result")

_MOST_DEATHS = 3  # of processes at the same task
_PATIENCE = 5.0  # [s] in which a process that has nothing left to do may end
_GLANCE = 0.05  # [s] from one look to the next whether a process of the crew is free


class Crew:
    """Processes that stay from one piece of work to the next, and that several pieces of work share.

    Parameters
    ----------
    most : int
        Processes at once.
    modules : (str, ...)
        Names of modules that each imports before it is there.
    """

    def __init__(self, most: int, modules: tuple[str, ...] = ()) -> None:
        self.most, self.modules = most, modules
        self.processes: dict[Any, SpawnProcess] = {}  # by the pipe to each
        self.idle: list[Any] = []  # pipes to those that have nothing to do
        self.starting: list[Any] = []  # pipes to those that no one has heard of yet
        self.frozen: set[Any] = set()  # pipes to those that were given up
        self._lock = RLock()  # of the threads that do pieces of work
        self._ended = False
        self._watched = Event()  # set at the end of the thread that looks for frozen processes
        self._watcher: Thread | None = None

    def hire_all(self) -> None:
        """Start all processes, which then import beside this one."""
        while len(self.processes) < self.most:
            self.starting.append(self._hire())

    def take(self) -> tuple[Any, bool] | None:
        """Pipe to a process that is free, and whether it is there yet; None where all are at work.

        The first answer of one that is not there yet is empty: it is there.

        Returns
        -------
        (pipe, bool) or None
            To be given back, or lost.

        Raises
        ------
        KeyboardInterrupt
            If the crew has been ended.
        """
        with self._lock:
            if self._ended:
                raise KeyboardInterrupt
            if self.idle:
                return self.idle.pop(), True
            if self.starting:
                return self.starting.pop(), False
            return (self._hire(), False) if len(self.processes) < self.most else None

    def give_back(self, line: Any) -> None:
        """Let others have a process.

        Parameters
        ----------
        line : pipe
            To the process, which has nothing to do.
        """
        with self._lock:
            self.idle.append(line)

    def lose(self, line: Any) -> None:
        """Do without a process, whatever it does.

        Parameters
        ----------
        line : pipe
            To the process.
        """
        with self._lock:
            process = self.processes.pop(line)
            self.frozen.discard(line)
        line.close()
        process.kill()
        process.join(_PATIENCE)

    def end(self) -> None:
        """End all processes, from another thread than those that wait for them; these are then interrupted."""
        with self._lock:
            self._ended = True
            for process in self.processes.values():
                process.kill()

    def dismiss(self, at_once: bool = False) -> None:
        """End all processes, and wait until they have ended.

        Parameters
        ----------
        at_once : bool
            Whether those at work are killed.
        """
        self._watched.set()
        self.idle.clear()
        self.starting.clear()
        started = [process for process in self.processes.values() if process.pid is not None]
        for line in self.processes:
            line.close()
        self.processes.clear()
        if at_once:
            for process in started:
                process.kill()
        for process in started:
            process.join(_PATIENCE)
            if process.is_alive():
                process.kill()

    def _hire(self) -> Any:
        """Pipe to a new process."""
        if os.name == "posix":  # else it starts with the first process, and lets Ctrl-C through to that one
            resource_tracker.ensure_running()
        context = get_context("spawn")
        line, far = context.Pipe()
        process = context.Process(target=_serve, args=(far, self.modules), daemon=True)
        self.processes[line] = process
        with _undisturbed(), one_thread_each():
            process.start()
        far.close()
        if self._watcher is None:
            self._watcher = Thread(target=self._watch_over, daemon=True)
            self._watcher.start()
        return line

    def _watch_over(self) -> None:
        """Kill processes that have work and are frozen: their pipe breaks, and the waiting thread continues."""
        still = frozen.Stillness()
        while not self._watched.wait(frozen.LOOK):
            with self._lock:
                at_work = {
                    process.pid: line
                    for line, process in self.processes.items()
                    if process.pid is not None and line not in self.idle and line not in self.starting
                }
                for number in still.look(at_work):
                    if not _answered(at_work[number]):
                        self.frozen.add(at_work[number])
                        self.processes[at_work[number]].kill()


def in_processes(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    count: Callable[[int, Result], None],
    crew: Crew,
) -> None:
    """Have each item done in a process; where one dies, another does its item.

    Processes end with their crew, and with this process, whatever ends it.

    Parameters
    ----------
    function : callable
        Of a module, so that the processes find it. What it raises is raised here, and ends the work.
    items : sequence
        What it is called with; plain data.
    count : callable
        Called with the number of an item and its result as they come.
    crew : Crew
        The processes, of which it takes those that are free.

    Raises
    ------
    InputError
        If processes die again and again at the same item.
    """
    work = _Work(crew, function, items, count)
    try:
        work.do()
    except BaseException:
        work.leave()
        raise


class _Work:
    """What is to be done, and which task each process has."""

    def __init__(
        self, crew: Crew, function: Callable[[Any], Any], items: Sequence[Any], count: Callable[[int, Any], None]
    ) -> None:
        self.crew, self.function, self.items, self.count = crew, function, items, count
        self.waiting = list(range(len(items)))[::-1]
        self.deaths: Counter[int] = Counter()  # of processes, by the number of the task they had
        self.tasks: dict[Any, int] = {}  # number of the task, by the pipe to the process that has it

    def do(self) -> None:
        """Do all."""
        while self.waiting or self.tasks:
            while self.waiting and (taken := self.crew.take()):
                line, there = taken
                self.tasks[line] = self.waiting.pop()
                if there:
                    self._give(line, self.tasks[line])
            if not self.tasks:  # all processes are at work for others
                sleep(_GLANCE)
            for line in connection.wait(list(self.tasks), _GLANCE if self.waiting else frozen.LOOK):
                self._hear(line)
            for line in self.crew.frozen & self.tasks.keys():  # not even a kill ends it
                self._replace(line)

    def leave(self) -> None:
        """Do without those at work."""
        for line in self.tasks:
            self.crew.lose(line)

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
        number = self.tasks.pop(line)
        if worked and self.waiting:
            self._give(line, self.waiting.pop())
        else:
            self.crew.give_back(line)
        if not worked:
            raise result
        self.count(number, result)

    def _replace(self, line: Any) -> None:
        number, still = self.tasks.pop(line), line in self.crew.frozen
        self.crew.lose(line)
        self.deaths[number] += 1
        if self.deaths[number] == _MOST_DEATHS:
            what, remedy = "the death", "is the memory full? try fewer `workers`"
            if still:
                what = f"the standstill ({frozen.FROZEN:g} s without processor time)"
                remedy = "does a disk not answer? then give the same command again"
            found = f"{what} of {_MOST_DEATHS} at the same task, number {number + 1} of {len(self.items)}"
            raise MachineError("the worker processes", "must stay alive", found, remedy)
        self.waiting.append(number)


def _serve(line: Any, modules: tuple[str, ...]) -> None:
    """Do task after task, in its own process, until the other end of the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that started this one
    end_with_parent()
    for module in modules:
        import_module(module)
    with suppress(EOFError, OSError):
        line.send_bytes(b"")
        while True:
            line.send_bytes(_answer(line.recv_bytes()))


def end_with_parent() -> None:
    """Have this process end as soon as the one that started it has, whatever ended that."""

    def watch() -> None:
        parent = parent_process()
        if parent is not None:
            parent.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()


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


def _answered(line: Any) -> bool:
    """Whether something of a process waits to be read, its end too."""
    try:
        return bool(line.poll())
    except OSError:  # closed meanwhile
        return True


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let a process start whole, where a terminal's Ctrl-C does not reach it; a stop takes effect after."""
    with without_stops():
        masks = hasattr(signal, "pthread_sigmask")  # not on Windows
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()  # it inherits the mask
        try:
            yield
        finally:
            if masks:
                signal.pthread_sigmask(signal.SIG_SETMASK, mask)
