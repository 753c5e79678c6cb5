"""Movies in containers (AVI, MP4, MKV and the like, a still picture as one frame) through PyAV.

The rate in a container is a *playback* rate: a high-speed camera plays at 25 frames/s what it took at
5,000, so it is never taken for the frame rate of the acquisition.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import chain
from math import nan
from pathlib import Path
from typing import Any

import av
import numpy as np

from vibrissa.arrays import Integers
from vibrissa.errors import FormatError, InputError, ShapeError, TooFewError
from vibrissa.video.io.about import Movie, Opened, empty_block
from vibrissa.video.io.display_marks import PICTURES, quarter_turns, refuse_oblong
from vibrissa.video.io.frame_times import FrameTimes, frame_times
from vibrissa.video.io.grey import Frames, grey_levels, has_colour, kind_of
from vibrissa.video.io.slice_checksums import SliceChecksums

LOSSLESS = frozenset({"ffv1", "rawvideo", "huffyuv", "ffvhuff", "utvideo", "png", "bmp", "tiff"})
CHECKED = frozenset({"png", "apng"})  # checksums that FFmpeg itself checks; those of FFV1 are checked here
TITLE_PICTURE = 0x400  # FFmpeg's mark of such a stream

# titles may be in any encoding: since version 19 PyAV reads them all, before it was asked to
_ASKED = hasattr(av.container.InputContainer, "metadata_errors")
_ANY_ENCODING: dict[str, Any] = {"metadata_errors": "surrogateescape"} if _ASKED else {}


@contextmanager
def opened(path: Path, holes: bool = False) -> Iterator[Opened]:
    """Open a movie, described by its header and first frame; its blocks can be read once.

    Parameters
    ----------
    path : Path
        The file.
    holes : bool
        Whether frames that the container counts may be missing, as long as the last is there.

    Yields
    ------
    Opened
        The movie.

    Raises
    ------
    InputError
        If it is no movie, has no frames, or its pixels have no exact grey level; if pixels are not square, or players
        show it mirrored; also if the frame size or the pixel format changes, or the movie is cut off or damaged.
    """
    with _container(path) as container:
        checksums = _checksums(container)
        decoded = _frames(container, path, checksums, holes)
        first = next(decoded, None)
        if first is None:
            raise TooFewError(str(path), "must have at least one frame")
        refuse_oblong(path, first.width, _stream(container).sample_aspect_ratio)
        turns = quarter_turns(path, first, _stream(container).codec_context.name in PICTURES)
        movie = _described(path, container, first, checksums, turns)
        yield Opened(movie, partial(_blocks, movie, turns, chain([first], decoded)))


def _blocks(movie: Movie, turns: int, decoded: Iterable[av.VideoFrame], frames: int) -> Iterator[Frames]:
    block, filled = empty_block(movie, frames), 0
    try:
        for frame in decoded:
            levels = grey_levels(frame, movie.path, movie.bits, movie.expanded, movie.colour)
            block[filled] = np.rot90(levels, turns)
            filled += 1
            if filled == frames:
                yield block
                block, filled = np.empty_like(block), 0
    except InputError:
        if filled:  # the frames before a damaged one are good
            yield block[:filled]
        raise
    if filled:
        yield block[:filled]


def key_frames(path: Path) -> Integers:
    """Numbers of the key frames, from 0, as the container flags them; nothing is decoded.

    Frames between key frames are coded as changes, by all lossy codecs but those for single pictures.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    (n,) array of int, rising
        Numbers from 0.

    Raises
    ------
    InputError
        If it is no movie, or cannot be read to its end.
    """
    return np.flatnonzero([key for _, key in _stamps(path)[0]])


def time_stamps(path: Path) -> FrameTimes | None:
    """Places of the frames on an even time axis, as the container times them; nothing is decoded.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    FrameTimes or None
        None where frames have no time stamps.

    Raises
    ------
    InputError
        If it is no movie, or cannot be read to its end.
    """
    stamps, tick, rate, guessed = _stamps(path)
    if not stamps or any(time is None for time, _ in stamps):
        return None
    times = frame_times(np.array([float(time * tick) for time, _ in stamps]), float(tick), rate)
    return replace(times, guessed=guessed)


def _stamps(path: Path) -> tuple[list[tuple[Any, bool]], Fraction, float, bool]:
    """Time in ticks and whether it is a key frame, of every frame in its order; tick [s], rate [Hz]; if guessed."""
    with _container(path) as container:
        stream = _stream(container)
        # AVI has no times, and counts frames in the order of decoding: another one where some are coded backwards
        counted = container.format.name == "avi"
        packets = (packet for packet in container.demux(stream) if packet.size and not packet.is_discard)
        try:
            stamps = [(packet.dts if counted else packet.pts, packet.is_keyframe) for packet in packets]
        except av.FFmpegError as error:
            raise _cut_off(path, 0, _announced(container)) from error
        base, rate = stream.time_base or Fraction(0), float(stream.base_rate or nan)
        guessed = counted and bool(stream.codec_context.has_b_frames)
    if all(time is not None for time, _ in stamps):
        stamps.sort()  # packets come in the order of decoding
    return stamps, Fraction(base.numerator, base.denominator), rate, guessed


def _container(path: Path) -> av.container.InputContainer:
    try:
        container = av.open(f"file:{path}", **_ANY_ENCODING)  # a colon in a name makes no protocol
    except (av.FFmpegError, OSError) as error:
        rule = f"must be a whole movie ({error.strerror})"
        raise FormatError(str(path), rule, remedy="cut off, or another kind of file?") from error
    streams = _streams(container)
    if len(streams) == 1 and streams[0].codec_context is not None:
        return container
    container.close()
    if len(streams) > 1:
        remedy = "take one out, here the first: ffmpeg -i IN -map 0:v:0 -c copy OUT.mkv"
        raise TooFewError(str(path), "must have one video stream", len(streams), remedy)
    raise FormatError(
        str(path), "must be coded by a codec that FFmpeg knows" if streams else "must have a video stream"
    )


def _streams(container: av.container.InputContainer) -> list[Any]:
    """Video streams of a file, but for its title picture; the first, where PyAV (up to some 14) does not know it."""
    streams = list(container.streams.video)
    if streams and not hasattr(streams[0], "disposition"):
        return streams[:1]
    return [one for one in streams if not int(one.disposition) & TITLE_PICTURE]


def _stream(container: av.container.InputContainer) -> Any:
    return _streams(container)[0]


def _checksums(container: av.container.InputContainer) -> SliceChecksums | None:
    context = _stream(container).codec_context
    return SliceChecksums(bytes(context.extradata or b"")) if context.name == "ffv1" else None


def _packets(container: av.container.InputContainer, checksums: SliceChecksums | None) -> Iterator[Any]:
    """Packets whose checksums hold, up to the first that does not, and one that empties the decoder."""
    stream = _stream(container)
    for packet in container.demux(stream):
        if packet.size and checksums is not None and not checksums.hold(bytes(packet)):
            empty = av.Packet(0)
            empty.stream = stream
            yield empty
            return
        yield packet


def _frames(
    container: av.container.InputContainer, path: Path, checksums: SliceChecksums | None, holes: bool
) -> Iterator[av.VideoFrame]:
    """Decode all frames of one size; an error where one is damaged or the file holds fewer than it announces."""
    stream = _stream(container)
    stream.thread_type = "AUTO"
    stream.codec_context.options = {"err_detect": "crccheck+explode"}  # no frame is patched up from its neighbours
    announced, count = _announced(container), 0
    frame: av.VideoFrame | None = None
    try:
        for frame in (frame for packet in _packets(container, checksums) for frame in packet.decode()):
            if count == 0:
                first = frame
            _alike(frame, first, path, count)
            if frame.is_corrupt:
                raise _cut_off(path, count, announced)
            count += 1
            yield frame
    except (av.FFmpegError, OSError, MemoryError) as error:
        raise _cut_off(path, count, announced) from error
    if checksums is not None and checksums.failed:
        raise _damaged(path, count, announced)
    whole = stream.frames and count >= announced
    early = not stream.frames or holes
    if frame is not None and not whole and (not early or _ends_early(container, frame)):
        raise _cut_off(path, count, announced)


def _alike(frame: av.VideoFrame, first: av.VideoFrame, path: Path, number: int) -> None:
    if (frame.width, frame.height) != (first.width, first.height):
        rule, found = "must keep its frame size", f"{frame.width}×{frame.height} after {first.width}×{first.height}"
    elif frame.format.name != first.format.name:
        rule, found = "must keep its pixel format", f"{frame.format.name} after {first.format.name}"
    else:
        return
    raise ShapeError(str(path), rule, f"{found} at frame {number}")


def _cut_off(path: Path, count: int, announced: int) -> InputError:
    found = f"{count} readable frames of {announced or 'an unknown number'}"
    return FormatError(str(path), "is cut off or damaged", found, "copy it again, or cut it after those frames")


def _damaged(path: Path, count: int, announced: int) -> InputError:
    found = f"{count} whole frames of {announced or 'an unknown number'} before it"
    remedy = "copy it again, or read the frames before it alone"
    return FormatError(str(path), f"is damaged: the checksum of frame {count} does not hold", found, remedy)


def _duration(container: av.container.InputContainer) -> float:
    """Duration of the video stream [s], NaN if the file does not say."""
    stream = _stream(container)
    if stream.duration is not None and stream.time_base:
        return float(stream.duration * stream.time_base)
    if "DURATION" in stream.metadata:
        clock = re.fullmatch(r"(\d+):(\d+):(\d+(?:\.\d*)?)", stream.metadata["DURATION"])
        return 3600 * float(clock[1]) + 60 * float(clock[2]) + float(clock[3]) if clock else nan
    # a container with a sound track may last longer than its frames
    if container.duration is not None and len(container.streams) == 1:
        return float(container.duration / av.time_base)
    return nan


def _announced(container: av.container.InputContainer) -> int:
    """Frames the file announces: its count, else duration × rate, else 0."""
    stream = _stream(container)
    duration = _duration(container)
    if stream.frames or not stream.average_rate or np.isnan(duration):  # an unknown rate is None, or 0/0
        return _pictures(container, int(stream.frames))
    return round(duration * float(stream.average_rate))


def _pictures(container: av.container.InputContainer, counted: int) -> int:
    """Frames of a count that have a picture: AVI also counts empty ones, in the places of dropped frames."""
    index: Any = _stream(container).index_entries if container.format.name == "avi" else ()
    whole = len(index) > 0 and index[-1].timestamp == counted - 1  # that of a movie that was cut off is not
    return len(index) if whole else counted


def _ends_early(container: av.container.InputContainer, last: av.VideoFrame) -> bool:
    stream = _stream(container)
    if last.time is None or not stream.average_rate:
        return False
    # half a frame more than the last frame's own duration: time stamps are rounded to 1 ms in MKV
    return bool(_duration(container) - last.time > 1.5 / float(stream.average_rate) + 2e-3)


def _described(
    path: Path,
    container: av.container.InputContainer,
    frame: av.VideoFrame,
    checksums: SliceChecksums | None,
    turns: int,
) -> Movie:
    stream = _stream(container)
    bits, expanded = kind_of(frame, path)
    width, height = (frame.height, frame.width) if turns % 2 else (frame.width, frame.height)
    return Movie(
        path=path,
        width=width,
        height=height,
        bits=bits,
        codec=stream.codec_context.name,
        lossy=stream.codec_context.name not in LOSSLESS,
        checksums=stream.codec_context.name in CHECKED or (checksums is not None and checksums.present),
        expanded=expanded,
        colour=has_colour(frame),
        playback_rate=float(stream.average_rate) if stream.average_rate else nan,
        frame_count=_announced(container) or 1,
        frame_count_is_estimate=stream.frames == 0,
    )
