"""Movies in and out: blocks of grey frames, exact to the bit where the codec is, bounded in memory.

AVI, MP4, MKV and the like (a still picture too, as one frame) through PyAV, multi-page TIFF through
tifffile; 8 to 16 bit grey. The rate in a container is a *playback* rate: a high-speed camera plays at
25 frames/s what it took at 5,000, so it is never taken for the frame rate of the acquisition.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from vibrissa.errors import InputError
from vibrissa.files import written_whole
from vibrissa.video import tiff
from vibrissa.video.grey import Frames, grey_levels, kind_of

LOSSLESS = frozenset({"ffv1", "rawvideo", "huffyuv", "ffvhuff", "utvideo", "png", "bmp", "tiff"})


@dataclass(frozen=True, kw_only=True)
class Movie:
    """What a movie file says of itself.

    Attributes
    ----------
    path : Path
        The file.
    width, height : int
        Frame size [px].
    bits : int
        Bits per pixel, 8 to 16; frames are uint8 at 8 bits, else uint16.
    codec : str
        Name of the codec, "tiff" for TIFF.
    lossy : bool
        Whether the codec may have altered the grey levels (one that can do both counts as lossy).
    expanded : bool
        Whether limited-range luma (16 to 235 at 8 bits) is expanded to the full range on reading.
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
    lossy: bool
    expanded: bool
    playback_rate: float
    frame_count: int
    frame_count_is_estimate: bool

    @property
    def dtype(self) -> np.dtype[np.uint8] | np.dtype[np.uint16]:
        """Type of the pixels, native byte order."""
        return np.dtype(np.uint8) if self.bits == 8 else np.dtype(np.uint16)


def open_movie(path: str | Path) -> Movie:
    """Describe a movie without reading it through.

    Raises
    ------
    InputError
        If the file is missing, is no movie, has no frames, or its pixels have no exact grey level.
    """
    path = _existing(path)
    if path.suffix.lower() in tiff.SUFFIXES:
        count, height, width, bits = tiff.describe(path)
        return Movie(
            path=path,
            width=width,
            height=height,
            bits=bits,
            codec="tiff",
            lossy=False,
            expanded=False,
            playback_rate=float("nan"),
            frame_count=count,
            frame_count_is_estimate=False,
        )
    with _container(path) as container:
        frame = next(_frames(container, path), None)
        if frame is None:
            raise InputError(str(path), "must have at least one frame")
        return _describe(path, container, frame)


def read_blocks(path: str | Path, frames: int = 256) -> Iterator[Frames]:
    """Read a movie in blocks of frames.

    Limited-range luma (Y'CbCr formats not marked as full range, 16 to 235 at 8 bits) is expanded to the
    full range, rounded, and clipped where the encoder overshot; grey formats are passed on as stored.

    Parameters
    ----------
    path : path
        The movie.
    frames : int
        Frames per block, at least 1; memory is bounded by one block.

    Yields
    ------
    (T, height, width) array of uint8 or uint16
        Grey levels; T = ``frames`` except in the last block. Row 0 is the top of the image.

    Raises
    ------
    InputError
        If the file is missing, is no movie, has no frames or no exact grey level, changes its frame size,
        or is cut off or damaged (after the readable blocks: the number of readable frames is told).
    """
    if frames < 1:
        raise InputError("frames per block", "must be at least 1", frames)
    path = _existing(path)
    if path.suffix.lower() in tiff.SUFFIXES:
        yield from tiff.read_blocks(path, frames)
        return
    movie = open_movie(path)
    with _container(path) as container:
        block = np.empty((frames, movie.height, movie.width), movie.dtype)
        filled = 0
        for frame in _frames(container, path):
            block[filled] = grey_levels(frame, path, movie.bits, movie.expanded)
            filled += 1
            if filled == frames:
                yield block
                block, filled = np.empty_like(block), 0
        if filled:
            yield block[:filled]


def write_movie(path: str | Path, blocks: Iterable[Frames], codec: str = "ffv1", playback_rate: float = 25.0) -> None:
    """Write grey frames without loss, whole or not at all: FFV1 in MKV or AVI, or TIFF, by the suffix.

    Parameters
    ----------
    path : path
        File to write, ``.mkv``, ``.avi``, ``.tif`` or ``.tiff``.
    blocks : iterable of (T, height, width) arrays of uint8 or uint16
        The frames, all of one size and type.
    codec : {"ffv1"}
        Codec in a container; TIFF is written uncompressed.
    playback_rate : float
        Rate at which players show it [Hz]; it says nothing of the acquisition. TIFF has none.

    Raises
    ------
    InputError
        If the suffix or codec is not one of these, there are no frames, or their size or type changes.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in {".mkv", ".avi", *tiff.SUFFIXES}:
        raise InputError(str(path), "must end in .mkv, .avi, .tif or .tiff", repr(suffix))
    if codec != "ffv1":
        raise InputError("codec", "must be 'ffv1', which loses nothing", repr(codec))
    if not playback_rate > 0:
        raise InputError("playback_rate", "must be positive", playback_rate)
    with written_whole(path) as temporary:
        if suffix in tiff.SUFFIXES:
            tiff.write(temporary, _uniform(blocks))
        else:
            _encode(temporary, _uniform(blocks), playback_rate)


def _existing(path: str | Path) -> Path:
    path = Path(path)
    if not path.is_file():
        raise InputError(str(path), "must be an existing file")
    return path


def _container(path: Path) -> av.container.InputContainer:
    try:
        container = av.open(str(path))
    except (av.FFmpegError, OSError) as error:
        raise InputError(
            str(path), f"must be a whole movie ({error.strerror})", remedy="cut off, or another kind of file?"
        ) from error
    if not container.streams.video:
        container.close()
        raise InputError(str(path), "must contain a video stream")
    return container


def _frames(container: av.container.InputContainer, path: Path) -> Iterator[av.VideoFrame]:
    """Decode all frames of one size; an error where the file holds fewer than it announces."""
    stream = container.streams.video[0]
    stream.thread_type = "AUTO"
    announced, count = _announced(container), 0
    frame: av.VideoFrame | None = None
    try:
        for frame in container.decode(stream):
            if count == 0:
                size = frame.width, frame.height
            elif (frame.width, frame.height) != size:
                found = f"{frame.width}×{frame.height} after {size[0]}×{size[1]} at frame {count}"
                raise InputError(str(path), "must keep its frame size", found)
            count += 1
            yield frame
    except av.FFmpegError as error:
        raise _cut_off(path, count, announced) from error
    if frame is not None and (count < stream.frames or _ends_early(container, frame)):
        raise _cut_off(path, count, announced)


def _cut_off(path: Path, count: int, announced: int) -> InputError:
    found = f"{count} readable frames of {announced or 'an unknown number'}"
    return InputError(str(path), "is cut off or damaged", found, "copy it again, or cut it after those frames")


def _duration(container: av.container.InputContainer) -> float:
    """Duration of the video stream [s], NaN if the file does not say."""
    stream = container.streams.video[0]
    if stream.duration is not None and stream.time_base is not None:
        return float(stream.duration * stream.time_base)
    if "DURATION" in stream.metadata:
        hours, minutes, seconds = stream.metadata["DURATION"].split(":")
        return int(hours) * 3600 + int(minutes) * 60 + float(seconds)
    # a container with a sound track may last longer than its frames
    if container.duration is not None and len(container.streams) == 1:
        return float(container.duration / av.time_base)
    return float("nan")


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
        playback_rate=float(stream.average_rate) if stream.average_rate else float("nan"),
        frame_count=_announced(container) or 1,
        frame_count_is_estimate=stream.frames == 0,
    )


def _uniform(blocks: Iterable[Frames]) -> Iterator[Frames]:
    """Check that there are frames and that all are of one size and type."""
    first: tuple[object, ...] | None = None
    for block in blocks:
        kind = (block.dtype.name, *block.shape[1:])
        if block.dtype not in (np.uint8, np.uint16) or block.ndim != 3:
            raise InputError("frames", "must be (T, height, width) of uint8 or uint16", f"{block.dtype} {block.shape}")
        if first is not None and kind != first:
            raise InputError("frames", "must keep their size and type", f"{kind} after {first}")
        first = kind
        yield block
    if first is None:
        raise InputError("frames", "must be at least one")


def _encode(path: Path, blocks: Iterator[Frames], playback_rate: float) -> None:
    exact = {"fflags": "+bitexact"}  # no random identifier: equal movies are equal files
    with av.open(str(path), "w", container_options=exact) as container:
        stream = container.add_stream("ffv1", rate=Fraction(playback_rate).limit_denominator(100_000))
        for block in blocks:
            layout = "gray" if block.dtype == np.uint8 else "gray16le"
            if not stream.codec_context.is_open:
                stream.height, stream.width, stream.pix_fmt = *block.shape[1:], layout
            for frame in block:
                grey = av.VideoFrame.from_ndarray(np.ascontiguousarray(frame), format=layout)
                container.mux(stream.encode(grey))
        container.mux(stream.encode())
