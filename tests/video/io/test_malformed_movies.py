"""Files that are no whole movies: one line each, nothing hangs, nothing wrong is read without a word."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st

from vibrissa.errors import InputError
from vibrissa.video.io.movie import open_movie, read_blocks, write_movie

SUFFIXES = [".mkv", ".avi", ".mp4", ".tif", ".npy", ".cih", ".cihx", ".mraw"]


def images(count: int = 5, height: int = 12, width: int = 18) -> np.ndarray:
    return np.random.default_rng(1).integers(0, 256, (count, height, width)).astype(np.uint8)


def written(folder: Path, suffix: str, frames: np.ndarray | None = None) -> Path:
    """A whole movie of any format."""
    frames, path = images() if frames is None else frames, folder / f"movie{suffix}"
    if suffix == ".npy":
        np.save(path, frames)
    elif suffix in (".cih", ".mraw"):
        count, height, width = frames.shape
        said = {"Total Frame": count, "Image Width": width, "Image Height": height, "Color Bit": 8}
        lines = [f"{key} : {value}" for key, value in {**said, "EffectiveBit Depth": 8}.items()]
        path.with_suffix(".cih").write_text("\n".join(lines))
        path.with_suffix(".mraw").write_bytes(frames.tobytes())
    else:
        write_movie(path, [frames], "h264-lossless" if suffix == ".mp4" else "ffv1")
    return path


def read_or_told(path: Path) -> np.ndarray | str:
    """The frames, or the one line that says why not; nothing else may come out."""
    try:
        open_movie(path)
        return np.concatenate(list(read_blocks(path, 2)))
    except InputError as error:
        told = str(error)
    assert told
    assert "\n" not in told
    return told


@pytest.mark.parametrize(
    "content", [b"", b"\0", b"\0" * 4096, b"RIFF\xff\xff\xff\xffAVI ", b"II*\0", b"column,row\n" * 99]
)
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_no_movie_is_one_line(tmp_path, suffix, content):
    path = tmp_path / f"movie{suffix}"
    path.write_bytes(content)
    assert isinstance(read_or_told(path), str)


@pytest.mark.parametrize("suffix", [".mkv", ".avi", ".mp4", ".tif", ".npy", ".mraw"])
@pytest.mark.parametrize("part", [0.02, 0.1, 0.3, 0.6, 0.9])
def test_movie_cut_anywhere_is_one_line(tmp_path, suffix, part):
    path = written(tmp_path, suffix, images(20))
    whole = path.read_bytes()
    path.write_bytes(whole[: int(part * len(whole))])
    assert isinstance(read_or_told(path), str)


@pytest.mark.parametrize("suffix", [".tif", ".npy", ".mraw"])
def test_movie_cut_at_every_length_is_one_line(tmp_path, suffix):
    path = written(tmp_path, suffix, images(2, 5, 4))
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        read = read_or_told(path)
        # nothing but padding after the last frame may be missing
        assert isinstance(read, str) or np.array_equal(read, images(2, 5, 4)), length


def test_pages_cut_at_every_length_are_one_line(tmp_path):
    path = tmp_path / "pages.tif"
    for page in images(2, 5, 4):
        tifffile.imwrite(path, page, append=path.exists(), compression="zlib")
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        read = read_or_told(path)
        assert isinstance(read, str) or np.array_equal(read, images(2, 5, 4)), length


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((4, 4), np.uint8),
        np.zeros((2, 4, 4, 3), np.uint8),
        np.zeros((2, 4, 4)),
        np.zeros((2, 4, 4), np.int16),
        np.zeros((0, 4, 4), np.uint8),
        np.zeros((2, 0, 4), np.uint8),
        np.zeros(2, [("frame", np.uint8)]),
        np.array([None]),
    ],
)
def test_array_that_is_no_movie_is_one_line(tmp_path, array):
    np.save(tmp_path / "movie.npy", array, allow_pickle=True)
    assert isinstance(read_or_told(tmp_path / "movie.npy"), str)


def test_movie_whose_name_is_a_pattern_or_a_protocol_is_read(tmp_path):
    for name in ("run%03d.mkv", "http:run.mkv", "concat:a|b.avi", " run.mkv", "Schnurrhaar µ.mkv"):
        write_movie(tmp_path / name, [images()])
        np.testing.assert_array_equal(read_or_told(tmp_path / name), images())


def test_title_in_another_encoding_does_not_matter(tmp_path):
    path = written(tmp_path, ".mkv")
    whole = path.read_bytes()
    assert whole.count(b"DURATION") == 1
    path.write_bytes(whole.replace(b"DURATION", b"DURATI\xe6N"))
    np.testing.assert_array_equal(read_or_told(path), images())


def test_folder_without_images_and_missing_file_are_one_line(tmp_path):
    assert "must hold" in read_or_told(tmp_path)
    assert "must be an existing file" in read_or_told(tmp_path / "none.mkv")


# Bytes flipped: readers of our own, and tifffile, in this process


@settings(deadline=None, max_examples=200)
@given(data=st.data(), suffix=st.sampled_from([".tif", ".npy", ".cih", ".mraw"]))
def test_flipped_bytes_are_one_line_or_frames(tmp_path_factory, data, suffix):
    path = written(tmp_path_factory.mktemp("fuzz"), suffix, images(2, 5, 4))
    content = bytearray(path.read_bytes())
    # headers are at the start: most flips there
    end = data.draw(st.sampled_from([min(len(content), 100), len(content)]))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, end - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    read_or_told(path)


@settings(deadline=None, max_examples=200)
@given(
    rest=st.binary(max_size=300), start=st.sampled_from([b"II*\0\x08\0\0\0", b"MM\0*\0\0\0\x08", b"II+\0\x08\0\0\0"])
)
def test_random_tiff_after_its_magic_is_one_line_or_frames(tmp_path_factory, rest, start):
    path = tmp_path_factory.mktemp("fuzz") / "movie.tif"
    path.write_bytes(start + rest)
    read_or_told(path)


# Bytes flipped: FFmpeg, in a process of its own, which may die without taking the tests along

DECODE = """
import sys
from pathlib import Path
from test_malformed_movies import read_or_told
for path in sorted(Path(sys.argv[1]).iterdir()):
    print(path.name, flush=True)
    read_or_told(path)
print("all read")
"""


def mutations(whole: bytes, count: int, seed: int) -> list[bytes]:
    """Copies with bytes flipped, cut out, doubled or zeroed; half of them in the first kilobyte."""
    rng, out = random.Random(seed), []
    for i in range(count):
        content = bytearray(whole)
        for _ in range(rng.choice([1, 1, 3, 20])):
            at = rng.randrange(min(len(content), 1000) if i % 2 else len(content))
            length = rng.randrange(1, 9)
            match rng.randrange(4):
                case 0:
                    content[at] ^= 1 << rng.randrange(8)
                case 1:
                    content[at : at + length] = b"\xff" * length
                case 2:
                    del content[at : at + length]
                case _:
                    content[at:at] = content[at : at + length]
        out.append(bytes(content))
    return out


@pytest.mark.parametrize(
    ("suffix", "codec"),
    [(".mkv", "ffv1"), (".avi", "ffv1"), (".avi", "ffvhuff"), (".mp4", "h264"), (".mkv", "h264-lossless")],
)
def test_mutated_containers_are_one_line_or_frames(tmp_path, suffix, codec):
    source, folder = tmp_path / f"movie{suffix}", tmp_path / "mutations"
    folder.mkdir()
    write_movie(source, [images(8, 32, 48)], codec)
    for number, content in enumerate(mutations(source.read_bytes(), 80, seed=3)):
        (folder / f"{number:03d}{suffix}").write_bytes(content)
    done = subprocess.run(
        [sys.executable, "-c", DECODE, folder],
        capture_output=True,
        text=True,
        timeout=100,
        cwd=Path(__file__).parent,
        check=False,
    )
    assert done.returncode == 0, (done.stdout[-200:], done.stderr[-2000:])
    assert done.stdout.endswith("all read\n")
