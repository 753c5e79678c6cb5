"""Movies in containers (AVI, MP4, MKV and the like, a still picture as one frame) through PyAV.

The rate in a container is a *playback* rate: a high-speed camera plays at 25 frames/s what it took at
5,000, so it is never taken for the frame rate of the acquisition.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from fractions import Fraction
from itertools import chain
from math import nan
from pathlib import Path
from typing import cast

import av
import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.video.about import Movie, empty_block
from vibrissa.video.grey import Frames, grey_levels, kind_of

LOSSLESS = frozenset({"ffv1", "rawvideo", "huffyuv", "ffvhuff", "utvideo", "png", "bmp", "tiff"})
SUFFIXES = frozenset({".avi", ".mkv", ".mp4"})

# name of the codec as the user says it: FFmpeg's name, its options, the containers that hold it
ENCODERS: dict[str, tuple[str, dict[str, str], frozenset[str]]] = {
    "ffv1": ("ffv1", {}, frozenset({".avi", ".mkv"})),
    "ffvhuff": ("ffvhuff", {}, frozenset({".avi"})),
    "h264": ("libx264", {"crf": "18"}, SUFFIXES),
    "h264-lossless": ("libx264", {"qp": "0"}, SUFFIXES),
}


def describe(path: Path) -> Movie:
    """Describe a movie by its header and first frame.

    Raises
    ------
    InputError
        If it is no movie, has no frames, or its pixels have no exact grey level.
    """
    with _container(path) as container:
        return _describe(path, container, _first(_frames(container, path), path))


def read_blocks(path: Path, frames: int) -> Iterator[Frames]:
    """Read a movie in blocks of (T, height, width).

    Raises
    ------
    InputError
        As :func:`describe`; also if the frame size or the pixel format changes, or the movie is cut off or damaged.
    """
    with _container(path) as container:
        decoded = _frames(container, path)
        first = _first(decoded, path)
        movie = _describe(path, container, first)
        block, filled = empty_block(movie, frames), 0
        for frame in chain([first], decoded):
            block[filled] = grey_levels(frame, path, movie.bits, movie.expanded)
            filled += 1
            if filled == frames:
                yield block
                block, filled = np.empty_like(block), 0
        if filled:
            yield block[:filled]


def key_frames(path: Path) -> NDArray[np.int64]:
    """Numbers of the key frames, from 0, as the container flags them; nothing is decoded.

    Frames between key frames are coded as changes, by all lossy codecs but those for single pictures.

    Raises
    ------
    InputError
        If it is no movie, or cannot be read to its end.
    """
    with _container(path) as container:
        stream = container.streams.video[0]
        try:
            flags = [(packet.pts, packet.is_keyframe) for packet in container.demux(stream) if packet.size]
        except av.FFmpegError as error:
            raise _cut_off(path, 0, _announced(container)) from error
    if all(time is not None for time, _ in flags):
        flags.sort()  # packets come in the order of decoding
    return np.flatnonzero([key for _, key in flags])


def write(path: Path, blocks: Iterator[Frames], codec: str, playback_rate: float) -> None:
    """Encode frames by one of ``ENCODERS``; equal frames give equal files."""
    name, options, _ = ENCODERS[codec]
    exact = {"fflags": "+bitexact"}  # no random identifier
    with av.open(str(path), "w", container_options=exact) as container:
        rate = Fraction(playback_rate).limit_denominator(100_000)
        stream = cast(av.VideoStream, container.add_stream(name, rate=rate, options=options))
        for block in blocks:
            if not stream.codec_context.is_open:
                layout = _layout(block, codec)
                stream.height, stream.width, stream.pix_fmt = *block.shape[1:], layout
                if name == "libx264":
                    stream.codec_context.color_range = av.video.reformatter.ColorRange.JPEG
            for frame in block:
                grey = av.VideoFrame.from_ndarray(np.ascontiguousarray(frame), format=layout)
                container.mux(stream.encode(grey))
        container.mux(stream.encode())


def _layout(block: Frames, codec: str) -> str:
    if block.dtype == np.uint8:
        return "gray"
    if codec.startswith("h264"):
        raise InputError("frames", "must be of 8 bits for H.264", block.dtype, "write 'ffv1' or TIFF")
    return "gray16le"


def _container(path: Path) -> av.container.InputContainer:
    try:
        # a colon in a name makes no protocol; titles may be in any encoding
        container = av.open(f"file:{path}", metadata_errors="replace")
    except (av.FFmpegError, OSError) as error:
        raise InputError(
            str(path), f"must be a whole movie ({error.strerror})", remedy="cut off, or another kind of file?"
        ) from error
    if not container.streams.video:
        container.close()
        raise InputError(str(path), "must contain a video stream")
    if container.streams.video[0].codec_context is None:
        container.close()
        raise InputError(str(path), "must be coded by a codec that FFmpeg knows")
    return container


def _frames(container: av.container.InputContainer, path: Path) -> Iterator[av.VideoFrame]:
    """Decode all frames of one size; an error where the file holds fewer than it announces."""
    stream = container.streams.video[0]
    stream.thread_type = "AUTO"
    stream.codec_context.options = {"err_detect": "crccheck+explode"}  # no frame is patched up from its neighbours
    announced, count = _announced(container), 0
    frame: av.VideoFrame | None = None
    try:
        for frame in container.decode(stream):
            if count == 0:
                first = frame
            _alike(frame, first, path, count)
            if frame.is_corrupt:
                raise _cut_off(path, count, announced)
            count += 1
            yield frame
    except (av.FFmpegError, OSError, MemoryError) as error:
        raise _cut_off(path, count, announced) from error
    if frame is not None and (count < stream.frames or _ends_early(container, frame)):
        raise _cut_off(path, count, announced)


def _first(frames: Iterator[av.VideoFrame], path: Path) -> av.VideoFrame:
    frame = next(frames, None)
    if frame is None:
        raise InputError(str(path), "must have at least one frame")
    return frame


def _alike(frame: av.VideoFrame, first: av.VideoFrame, path: Path, number: int) -> None:
    if (frame.width, frame.height) != (first.width, first.height):
        found = f"{frame.width}×{frame.height} after {first.width}×{first.height} at frame {number}"
        raise InputError(str(path), "must keep its frame size", found)
    if frame.format.name != first.format.name:
        found = f"{frame.format.name} after {first.format.name} at frame {number}"
        raise InputError(str(path), "must keep its pixel format", found)


def _cut_off(path: Path, count: int, announced: int) -> InputError:
    found = f"{count} readable frames of {announced or 'an unknown number'}"
    return InputError(str(path), "is cut off or damaged", found, "copy it again, or cut it after those frames")


def _duration(container: av.container.InputContainer) -> float:
    """Duration of the video stream [s], NaN if the file does not say."""
    stream = container.streams.video[0]
    if stream.duration is not None and stream.time_base is not None:
        return float(stream.duration * stream.time_base)
    if "DURATION" in stream.metadata:
        clock = re.fullmatch(r"(\d+):(\d+):(\d+(?:\.\d*)?)", stream.metadata["DURATION"])
        return (
            sum(float(part) * unit for part, unit in zip(clock.groups(), (3600, 60, 1), strict=True)) if clock else nan
        )
    # a container with a sound track may last longer than its frames
    if container.duration is not None and len(container.streams) == 1:
        return float(container.duration / av.time_base)
    return nan


def _announced(container: av.container.InputContainer) -> int:
    """Frames the file announces: its count, else duration × rate, else 0."""
    stream = container.streams.video[0]
    duration = _duration(container)
    if stream.frames or stream.average_rate is None or np.isnan(duration):
        return int(stream.frames)
    return round(duration * float(stream.average_rate))


def _ends_early(container: av.container.InputContainer, last: av.VideoFrame) -> bool:
    stream = container.streams.video[0]
    if stream.frames or last.time is None or not stream.average_rate:
        return False
    # half a frame more than the last frame's own duration: time stamps are rounded to 1 ms in MKV
    return bool(_duration(container) - last.time > 1.5 / float(stream.average_rate) + 2e-3)


def _describe(path: Path, container: av.container.InputContainer, frame: av.VideoFrame) -> Movie:
    stream = container.streams.video[0]
    bits, expanded = kind_of(frame, path)
    return Movie(
        path=path,
        width=frame.width,
        height=frame.height,
        bits=bits,
        codec=stream.codec_context.name,
        lossy=stream.codec_context.name not in LOSSLESS,
        expanded=expanded,
        playback_rate=float(stream.average_rate) if stream.average_rate else nan,
        frame_count=_announced(container) or 1,
        frame_count_is_estimate=stream.frames == 0,
    )
