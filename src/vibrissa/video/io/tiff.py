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

from vibrissa.errors import FormatError, InputError, RangeError, ShapeError, TooFewError
from vibrissa.video.io.about import Movie, Opened, opened_runs
from vibrissa.video.io.grey import Frames

SUFFIXES = frozenset({".tif", ".tiff"})
CHECKED = frozenset({8, 32946})  # deflate, whose checksum zlib checks
CHANNELS = 4  # at most: a stack of more that calls them channels is one of times whose axis was never named
AXES = {"T": "times", "Z": "planes", "C": "channels", "S": "samples", "P": "positions", "R": "tiles"}
IMAGE = frozenset("YX")
LOSSY = frozenset({6, 7, 33003, 33005, 34712, 34892, 50001, 50002})  # JPEG, JPEG 2000, WebP, JPEG XL, by TIFF's numbers

# what tifffile thinks of damaged tags reaches whoever sets up logging, and not the screen
logging.getLogger("tifffile").addHandler(logging.NullHandler())


@contextmanager
def opened(path: Path) -> Iterator[Opened]:
    """Open a TIFF movie, checked to be grey and whole; its blocks are in native byte order.

    Parameters
    ----------
    path : Path
        The file.

    Yields
    ------
    Opened
        The movie.

    Raises
    ------
    InputError
        If it is no TIFF, is cut off, is in colour, is not of 8 to 16 bits, or a page cannot be decoded.
    """
    try:
        with tifffile.TiffFile(path) as file:
            movie = _described(file, path)
            yield opened_runs(movie, lambda start, stop: _block(file, path, start, stop))
    except InputError:
        raise
    except Exception as error:  # damaged tags raise exceptions of every kind
        raise FormatError(str(path), f"must be a whole TIFF file ({error})", remedy="copy it again") from error


def write(path: Path, blocks: Iterator[Frames]) -> None:
    """Write frames as uncompressed pages of one TIFF (BigTIFF, as movies pass 4 GB).

    Parameters
    ----------
    path : Path
        The file.
    blocks : iterator of (T, height, width) arrays
        Frames of one size and type.
    """
    with tifffile.TiffWriter(path, bigtiff=True) as writer:
        for block in blocks:
            writer.write(block, photometric="minisblack", contiguous=True, metadata=None)


def _one_run(file: Any) -> bool:
    """Whether the frames are in one run, which ImageJ writes as a single page."""
    return len(file.series) == 1 and file.series[0].dataoffset is not None and file.series[0].ndim == 3


def _described(file: Any, path: Path) -> Movie:
    """Describe a file after checking that all of its frames are grey, alike and present."""
    if not len(file.pages):
        raise TooFewError(str(path), "must have at least one frame")
    pages = [file.pages[i] for i in range(len(file.pages))]
    first = pages[0]
    if first.samplesperpixel != 1 or first.photometric != tifffile.PHOTOMETRIC.MINISBLACK:
        found = getattr(first.photometric, "name", str(first.photometric)).lower()
        raise FormatError(str(path), "must be grey, with black as 0", found, "save it as 8- or 16-bit grey")
    _refuse_stack(file, path)
    if (orientation := first.tags.valueof("Orientation", 1)) != 1:
        remedy = "save it as it is shown"
        raise FormatError(str(path), "must be stored upright", f"orientation {orientation}", remedy)
    if first.shape != (first.imagelength, first.imagewidth):
        raise ShapeError(str(path), "must have pages of rows and columns alone", first.shape)
    if first.dtype not in (np.dtype(np.uint8), np.dtype(np.uint16)):
        raise RangeError(str(path), "must have 8 to 16 bits, unsigned", first.dtype)
    for i, page in enumerate(pages):
        if page.shape != first.shape or page.dtype != first.dtype:
            raise ShapeError(str(path), "must keep its frame size", f"{page.shape} after {first.shape} at frame {i}")
    if _one_run(file):
        count = int(file.series[0].shape[0])
        readable = (file.filehandle.size - file.series[0].dataoffset) // (first.size * first.dtype.itemsize)
    else:
        count = len(pages)
        readable = sum(_is_whole(page, file.filehandle.size) for page in pages)
    more = _next_page(file, pages[-1]) != 0
    if readable < count or more:
        found = f"{min(readable, count)} readable frames of {'a longer movie' if more else count}"
        raise FormatError(str(path), "is cut off or damaged", found, "copy it again, or cut it after those frames")
    return Movie(
        path=path,
        width=first.imagewidth,
        height=first.imagelength,
        bits=first.bitspersample,
        codec="tiff",
        lossy=first.compression in LOSSY,
        checksums=first.compression in CHECKED,
        frame_count=count,
    )


def _refuse_stack(file: Any, path: Path) -> None:
    """Refuse frames along several axes, or along colours or positions: which of them follow in time is not known."""
    series = file.series[0]
    axes = [
        (name, size) for name, size in zip(series.axes, series.shape, strict=True) if name not in IMAGE and size > 1
    ]
    found = " × ".join(f"{size} {AXES.get(name, f'of axis {name}')}" for name, size in axes)
    remedy = "save one stack of times alone: in ImageJ, Image > Hyperstacks > Reduce Dimensionality"
    if len(axes) > 1 or any(name in "SPR" or (name == "C" and size <= CHANNELS) for name, size in axes):
        raise ShapeError(str(path), "must have frames along one axis, of times", found, remedy)
    if file.is_ome and len(file.series) > 1:
        raise ShapeError(str(path), "must have one series of images", f"{len(file.series)} of OME", remedy)


def _image(page: Any) -> Frames:
    """Grey levels of a page; a damaged tag gives them another shape than the page has."""
    image: Frames = page.asarray()
    if image.shape != page.shape:
        raise ValueError(f"its shape is {image.shape}, not {page.shape}")
    return image


def _is_whole(page: Any, size: int) -> bool:
    """Whether all of a page is in a file of this size."""
    return all(at + length <= size for at, length in zip(page.dataoffsets, page.databytecounts, strict=True))


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
        return np.stack([_image(file.pages[i]) for i in range(start, stop)]).astype(first.dtype, copy=False)
    except Exception as error:  # each decompressor has its own exception
        rule = f"could not be decoded ({error}) at frames {start} to {stop - 1}"
        raise FormatError(str(path), rule, remedy="save it uncompressed") from error
