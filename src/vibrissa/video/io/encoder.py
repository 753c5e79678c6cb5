"""Movies written into containers through PyAV: equal frames give equal files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any, cast

import av
import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import FormatError
from vibrissa.video.io.grey import Frames

SUFFIXES = frozenset({".avi", ".mkv", ".mp4"})

# name of the codec as the user says it: FFmpeg's name, its options, the containers that hold it
ENCODERS: dict[str, tuple[str, dict[str, str], frozenset[str]]] = {
    "ffv1": ("ffv1", {}, frozenset({".avi", ".mkv"})),
    "ffvhuff": ("ffvhuff", {}, frozenset({".avi"})),
    "h264": ("libx264", {"crf": "18"}, SUFFIXES),
    "h264-lossless": ("libx264", {"qp": "0"}, SUFFIXES),
}


def write(path: Path, blocks: Iterator[Frames], codec: str, playback_rate: float) -> None:
    """Encode grey frames by one of ``ENCODERS``; equal frames give equal files.

    Parameters
    ----------
    path : Path
        File to write.
    blocks : iterator of (T, height, width) arrays
        Frames of one size and type.
    codec : str
        One of ``ENCODERS``.
    playback_rate : float
        Rate at which players show it [Hz].

    Raises
    ------
    InputError
        If the codec cannot hold the bits of the frames.
    """
    name, options, _ = ENCODERS[codec]
    first = next(blocks)
    if first.dtype == np.uint16 and name == "libx264":
        raise FormatError("frames", "must be of 8 bits for H.264", first.dtype, "write 'ffv1' or TIFF")
    layout = "gray" if first.dtype == np.uint8 else "gray16le"
    frames = (frame for block in chain([first], blocks) for frame in block)
    encode(path, frames, name, options, layout, layout, playback_rate)


def encode(
    path: Path,
    frames: Iterable[NDArray[Any]],
    name: str,
    options: dict[str, str],
    given: str,
    stored: str,
    playback_rate: float,
) -> int:
    """Encode frames with one codec of FFmpeg, without a random identifier.

    Parameters
    ----------
    path : Path
        File to write; its suffix is the container.
    frames : iterable of (height, width, …) arrays
        Frames of one size and type.
    name, options : str, dict
        FFmpeg's name of the codec, and its options.
    given, stored : str
        FFmpeg's pixel format of the frames, and of the movie.
    playback_rate : float
        Rate at which players show it [Hz].

    Returns
    -------
    int
        Number of frames.
    """
    count = 0
    with av.open(str(path), "w", container_options={"fflags": "+bitexact"}) as file:
        rate = Fraction(playback_rate).limit_denominator(100_000)
        stream = cast(av.VideoStream, file.add_stream(name, rate=rate, options=options))
        for count, frame in enumerate(frames, 1):
            if count == 1:
                stream.height, stream.width, stream.pix_fmt = *frame.shape[:2], stored
                if name == "libx264" and stored == "gray":
                    stream.codec_context.color_range = av.video.reformatter.ColorRange.JPEG
            image = av.VideoFrame.from_ndarray(np.ascontiguousarray(frame), format=given)
            file.mux(stream.encode(image))
        file.mux(stream.encode())
    return count
