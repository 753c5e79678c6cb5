"""Dropped files are read in a process apart, whose memory and time are limited: a file may be made to fill both."""

from __future__ import annotations

import importlib
import multiprocessing
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

from vibrissa.errors import FormatError, InputError, RangeError
from vibrissa.sweep.processes import end_with_parent
from vibrissa.texture.io import read_texture

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from vibrissa.texture.relief import HeightProfile
    from vibrissa.texture.surface import Gaps

START = 60.0  # [s] in which the process, and the readers that it needs, must be there
PATIENCE, PACE = 20.0, 1e6  # [s], and [bytes/s] of what a file has in truth, in which it must be read
TABLES = (".csv", ".txt", ".tsv", ".dat")  # which need no instrument's reader
MEMORY = 2 << 30  # bytes of data that it may have
LARGE = 512 << 20  # bytes; a process that has used more ends, so that its memory is free again
LARGEST_SURFACE = 64 << 20  # bytes of an answer: two million heights and their places take 32 MB
TOO_MUCH = "the file is damaged, or too much for the page: give it to vibrissa scan"
UNREADABLE = (OSError, ValueError, LookupError, TypeError, ArithmeticError, AttributeError, RuntimeError)


class DroppedReader:
    """The process that reads; it is started with the first file, and again where it was given up."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._process: Any = None
        self._line: Connection | None = None

    def read(self, path: Path, how: Mapping[str, Any]) -> tuple[Gaps | HeightProfile, list[str]]:
        """Read a texture, and what was decided on the way.

        Parameters
        ----------
        path : Path
            The file.
        how : mapping
            Settings of :func:`vibrissa.texture.io.read_texture`.

        Returns
        -------
        surface : Gaps or HeightProfile
            Its texture.
        notes : list of str
            Remarks, one line each.

        Raises
        ------
        InputError
            If it is no texture, or cannot be read with the memory and in the time that it is given.
        """
        with self._lock:
            line = self._line or self._start()
            try:
                last, found = self._answer(line, path, how)
            except BaseException:
                self.end()
                raise
            if last:
                self.end()
        if isinstance(found, InputError):
            raise found
        surface, notes = found
        return surface, notes

    def end(self) -> None:
        """End the process, whatever it does."""
        if self._line is not None:
            self._line.close()
            self._process.kill()
            self._process.join(1.0)
        self._line = self._process = None

    def _start(self) -> Connection:
        context = multiprocessing.get_context("spawn")
        self._line, far = context.Pipe()
        self._process = context.Process(target=_serve, args=(far, MEMORY), daemon=True)
        self._process.start()
        far.close()
        if not self._line.poll(START):
            self.end()
            raise RangeError("the reader of dropped files", f"must start within {START:g} s", remedy="drop it again")
        return self._line

    def _answer(self, line: Connection, path: Path, how: Mapping[str, Any]) -> tuple[bool, Any]:
        """Whether it is the last answer of the process, and the answer."""
        try:
            line.recv_bytes()  # it waits for a file
            line.send((path, dict(how)))
            there = line.poll(START)
            if there:
                line.recv_bytes()  # it has what it reads files of this name with
            limit = PATIENCE + path.stat().st_size / PACE
            if not there or not line.poll(limit):
                raise RangeError(str(path), f"must be readable within {limit:.0f} s", remedy=TOO_MUCH)
            return _unpacked(line.recv_bytes(LARGEST_SURFACE))
        except (EOFError, OSError) as error:
            raise _too_much(path) from error


def _unpacked(content: bytes) -> tuple[bool, Any]:
    import pickle

    last, found = pickle.loads(content)
    return bool(last), found


def _too_much(path: Path) -> InputError:
    return RangeError(str(path), f"must be readable with {MEMORY >> 30} GB of memory", remedy=TOO_MUCH)


def _serve(line: Connection, memory: int) -> None:
    """Read file after file, in its own process, until the other end of the pipe is closed."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process of the page
    end_with_parent()
    _limit(memory)
    with suppress(EOFError, OSError):
        while True:
            line.send_bytes(b"ready")
            path, how = line.recv()
            if path.suffix.lower() not in TABLES:
                _load_instruments()
            line.send_bytes(b"reading")
            found = _read(path, how)
            last = _most_memory() > LARGE
            line.send((last, found))
            if last:
                return


def _load_instruments() -> None:
    """Load the readers of instruments, for a second or two, if they are installed."""
    with suppress(ImportError):
        importlib.import_module("SurfaceTopography.IO")


def _read(path: Path, how: Mapping[str, Any]) -> tuple[Gaps | HeightProfile, list[str]] | InputError:
    notes: list[str] = []
    try:
        return read_texture(path, tell=notes.append, **how), notes
    except InputError as error:
        return error
    except MemoryError:
        return _too_much(path)
    except UNREADABLE as error:
        return FormatError(str(path), "could not be read", remedy=f"{type(error).__name__}: {error}"[:200])


def _limit(memory: int) -> None:
    """Limit the memory of this process, where the system can."""
    with suppress(ImportError, ValueError, OSError):  # Windows has no such limit, macOS refuses it
        resource = importlib.import_module("resource")
        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))


def _most_memory() -> int:
    """Most bytes that this process has had in memory; 0 where it is not known."""
    with suppress(ImportError):
        resource = importlib.import_module("resource")
        return int(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) << 10
    return 0
