"""What a movie file states, whatever its format."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vibrissa.errors import FormatError, RangeError
from vibrissa.video.io.grey import Frames

MOVIES = frozenset(  # by which movies are known where a file may be anything; ``track`` reads whatever FFmpeg reads
    [
        ".avi",
        ".cih",
        ".cihx",
        ".flv",
        ".gif",
        ".m4v",
        ".mkv",
        ".mov",
        ".mp4",
        ".mpeg",
        ".mpg",
        ".mraw",
        ".tif",
        ".tiff",
        ".webm",
        ".wmv",
    ]
)
IN_COLOUR = "the movie is in colour: its luma is read as grey levels"


@dataclass(frozen=True, kw_only=True)
class Movie:
    """What a movie file states.

    Attributes
    ----------
    path : Path
        The file, or the folder of images.
    width, height : int
        Frame size [px].
    bits : int
        Bits per pixel, 8 to 16; frames are uint8 at 8 bits, else uint16.
    codec : str
        Name of the codec; "tiff", "mraw" and "npy" for those formats.
    lossy : bool
        Whether the codec may have altered the grey levels (one that can do both counts as lossy).
    checksums : bool
        Whether the frames have checksums, so that a damaged one is refused.
    expanded : bool
        Whether limited-range luma (16 to 235 at 8 bits) is expanded to the full range on reading.
    colour : bool
        Whether the movie is in colour; its luma is read.
    frame_rate : float
        Frames per second of the acquisition [Hz], which a high-speed camera's own header knows; else NaN.
    playback_rate : float
        Rate at which the file asks to be played [Hz], NaN if it says nothing; not the acquisition's.
    frame_count : int
        Number of frames.
    frame_count_is_estimate : bool
        Whether ``frame_count`` is duration × playback rate, for want of a count in the file.
    """

    path: Path
    width: int
    height: int
    bits: int
    codec: str
    frame_count: int
    lossy: bool = False
    checksums: bool = False
    expanded: bool = False
    colour: bool = False
    frame_rate: float = float("nan")
    playback_rate: float = float("nan")
    frame_count_is_estimate: bool = False

    @property
    def dtype(self) -> np.dtype[np.uint8] | np.dtype[np.uint16]:
        """Type of the pixels, native byte order."""
        return np.dtype(np.uint8) if self.bits == 8 else np.dtype(np.uint16)


class Opened(NamedTuple):
    """An open movie: what its file says, and a function that reads all frames in blocks of a given number."""

    movie: Movie
    blocks: Callable[[int], Iterator[Frames]]


def opened_runs(movie: Movie, run: Callable[[int, int], Frames]) -> Opened:
    """Give an open movie whose frames can be read from any of them on.

    Parameters
    ----------
    movie : Movie
        What its file says.
    run : callable
        Reads the frames from a first one to before a last one, (T, height, width).

    Returns
    -------
    Opened
        The movie and its blocks, the last of which may be shorter.
    """

    def blocks(frames: int) -> Iterator[Frames]:
        for start in range(0, movie.frame_count, frames):
            yield run(start, min(start + frames, movie.frame_count))

    return Opened(movie, blocks)


def empty_block(movie: Movie, frames: int) -> Frames:
    """Room for a block of frames (frames, height, width), not yet filled.

    Parameters
    ----------
    movie : Movie
        Its frame size and type count.
    frames : int
        Number of frames.

    Returns
    -------
    (frames, height, width) array
        Of the movie's type.

    Raises
    ------
    InputError
        If it does not fit into memory.
    """
    try:
        return np.empty((frames, movie.height, movie.width), movie.dtype)
    except (MemoryError, ValueError) as error:
        size = f"{frames} frames of {movie.width}×{movie.height}"
        raise FormatError(str(movie.path), "must have blocks that fit into memory", size) from error


def refuse_region(region: tuple[int, int, int, int], shape: tuple[int, ...]) -> None:
    """Refuse a region off the image.

    Parameters
    ----------
    region : (int, int, int, int)
        Left, top, right and bottom [px].
    shape : (int, int)
        Height and width of the image.

    Raises
    ------
    InputError
        If it does not lie within.
    """
    (height, width), (left, top, right, bottom) = shape, region
    if not (0 <= left < right < width and 0 <= top < bottom < height):
        rule, order = f"must lie within the image of {width} × {height} pixels", "its left, top, right and bottom"
        raise RangeError("region", rule, region, f"give {order}; right and bottom are the larger ones")
