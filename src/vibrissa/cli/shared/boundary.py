"""The boundary of a command: whatever goes wrong behind it is one line on stderr, and an exit code."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from vibrissa.cli.shared.display.output import tell
from vibrissa.errors import ConvergenceError

DEBUG = "--debug"
REFUSED, UNFORESEEN, INTERRUPTED = 2, 1, 130  # exit codes: bad input or a machine that refuses; a fault; Control-C
_CALLS = 3  # innermost calls of a fault that are named


@contextmanager
def one_line_for_all(debug: bool) -> Iterator[None]:
    """Turn what no verb foresees into one line: no memory, a full disk, a fault of the package itself.

    Parameters
    ----------
    debug : bool
        Let the error through, so that Python shows where it arose.

    Returns
    -------
    iterator of None
        Once.
    """
    try:
        yield
        sys.stdout.flush()  # a full disk behind it is found here, not after the end
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except BrokenPipeError:  # the reader of our output has closed it
        _close_output()
        sys.exit(1)
    except Exception as error:
        if debug:
            raise
        if isinstance(error, OSError):
            _close_output()
        line, code = explained(error)
        tell(line)
        sys.exit(code)


def explained(error: Exception) -> tuple[str, int]:
    """The line for an error that no verb foresees, and the exit code.

    Parameters
    ----------
    error : Exception
        As it was raised.

    Returns
    -------
    str
        One line.
    int
        2 where the machine refuses, 1 for a fault of the package.
    """
    why = " ".join(str(error).split())
    if isinstance(error, ConvergenceError):
        return why, REFUSED
    if isinstance(error, MemoryError):
        return f"there is too little memory for this{f': {why}' if why else ''}; take less at once", REFUSED
    if isinstance(error, RecursionError):
        return "an input is nested too deeply to be read", REFUSED
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}the system refuses: {error.strerror or why}", REFUSED
    what = f"{type(error).__name__}{f', {why}' if why else ''}"
    where = f"at {_place(error)}"
    return f"a fault of vibrissa: {what} {where}; {DEBUG} shows all of it, `vibrissa info` what to report", UNFORESEEN


def _place(error: Exception) -> str:
    """File and line where an error arose, and what called it."""
    places, step = [], error.__traceback__
    while step is not None:
        places.append(f"{os.path.basename(step.tb_frame.f_code.co_filename)}:{step.tb_lineno}")
        step = step.tb_next
    return " < ".join(reversed(places[-_CALLS:]))


def _close_output() -> None:
    """Leave nothing for Python to write at its end, where it would complain of the same once more."""
    with suppress(OSError, ValueError, AttributeError):  # an output without a descriptor, as in tests
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
