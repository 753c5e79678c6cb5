"""Scans of the whole whisker: asked of a process apart, which reports its progress; the last ones are kept."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from vibrissa.errors import MachineError

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from vibrissa.page.whole.job import WholeJob


KEPT = 12  # scans
PATIENCE, GLANCE = 0.15, 0.01  # [s] that one question waits, and between two looks whether another one does
FORGOTTEN = 0.4  # [s] after which a scan that nobody asks for any longer makes room for another
SILENT = 300.0  # [s] without a word after which the process is given up; the first scan of an installation compiles


def serve_rod(line: Connection) -> None:
    """Compute the whole whisker in a process of its own; the rod is loaded there alone.

    Parameters
    ----------
    line : Connection
        See :func:`vibrissa.page.whole.worker.serve`.
    """
    from vibrissa.page.whole.worker import serve

    serve(line)


class WholeRuns:
    """The process that computes the whole whisker; it is started with the first scan, and ends when none is asked."""

    def __init__(self) -> None:
        self._kept: dict[WholeJob, Any] = {}  # scans, datasets and errors
        self._process: Any = None
        self._line: Connection | None = None
        self._number = 0
        self._running: WholeJob | None = None
        self._share = self._asked = self._heard = 0.0

    def get(self, jobs: Sequence[WholeJob], hurried: Callable[[], bool]) -> list[Any] | float:
        """Scans, if they are there; they are computed one after the other, while somebody asks for them.

        Parameters
        ----------
        jobs : sequence of WholeJob
            What is wanted.
        hurried : callable
            Whether another question waits.

        Returns
        -------
        list or float
            The scans, or the share of them that is done.

        Raises
        ------
        InputError, ConvergenceError
            If one of them cannot be computed.
        """
        stop = time.monotonic() + PATIENCE
        while missing := [job for job in jobs if job not in self._kept]:
            self._go_on(missing)
            if time.monotonic() > stop or hurried():
                share = self._share if self._running in missing else 0.0
                return (len(jobs) - len([job for job in jobs if job not in self._kept]) + share) / len(jobs)
        return [self._taken(job) for job in jobs]

    def wait(self, job: WholeJob) -> Any:
        """One scan, however long it takes.

        Parameters
        ----------
        job : WholeJob
            What is wanted.

        Returns
        -------
        WholeScan or Dataset
            It.

        Raises
        ------
        InputError, ConvergenceError
            As of :meth:`get`.
        """
        while isinstance(found := self.get([job], lambda: False), float):
            pass
        return found[0]

    def end(self) -> None:
        """End the process, whatever it does."""
        if self._line is not None:
            self._line.close()
            self._process.kill()
            self._process.join(1.0)
        self._line = self._process = self._running = None
        self._share = 0.0

    def _taken(self, job: WholeJob) -> Any:
        found = self._kept[job] = self._kept.pop(job)  # the last one asked for is the last one dropped
        if isinstance(found, Exception):
            raise found
        return found

    def _go_on(self, missing: Sequence[WholeJob]) -> None:
        """Ask for the first that is missing, unless another is wanted still; hear what the process says."""
        now = time.monotonic()
        if self._running in missing:
            self._asked = now
        elif self._running is None or now - self._asked > FORGOTTEN:
            self._send(missing[0])
        try:
            if self._line is not None and self._line.poll(GLANCE):
                self._heard = now
                self._hear(*self._line.recv())
            elif now - self._heard > SILENT:
                raise EOFError
        except (EOFError, OSError) as error:
            self.end()
            remedy = "move a slider to start it again"
            raise MachineError("the process that computes the whole whisker", "has ended", remedy=remedy) from error

    def _send(self, job: WholeJob) -> None:
        if self._process is None or not self._process.is_alive():
            self.end()
            self._start()
        self._number, self._running, self._share = self._number + 1, job, 0.0
        self._asked = self._heard = time.monotonic()
        if self._line is not None:
            self._line.send((self._number, job))

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._line, far = context.Pipe()
        self._process = context.Process(target=serve_rod, args=(far,), daemon=True)
        self._process.start()
        far.close()

    def _hear(self, number: int, said: Any) -> None:
        if number != self._number or self._running is None:
            return  # of a scan that was given up
        if isinstance(said, float):
            self._share = said
            return
        self._kept[self._running] = said
        self._running, self._share = None, 0.0
        while len(self._kept) > KEPT:
            del self._kept[next(iter(self._kept))]
