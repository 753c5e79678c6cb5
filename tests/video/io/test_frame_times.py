"""Time stamps with holes and jitter: reported, and missing frames keep their place."""

from __future__ import annotations

import dataclasses
import json
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
import tifffile
from hypothesis import given
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.study.movie.track_file import track_file
from vibrissa.study.spec.settings import MovieFile
from vibrissa.video.io.frame_times import filled, frame_times
from vibrissa.video.io.movie import frame_times_of, open_movie, read_blocks, write_movie

KEPT = np.array([0, 1, 2, 3, 6, 7, 8, 9, 10, 14, 15, 16])  # two holes, of 2 and 3 frames


def scene(count: int) -> np.ndarray:
    """A dark line that sinks by half a pixel in each frame."""
    row, column = np.mgrid[:60, :120]
    lines = [20 + 0.5 * k + 0.05 * column for k in range(count)]
    return np.array([180 - 80 * np.exp(-((row - line) ** 2) / 3) for line in lines]).astype(np.uint8)


def stamped(path: Path, frames: np.ndarray, ticks: list[int], tick: Fraction, codec="ffv1", options=None) -> Path:
    """A movie whose frames have these time stamps."""
    options = options or ({"qp": "0"} if codec == "libx264" else {})
    with av.open(str(path), "w") as file:
        stream = file.add_stream(codec, rate=round(1 / tick), options=options)
        stream.height, stream.width, stream.pix_fmt = *frames.shape[1:], "gray"
        stream.codec_context.time_base = tick
        if codec == "libx264":
            stream.codec_context.color_range = av.video.reformatter.ColorRange.JPEG
        for image, at in zip(frames, ticks, strict=True):
            one = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format="gray")
            one.pts, one.time_base = int(at), tick
            file.mux(stream.encode(one))
        file.mux(stream.encode())
    return path


@given(
    st.lists(st.integers(1, 9), min_size=8, max_size=60),
    st.sampled_from([25.0, 29.97, 120.0, 240.0]),
    st.sampled_from([1e-6, 1e-3]),
)
def test_holes_among_even_frames_are_found_exactly(steps, rate, tick):
    # most intervals are one frame, as in a movie
    slots = np.cumsum([0, 1, 1, *(n for step in steps for n in (1, 1, 1, step))])
    found = frame_times(np.rint(slots / rate / tick) * tick, tick, rate)
    np.testing.assert_array_equal(found.slots, slots)
    assert found.irregular == 0
    np.testing.assert_array_equal(found.missing, sorted(set(range(slots[-1])) - set(slots.tolist())))


def test_an_even_movie_has_no_remark_at_any_rate():
    for rate in (24000 / 1001, 25, 30, 59.94, 240, 500, 700, 1000, 2000, 5000):
        found = frame_times(np.rint(np.arange(5000) / rate * 1e3) / 1e3, 1e-3, rate)
        assert found.remarks(kept=False) == []


@pytest.mark.parametrize("jitter", [0.2, 0.45])
def test_jitter_is_reported_in_frames(jitter):
    time = (np.arange(200) + np.where(np.arange(200) == 77, jitter, 0)) / 100
    (line,) = frame_times(time, 1e-6, 100.0).remarks(kept=False)
    assert line.startswith(f"the time stamps jitter: 2 intervals are off by up to {jitter:.2g} of a frame")


@pytest.mark.parametrize(
    ("name", "codec"),
    [("m.mkv", "ffv1"), ("m.avi", "ffv1"), ("m.avi", "libx264"), ("m.mp4", "libx264"), ("m.mkv", "libx264")],
)
def test_missing_frames_keep_their_place(tmp_path, name, codec):
    frames = scene(17)
    path = stamped(tmp_path / name, frames[KEPT], KEPT.tolist(), Fraction(1, 25), codec)
    found = frame_times_of(path)
    np.testing.assert_array_equal(found.slots, KEPT)
    line = "the time stamps have 2 holes, the largest of 3 frames, 5 in all"
    assert [one.partition(":")[0] for one in found.remarks(kept=True)] == [line]
    read = np.concatenate(list(read_blocks(path, 4, drop_frames="nan")))
    np.testing.assert_array_equal(read[KEPT], frames[KEPT])
    np.testing.assert_array_equal(read[[4, 5, 11, 12, 13]], frames[[3, 3, 10, 10, 10]])


@pytest.mark.parametrize("codec", ["ffv1", "rawvideo", "libx264"])
def test_empty_frames_of_avi_are_holes_and_no_damage(tmp_path, codec):
    frames = scene(17)
    path = stamped(tmp_path / "m.avi", frames[KEPT], KEPT.tolist(), Fraction(1, 25), codec)
    movie = open_movie(path)
    assert (movie.frame_count, movie.frame_count_is_estimate) == (len(KEPT), False)
    read = np.concatenate(list(read_blocks(path, 4)))
    np.testing.assert_array_equal(read, frames[KEPT])
    (line,) = frame_times_of(path).remarks(kept=False)
    assert line.startswith("the time stamps have 2 holes, the largest of 3 frames, 5 in all: ")
    assert line.endswith("later frames are timed too early; `drop_frames='nan'` corrects this")
    whole = path.read_bytes()
    for share in (0.5, 0.8, 0.95):
        path.write_bytes(whole[: int(share * len(whole))])
        with refusal("format", "m.avi"):
            list(read_blocks(path))


def test_avi_of_frames_coded_out_of_order_does_not_say_where_frames_are_missing(tmp_path):
    frames, twos = scene(17), {"crf": "1", "bf": "2", "b-adapt": "0"}
    path = stamped(tmp_path / "whole.avi", frames, list(range(17)), Fraction(1, 25), "libx264", twos)
    found = np.concatenate(list(read_blocks(path, 4, drop_frames="nan")))
    np.testing.assert_allclose(found, frames.astype(float), atol=8)  # [grey levels]
    path = stamped(tmp_path / "m.avi", frames[KEPT], KEPT.tolist(), Fraction(1, 25), "libx264", twos)
    np.testing.assert_allclose(np.concatenate(list(read_blocks(path, 4))), frames[KEPT].astype(float), atol=8)
    (line,) = frame_times_of(path).remarks(kept=False)
    assert line.endswith("later frames are timed too early")
    with refusal("format", "m.avi", "AVI with frames that are coded out of order"):
        list(read_blocks(path, drop_frames="nan"))


def tracked(path: Path, **how):
    movie = MovieFile(path=str(path), frame_rate=100.0, pixel_size=1e-4, seeds=((60.0, 23.0),), **how)
    return track_file(movie, Path(), lambda *_: None)


def test_a_profile_has_the_right_times_and_no_values_where_frames_are_missing(tmp_path):
    frames, missing = scene(17), [4, 5, 11, 12, 13]
    whole = write_movie(tmp_path / "whole.mkv", [frames])
    whole = tracked(tmp_path / "whole.mkv")
    path = stamped(tmp_path / "m.mkv", frames[KEPT], KEPT.tolist(), Fraction(1, 25))
    kept = tracked(path, drop_frames="nan")
    np.testing.assert_allclose(kept.time, np.arange(17) / 100)
    assert np.isnan(kept.y.values[0, missing]).all()
    there = kept.y.values[0, KEPT]
    assert np.isfinite(there).any(axis=1).all()
    np.testing.assert_allclose(there, whole.y.values[0, KEPT], atol=2e-6)  # [m], 0.02 px
    assert json.loads(kept.attrs["lost"])[0] == [[4, 5, "not in the movie"], [11, 13, "not in the movie"]]
    assert kept.attrs["missing_frames"] == 5
    assert "counted in the numbers of frames" in kept.attrs["remarks"]
    part = tracked(path, drop_frames="nan", start=3, stop=9)
    np.testing.assert_allclose(part.time, np.arange(3, 9) / 100)
    assert json.loads(part.attrs["lost"])[0] == [[1, 2, "not in the movie"]]


def holed_folder(path: Path) -> Path:
    """Images whose numbers leave out those of the missing frames."""
    path.mkdir()
    for number in KEPT:
        tifffile.imwrite(path / f"{number + 1:05d}.tif", scene(17)[number])
    return path


@pytest.mark.parametrize("of", ["stamps", "numbers"])
@pytest.mark.parametrize("tracking", ["follow", "link"])
def test_a_part_is_counted_with_the_missing_frames(tmp_path, of, tracking):
    """Frames 14 to 16 are the last three of 12 pictures."""
    path = holed_folder(tmp_path / "images") if of == "numbers" else tmp_path / "m.mp4"
    if of == "stamps":
        stamped(path, scene(17)[KEPT], KEPT.tolist(), Fraction(1, 25), "libx264")
    how = {"tracking": tracking, "drop_frames": "nan", "seeds": ((60.0, 23.0),) if tracking == "follow" else ()}
    movie = MovieFile(path=str(path), frame_rate=100.0, pixel_size=1e-4, start=9, stop=17, **how)
    done: list[tuple[int, int]] = []
    profile = track_file(movie, Path(), lambda _, now, total: done.append((now, total)))
    np.testing.assert_allclose(profile.time, np.arange(9, 17) / 100)
    assert np.isfinite(profile.y.values[0]).any(axis=1).tolist() == [True, True, False, False, False, True, True, True]
    assert (8, 8) in done
    with pytest.raises(InputError, match=r"must lie within the 17 frames of the movie, got \(9, 18\)"):
        track_file(dataclasses.replace(movie, stop=18), Path(), lambda *_: None)


def test_missing_frames_are_missing_where_lines_are_linked(tmp_path):
    path = stamped(tmp_path / "m.mkv", scene(17)[KEPT], KEPT.tolist(), Fraction(1, 25))
    movie = MovieFile(path=str(path), frame_rate=100.0, pixel_size=1e-4, tracking="link", drop_frames="nan")
    profile = track_file(movie, Path(), lambda *_: None)
    np.testing.assert_allclose(profile.time, np.arange(17) / 100)
    assert np.isnan(profile.y.values[:, [4, 5, 11, 12, 13]]).all()
    assert np.isfinite(profile.y.values[0, KEPT]).any(axis=1).mean() > 0.9


def head_of_deeplabcut(path: Path, frames: np.ndarray) -> str:
    """Predictions, a row for each of these frames, of a head that moves by 0.1 px in a frame."""
    cells = ",".join(f"{point}" for point in ("neck",) * 3 + ("nose",) * 3)
    lines = [f"scorer{',net' * 6}", f"bodyparts,{cells}", "coords,x,y,likelihood,x,y,likelihood"]
    lines += [f"{row},{20 + 0.1 * at},30,1,{40 + 0.1 * at},30,1" for row, at in enumerate(frames)]
    path.write_text("\n".join(lines) + "\n")
    return str(path)


@pytest.mark.parametrize("rows", [KEPT, np.arange(17)], ids=["pictures", "frames"])
def test_the_head_of_each_picture_is_in_the_frame_of_that_picture(tmp_path, rows):
    path = stamped(tmp_path / "m.mkv", scene(17)[KEPT], KEPT.tolist(), Fraction(1, 25))
    head = head_of_deeplabcut(tmp_path / "head.csv", rows)
    how = {"tracking": "link", "drop_frames": "nan", "head": head, "head_points": ("neck", "nose")}
    movie = MovieFile(path=str(path), frame_rate=100.0, pixel_size=1e-4, **how)
    profile = track_file(movie, Path(), lambda *_: None)
    np.testing.assert_allclose(profile.head_column[KEPT], 40 + 0.1 * KEPT, atol=1e-9)
    part = track_file(dataclasses.replace(movie, start=8, stop=16), Path(), lambda *_: None)
    np.testing.assert_allclose(part.head_column[[0, 1, 2, 6]], 40 + 0.1 * np.array([8, 9, 10, 14]), atol=1e-9)


@pytest.mark.parametrize(("rows", "drop"), [(11, None), (11, "nan"), (13, "nan"), (18, "nan")])
def test_a_head_of_other_pictures_is_refused(tmp_path, rows, drop):
    path = stamped(tmp_path / "m.mkv", scene(17)[KEPT], KEPT.tolist(), Fraction(1, 25))
    head = head_of_deeplabcut(tmp_path / "head.csv", np.arange(rows))
    movie = MovieFile(path=str(path), frame_rate=100.0, pixel_size=1e-4, tracking="link", drop_frames=drop, head=head)
    counted = "12 pictures, or of its 17 frames" if drop else "12 frames"
    with pytest.raises(InputError, match=rf"must have a row for each of the movie's {counted}, got {rows}"):
        track_file(movie, Path(), lambda *_: None)


def test_by_default_holes_are_reported_alone(tmp_path):
    path = stamped(tmp_path / "m.mkv", scene(17)[KEPT], KEPT.tolist(), Fraction(1, 25))
    profile = tracked(path)
    assert profile.sizes["time"] == len(KEPT)
    assert any("2 holes, the largest of 3 frames, 5 in all" in one for one in json.loads(profile.attrs["remarks"]))


def test_what_is_not_known_is_refused(tmp_path):
    ticks = np.arange(12) * 10 + np.array([0, 4] * 6)
    path = stamped(tmp_path / "m.mkv", scene(12), ticks.tolist(), Fraction(1, 250))
    with pytest.raises(InputError, match=r"must have time stamps that jitter by 0\.25 of a frame at most"):
        list(read_blocks(path, drop_frames="nan"))
    write_movie(tmp_path / "m.tif", [scene(3)])
    with pytest.raises(InputError, match=r"drop_frames must be left out: .*m\.tif has no time stamps"):
        list(read_blocks(tmp_path / "m.tif", drop_frames="nan"))
    assert frame_times_of(tmp_path / "m.tif") is None
    assert open_movie(path).frame_count


def test_more_or_fewer_frames_than_stamps_are_refused():
    blocks = [np.zeros((3, 2, 2), np.uint8)] * 2
    for count in (5, 7):
        with pytest.raises(InputError, match=f"must have a time stamp for each frame, got {count} for 6"):
            list(filled(blocks, np.arange(count), "m.mkv"))


def test_a_folder_whose_images_have_gaps_gives_missing_frames(tmp_path):
    path = holed_folder(tmp_path / "images")
    kept = tracked(path, drop_frames="nan")
    np.testing.assert_allclose(kept.time, np.arange(17) / 100)
    assert np.isnan(kept.y.values[0, [4, 5, 11, 12, 13]]).all()
    assert np.isfinite(kept.y.values[0, KEPT]).any(axis=1).all()
    told = json.loads(tracked(path).attrs["remarks"])
    assert any("numbers of the images have 2 holes, the largest of 3 frames, 5 in all" in one for one in told)


def test_a_folder_of_lossy_images_is_tracked(tmp_path):
    for number, image in enumerate(scene(8)):
        with av.open(str(tmp_path / f"{number}.jpg"), "w", format="image2") as file:
            stream = file.add_stream("mjpeg", rate=25)
            stream.height, stream.width, stream.pix_fmt = *image.shape, "yuvj420p"
            file.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray")))
            file.mux(stream.encode())
    profile = tracked(tmp_path)
    assert np.isfinite(profile.y.values[0]).any(axis=1).all()
    assert any("mjpeg may have altered" in one for one in json.loads(profile.attrs["remarks"]))
