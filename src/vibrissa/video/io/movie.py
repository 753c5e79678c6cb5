"""Movies in and out: blocks of grey frames, exact to the bit where the codec is, bounded in memory.

What is read: AVI, MP4, MKV and the like through PyAV, multi-page TIFF, a folder of numbered images, Photron's
``.cih`` or ``.cihx`` with ``.mraw``, and ``.npy``; 8 to 16 bit grey.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.errors import ConflictError, FormatError, RangeError, ShapeError, UnknownError
from vibrissa.files import existing, written_whole
from vibrissa.video.io import container, encoder, folder, npy, photron, tiff
from vibrissa.video.io.about import Movie, Opened
from vibrissa.video.io.frame_times import FrameTimes, filled
from vibrissa.video.io.grey import Frames
from vibrissa.video.io.prefetch import prefetched

__all__ = ["Movie", "open_movie", "read_blocks", "write_movie"]

DropFrames = Literal["nan"] | None


def open_movie(path: str | Path) -> Movie:
    """Describe a movie without reading it through.

    Parameters
    ----------
    path : path
        The movie, or a folder of numbered images.

    Returns
    -------
    Movie
        What the file says.

    Raises
    ------
    InputError
        If the file is missing, is no movie, has no frames, or its pixels have no exact grey level.
    """
    with _opened(path) as (movie, _):
        return movie


def read_blocks(
    path: str | Path, frames: int = 256, start: int = 0, stop: int | None = None, *, drop_frames: DropFrames = None
) -> Iterator[Frames]:
    """Read a movie in blocks of frames, the next one decoded while the last one is worked on.

    Limited-range luma (Y'CbCr formats not marked as full range, 16 to 235 at 8 bits) is expanded to the
    full range, rounded, and clipped where the encoder overshot; grey formats are passed on as stored.

    Parameters
    ----------
    path : path
        The movie, or a folder of numbered images.
    frames : int
        Frames per block, at least 1; memory is bounded by three blocks.
    start, stop : int
        First frame that is wanted, from 0, and the first after it that is not; all by default. Earlier frames are
        decoded all the same.
    drop_frames : {"nan"}, optional
        Give, for each frame that time stamps or image numbers show to be missing, the one before it again, so that
        frames are even in time; ``frame_times_of`` gives the numbers of these.

    Yields
    ------
    (T, height, width) array of uint8 or uint16
        Grey levels; T = ``frames`` except in the first and last block. Row 0 is the top of the image.

    Raises
    ------
    InputError
        If the file is missing, is no movie, has no frames or no exact grey level, changes its frame size, ends before
        ``stop``, or is cut off or damaged (after the readable blocks: the error gives the number of readable frames).
    """
    if frames < 1:
        raise RangeError("frames per block", "must be at least 1", frames)
    blocks = _blocks(path, frames) if drop_frames is None else _filled_blocks(path, frames)
    yield from prefetched(_between(blocks, start, stop))


def frame_times_of(path: str | Path) -> FrameTimes | None:
    """Places of the frames on an even time axis, by the time stamps of a container or the numbers of images.

    Parameters
    ----------
    path : path
        The movie, or a folder of numbered images.

    Returns
    -------
    FrameTimes or None
        None of formats without either.

    Raises
    ------
    InputError
        As :func:`open_movie`.
    """
    reader = _reader(path)
    if reader is folder:
        return folder.frame_numbers(Path(path))
    return container.time_stamps(existing(path)) if reader is container else None


def key_frames_of(path: str | Path) -> Integers:
    """Numbers of the key frames of a container; none of formats in which each frame is a picture of its own.

    Parameters
    ----------
    path : path
        The movie, or a folder of numbered images.

    Returns
    -------
    (n,) array of int, rising
        Numbers from 0.

    Raises
    ------
    InputError
        As :func:`open_movie`.
    """
    return container.key_frames(existing(path)) if _reader(path) is container else np.empty(0, np.int64)


def sure_frame_times(path: str | Path) -> FrameTimes:
    """Places of the frames, where time stamps or the numbers of images show which are missing.

    Parameters
    ----------
    path : path
        The movie.

    Returns
    -------
    FrameTimes
        The places.

    Raises
    ------
    InputError
        If it has neither, or they do not show it.
    """
    times = frame_times_of(path)
    if times is None:
        raise ConflictError("drop_frames", f"must be left out: {path} has no time stamps")
    times.refuse_unsure(str(path))
    return times


def with_missing_frames(movie: Movie, drop_frames: DropFrames) -> Movie:
    """A movie whose number of frames counts the missing ones, if they keep their place.

    Parameters
    ----------
    movie : Movie
        That is read.
    drop_frames : {"nan"} or None
        As in :func:`read_blocks`.

    Returns
    -------
    Movie
        As it is without ``drop_frames``.

    Raises
    ------
    InputError
        As :func:`sure_frame_times`.
    """
    if drop_frames is None:
        return movie
    count = int(sure_frame_times(movie.path).slots[-1]) + 1
    return replace(movie, frame_count=count, frame_count_is_estimate=False)


def frames_within(movie: Movie, start: int, stop: int | None) -> int:
    """Number of frames of a range.

    Parameters
    ----------
    movie : Movie
        That is read; of :func:`with_missing_frames`, if missing frames are counted.
    start, stop : int
        As in :func:`read_blocks`.

    Returns
    -------
    int
        How many; an estimate where the movie's own number is one.

    Raises
    ------
    InputError
        If the range is empty, or the movie is known to end before it.
    """
    count = movie.frame_count
    if start < 0 or (stop is not None and stop <= start):
        raise RangeError("start, stop", "must be frames from 0 on, the second after the first", (start, stop))
    if not movie.frame_count_is_estimate and max(start + 1, stop or 0) > count:
        raise RangeError("start, stop", f"must lie within the {count} frames of the movie", (start, stop))
    return (count if stop is None else stop) - start


def _blocks(path: str | Path, frames: int) -> Iterator[Frames]:
    with _opened(path) as (_, blocks):
        yield from blocks(frames)


def _filled_blocks(path: str | Path, frames: int) -> Iterator[Frames]:
    slots = sure_frame_times(path).slots
    with _opened(path, holes=True) as (_, blocks):
        yield from filled(blocks(frames), slots, str(path))


def _between(blocks: Iterable[Frames], start: int, stop: int | None) -> Iterator[Frames]:
    """Frames from the first to the one before the second, in blocks."""
    done = 0
    for block in blocks:
        part = block[max(start - done, 0) : None if stop is None else stop - done]
        if len(part):
            yield part
        done += len(block)
        if stop is not None and done >= stop:
            return
    if 0 < start >= done or stop is not None:
        raise RangeError("start, stop", f"must lie within the {done} frames of the movie", (start, stop))


def write_movie(path: str | Path, blocks: Iterable[Frames], codec: str = "ffv1", playback_rate: float = 25.0) -> None:
    """Write grey frames, whole or not at all: TIFF by its suffix, else a container and a codec.

    Parameters
    ----------
    path : path
        File to write: ``.tif`` or ``.tiff``, uncompressed; ``.mkv``, ``.avi`` or ``.mp4``.
    blocks : iterable of (T, height, width) arrays of uint8 or uint16
        The frames, all of one size and type.
    codec : {"ffv1", "ffvhuff", "h264-lossless", "h264"}
        Codec in a container. FFV1 (MKV, AVI) is the smallest without loss, FFVHUFF (AVI) decodes three times
        faster; H.264 (MKV, MP4, AVI) takes 8 bits only. "h264" (at CRF 18) *loses grey levels*: for showing,
        not for measuring.
    playback_rate : float
        Rate at which players show it [Hz]; it says nothing of the acquisition. TIFF has none.

    Raises
    ------
    InputError
        If the suffix or codec is not one of these or they do not go together, there are no frames, or their
        size or type changes.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in encoder.SUFFIXES | tiff.SUFFIXES:
        raise FormatError(str(path), "must end in .mkv, .avi, .mp4, .tif or .tiff", repr(suffix))
    if codec not in encoder.ENCODERS:
        raise UnknownError("codec", f"must be one of {', '.join(encoder.ENCODERS)}", repr(codec))
    if not (np.isfinite(playback_rate) and playback_rate > 0):
        raise RangeError("playback_rate", "must be positive and finite", playback_rate)
    holding = encoder.ENCODERS[codec][2] | tiff.SUFFIXES
    if suffix not in holding:
        raise FormatError(str(path), f"must end in {' or '.join(sorted(holding - tiff.SUFFIXES))} for {codec}", suffix)
    with written_whole(path) as temporary:
        if suffix in tiff.SUFFIXES:
            tiff.write(temporary, _uniform(blocks))
        else:
            encoder.write(temporary, _uniform(blocks), codec, playback_rate)


def _opened(path: str | Path, holes: bool = False) -> AbstractContextManager[Opened]:
    reader = _reader(path)
    if holes and reader is container:
        return container.opened(existing(path), holes=True)
    return reader.opened(Path(path) if reader is folder else existing(path))


def _reader(path: str | Path) -> Any:
    if Path(path).is_dir():
        return folder
    suffixes = {kind: one for one in (tiff, photron, npy) for kind in one.SUFFIXES}
    return suffixes.get(Path(path).suffix.lower(), container)


def _uniform(blocks: Iterable[Frames]) -> Iterator[Frames]:
    """Check that there are frames and that all are of one size and type."""
    first: tuple[object, ...] | None = None
    for block in blocks:
        kind = (block.dtype.name, *block.shape[1:])
        if block.dtype not in (np.uint8, np.uint16) or block.ndim != 3:
            raise ShapeError("frames", "must be (T, height, width) of uint8 or uint16", f"{block.dtype} {block.shape}")
        if first is not None and kind != first:
            raise ShapeError("frames", "must keep their size and type", f"{kind} after {first}")
        first = kind
        yield block
    if first is None:
        raise RangeError("frames", "must be at least one")
