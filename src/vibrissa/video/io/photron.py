"""High-speed movies as Photron's cameras save them: a header (``.cih`` or ``.cihx``) beside bare frames (``.mraw``).

The header is the one movie format here that knows the frame rate of the acquisition.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from glob import escape
from io import BufferedReader
from math import isfinite, nan
from pathlib import Path
from typing import cast
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import FormatError, MissingError, ShapeError
from vibrissa.loops import njit
from vibrissa.tables.text import as_number
from vibrissa.video.io.about import Movie, Opened, empty_block, opened_runs
from vibrissa.video.io.grey import Frames

SUFFIXES = frozenset({".cih", ".cihx", ".mraw"})
LONGEST = 1 << 24  # [bytes] a header is some kilobytes; frames renamed to .cih are not

# keys of .cih, and where .cihx has them
KEYS = {
    "Record Rate(fps)": "recordInfo/recordRate",
    "Total Frame": "frameInfo/totalFrame",
    "Image Width": "imageDataInfo/resolution/width",
    "Image Height": "imageDataInfo/resolution/height",
    "File Format": "imageFileInfo/fileFormat",
    "Color Type": "imageDataInfo/colorInfo/type",
    "Color Bit": "imageDataInfo/colorInfo/bit",
    "EffectiveBit Depth": "imageDataInfo/effectiveBit/depth",
    "EffectiveBit Side": "imageDataInfo/effectiveBit/side",
}


@dataclass(frozen=True, kw_only=True)
class _Recording:
    """A header, read and found to fit its frames; ``shift``: bits below the effective ones."""

    mraw: Path
    movie: Movie
    stored_bits: int
    shift: int

    @property
    def frame_bytes(self) -> int:
        return self.movie.width * self.movie.height * self.stored_bits // 8


@contextmanager
def opened(path: Path) -> Iterator[Opened]:
    """Open a movie, whichever of its two files is given; grey levels count in the lowest effective bit.

    Parameters
    ----------
    path : Path
        Header or frames.

    Yields
    ------
    Opened
        The movie.

    Raises
    ------
    InputError
        If one of the files is missing, the header cannot be read or is of another format, the movie is in colour, the
        frames are not as many bytes as the header says, or a grey level has more bits.
    """
    recording = _recording(path)
    with recording.mraw.open("rb") as file:
        yield opened_runs(recording.movie, lambda start, stop: _block(recording, file, start, stop))


def _block(recording: _Recording, file: BufferedReader, start: int, stop: int) -> Frames:
    movie = recording.movie
    raw = np.empty((stop - start) * recording.frame_bytes, np.uint8)
    if file.readinto(raw.data) != raw.size:
        raise FormatError(str(recording.mraw), "was cut while it was read", f"{start} whole frames")
    if recording.stored_bits == 8:
        return raw.reshape(-1, movie.height, movie.width)
    if recording.stored_bits == 12:
        block = cast(NDArray[np.uint16], empty_block(movie, stop - start))
        _unpack(raw, block.reshape(-1))
        return block
    levels = raw.view("<u2").reshape(-1, movie.height, movie.width) >> recording.shift
    if levels.max() >> movie.bits:
        rule = f"must have grey levels of {movie.bits} bits, as its header says"
        raise ShapeError(str(recording.mraw), rule, levels.max())
    return cast(Frames, levels.astype(movie.dtype, copy=False))


@njit(cache=True, nogil=True)
def _unpack(packed: NDArray[np.uint8], levels: NDArray[np.uint16]) -> None:
    """Two grey levels of 12 bits from every three bytes, highest bits first."""
    for pair in range(levels.size // 2):
        first, middle, last = packed[3 * pair], packed[3 * pair + 1], packed[3 * pair + 2]
        levels[2 * pair] = (np.uint16(first) << 4) | (middle >> 4)
        levels[2 * pair + 1] = (np.uint16(middle & 15) << 8) | last


def _recording(path: Path) -> _Recording:
    header, mraw = _pair(path)
    said = _said(header)
    if (kind := said.get("File Format", "MRaw")).lower() != "mraw":
        raise FormatError(str(header), "must be the header of an MRAW movie", kind, f"open the {kind} file itself")
    if (colour := said.get("Color Type", "Mono")).lower() != "mono":
        raise FormatError(str(header), "must be grey", f"colour type {colour}", "save it as monochrome")
    width, height, count, stored, bits = (
        _whole_number(said, key, header)
        for key in ("Image Width", "Image Height", "Total Frame", "Color Bit", "EffectiveBit Depth")
    )
    if stored not in (8, 12, 16) or not 8 <= bits <= stored or width * height * stored % 8:
        rule = "must be of 8, 12 or 16 bits, 8 or more effective"
        raise FormatError(str(header), rule, f"{bits} effective of {stored}")
    movie = Movie(
        path=path,
        width=width,
        height=height,
        bits=bits,
        codec="mraw",
        frame_count=count,
        frame_rate=_rate(said, header),
    )
    recording = _Recording(mraw=mraw, movie=movie, stored_bits=stored, shift=_shift(said, header, stored, bits))
    _check_size(recording)
    return recording


def pair(path: Path) -> tuple[Path | None, Path | None]:
    """Find the other file of a movie, of which one is given.

    Parameters
    ----------
    path : Path
        Header or frames.

    Returns
    -------
    header, frames : Path or None
        Which may be the given one; None where there is none beside it.
    """
    alike = sorted(path.parent.glob(f"{escape(path.stem)}.*"))  # also a.b.mraw of a movie a.b
    beside = {other.suffix.lower(): other for other in alike if other.stem == path.stem}
    if path.suffix.lower() == ".mraw":
        return beside.get(".cihx", beside.get(".cih")), path
    return path, beside.get(".mraw")


def _pair(path: Path) -> tuple[Path, Path]:
    header, mraw = pair(path)
    if header is None or mraw is None:
        part, suffix = ("header", ".cih or .cihx") if header is None else ("frames", ".mraw")
        remedy = f"copy {path.stem}{suffix} there too"
        raise MissingError(str(path), f"must have its {part} beside it", remedy=remedy)
    return header, mraw


def _said(header: Path) -> Mapping[str, str]:
    """Keys and values of a header, as text."""
    if header.stat().st_size > LONGEST:
        found = f"{header.stat().st_size} bytes"
        raise FormatError(str(header), "must be a Photron header, some kilobytes long", found)
    content = header.read_bytes()
    if header.suffix.lower() == ".cih":
        lines = (line.partition(":") for line in content.decode("latin-1").splitlines())
        return {key.strip(): value.strip() for key, colon, value in lines if colon}
    tree = re.search(rb"<cih>.*</cih>", content, re.DOTALL)
    try:
        root = ElementTree.fromstring(tree.group() if tree else b"")
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise FormatError(str(header), f"must be a Photron header ({error})") from error
    return {key: text.strip() for key, place in KEYS.items() if (text := root.findtext(place)) is not None}


def _whole_number(said: Mapping[str, str], key: str, header: Path) -> int:
    text = said.get(key)
    if text is None:
        raise MissingError(str(header), f"must say {key}", remedy="is it the header of a Photron movie, and whole?")
    if not re.fullmatch(r"0*[1-9]\d{0,8}", text, re.ASCII):
        raise FormatError(str(header), f"must have a positive whole number as {key}", repr(text))
    return int(text)


def _rate(said: Mapping[str, str], header: Path) -> float:
    """Frame rate [Hz], NaN if the header says nothing."""
    text = said.get("Record Rate(fps)")
    if text is None:
        return nan
    rate = as_number(text)
    if not (isfinite(rate) and rate > 0):
        raise FormatError(str(header), "must have a positive Record Rate(fps)", repr(text))
    return rate


def _shift(said: Mapping[str, str], header: Path, stored: int, bits: int) -> int:
    side = said.get("EffectiveBit Side", "Lower")
    if side.lower() not in ("lower", "higher"):
        raise FormatError(str(header), "must have Lower or Higher as EffectiveBit Side", repr(side))
    return stored - bits if side.lower() == "higher" else 0


def _check_size(recording: _Recording) -> None:
    movie, found = recording.movie, recording.mraw.stat().st_size
    expected = movie.frame_count * recording.frame_bytes
    if found < expected:
        got = f"{found // recording.frame_bytes} readable frames of {movie.frame_count}"
        raise FormatError(str(recording.mraw), "is cut off or damaged", got, "copy it again")
    if found > expected:
        rule = f"must have the {expected} bytes of its header's {movie.frame_count} frames"
        raise FormatError(str(recording.mraw), rule, f"{found} bytes", "is the header another movie's?")
