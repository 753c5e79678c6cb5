"""Marks by which players show frames other than they are stored: turned, mirrored, or wider."""

from __future__ import annotations

import re
from fractions import Fraction
from io import BytesIO
from pathlib import Path
from typing import Any

import av
import numpy as np
from tifffile import TiffFile, TiffFileError

from vibrissa.errors import FormatError

PICTURES = frozenset({"png", "apng", "mjpeg", "webp"})  # codecs whose frames may hold EXIF
_EXIF = re.compile(rb"(?:Exif\0\0|eXIf|EXIF.{4})((?:II\*\0|MM\0\*).*)", re.DOTALL)
_READ = 1 << 24  # bytes of a file in which EXIF and colour profile are sought
_ORIENTATION = 274  # tag of EXIF; its values 2, 4, 5 and 7 mirror
_TURNS, _MIRRORED = {3: 2, 6: 3, 8: 1}, frozenset({2, 4, 5, 7})


def quarter_turns(path: Path, frame: av.VideoFrame, picture: bool) -> int:
    """Quarter turns, anticlockwise, by which players show a frame turned.

    Parameters
    ----------
    path : Path
        The movie.
    frame : VideoFrame
        Its first.
    picture : bool
        Whether its codec is one of ``PICTURES``.

    Returns
    -------
    int
        By the rotation mark of the container, or of the picture.

    Raises
    ------
    InputError
        If players show it mirrored, or at another angle.
    """
    coded = _beginning(path) if picture else b""
    exif = _EXIF.search(coded)
    orientation = 1 if exif is None else _orientation(exif[1])
    if orientation in _TURNS:
        return _TURNS[orientation]
    degrees = getattr(frame, "rotation", 0)  # the first versions 14 of PyAV may not know it
    remedy = "write it with its frames turned: ffmpeg -i IN -c:v ffv1 OUT.mkv"
    # PyAV frees the name of a colour profile twice, with the side data, and fails at EXIF there
    if orientation in _MIRRORED or (exif is None and b"iCCP" not in coded and _mirrored(frame)):
        raise FormatError(str(path), "must be shown as it is or turned", "a mirrored picture", remedy)
    if degrees % 90:
        raise FormatError(str(path), "must be shown in quarter turns", f"{degrees} degrees", remedy)
    return int(degrees // 90)


def refuse_oblong(path: Path, width: int, aspect: Fraction | None) -> None:
    """Refuse pixels that are not square; a width rounded to whole pixels leaves them square.

    Parameters
    ----------
    path : Path
        The movie.
    width : int
        Of a frame [px].
    aspect : Fraction or None
        Width of a pixel over its height; unknown is None or 0.

    Raises
    ------
    InputError
        If they are not.
    """
    if abs(float(aspect or 1) - 1) * width > 1:
        remedy = 'make them square: ffmpeg -i IN -vf "scale=iw*sar:ih,setsar=1" -c:v ffv1 OUT.mkv'
        raise FormatError(str(path), "must have square pixels", f"{float(aspect or 1):g} times as wide as high", remedy)


def _beginning(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(_READ)


def _mirrored(frame: av.VideoFrame) -> bool:
    """Whether players show a frame mirrored: the determinant of its display matrix is negative."""
    try:
        matrix: Any = frame.side_data.get("DISPLAYMATRIX")  # its type is not known to have a buffer
    except ValueError:  # data of a kind that this PyAV does not know
        return False
    if matrix is None:
        return False
    a, b, _, c, d, *_ = np.frombuffer(matrix, np.int32).astype(float)
    return bool(a * d < b * c)


def _orientation(exif: bytes) -> int:
    """Orientation by EXIF, 1 to 8; 1, upright, where it does not say."""
    try:
        with TiffFile(BytesIO(exif)) as file:
            return int(file.pages.first.tags.valueof(_ORIENTATION, 1))
    except (TiffFileError, IndexError, ValueError, TypeError):  # what viewers do with damaged EXIF
        return 1
