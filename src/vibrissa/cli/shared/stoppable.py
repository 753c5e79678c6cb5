"""A verb that is stopped, by Ctrl-C, a batch system or a terminal that is closed, ends in one line and in time."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Timer, current_thread, main_thread
from time import monotonic
from typing import NoReturn

from vibrissa.cli.shared.display.output import tell
from vibrissa.sweep.stops import STOPS

LONGEST = 20.0  # [s] from the signal to the end of this process, whatever hangs
KEPT = "finished work is kept in"  # as a run that can be continued says
HEARD = 2.0  # [s] in which a child has ended, or is killed


@contextmanager
def stoppable(out: Path | None = None) -> Iterator[None]:
    """End this process cleanly at a signal to stop, and print how to continue, if it can be continued.

    The first signal interrupts the work, which removes what it has not ended; those that follow change nothing. A
    signal that this process was started to ignore, as under ``nohup``, stays ignored. The exit code is 128 and the
    number of the signal.

    Parameters
    ----------
    out : Path, optional
        Folder of the results of a run that can be continued.

    Returns
    -------
    iterator of None
        For ``with``.
    """
    stop, before = _Stop(out), {}
    try:
        for number in STOPS if current_thread() is main_thread() else ():
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop.hear)
        yield
    except BaseException as error:
        # libraries turn an interruption into errors; a page that closes at one has ended well
        closed = isinstance(error, SystemExit) and not error.code
        if closed or not (stop.number or isinstance(error, KeyboardInterrupt)):
            raise
        if out is None:
            stop.leave()
        stop.end()
    finally:
        for number, handler in before.items() if not stop.number else ():  # the end of Python is not disturbed either
            signal.signal(number, handler)


def _end_children() -> None:
    """End the processes that libraries have started; one that was forked a moment ago may not have heard it."""
    from multiprocessing import active_children

    children, until = active_children(), monotonic() + HEARD
    for child in children:
        child.terminate()
    for child in children:
        child.join(max(0.0, until - monotonic()))
        if child.is_alive():
            child.kill()


class _Stop:
    """One stop, from its signal to the end of this process."""

    def __init__(self, out: Path | None) -> None:
        self.out, self.number, self.said = out, 0, False
        self.process = os.getpid()

    @property
    def code(self) -> int:
        return 128 + (self.number or signal.SIGINT)

    def hear(self, number: int, _: object) -> None:
        """Interrupt the work, the first time; a process that a library has forked from this one just ends."""
        if os.getpid() != self.process:
            os._exit(128 + number)
        if self.number:
            return
        self.number = number
        limit = Timer(LONGEST, self.end)
        limit.daemon = True
        limit.start()
        raise KeyboardInterrupt

    def leave(self) -> NoReturn:
        """Say it, end the processes that libraries have started, and let Python end."""
        self._say()
        _end_children()
        for number in STOPS if self.number else ():  # at its end Python forgets who hears them
            signal.signal(number, signal.SIG_IGN)
        sys.exit(self.code)

    def end(self) -> NoReturn:
        """Say it, and end without waiting for threads: one that computes, or reads from a lost disk, would hold it."""
        self._say()
        os._exit(self.code)

    def _say(self) -> None:
        if self.said:
            return
        self.said = True
        kept = f"; {KEPT} {self.out}, and the same command continues from there" if self.out else ""
        with suppress(OSError):  # of a terminal that is closed
            tell(f"stopped{kept or ' before its end'}")
            sys.stdout.flush()
