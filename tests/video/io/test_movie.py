from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
import tifffile
from refusals import refusal

from vibrissa.video.io.container import key_frames
from vibrissa.video.io.movie import open_movie, read_blocks, write_movie

FULL = {8: (np.uint8, 255), 12: (np.uint16, 4095), 16: (np.uint16, 65535)}


def frames(bits: int, count: int = 40) -> np.ndarray:
    kind, white = FULL[bits]
    # 54 columns: no codec's line stride, so that a stride read wrongly shears the image
    return np.random.default_rng(7).integers(0, white, (count, 38, 54), endpoint=True).astype(kind)


def encode(path: Path, images: np.ndarray, codec: str, pixels: str, **options: str) -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=25, options=options)
        stream.height, stream.width, stream.pix_fmt = *images.shape[1:3], pixels
        for image in images:
            frame = av.VideoFrame.from_ndarray(image, format="rgb24" if image.ndim == 3 else "gray")
            container.mux(stream.encode(frame.reformat(format=pixels)))
        container.mux(stream.encode())
    return path


def cut_in_half(path: Path) -> Path:
    whole = path.read_bytes()
    half = path.with_name(f"half{path.suffix}")
    half.write_bytes(whole[: len(whole) // 2])
    return half


@pytest.mark.parametrize("suffix", [".mkv", ".avi", ".tif"])
@pytest.mark.parametrize("bits", [8, 12, 16])
def test_what_is_written_is_read_to_the_bit(tmp_path, suffix, bits):
    path, written = tmp_path / f"movie{suffix}", frames(bits)
    write_movie(path, [written[:17], written[17:]])
    blocks = list(read_blocks(path, frames=16))
    assert [len(block) for block in blocks] == [16, 16, 8]
    np.testing.assert_array_equal(np.concatenate(blocks), written)
    assert blocks[0].dtype == written.dtype
    movie = open_movie(path)
    assert (movie.width, movie.height, movie.frame_count, movie.lossy) == (54, 38, 40, False)
    assert movie.dtype == written.dtype


@pytest.mark.parametrize(
    ("suffix", "codec", "bits"),
    [
        (".avi", "ffvhuff", 8),
        (".avi", "ffvhuff", 16),
        (".mkv", "h264-lossless", 8),
        (".mp4", "h264-lossless", 8),
        (".avi", "h264-lossless", 8),
    ],
)
def test_other_lossless_codecs_are_exact_and_equal_movies_equal_files(tmp_path, suffix, codec, bits):
    one, other, written = tmp_path / f"one{suffix}", tmp_path / f"other{suffix}", frames(bits)
    write_movie(one, [written], codec)
    write_movie(other, [written[:7], written[7:]], codec)
    np.testing.assert_array_equal(np.concatenate(list(read_blocks(one))), written)
    assert one.read_bytes() == other.read_bytes()


def test_lossy_h264_is_near_and_told(tmp_path):
    row, column = np.mgrid[:38, :54]
    smooth = (128 + 60 * np.sin(row / 9) * np.cos(column / 11))[None] + np.arange(12)[:, None, None]
    written = np.rint(smooth).astype(np.uint8)
    write_movie(tmp_path / "movie.mp4", [written], "h264")
    read = np.concatenate(list(read_blocks(tmp_path / "movie.mp4")))
    assert open_movie(tmp_path / "movie.mp4").lossy
    assert 0 < np.abs(read.astype(int) - written).max() < 12


@pytest.mark.parametrize(
    ("name", "codec", "fields"),
    [
        ("movie.mkv", "ffvhuff", ("format", "movie.mkv", ".mkv")),
        ("movie.mp4", "ffv1", ("format", "movie.mp4", ".mp4")),
        ("movie.mkv", "vp9", ("unknown", "codec", "'vp9'")),
    ],
)
def test_codec_that_the_container_does_not_hold_is_refused(tmp_path, name, codec, fields):
    with refusal(*fields):
        write_movie(tmp_path / name, [frames(8)], codec)
    assert not list(tmp_path.iterdir())


def test_h264_takes_eight_bits_and_leaves_no_file(tmp_path):
    with refusal("format", "frames"):
        write_movie(tmp_path / "movie.mp4", [frames(16)], "h264")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("bits", [8, 16])
def test_numpy_array_is_read_to_the_bit(tmp_path, bits, order):
    written = frames(bits)
    np.save(tmp_path / "movie.npy", written.astype(written.dtype.newbyteorder(order)))
    blocks = list(read_blocks(tmp_path / "movie.npy", 16))
    np.testing.assert_array_equal(np.concatenate(blocks), written)
    assert blocks[0].dtype == written.dtype
    assert open_movie(tmp_path / "movie.npy").frame_count == 40


def test_only_a_camera_header_knows_the_frame_rate(tmp_path):
    write_movie(tmp_path / "movie.mkv", [frames(8)], playback_rate=30)
    movie = open_movie(tmp_path / "movie.mkv")
    assert np.isnan(movie.frame_rate)
    assert movie.playback_rate == 30


def test_key_frames_are_those_of_the_encoder(tmp_path):
    still = np.repeat(frames(8, 1), 40, axis=0)  # else the encoder takes every frame for a new scene
    path = encode(tmp_path / "movie.mp4", still, "mpeg4", "yuv420p", g="12")
    np.testing.assert_array_equal(key_frames(path), [0, 12, 24, 36])
    # B frames are stored after frames that are shown later
    path = encode(tmp_path / "b.mp4", frames(8), "libx264", "yuv420p", g="10", bf="2", sc_threshold="0", flags="+cgop")
    np.testing.assert_array_equal(key_frames(path), [0, 10, 20, 30])


def test_compressed_pages_of_tiff_are_read(tmp_path):
    path, written = tmp_path / "pages.tif", frames(16, 5)
    for i, page in enumerate(written):
        tifffile.imwrite(path, page, append=i > 0, compression="zlib", byteorder=">" if i == 0 else None)
    np.testing.assert_array_equal(np.concatenate(list(read_blocks(path, 2))), written)


def test_imagej_stack_of_one_page_is_read(tmp_path):
    path, written = tmp_path / "stack.tif", frames(16, 9)
    tifffile.imwrite(path, written, imagej=True)
    np.testing.assert_array_equal(np.concatenate(list(read_blocks(path, 4))), written)


def test_limited_range_is_expanded_and_full_range_is_not(tmp_path):
    ramp = np.tile(np.arange(0, 256, dtype=np.uint8), (2, 64, 1))
    limited = encode(tmp_path / "limited.mkv", ramp, "ffv1", "yuv420p")
    with av.open(str(limited)) as container:
        luma = np.frombuffer(memoryview(next(container.decode(video=0)).planes[0]), np.uint8)
    assert (luma.min(), luma.max()) == (16, 235)
    assert open_movie(limited).expanded
    (block,) = read_blocks(limited)
    # 220 levels spread over 256: half a level of 255/219, and the encoder's own rounding of as much
    assert np.abs(block.astype(int) - ramp).max() <= 1
    grey = encode(tmp_path / "grey.mkv", ramp, "ffv1", "gray")
    assert not open_movie(grey).expanded
    np.testing.assert_array_equal(next(read_blocks(grey)), ramp)


def test_grey_in_rgb_is_exact_and_colour_is_refused(tmp_path):
    grey = frames(8, 3)
    rgb = np.repeat(grey[..., None], 3, axis=3)
    np.testing.assert_array_equal(next(read_blocks(encode(tmp_path / "rgb.mkv", rgb, "ffv1", "bgr0"))), grey)
    rgb[2, 5, 5, 0] ^= 128
    with refusal("format", "colour.mkv", value="colours in bgr0"):
        list(read_blocks(encode(tmp_path / "colour.mkv", rgb, "ffv1", "bgr0")))


def test_a_movie_in_colour_is_read_as_its_luma_and_says_so(tmp_path):
    rng = np.random.default_rng(7)
    rgb = rng.integers(0, 256, (3, 32, 48, 3), dtype=np.uint8)
    movie = encode(tmp_path / "rgb.mkv", rgb, "ffv1", "bgr0")
    assert open_movie(movie).colour
    np.testing.assert_allclose(next(read_blocks(movie)), rgb @ [0.299, 0.587, 0.114], atol=0.51)
    assert open_movie(encode(tmp_path / "yuv.mp4", np.full_like(rgb, (200, 90, 20)), "mpeg4", "yuv420p")).colour
    assert not open_movie(encode(tmp_path / "grey.mp4", frames(8), "mpeg4", "yuv420p")).colour


def test_lossy_codec_is_told(tmp_path):
    movie = open_movie(encode(tmp_path / "lossy.avi", frames(8), "mpeg4", "yuv420p"))
    assert movie.lossy
    assert movie.codec == "mpeg4"
    assert movie.playback_rate == 25


@pytest.mark.parametrize(
    ("suffix", "codec", "pixels"),
    [
        (".mkv", "ffv1", "gray"),
        (".avi", "rawvideo", "gray"),
        (".avi", "mpeg4", "yuv420p"),
        (".mp4", "mpeg4", "yuv420p"),
    ],
)
def test_half_a_movie_is_an_error_that_counts_its_frames(tmp_path, suffix, codec, pixels):
    options = {"movflags": "faststart"} if suffix == ".mp4" else {}
    path = tmp_path / f"movie{suffix}"
    with av.open(str(path), "w", options=options) as container:
        stream = container.add_stream(codec, rate=25)
        stream.height, stream.width, stream.pix_fmt = 38, 54, pixels
        for image in frames(8):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray").reformat(format=pixels)))
        container.mux(stream.encode())
    assert sum(len(block) for block in read_blocks(path)) == 40
    with refusal("format"):
        list(read_blocks(cut_in_half(path), 1))


def test_half_an_mp4_whose_index_is_at_the_end_is_no_movie(tmp_path):
    path = encode(tmp_path / "movie.mp4", frames(8), "mpeg4", "yuv420p")
    with refusal("format", "half.mp4"):
        open_movie(cut_in_half(path))


def test_half_a_tiff_is_an_error(tmp_path):
    path = tmp_path / "movie.tif"
    write_movie(path, [frames(12)])
    with refusal("format", "half.tif"):
        list(read_blocks(cut_in_half(path)))


def test_half_an_imagej_stack_is_an_error(tmp_path):
    path = tmp_path / "stack.tif"
    tifffile.imwrite(path, frames(16, 10), imagej=True)
    with refusal("format", "half.tif"):
        list(read_blocks(cut_in_half(path)))


@pytest.mark.parametrize(("start", "stop"), [(0, None), (0, 5), (3, 9), (7, None), (4, 5)])
@pytest.mark.parametrize("block", [1, 3, 256])
def test_a_part_is_the_same_frames(tmp_path, start, stop, block):
    frames = np.random.default_rng(0).integers(0, 255, (10, 8, 12)).astype(np.uint8)
    np.save(tmp_path / "a.npy", frames)
    found = np.concatenate(list(read_blocks(tmp_path / "a.npy", block, start, stop)))
    np.testing.assert_array_equal(found, frames[start:stop])
    with refusal("range", "start, stop"):
        list(read_blocks(tmp_path / "a.npy", block, start, 11))


def test_missing_file_is_one_line(tmp_path):
    with refusal("missing", "none.avi") as error:
        open_movie(tmp_path / "none.avi")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("suffix", [".avi", ".mp4", ".mkv", ".tif"])
def test_text_is_no_movie(tmp_path, suffix):
    path = tmp_path / f"text{suffix}"
    path.write_text("column,row\n" * 100)
    with refusal("format"):
        open_movie(path)


def test_movie_without_frames_is_an_error(tmp_path):
    path = tmp_path / "empty.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=25)
        stream.height, stream.width, stream.pix_fmt = 38, 54, "gray"
        container.start_encoding()
    with refusal("format", "empty.mkv"):
        open_movie(path)


def test_sound_alone_is_no_movie(tmp_path):
    path = tmp_path / "sound.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), format="s16", layout="mono")
        sound.rate = 8000
        container.mux(stream.encode(sound))
    with refusal("format", "sound.mkv"):
        open_movie(path)


def test_pixel_format_without_grey_levels_is_named(tmp_path):
    path = encode(tmp_path / "packed.avi", frames(8, 3), "rawvideo", "uyvy422")
    with refusal("format", "packed.avi"):
        open_movie(path)


def test_change_of_frame_size_is_an_error(tmp_path):
    one = encode(tmp_path / "one.mjpeg", frames(8, 3), "mjpeg", "yuvj420p").read_bytes()
    other = encode(tmp_path / "other.mjpeg", frames(8, 3)[:, :30], "mjpeg", "yuvj420p").read_bytes()
    (tmp_path / "both.mjpeg").write_bytes(one + other)
    with refusal("shape", "both.mjpeg", value="54×30 after 54×38 at frame 3"):
        list(read_blocks(tmp_path / "both.mjpeg"))


def test_tiff_pages_of_two_sizes_are_an_error(tmp_path):
    path = tmp_path / "sizes.tif"
    tifffile.imwrite(path, frames(8, 1)[0])
    tifffile.imwrite(path, frames(8, 1)[0, :30], append=True)
    with refusal("shape", "sizes.tif"):
        list(read_blocks(path))


def test_colour_tiff_is_refused(tmp_path):
    path = tmp_path / "colour.tif"
    tifffile.imwrite(path, np.zeros((4, 20, 30, 3), np.uint8), photometric="rgb")
    with refusal("format", "colour.tif", "rgb") as caught:
        open_movie(path)
    assert caught.value.remedy == "save it as 8- or 16-bit grey"


def test_float_tiff_is_refused(tmp_path):
    path = tmp_path / "float.tif"
    tifffile.imwrite(path, np.zeros((5, 20, 30), np.float32), photometric="minisblack")
    with refusal("range", "float.tif"):
        open_movie(path)


@pytest.mark.parametrize(
    ("blocks", "message"),
    [
        ([], ("range", "frames")),
        ([np.zeros((2, 8, 8), np.uint8), np.zeros((2, 8, 9), np.uint8)], ("shape", "frames")),
        ([np.zeros((2, 8, 8))], ("shape", "frames")),
    ],
)
def test_frames_that_cannot_be_written_leave_no_file(tmp_path, blocks, message):
    with refusal(*message):
        write_movie(tmp_path / "movie.mkv", blocks)
    assert not list(tmp_path.iterdir())


def test_unknown_suffix_is_refused(tmp_path):
    with refusal("format", "movie.gif"):
        write_movie(tmp_path / "movie.gif", [frames(8)])


@pytest.mark.parametrize(
    "frames", [np.arange(72, dtype=np.uint8).reshape(2, 3, 4, 3), np.linspace(0, 1, 24).reshape(2, 3, 4)]
)
def test_an_array_of_colours_or_fractions_is_refused_with_the_way_to_grey_levels(tmp_path, frames):
    np.save(tmp_path / "a.npy", frames)
    with refusal("format", "a.npy") as caught:
        list(read_blocks(tmp_path / "a.npy"))
    way = caught.value.remedy.partition("save ")[2].removeprefix("the mean: ")
    np.save(tmp_path / "b.npy", eval(way, {"frames": frames}))
    assert np.concatenate(list(read_blocks(tmp_path / "b.npy"))).shape == (2, 3, 4)
