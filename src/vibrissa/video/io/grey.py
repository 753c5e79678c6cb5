"""Exact grey levels of a decoded frame, whatever its pixel format; those without any are refused."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import FormatError

Frames = NDArray[np.uint8] | NDArray[np.uint16]

RGB = frozenset({"rgb24", "bgr24", "rgba", "bgra", "rgb0", "bgr0", "0rgb", "0bgr", "argb", "abgr", "gbrp", "pal8"})
LUMA = 0.299, 0.587, 0.114  # shares of red, green and blue in the luma (BT.601)
COLOURED = 24  # difference of red, green and blue above which a pixel is coloured, and not grey in a lossy codec
TO_GREY = "ffmpeg -i IN -pix_fmt gray -c:v ffv1 OUT.mkv makes it grey"


def kind_of(frame: av.VideoFrame, path: Path) -> tuple[int, bool]:
    """Bits of the grey levels, and whether they are of limited range.

    Parameters
    ----------
    frame : VideoFrame
        As decoded.
    path : Path
        The file, for errors.

    Returns
    -------
    bits : int
        Bits of the grey levels.
    limited : bool
        Whether they are of limited range.

    Raises
    ------
    InputError
        If the pixel format has no plane of grey levels.
    """
    name = frame.format.name
    if name in RGB:
        return 8, False
    luma = frame.format.components[0]
    packed = name.startswith(("yuyv", "yvyu", "grayf"))
    if packed or not name.startswith(("gray", "yuv", "nv")) or luma.plane != 0:
        raise FormatError(str(path), "must have a pixel format with a plane of grey levels", name, TO_GREY)
    full = name.startswith(("gray", "yuvj")) or frame.color_range == av.video.reformatter.ColorRange.JPEG
    return luma.bits, not full


def grey_levels(frame: av.VideoFrame, path: Path, bits: int, expanded: bool, colour: bool = False) -> Frames:
    """Grey levels (height, width) of one frame, of full range.

    Parameters
    ----------
    frame : VideoFrame
        As decoded.
    path : Path
        The file, for errors.
    bits, expanded
        As of :func:`kind_of`, for the movie's first frame.
    colour : bool
        Whether colours may be there, of which the luma is given.

    Returns
    -------
    (height, width) array
        Grey levels.

    Raises
    ------
    InputError
        If a frame in red, green and blue has colour that may not be there.
    """
    if frame.format.name in RGB:
        return _luma_of_rgb(frame) if colour else _grey_of_rgb(frame, path)
    order = ">" if frame.format.is_big_endian else "<"
    stored = np.dtype(np.uint8) if bits == 8 else np.dtype(f"{order}u2")
    plane = frame.planes[0]
    # a line is padded to the codec's stride
    luma = np.frombuffer(memoryview(plane), stored).reshape(-1, plane.line_size // stored.itemsize)
    luma = luma[: frame.height, : frame.width]
    return _full_range(bits)[luma] if expanded else luma


@cache
def _full_range(bits: int) -> Frames:
    """Grey level for every limited-range luma: 16 to 235 (at 8 bits) becomes 0 to 255."""
    unit = 2 ** (bits - 8)
    black, span, white = 16 * unit, 219 * unit, 2**bits - 1
    levels = np.clip((np.arange(white + 1) - black) * (white / span), 0, white)
    return np.rint(levels).astype(np.uint8 if bits == 8 else np.uint16)


def _grey_of_rgb(frame: av.VideoFrame, path: Path) -> Frames:
    rgb = frame.to_ndarray(format="rgb24").astype(np.uint8, copy=False)
    if not (np.array_equal(rgb[..., 0], rgb[..., 1]) and np.array_equal(rgb[..., 0], rgb[..., 2])):
        raise FormatError(str(path), "must be grey", f"colours in {frame.format.name}", TO_GREY)
    return rgb[..., 0]


def _luma_of_rgb(frame: av.VideoFrame) -> Frames:
    rgb = frame.to_ndarray(format="rgb24").astype(np.float32, copy=False)
    return np.rint(rgb @ np.array(LUMA, np.float32)).astype(np.uint8)


def has_colour(frame: av.VideoFrame) -> bool:
    """Whether a frame shows colours, and not only grey levels in a format for colours.

    Parameters
    ----------
    frame : VideoFrame
        As decoded, of a format with grey levels (:func:`kind_of`).

    Returns
    -------
    bool
        True if more than a thousandth of the pixels is coloured.
    """
    name = frame.format.name
    if name.startswith("gray"):
        return False
    rgb = frame.to_ndarray(format="rgb24").astype(np.int16)
    return bool(np.mean(np.ptp(rgb, axis=2) > COLOURED) > 1e-3)
