"""Multi-page TIFF: grey frames of 8 to 16 bits, in and out."""

from __future__ import annotations

import logging
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import tifffile

from vibrissa.errors import InputError
from vibrissa.video.about import Movie
from vibrissa.video.grey import Frames

SUFFIXES = frozenset({".tif", ".tiff"})
LOSSY = frozenset({6, 7, 33003, 33005, 34712, 34892, 50001, 50002})  # JPEG, JPEG 2000, WebP, JPEG XL, by TIFF's numbers

# what tifffile thinks of damaged tags reaches whoever sets up logging, and not the screen
logging.getLogger("tifffile").addHandler(logging.NullHandler())


def describe(path: Path) -> Movie:
    """Describe a TIFF movie, checked to be grey and whole.

    Raises
    ------
    InputError
        If it is no TIFF, is cut off, is in colour, or is not of 8 to 16 bits.
    """
    with _opened(path) as file:
        count = _checked(file, path)
        page = file.pages[0]
        return Movie(
            path=path,
            width=page.imagewidth,
            height=page.imagelength,
            bits=page.bitspersample,
            codec="tiff",
            lossy=page.compression in LOSSY,
            frame_count=count,
        )


def read_blocks(path: Path, frames: int) -> Iterator[Frames]:
    """Read a TIFF movie in blocks of (T, height, width), in native byte order.

    Raises
    ------
    InputError
        As :func:`describe`; also if a page cannot be decoded.
    """
    with _opened(path) as file:
        count = _checked(file, path)
        for start in range(0, count, frames):
            yield _block(file, path, start, min(start + frames, count))


def write(path: Path, blocks: Iterator[Frames]) -> None:
    """Write frames as uncompressed pages of one TIFF (BigTIFF, as movies pass 4 GB)."""
    with tifffile.TiffWriter(path, bigtiff=True) as writer:
        for block in blocks:
            writer.write(block, photometric="minisblack", contiguous=True, metadata=None)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a TIFF file; whatever goes wrong in its reading is the file's fault, told in one line."""
    try:
        with tifffile.TiffFile(path) as file:
            yield file
    except InputError:
        raise
    except Exception as error:  # damaged tags raise exceptions of every kind
        raise InputError(str(path), f"must be a whole TIFF file ({error})", remedy="copy it again") from error


def _one_run(file: Any) -> bool:
    """Whether the frames stand in one run, which ImageJ writes as a single page."""
    return len(file.series) == 1 and file.series[0].dataoffset is not None and file.series[0].ndim == 3


def _checked(file: Any, path: Path) -> int:
    """Number of frames, after checking that all of them are grey, alike and present."""
    if not len(file.pages):
        raise InputError(str(path), "must have at least one frame")
    pages = [file.pages[i] for i in range(len(file.pages))]
    first = pages[0]
    grey = first.samplesperpixel == 1 and first.photometric == tifffile.PHOTOMETRIC.MINISBLACK
    if not grey:
        found = getattr(first.photometric, "name", str(first.photometric)).lower()
        raise InputError(str(path), "must be grey, with black as 0", found)
    if first.dtype not in (np.dtype(np.uint8), np.dtype(np.uint16)):
        raise InputError(str(path), "must have 8 to 16 bits, unsigned", first.dtype)
    for i, page in enumerate(pages):
        if page.shape != first.shape or page.dtype != first.dtype:
            raise InputError(str(path), "must keep its frame size", f"{page.shape} after {first.shape} at frame {i}")
    if _one_run(file):
        count = int(file.series[0].shape[0])
        readable = (file.filehandle.size - file.series[0].dataoffset) // (first.size * first.dtype.itemsize)
    else:
        count = len(pages)
        readable = sum(_stands_in_file(page, file.filehandle.size) for page in pages)
    more = _next_page(file, pages[-1]) != 0
    if readable < count or more:
        found = f"{min(readable, count)} readable frames of {'a longer movie' if more else count}"
        raise InputError(str(path), "is cut off or damaged", found, "copy it again, or cut it after those frames")
    return count


def _stands_in_file(page: Any, size: int) -> bool:
    ends = (offset + length for offset, length in zip(page.dataoffsets, page.databytecounts, strict=True))
    return all(end <= size for end in ends)


def _next_page(file: Any, page: Any) -> int:
    """Offset of the page after this one, 0 at the end; tifffile itself drops a link that leads nowhere."""
    layout, handle = file.tiff, file.filehandle
    handle.seek(page.offset)
    tags = struct.unpack(layout.tagnoformat, handle.read(layout.tagnosize))[0]
    handle.seek(page.offset + layout.tagnosize + tags * layout.tagsize)
    link = handle.read(layout.offsetsize)
    return int(struct.unpack(layout.offsetformat, link)[0]) if len(link) == layout.offsetsize else -1


def _block(file: Any, path: Path, start: int, stop: int) -> Frames:
    first = file.pages[0]
    if _one_run(file):
        offset = file.series[0].dataoffset + start * first.size * first.dtype.itemsize
        stored = np.dtype(first.dtype).newbyteorder(file.byteorder)
        run = file.filehandle.read_array(stored, (stop - start) * first.size, offset)
        return run.reshape(stop - start, *first.shape).astype(first.dtype, copy=False)
    try:
        return np.stack([file.pages[i].asarray() for i in range(start, stop)]).astype(first.dtype, copy=False)
    except Exception as error:  # each decompressor has an exception of its own
        where = f"at frames {start} to {stop - 1}"
        raise InputError(str(path), f"could not be decoded ({error}) {where}", remedy="save it uncompressed") from error
