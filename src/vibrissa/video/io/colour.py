"""Movies in colour, to look at: H.264, which every player shows. Nothing is measured in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import FormatError, RangeError, ShapeError
from vibrissa.files import written_whole
from vibrissa.video.io.encoder import encode

PLAYBACK_RATE = 25.0  # at which players show it [Hz]
QUALITY = "23"  # constant rate factor, of 0 to 51; x264's own default


def write_colour(path: str | Path, frames: Iterable[NDArray[np.uint8]]) -> int:
    """Write colour frames as H.264 (4:2:0) in MP4 or MKV, whole or not at all.

    Parameters
    ----------
    path : path
        File to write, ``.mp4`` or ``.mkv``.
    frames : iterable of (height, width, 3) arrays of uint8
        Red, green and blue, all of one size; the last row or column is left out where their number is odd.

    Returns
    -------
    int
        Number of frames written.

    Raises
    ------
    InputError
        If the suffix is another, there are no frames, or their size or type changes.
    """
    if Path(path).suffix.lower() not in (".mp4", ".mkv"):
        raise FormatError(str(path), "must end in .mp4 or .mkv", repr(Path(path).suffix))
    with written_whole(path) as temporary:
        options = {"crf": QUALITY, "threads": "1"}
        return encode(temporary, _even(frames), "libx264", options, "rgb24", "yuv420p", PLAYBACK_RATE)


def _even(frames: Iterable[NDArray[np.uint8]]) -> Iterator[NDArray[np.uint8]]:
    """Frames without an odd last row or column, which 4:2:0 does not have."""
    size = None
    for frame in frames:
        if frame.ndim != 3 or frame.shape[2] != 3 or frame.dtype != np.uint8:
            raise ShapeError("frames", "must be (height, width, 3) of uint8", f"{frame.dtype} {frame.shape}")
        even = frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2]
        if even.shape != (size or even.shape):
            raise ShapeError("frames", "must keep their size", frame.shape)
        size = even.shape
        yield even
    if size is None:
        raise RangeError("frames", "must be at least one")
