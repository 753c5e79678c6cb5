"""A run that is stopped, by Ctrl-C, a batch system or a terminal that is closed, ends in one line and in time."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Timer
from typing import NoReturn

from vibrissa.cli.shared.output import tell
from vibrissa.sweep.stops import STOPS

LONGEST = 20.0  # [s] from the signal to the end of this process, whatever hangs


@contextmanager
def stoppable(out: Path) -> Iterator[None]:
    """End this process cleanly at a signal to stop, and print how to continue.

    The first signal interrupts the work, which removes what it has not ended; those that follow change nothing. A
    signal that this process was started to ignore, as under ``nohup``, stays ignored. The exit code is 128 and the
    number of the signal.

    Parameters
    ----------
    out : Path
        Folder of the results.

    Returns
    -------
    iterator of None
        For ``with``.
    """
    stop, before = _Stop(out), {}
    try:
        for number in STOPS:
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop.hear)
        yield
    except KeyboardInterrupt:
        stop.end()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Stop:
    """One stop, from its signal to the end of this process."""

    def __init__(self, out: Path) -> None:
        self.out, self.number = out, 0

    def hear(self, number: int, _: object) -> None:
        """Interrupt the work, the first time."""
        if self.number:
            return
        self.number = number
        limit = Timer(LONGEST, self.end)
        limit.daemon = True
        limit.start()
        raise KeyboardInterrupt

    def end(self) -> NoReturn:
        """Say it, and end without waiting for threads: one that computes, or reads from a lost disk, would hold it."""
        with suppress(OSError):  # of a terminal that is closed
            tell(f"stopped; what is done is kept in {self.out}, and the same command goes on from there")
            sys.stdout.flush()
        os._exit(128 + (self.number or signal.SIGINT))
