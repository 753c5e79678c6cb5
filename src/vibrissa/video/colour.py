"""Movies in colour, to look at: H.264, which every player shows. Nothing is measured in them."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.files import written_whole

QUALITY = "23"  # constant rate factor, of 0 to 51; x264's own default


def write_colour(path: str | Path, frames: Iterable[NDArray[np.uint8]], playback_rate: float = 25.0) -> int:
    """Write colour frames as H.264 (4:2:0) in MP4 or MKV, whole or not at all.

    Parameters
    ----------
    path : path
        File to write, ``.mp4`` or ``.mkv``.
    frames : iterable of (height, width, 3) arrays of uint8
        Red, green and blue, all of one size; the last row or column is left out where their number is odd.
    playback_rate : float
        Rate at which players show it [Hz].

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
        raise InputError(str(path), "must end in .mp4 or .mkv", repr(Path(path).suffix))
    if not playback_rate > 0:
        raise InputError("playback_rate", "must be positive", playback_rate)
    count = 0
    with (
        written_whole(path) as temporary,
        av.open(str(temporary), "w", container_options={"fflags": "+bitexact"}) as file,
    ):
        stream = file.add_stream("libx264", rate=Fraction(playback_rate).limit_denominator(100_000))
        stream.pix_fmt, stream.options = "yuv420p", {"crf": QUALITY, "threads": "1"}
        for frame in frames:
            shape = _even(frame)
            if not count:
                stream.height, stream.width = shape
            elif shape != (stream.height, stream.width):
                raise InputError("frames", "must keep their size", frame.shape)
            image = av.VideoFrame.from_ndarray(np.ascontiguousarray(frame[: shape[0], : shape[1]]), format="rgb24")
            file.mux(stream.encode(image))
            count += 1
        if not count:
            raise InputError("frames", "must be at least one")
        file.mux(stream.encode())
    return count


def _even(frame: NDArray[np.uint8]) -> tuple[int, int]:
    """Height and width without an odd last row or column, which 4:2:0 does not have."""
    if frame.ndim != 3 or frame.shape[2] != 3 or frame.dtype != np.uint8:
        raise InputError("frames", "must be (height, width, 3) of uint8", f"{frame.dtype} {frame.shape}")
    return frame.shape[0] // 2 * 2, frame.shape[1] // 2 * 2
