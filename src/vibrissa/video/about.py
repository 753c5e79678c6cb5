"""What a movie file says of itself, whatever its format."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vibrissa.errors import InputError
from vibrissa.video.grey import Frames


@dataclass(frozen=True, kw_only=True)
class Movie:
    """What a movie file says of itself.

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
    expanded : bool
        Whether limited-range luma (16 to 235 at 8 bits) is expanded to the full range on reading.
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
    expanded: bool = False
    frame_rate: float = float("nan")
    playback_rate: float = float("nan")
    frame_count_is_estimate: bool = False

    @property
    def dtype(self) -> np.dtype[np.uint8] | np.dtype[np.uint16]:
        """Type of the pixels, native byte order."""
        return np.dtype(np.uint8) if self.bits == 8 else np.dtype(np.uint16)


def empty_block(movie: Movie, frames: int) -> Frames:
    """Room for a block of frames (frames, height, width), not yet filled.

    Raises
    ------
    InputError
        If it does not fit into memory.
    """
    try:
        return np.empty((frames, movie.height, movie.width), movie.dtype)
    except (MemoryError, ValueError) as error:
        size = f"{frames} frames of {movie.width}×{movie.height}"
        raise InputError(str(movie.path), "must have blocks that fit into memory", size) from error
