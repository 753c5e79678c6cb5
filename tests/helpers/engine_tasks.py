"""Work that tests have engines do; of a module of its own, so that other processes find it."""

import os
import signal
import time
from pathlib import Path


def square(number):
    return number**2


def slow_square(number):
    time.sleep(0.3)
    return number**2


class UnsendableError(Exception):
    """An error that another process cannot build anew."""

    def __init__(self, one, two):
        super().__init__(f"{one} {two}")


def refuse_oddly(number):
    raise UnsendableError("refused", number)


def place(_):
    """The process that does it."""
    time.sleep(0.05)
    return os.getpid()


def refuse_three(number):
    if number == 3:
        raise ValueError("three is refused")
    return number


def die_once(item):
    """Kill the own process, the first time."""
    number, mark, _ = item
    if number == 2 and not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def die(number):
    """Kill the own process, whenever it is asked."""
    if number == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def freeze_once(item):
    """Freeze the own process, the first time."""
    number, mark, _ = item
    if number == 2 and not Path(mark).exists():
        Path(mark).write_text(str(os.getpid()))
        os.kill(os.getpid(), signal.SIGSTOP)
    return number**2


def freeze(number):
    """Freeze the own process, whenever it is asked."""
    os.kill(os.getpid(), signal.SIGSTOP)
    return number
