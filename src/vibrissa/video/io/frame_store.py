"""Frames of a movie in any order: decoded once, in the background, into a temporary file."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import MachineError, RangeError
from vibrissa.video.io.movie import DropFrames, open_movie, read_blocks

BLOCK = 16  # frames that are decoded at once: the first ones are there soon


class FrameStore:
    """Frames of a movie as grey levels of 8 bits.

    Frames of more bits are shown from the least to the highest level of the first ones. The temporary file takes a
    byte for each pixel of the movie, and vanishes with the store.

    Parameters
    ----------
    path : path
        The movie.
    drop_frames : {"nan"}, optional
        As of :func:`vibrissa.video.io.movie.read_blocks`.

    Raises
    ------
    InputError
        If it is no movie.
    """

    def __init__(self, path: str | Path, drop_frames: DropFrames = None) -> None:
        self.movie = open_movie(path)
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - open as long as the store
        self._ready = threading.Condition()
        self._done, self._ended, self._closed = 0, False, False
        self._error: Exception | None = None
        self._range: tuple[float, float] | None = None
        self._thread = threading.Thread(target=self._decode, args=(path, drop_frames), daemon=True)
        self._thread.start()

    def frame(self, number: int) -> bytes:
        """Grey levels of a frame, row by row; waits until it is decoded.

        Parameters
        ----------
        number : int
            From 0.

        Returns
        -------
        bytes
            Width × height.

        Raises
        ------
        InputError
            If the movie has no such frame, or is damaged before it.
        """
        size = self.movie.width * self.movie.height
        with self._ready:
            self._ready.wait_for(lambda: self._ended or number < self._done)
            if not 0 <= number < self._done:
                raise self._error or RangeError("frame", f"must be one of the {self._done} of the movie", number)
            self._file.seek(number * size)
            return self._file.read(size)

    def close(self) -> None:
        """Stop decoding and remove the temporary file."""
        self._closed = True
        self._thread.join()
        self._file.close()

    def _decode(self, path: str | Path, drop_frames: DropFrames) -> None:
        try:
            with closing(read_blocks(path, BLOCK, drop_frames=drop_frames)) as blocks:  # type: ignore[type-var]
                self._keep(blocks)
        except OSError as error:
            self._error = MachineError(tempfile.gettempdir(), f"could not take the frames ({error.strerror or error})")
        except Exception as error:  # for whoever asks for a frame
            self._error = error
        finally:
            with self._ready:
                self._ended = True
                self._ready.notify_all()

    def _keep(self, blocks: Iterable[NDArray[Any]]) -> None:
        for block in blocks:
            levels = self._levels(block).tobytes()
            with self._ready:
                self._file.seek(0, 2)
                self._file.write(levels)
                self._done += len(block)
                self._ready.notify_all()
            if self._closed:
                break

    def _levels(self, block: NDArray[Any]) -> NDArray[np.uint8]:
        if block.dtype == np.uint8:
            return block
        if self._range is None:
            self._range = float(block.min()), max(float(np.ptp(block)), 1.0)
        low, span = self._range
        return np.clip(np.rint((block - low) * (255 / span)), 0, 255).astype(np.uint8)
