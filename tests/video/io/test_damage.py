"""Bytes flipped in the coded frames: refused with the frame, proven harmless, or named as past finding."""

from __future__ import annotations

import random
from pathlib import Path

import av
import numpy as np
import pytest
import tifffile

from vibrissa.errors import InputError
from vibrissa.video.io import encoder
from vibrissa.video.io.movie import open_movie, read_blocks, write_movie

PLACES = 24


def scene(count: int = 8) -> np.ndarray:
    """A dark line that moves, with noise."""
    rng, (row, column) = np.random.default_rng(3), np.mgrid[:48, :64]
    lines = [22 + 6 * np.sin(k / 2) + 0.1 * column for k in range(count)]
    levels = [180 - 60 * np.exp(-((row - line) ** 2)) + rng.normal(0, 2, row.shape) for line in lines]
    return np.clip(levels, 0, 255).astype(np.uint8)


def packets(path: Path) -> list[tuple[int, int]]:
    """Place and size of each coded frame in the file."""
    with av.open(str(path)) as file:
        return [(one.pos, one.size) for one in file.demux(file.streams.video[0]) if one.size]


def outcome(path: Path, true: np.ndarray) -> str | bool:
    """The refusal, or whether the frames are the true ones."""
    try:
        return np.array_equal(np.concatenate(list(read_blocks(path, 3))), true)
    except InputError as error:
        return str(error)


@pytest.mark.parametrize(
    ("suffix", "options"),
    [
        (".mkv", {}),
        (".avi", {}),
        (".mkv", {"level": "3", "slices": "12"}),
        (".mkv", {"level": "4", "strict": "-2"}),
        (".mkv", {"coder": "1", "context": "1"}),
    ],
)
def test_every_flipped_byte_of_ffv1_is_found_with_its_frame(tmp_path, suffix, options):
    path, made, places = tmp_path / f"m{suffix}", scene(), random.Random(5)
    encoder.encode(path, made, "ffv1", options, "gray", "gray", 25.0)
    assert open_movie(path).checksums
    whole, coded = path.read_bytes(), packets(path)
    for _ in range(PLACES):
        number = places.randrange(len(coded))
        start, size = coded[number]
        damaged = bytearray(whole)
        damaged[places.randrange(start, start + size)] ^= places.randrange(1, 256)
        path.write_bytes(damaged)
        found = outcome(path, made)
        assert isinstance(found, str)
        assert found.startswith(f"{path} is damaged: the checksum of frame {number} does not hold")
        assert found.endswith("copy it again, or read the frames before it alone")


@pytest.mark.parametrize("options", [{"level": "3", "slicecrc": "0"}, {"level": "1"}])
def test_ffv1_without_checksums_is_read_and_named(tmp_path, options):
    path, made = tmp_path / "m.mkv", scene()
    encoder.encode(path, made, "ffv1", options, "gray", "gray", 25.0)
    assert not open_movie(path).checksums
    assert outcome(path, made) is True


def test_the_frames_before_a_damaged_one_are_read(tmp_path):
    path, made = tmp_path / "m.mkv", scene()
    write_movie(path, [made])
    damaged, (start, size) = bytearray(path.read_bytes()), packets(path)[5]
    damaged[start + size // 2] ^= 1
    path.write_bytes(damaged)
    np.testing.assert_array_equal(np.concatenate(list(read_blocks(path, stop=5))), made[:5])
    blocks, read = read_blocks(path, 4), []
    with pytest.raises(InputError, match="the checksum of frame 5 does not hold, got 5 whole frames of 8 before it"):
        read.extend(blocks)
    np.testing.assert_array_equal(np.concatenate(read), made[:5])


def test_a_flipped_byte_of_a_deflated_tiff_is_found(tmp_path):
    path, made, places = tmp_path / "m.tif", scene(), random.Random(5)
    tifffile.imwrite(path, made, compression="zlib", photometric="minisblack", metadata=None)
    assert open_movie(path).checksums
    with tifffile.TiffFile(path) as file:
        coded = [(page.dataoffsets[0], page.databytecounts[0]) for page in file.pages]
    whole = path.read_bytes()
    for _ in range(PLACES):
        start, size = places.choice(coded)
        damaged = bytearray(whole)
        damaged[places.randrange(start, start + size)] ^= places.randrange(1, 256)
        path.write_bytes(damaged)
        assert outcome(path, made) is True or isinstance(outcome(path, made), str)


@pytest.mark.parametrize("suffix", [".mp4", ".tif", ".npy"])
def test_a_format_without_checksums_is_named(tmp_path, suffix):
    path = tmp_path / f"m{suffix}"
    if suffix == ".npy":
        np.save(path, scene())
    else:
        write_movie(path, [scene()], "h264-lossless")
    assert not open_movie(path).checksums
