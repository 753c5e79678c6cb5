"""WHISK's files: read to the last byte, written as WHISK reads them, and the whiskers that are in them."""

import platform
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from real_data import real, whisk_segments
from refusals import refusal

from vibrissa.video.foreign.tracks import kind_of, read_tracks
from vibrissa.video.foreign.whisk_files import (
    Segment,
    packed_measurements,
    packed_whiskers,
    read_measurements,
    read_whiskers,
)
from vibrissa.video.foreign.whisk_profile import KnownSegment, known_of, profile_from_whisk, write_whiskers
from vibrissa.video.tracking import Calibration

REAL = ["tracks/test", "whiskiwrap-movies/test_video2"]
CALIBRATION = Calibration(frame_rate=500.0, pixel_size=1e-4)


@pytest.fixture
def program(tmp_path):
    """Give WHISK's own programs by name, where its wheel is installed."""

    def give(name: str) -> Path:
        spec = find_spec("whisk")
        path = Path(spec.submodule_search_locations[0]) / "bin" / name if spec else None
        if path is None or sys.platform != "linux" or platform.machine() != "x86_64":
            pytest.skip("WHISK's own programs (whisk-janelia) are not here")
        copy = Path(shutil.copy(path, tmp_path))
        copy.chmod(0o755)  # a wheel does not keep that
        return copy

    return give


def line(frame: int, wid: int, points: int = 200, *, slide: int = 0, rise: float = 0.0) -> Segment:
    """A circle of radius 300 px from (40, 60): one point per pixel of arc, the first ``slide`` of them not traced."""
    angle = np.arange(slide, points) / 300
    x, y = 40 + 300 * np.sin(angle), 60 + 300 * (1 - np.cos(angle)) + rise
    return Segment(frame, wid, x, y, np.full(x.size, 2.0), np.full(x.size, 100.0))


# Bytes


@pytest.mark.parametrize("name", REAL)
def test_real_files_are_read_to_the_last_byte_and_written_back_as_they_were(name, tmp_path):
    traces, measures = real(f"{name}.whiskers"), real(f"{name}.measurements")
    segments, table = read_whiskers(traces), read_measurements(measures)
    (tmp_path / "a.whiskers").write_bytes(packed_whiskers(segments))
    (tmp_path / "a.measurements").write_bytes(packed_measurements(table))
    assert (tmp_path / "a.whiskers").read_bytes() == traces.read_bytes()
    assert (tmp_path / "a.measurements").read_bytes() == measures.read_bytes()
    assert {(one.frame, one.wid) for one in segments} == set(known_of(table))


@pytest.mark.parametrize("name", REAL)
def test_real_segments_agree_with_another_reader(name):
    path = real(f"{name}.whiskers")
    for mine, other in zip(read_whiskers(path), whisk_segments(path), strict=True):
        order = np.argsort(mine.x, kind="stable")
        assert mine.frame == other.frame
        np.testing.assert_array_equal([mine.x[order], mine.y[order]], [other.x, other.y])


@pytest.mark.parametrize("name", REAL)
def test_measured_lengths_and_ends_are_those_of_the_segments(name):
    segments, table = read_whiskers(real(f"{name}.whiskers")), read_measurements(real(f"{name}.measurements"))
    data = {(int(row["frame"]), int(row["wid"])): row["data"] for row in table}
    for one in segments:
        row, ends = data[one.frame, one.wid], {(one.x[0], one.y[0]), (one.x[-1], one.y[-1])}
        assert {(row[4], row[5]), (row[6], row[7])} == ends
        assert row[0] == pytest.approx(np.hypot(np.diff(one.x), np.diff(one.y)).sum(), rel=1e-5)


@pytest.mark.parametrize("name", REAL)
def test_whisks_own_reader_finds_the_same_numbers(name, tmp_path, program):
    path, text = real(f"{name}.whiskers"), tmp_path / "text"
    subprocess.run([program("whisker_convert"), path, text, "whisk1"], check=True, capture_output=True)
    rows = [line.rstrip(",").split(",") for line in text.read_text().splitlines()[1:]]
    segments = read_whiskers(path)
    assert len(rows) == len(segments)
    for row, one in zip(rows, segments, strict=True):
        assert {int(row[0]), int(row[1])} == {one.frame, one.wid}
        x, y, thick, score = np.array(row[4:], float).reshape(-1, 4).T
        # six digits are printed
        for printed, read in zip((x, y, thick, score), one[2:], strict=True):
            np.testing.assert_allclose(printed, read, rtol=5.1e-6, atol=1e-6)


def test_whisks_own_programs_give_back_what_is_written_bit_for_bit(tmp_path, program):
    segments = [line(f, 0, rise=0.3 * f) for f in range(20)]
    known = {(f, 0): KnownSegment(0, (40.0, 60.0)) for f in range(20)}
    profile = profile_from_whisk(segments, known, calibration=CALIBRATION)
    measures = write_whiskers(profile, tmp_path / "ours.whiskers")
    for tool, path, kind in (
        ("whisker_convert", tmp_path / "ours.whiskers", "whiskbin1"),
        ("measurements_convert", measures, "v3"),
    ):
        subprocess.run([program(tool), path, tmp_path / "back", kind], check=True, capture_output=True)
        assert (tmp_path / "back").read_bytes() == path.read_bytes()


def test_older_text_of_whisk_is_refused_with_the_remedy(tmp_path):
    for head in (b"whisker1 (frame,id,time,n,x1,y1,thick1,score1...\n", b"bwhiskpoly1\0" + bytes(20)):
        (tmp_path / "old.whiskers").write_bytes(head)
        assert kind_of(tmp_path / "old.whiskers") == "WHISK"
        with refusal("format", "old.whiskers"):
            read_tracks(tmp_path / "old.whiskers", CALIBRATION)


# Who is who, and where the follicle is


def test_nodes_stand_at_equal_arc_of_a_circle_wherever_a_trace_starts():
    slides = [0, 3, 12, 0, 7]
    segments = [line(f, 0, slide=slide) for f, slide in enumerate(slides)]
    profile = profile_from_whisk(
        segments, calibration=CALIBRATION, identity="longest", base="left", skin=[(40.0, 60.0)]
    )
    arc = profile.arc_length.values[0] / 1e-4
    np.testing.assert_allclose(arc, 5.0 * np.arange(40))
    x, y = profile.x.values[0] / 1e-4, profile.y.values[0] / 1e-4
    for frame, slide in enumerate(slides):
        seen = arc >= slide
        assert np.isfinite(x[frame, seen]).all()
        assert np.isnan(x[frame, arc < slide - 0.05]).all()
        # where the line starts late it is carried straight on, so s lags by slide³ / (24 R²)
        np.testing.assert_allclose(x[frame, seen], 40 + 300 * np.sin(arc[seen] / 300), atol=0.02)
        np.testing.assert_allclose(y[frame, seen], 60 + 300 * (1 - np.cos(arc[seen] / 300)), atol=0.02)


@pytest.mark.parametrize("turned", [False, True])
def test_the_base_is_the_end_at_the_follicle_whichever_way_a_segment_runs(turned):
    one = line(0, 3)
    one = Segment(0, 3, *(values[::-1] if turned else values for values in one[2:]))
    known = {(0, 3): KnownSegment(5, (40.0, 60.0))}
    profile = profile_from_whisk([one], known, calibration=CALIBRATION)
    assert profile.x.values[0, 0, 0] == pytest.approx(40e-4, abs=1e-7)
    assert profile.attrs["identities"] == "[5]"


def test_frames_without_the_whisker_stay_in_place_and_are_told():
    segments = [line(f, 0) for f in (2, 3, 6)]
    profile = profile_from_whisk(segments, calibration=CALIBRATION, identity="number", base="left")
    assert profile.sizes["time"] == 7
    assert profile.attrs["lost"] == '[[[0, 1, "not in the file"], [4, 5, "not in the file"]]]'
    assert np.isfinite(profile.x.values[0]).any(axis=1).tolist() == [False, False, True, True, False, False, True]


def test_frames_of_a_part_of_a_movie_keep_their_numbers(tmp_path):
    """Cut to frames 3 to 6, written and read again: the lines are in frames 3 to 6, at their times."""
    segments = [line(frame, 0, rise=10.0 * frame) for frame in range(8)]
    whole = profile_from_whisk(segments, calibration=CALIBRATION, identity="number", base="left")
    write_whiskers(whole.isel(time=slice(3, 7)), tmp_path / "part.whiskers")
    assert [one.frame for one in read_whiskers(tmp_path / "part.whiskers")] == [3, 4, 5, 6]
    assert read_measurements(tmp_path / "part.measurements")["frame"].tolist() == [3, 4, 5, 6]
    back = read_tracks(tmp_path / "part.whiskers", CALIBRATION)
    seen = np.isfinite(back.y.values[0]).any(axis=1)
    np.testing.assert_allclose(back.time[seen], np.arange(3, 7) / CALIBRATION.frame_rate)
    height = np.nanmin(back.y.values[0, seen], axis=1) / CALIBRATION.pixel_size
    np.testing.assert_allclose(height - height[0], [0, 10, 20, 30], atol=0.5)  # nodes are placed again


OTHER_TIMES = {
    "from an onset": (lambda time: time - 4 / 500, 500.0, "-0.008 to 0.01 s at 500 frames/s"),
    "half the rate": (lambda time: time, 250.0, "0 to 0.018 s at 250 frames/s"),
    "a clock of years": (lambda time: time + 5e7, 500.0, "5e+07 to 5e+07 s at 500 frames/s"),
    "no rate": (lambda time: time, np.nan, "0 to 0.018 s at nan frames/s"),
}


@pytest.mark.parametrize("name", OTHER_TIMES)
def test_times_that_do_not_give_the_numbers_of_frames_are_refused(tmp_path, name):
    of, rate, found = OTHER_TIMES[name]
    segments = [line(frame, 0) for frame in range(10)]
    profile = profile_from_whisk(segments, calibration=CALIBRATION, identity="number", base="left")
    other = profile.assign_coords(time=of(profile.time)).assign_attrs(frame_rate=rate)
    with refusal("range", "profile.time", value=found) as caught:
        write_whiskers(other, tmp_path / "a.whiskers")
    assert "from the movie's first frame" in caught.value.remedy
    assert not list(tmp_path.iterdir())


def test_nothing_stands_in_a_gap_of_a_trace():
    one = line(0, 0)
    kept = (np.arange(200) < 80) | (np.arange(200) >= 110)
    gappy = Segment(0, 0, *(values[kept] for values in one[2:]))
    whole, profile = (
        profile_from_whisk([s], calibration=CALIBRATION, identity="number", base="left") for s in (one, gappy)
    )
    nodes = 5 * np.arange(40)
    absent = (nodes > 79.1) & (nodes < 109.9)
    assert np.array_equal(np.isnan(profile.x.values[0, 0]), absent)
    both = ~absent
    # across the gap the line is taken along the quadratic, so arc length stays within a hundredth of a pixel
    np.testing.assert_allclose(profile.x.values[0, 0, both], whole.x.values[0, 0, both], atol=2e-6)


def test_a_whisker_twice_in_a_frame_is_refused():
    segments = [line(4, 0), line(4, 1, rise=30)]
    known = {(4, wid): KnownSegment(0, (40.0, 60.0)) for wid in (0, 1)}
    with refusal("format", "the traces", value="2 in frame 4"):
        profile_from_whisk(segments, known, calibration=CALIBRATION)


def test_real_whiskers_lie_on_their_segments():
    path = real("whiskiwrap-movies/test_video2.whiskers")
    profile = read_tracks(path, CALIBRATION)
    assert profile.sizes["whisker"] == 3
    identity = {
        key: one.identity for key, one in known_of(read_measurements(path.with_suffix(".measurements"))).items()
    }
    seen = np.isfinite(profile.x.values).any(axis=2).sum(axis=1)
    assert np.all(seen > 0.95 * 433)  # frames in which WHISK knows each; short ones may end before the common origin
    for one in read_whiskers(path)[:2000]:
        who = identity[one.frame, one.wid]
        if who >= 0:
            x, y = (profile[name].values[who, one.frame] / 1e-4 for name in "xy")
            off = np.hypot(x[:, None] - one.x, y[:, None] - one.y)[np.isfinite(x)]
            assert np.all(off.min(axis=1) < 0.95)  # half of the longest step within which nodes stand
