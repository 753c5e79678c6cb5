"""Frames in any order are those of the movie in its order."""

import numpy as np
import pytest
import tifffile
from refusals import refusal

from vibrissa.video.io.frame_store import FrameStore
from vibrissa.video.io.movie import write_movie

SHAPE = (50, 24, 32)


@pytest.fixture
def frames():
    return np.random.default_rng(0).integers(0, 256, SHAPE).astype(np.uint8)


def test_any_frame_at_any_time(tmp_path, frames):
    write_movie(tmp_path / "movie.mkv", [frames])
    store = FrameStore(tmp_path / "movie.mkv")
    for number in (49, 0, 17, 16, 49):
        shown = np.frombuffer(store.frame(number), np.uint8).reshape(SHAPE[1:])
        np.testing.assert_array_equal(shown, frames[number])
    for number in (50, -1):
        with refusal("range", "frame", str(number)):
            store.frame(number)
    store.close()


def test_a_missing_frame_shows_the_one_before_it(tmp_path, frames):
    kept = [0, 1, 2, 5, 6]
    for number in kept:
        tifffile.imwrite(tmp_path / f"{number:02d}.tif", frames[number])
    store = FrameStore(tmp_path, "nan")
    for number, shown in enumerate([0, 1, 2, 2, 2, 5, 6]):
        assert store.frame(number) == frames[shown].tobytes()
    store.close()


def test_sixteen_bits_are_shown_over_the_range_of_the_first_frames(tmp_path, frames):
    np.save(tmp_path / "movie.npy", frames.astype(np.uint16) * 16 + 100)
    store = FrameStore(tmp_path / "movie.npy")
    low, high = int(frames[:16].min()), int(frames[:16].max())
    wanted = np.clip(np.rint((frames[40].astype(float) - low) * 255 / (high - low)), 0, 255)
    np.testing.assert_array_equal(np.frombuffer(store.frame(40), np.uint8), wanted.ravel())
    store.close()


def test_a_movie_that_is_damaged_later_shows_what_is_whole(tmp_path, frames):
    path = tmp_path / "movie.mkv"
    write_movie(path, [frames])
    path.write_bytes(path.read_bytes()[:-9000])
    store = FrameStore(path)
    assert len(store.frame(0)) == SHAPE[1] * SHAPE[2]
    with refusal("format", str(path)):
        store.frame(49)
    store.close()


def test_no_movie_is_refused(tmp_path):
    with refusal("missing"):
        FrameStore(tmp_path / "movie.mkv")


def test_a_full_disk_is_one_line(tmp_path, frames, monkeypatch):
    class Full:
        def seek(self, *_):
            raise OSError(28, "No space left on device")

        def close(self):
            pass

    write_movie(tmp_path / "movie.mkv", [frames])
    monkeypatch.setattr("tempfile.TemporaryFile", Full)
    store = FrameStore(tmp_path / "movie.mkv")
    with refusal("machine"):
        store.frame(0)
    store.close()


def test_whatever_ends_the_decoding_is_said_to_whoever_asks_for_a_frame(tmp_path, frames, monkeypatch):
    def failing(*_, **__):
        yield frames[:16]
        raise MemoryError("no room")

    write_movie(tmp_path / "movie.mkv", [frames])
    monkeypatch.setattr("vibrissa.video.io.frame_store.read_blocks", failing)
    store = FrameStore(tmp_path / "movie.mkv")
    assert len(store.frame(3)) == SHAPE[1] * SHAPE[2]
    with pytest.raises(MemoryError, match="no room"):
        store.frame(20)
    store.close()


def test_what_fails_before_the_first_frame_is_said_too(tmp_path, frames, monkeypatch):
    def failing(*_, **__):
        raise MemoryError("no room")

    write_movie(tmp_path / "movie.mkv", [frames])
    monkeypatch.setattr("vibrissa.video.io.frame_store.read_blocks", failing)
    store = FrameStore(tmp_path / "movie.mkv")
    with pytest.raises(MemoryError, match="no room"):
        store.frame(0)
    store.close()
