"""Marks of a container by which players show frames turned, mirrored or wider than they are stored."""

from __future__ import annotations

import struct
import subprocess
import sys
import zlib
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from av.stream import Disposition
from PIL import Image
from refusals import refusal

from vibrissa.video.io.movie import open_movie, read_blocks

# rows of the matrix of a track (ISO/IEC 14496-12): x' = a x + c y, y' = b x + d y with y downwards
CLOCKWISE = {1: (0, 1, -1, 0), 2: (-1, 0, 0, -1), 3: (0, -1, 1, 0)}
MIRRORED = {
    "left for right": (-1, 0, 0, 1),
    "upside down": (1, 0, 0, -1),
    "transposed": (0, 1, 1, 0),
    "across": (0, -1, -1, 0),
}


def encode(path: Path, aspect: Fraction | None = None) -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=25)
        stream.height, stream.width, stream.pix_fmt = 38, 54, "yuv420p"
        if aspect is not None:
            stream.codec_context.sample_aspect_ratio = aspect
        for image in np.random.default_rng(7).integers(0, 256, (3, 38, 54), np.uint8):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray").reformat(format="yuv420p")))
        container.mux(stream.encode())
    return path


def marked(path: Path, matrix: tuple[int, ...]) -> Path:
    """The movie with this matrix of its track."""
    content = bytearray(path.read_bytes())
    at = content.index(b"tkhd") + 44  # behind version, flags, times, number, duration, layer, group and volume
    a, b, c, d = matrix
    content[at : at + 36] = struct.pack(">9i", a << 16, b << 16, 0, c << 16, d << 16, 0, 0, 0, 1 << 30)
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("turns", CLOCKWISE)
def test_frames_are_turned_as_the_rotation_mark_says(tmp_path, turns):
    path = encode(tmp_path / "a.mp4")
    upright = np.concatenate(list(read_blocks(path)))
    marked(path, CLOCKWISE[turns])
    np.testing.assert_array_equal(np.concatenate(list(read_blocks(path))), np.rot90(upright, -turns, axes=(1, 2)))
    movie = open_movie(path)
    assert (movie.height, movie.width) == ((54, 38) if turns % 2 else (38, 54))


@pytest.mark.parametrize("way", MIRRORED)
def test_a_mirrored_picture_is_refused(tmp_path, way):
    with refusal("format", "a.mp4", "a mirrored picture") as caught:
        open_movie(marked(encode(tmp_path / "a.mp4"), MIRRORED[way]))
    assert "ffmpeg -i IN" in caught.value.remedy


@pytest.mark.parametrize("suffix", [".mp4", ".mkv"])
@pytest.mark.parametrize("aspect", [Fraction(2), Fraction(10, 11)])
def test_pixels_that_are_not_square_are_refused(tmp_path, suffix, aspect):
    with refusal("format", f"a{suffix}", f"{float(aspect):g} times as wide as high") as caught:
        open_movie(encode(tmp_path / f"a{suffix}", aspect))
    assert "scale=iw*sar:ih,setsar=1" in caught.value.remedy


@pytest.mark.parametrize("aspect", [None, Fraction(1), Fraction(54, 55)])
def test_a_width_rounded_to_whole_pixels_leaves_them_square(tmp_path, aspect):
    assert open_movie(encode(tmp_path / "a.mp4", aspect)).width == 54


def chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".webp"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_picture_is_turned_as_its_exif_says(tmp_path, suffix, orientation):
    picture = np.full((40, 60), 200, np.uint8)
    picture[:10, :10] = 20
    exif = Image.Exif()
    exif[274], exif[271] = orientation, "the maker"
    path = tmp_path / f"a{suffix}"
    Image.fromarray(picture).convert("RGB" if suffix == ".webp" else "L").save(path, exif=exif)
    if orientation in (2, 4, 5, 7):
        with refusal("format", f"a{suffix}", "a mirrored picture"):
            open_movie(path)
        return
    (frame,) = np.concatenate(list(read_blocks(path)))
    quarters = {1: 0, 3: 2, 6: 3, 8: 1}[orientation]  # anticlockwise
    assert np.max(np.abs(frame.astype(float) - np.rot90(picture, quarters))[::3, ::3]) < 30


@pytest.mark.parametrize("orientation", [1, 2, 3, 4, 5, 6, 7, 8])
def test_a_tiff_must_be_stored_upright(tmp_path, orientation):
    exif = Image.Exif()
    exif[274] = orientation
    Image.fromarray(np.full((40, 60), 200, np.uint8)).save(tmp_path / "a.tif", exif=exif)
    if orientation == 1:
        assert open_movie(tmp_path / "a.tif").width == 60
        return
    with refusal("format", "a.tif", f"orientation {orientation}"):
        open_movie(tmp_path / "a.tif")


def test_a_movie_of_png_has_its_marks_before_its_frames(tmp_path):
    exif = Image.Exif()
    frames = [Image.fromarray(np.full((40, 60), 200 - k, np.uint8)) for k in range(3)]
    for orientation, name in ((6, "turned.png"), (2, "mirrored.png")):
        exif[274] = orientation
        frames[0].save(tmp_path / name, save_all=True, append_images=frames[1:], exif=exif)
    movie = open_movie(tmp_path / "turned.png")
    assert (movie.codec, movie.width, movie.height) == ("apng", 40, 60)
    with refusal("format", "mirrored.png", "a mirrored picture"):
        open_movie(tmp_path / "mirrored.png")


def test_damaged_exif_is_no_mark(tmp_path):
    path = tmp_path / "a.jpg"
    Image.fromarray(np.full((40, 60), 200, np.uint8)).save(path, exif=b"Exif\0\0II*\0\xff\xff\xff\xff")
    assert open_movie(path).width == 60


@pytest.mark.parametrize("title", [False, True])
def test_a_second_movie_is_refused_and_a_title_picture_left_out(tmp_path, title):
    path = tmp_path / "a.mp4"
    with av.open(str(path), "w") as container:
        for codec, pixels in (("mpeg4", "yuv420p"), ("mjpeg", "yuvj420p") if title else ("mpeg4", "yuv420p")):
            stream = container.add_stream(codec, rate=25)
            stream.height, stream.width, stream.pix_fmt = 38, 54, pixels
        if title:
            stream.disposition = Disposition.attached_pic
        for one in container.streams.video:
            grey = av.VideoFrame.from_ndarray(np.full((38, 54), 100, np.uint8), format="gray")
            container.mux(one.encode(grey.reformat(format=one.pix_fmt)))
            container.mux(one.encode())
    if title:
        assert open_movie(path).codec == "mpeg4"
        return
    with refusal("too-few", "a.mp4", "2") as caught:
        open_movie(path)
    assert "-map 0:v:0" in caught.value.remedy


def test_a_still_with_a_named_colour_profile_is_read_and_left(tmp_path):
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 60, 40, 8, 0, 0, 0, 0))
    profile = chunk(b"iCCP", b"grey\0\0" + zlib.compress(bytes(128)))
    rows = chunk(b"IDAT", zlib.compress(bytes(40 * 61)))
    path = tmp_path / "a.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + header + profile + rows + chunk(b"IEND", b""))
    # a process of its own, as memory that is freed twice ends it
    read = "import gc, sys; from vibrissa.video.io.movie import open_movie; print(open_movie(sys.argv[1]).width)"
    done = subprocess.run([sys.executable, "-c", f"{read}; gc.collect()", path], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "60\n")
