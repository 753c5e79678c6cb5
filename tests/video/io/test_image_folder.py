from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
import tifffile
from refusals import refusal

from vibrissa.video.io.movie import frame_times_of, open_movie, read_blocks

CODECS = {".png": "png", ".bmp": "bmp", ".jpg": "mjpeg"}


def grey(count: int, bits: int = 8) -> np.ndarray:
    drawn = np.random.default_rng(11).integers(0, 2**bits, (count, 20, 31))
    return drawn.astype(np.uint8 if bits == 8 else np.uint16)


def save(path: Path, image: np.ndarray) -> None:
    if path.suffix in (".tif", ".tiff"):
        tifffile.imwrite(path, image)
        return
    codec = av.CodecContext.create(CODECS[path.suffix], "w")
    pixels = {"png": "gray" if image.dtype == np.uint8 else "gray16be", "bmp": "gray", "mjpeg": "yuvj420p"}[codec.name]
    if image.ndim == 3:
        pixels = "rgb24"
    codec.height, codec.width, codec.pix_fmt, codec.time_base = *image.shape[:2], pixels, Fraction(1, 25)
    source = "rgb24" if image.ndim == 3 else "gray" if image.dtype == np.uint8 else "gray16le"
    frame = av.VideoFrame.from_ndarray(image, format=source).reformat(format=pixels)
    path.write_bytes(b"".join(bytes(packet) for packet in [*codec.encode(frame), *codec.encode(None)]))


def folder_of(path: Path, images: np.ndarray, name: str, start: int = 1) -> Path:
    for number, image in enumerate(images, start):
        save(path / name.format(number), image)
    return path


@pytest.mark.parametrize(("suffix", "bits"), [(".png", 8), (".png", 16), (".tif", 8), (".tif", 16), (".bmp", 8)])
def test_images_are_read_to_the_bit_in_the_order_of_their_numbers(tmp_path, suffix, bits):
    # 8, 9, 10, ...: by letters, 10 would come first
    written = grey(7, bits)
    path = folder_of(tmp_path, written, "C1-whisker2_{}" + suffix, start=8)
    blocks = list(read_blocks(path, 3))
    assert [len(block) for block in blocks] == [3, 3, 1]
    np.testing.assert_array_equal(np.concatenate(blocks), written)
    movie = open_movie(path)
    assert (movie.width, movie.height, movie.bits, movie.frame_count, movie.lossy) == (31, 20, bits, 7, False)
    assert not movie.frame_count_is_estimate


def test_jpeg_images_are_told_to_be_lossy(tmp_path):
    path = folder_of(tmp_path, grey(2), "{:04d}.jpg")
    assert open_movie(path).lossy
    assert next(read_blocks(path)).shape == (2, 20, 31)


def test_other_files_and_hidden_ones_are_left_alone(tmp_path):
    path = folder_of(tmp_path, grey(3), "{:03d}.png")
    (path / "notes.txt").write_text("whisker C1")
    (path / "._001.png").write_bytes(b"\0\5")
    assert open_movie(path).frame_count == 3


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["1.png", "2.png", "02.png"], ("format",)),
        (["1.png", "2.bmp"], ("format",)),
        (["left1.png", "right2.png"], ("too-few",)),
        (["1a.png", "2b.png"], ("too-few",)),
        (["first.png"], ("format", "first.png")),
        ([], ("format",)),
    ],
)
def test_names_that_are_no_series_are_refused(tmp_path, names, message):
    for name in names:
        save(tmp_path / name, grey(1)[0])
    with refusal(*message) as error:
        open_movie(tmp_path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("other", [grey(1)[0, :19], grey(1, 16)[0]])
def test_image_of_another_size_or_type_is_named(tmp_path, other):
    path = folder_of(tmp_path, grey(3), "{}.png")
    save(path / "4.png", other)
    with refusal("shape", "4.png"):
        list(read_blocks(path))


def test_image_in_colour_is_refused(tmp_path):
    path = folder_of(tmp_path, grey(3), "{}.png")
    save(path / "4.png", np.random.default_rng(0).integers(0, 255, (20, 31, 3)).astype(np.uint8))
    with refusal("format", "4.png"):
        list(read_blocks(path))


def test_stack_among_images_is_refused(tmp_path):
    path = folder_of(tmp_path, grey(3), "{}.tif")
    tifffile.imwrite(path / "4.tif", grey(2), photometric="minisblack")
    with refusal("too-few", "4.tif", value="2"):
        list(read_blocks(path))


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".jpg", ".tif"])
def test_image_cut_in_half_is_an_error(tmp_path, suffix):
    path = folder_of(tmp_path, grey(3), "{}" + suffix)
    whole = (path / f"3{suffix}").read_bytes()
    (path / f"3{suffix}").write_bytes(whole[: len(whole) // 2])
    with refusal("format"):
        list(read_blocks(path))


def test_a_gap_in_the_numbers_is_reported_and_can_be_kept(tmp_path):
    written = grey(9)
    path = folder_of(tmp_path, written, "f{:05d}.png", start=8)
    for number in (12, 14, 15):
        (path / f"f{number:05d}.png").unlink()
    left = [0, 1, 2, 3, 5, 8]
    times = frame_times_of(path)
    np.testing.assert_array_equal(times.slots, left)
    line = "the numbers of the images have 2 holes, the largest of 2 frames, 3 in all"
    assert [one.partition(":")[0] for one in times.remarks(kept=False)] == [line]
    np.testing.assert_array_equal(np.concatenate(list(read_blocks(path))), written[left])
    kept = np.concatenate(list(read_blocks(path, 2, drop_frames="nan")))
    np.testing.assert_array_equal(kept, written[[0, 1, 2, 3, 3, 5, 5, 5, 8]])


def test_numbers_in_even_steps_are_all_frames_and_it_is_said(tmp_path):
    path = folder_of(tmp_path, grey(5), "{}0.png")
    (line,) = frame_times_of(path).remarks(kept=True)
    assert line == "the numbers of the images rise in steps of 10: each step counts as one frame"
    assert len(frame_times_of(path).missing) == 0


def test_a_number_far_from_the_others_takes_no_memory(tmp_path):
    path = folder_of(tmp_path, grey(3), "{}.png")
    save(path / "999999999999999999.png", grey(1)[0])
    assert "1 hole, the largest of 999999999999999995 frames" in frame_times_of(path).remarks(kept=False)[0]
    with refusal("range", value="999999999999999995 missing, 4 there"):
        list(read_blocks(path, drop_frames="nan"))
