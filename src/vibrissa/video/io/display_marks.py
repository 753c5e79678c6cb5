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
_ORIENTATION, _MIRRORED = 274, frozenset({2, 4, 5, 7})  # tag of EXIF, and those of its values that mirror


def quarter_turns(path: Path, frame: av.VideoFrame, coded: bytes) -> int:
    """Quarter turns, anticlockwise, by which players show a frame turned.

    Parameters
    ----------
    path : Path
        The movie.
    frame : VideoFrame
        Its first.
    coded : bytes
        The same as it is stored, if its codec is one of ``PICTURES``; else empty.

    Returns
    -------
    int
        By the rotation mark of the container, or of the picture.

    Raises
    ------
    InputError
        If players show it mirrored, or at another angle.
    """
    degrees = getattr(frame, "rotation", 0)  # the first versions 14 of PyAV may not know it
    remedy = "write it with its frames turned: ffmpeg -i IN -c:v ffv1 OUT.mkv"
    if _mirrored(frame, coded):
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


def _mirrored(frame: av.VideoFrame, coded: bytes) -> bool:
    """Whether players show a frame mirrored."""
    if (exif := _EXIF.search(coded)) is not None:
        return _orientation(exif[1]) in _MIRRORED
    if b"iCCP" in coded:  # PyAV frees the name of a colour profile twice, with the side data
        return False
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
