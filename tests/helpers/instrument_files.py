"""Small whole files of instruments: a map of three lines of 60 points, 10 µm apart, in several formats."""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np

NX, NY, STEP = 60, 3, 1e-5  # points, lines, [m]
HEIGHTS = 1e-8 * ((7 * np.arange(NX) + np.arange(NY)[:, None]) % 11)  # (y, x) [m]


def tmd() -> bytes:
    """TrueMap, in mm."""
    head = b"Binary TrueMap Data File v2.0\r\n\0".ljust(32, b"\0") + b"Created by TrueMap v6\r\n\0".ljust(24, b"\0")
    sizes = struct.pack("<2I4f", NX, NY, 1e3 * NX * STEP, 1e3 * NY * STEP, 0, 0)
    return head + sizes + (1e3 * HEIGHTS).astype("<f4").tobytes()


def os3d() -> bytes:
    """OmniSurf3D, in µm."""
    said = b"OmniSurf3D" + struct.pack("<2i", 1, 0) + struct.pack("<I", 1) + b"a" + struct.pack("<I", 1) + b"b"
    sizes = struct.pack("<2i4d", NX, NY, 1e6 * STEP, 1e6 * STEP, 0, 0)
    return said + sizes + (1e6 * HEIGHTS).astype("<f4").tobytes()


def al3d() -> bytes:
    """Alicona: tags of text, then heights in m."""
    tags = {"Cols": NX, "Rows": NY, "PixelSizeXMeter": STEP, "PixelSizeYMeter": STEP}
    tags |= {"InvalidPixelValue": "NaN", "DepthImageOffset": 17 + 52 * 8 + 256}
    every = {"Version": 1, "TagCount": len(tags), **tags}
    lines = b"".join(
        key.encode().ljust(20, b"\0") + str(value).encode().ljust(30, b"\0") + b"\r\n" for key, value in every.items()
    )
    return b"AliconaImaging\0\r\n" + lines + bytes(256) + HEIGHTS.astype("<f4").tobytes()


def sur() -> bytes:
    """Digital Surf: a head of 512 bytes, whole numbers of 10 nm."""
    values = (HEIGHTS / 1e-8).round().astype("<i2")
    names = [one.encode().ljust(16, b"\0") for one in ("X", "Y", "Z", *["m"] * 6)]
    head = b"DIGITAL SURF" + struct.pack("<4H", 0, 1, 1, 2) + bytes(60) + struct.pack("<5H", 0, 0, 0, 0, 1) + bytes(8)
    head += struct.pack("<H4iI3f", 16, 0, 10, NX, NY, NX * NY, STEP, STEP, 1e-8) + b"".join(names)
    head += struct.pack("<3f3H", 1, 1, 1, 0, 0, 0) + bytes(12) + struct.pack("<7H", 0, 0, 12, 1, 1, 2014, 0)
    head += struct.pack("<f", 1) + bytes(10) + struct.pack("<2H", 0, 0) + bytes(128 + 12 + 34)
    return head + values.tobytes()


def bcr() -> bytes:
    """BCR: a head of text, then heights in nm."""
    said = {"fileformat": "bcrf", "headersize": 2048, "xpixels": NX, "ypixels": NY, "intelmode": 1}
    said |= {"xlength": 1e9 * NX * STEP, "ylength": 1e9 * NY * STEP, "xunit": "nm", "yunit": "nm", "zunit": "nm"}
    text = "".join(f"{key} = {value}\n" for key, value in said.items())
    return text.encode().ljust(2048, b" ") + (1e9 * HEIGHTS).astype("<f4").tobytes()


def gwy() -> bytes:
    """Gwyddion: objects within objects."""
    unit = b"GwySIUnit\0" + _sized(b"unitstr\0s" + b"m\0")
    field = b"".join(b"%s\0i" % name + struct.pack("<i", size) for name, size in ((b"xres", NX), (b"yres", NY)))
    field += b"".join(
        b"%s\0d" % name + struct.pack("<d", size * STEP) for name, size in ((b"xreal", NX), (b"yreal", NY))
    )
    field += b"".join(b"si_unit_%s\0o" % name + unit for name in (b"xy", b"z"))
    field += b"data\0D" + struct.pack("<I", HEIGHTS.size) + HEIGHTS.astype("<f8").tobytes()
    return b"GWYPGwyContainer\0" + _sized(b"/0/data\0oGwyDataField\0" + _sized(field))


def _sized(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


def hfm() -> bytes:
    """A profile as text, with a mark of validity."""
    rows = [f"{8 + x * STEP * 1e3:.3f};{106 + np.cos(x):.6f};1" for x in range(NX)]
    return "\n".join(["X;Y;valid", "[mm];[um];[1/0]", *rows, ""]).encode()


MAPS: dict[str, Callable[[], bytes]] = {one.__name__: one for one in (tmd, os3d, al3d, sur, bcr, gwy)}
REAL = Path(__file__).parents[2] / ".." / "shared" / "data" / "topography"  # files that instruments wrote
