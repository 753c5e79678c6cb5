from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from real_data import real, whisk_segments
from refusals import refusal
from whisker_pad import DENSITIES, FAN, FRAMES, OFFSETS, RESTS, WIDTH, angles_of_pad, mark, movie_of_pad, rows_of_pad

from vibrissa.study.spec.settings import read_study
from vibrissa.video.follow.search import Search
from vibrissa.video.identity.common_motion import common_motion
from vibrissa.video.identity.whisker_fan import Fan, course, fan_lines
from vibrissa.video.identity.whisking import Whisking, whiskers, whisking_centrelines
from vibrissa.video.io.movie import read_blocks
from vibrissa.video.tracking import Calibration, track

NO_BACKGROUND = np.zeros((0, 0), np.float32)
SEARCH = Search(search=2, threshold=3.0)


@pytest.fixture(scope="module")
def angles() -> np.ndarray:
    return angles_of_pad()


@pytest.fixture(scope="module")
def pad(angles) -> np.ndarray:
    return movie_of_pad(angles, np.random.default_rng(5))


def follow(pad: np.ndarray, angles: np.ndarray, marked: range) -> np.ndarray:
    """Median distance [px] of all six whiskers from where they are, (whisker, frame); NaN where lost."""
    marks = tuple(tuple(mark(angles, w, t) for t in marked) for w in range(len(RESTS)))
    blocks = [pad[:70], pad[70:]]
    parts = whisking_centrelines(lambda: blocks, whisking=Whisking(fan=FAN, marks=marks), search=SEARCH)
    off = np.abs(np.concatenate([part.row for part in parts], axis=1) - rows_of_pad(angles))
    return np.ma.median(np.ma.masked_invalid(off), axis=2).filled(np.nan)


def test_whiskers_of_the_synthetic_pad_cross_and_swing_further_than_they_are_apart(angles):
    assert np.abs(np.diff(angles, axis=1)).max() > 5
    assert np.abs(np.diff(RESTS)).max() < 7.5
    crossings = np.count_nonzero(np.diff(np.sign(angles[:-1] - angles[1:]), axis=1))
    assert crossings >= 20


def test_lines_of_the_fan_have_the_angles_and_offsets_of_the_whiskers(pad, angles):
    angle, offset, density = fan_lines(pad[0], NO_BACKGROUND, 1.0, FAN).T
    for w in range(6):
        nearest = np.nanargmin(np.abs(angle - angles[w, 0]) + np.abs(offset - OFFSETS[w]) / 5)
        # the droop turns the line by up to 2e-4 × 2 × 100 px = 2°
        rows = course(FAN, angle[nearest], offset[nearest], WIDTH)
        assert np.nanmedian(np.abs(rows - rows_of_pad(angles)[w, 0])) < 0.7
        assert density[nearest] > 0.3 * DENSITIES[w]


def test_common_motion_is_that_of_the_pad(pad, angles):
    lines = np.stack([fan_lines(image, NO_BACKGROUND, 1.0, FAN) for image in pad[:31]])
    shift, spread = common_motion(lines, 0.0).T
    mean = np.diff(angles, axis=1)[:, :30].mean(axis=0)
    at_the_pad = shift + spread * angles[:, :30].mean(axis=0)
    # the two rows differ by a third of it, either way
    assert np.abs(at_the_pad - mean).max() < 0.25 * np.abs(mean).max() + 0.5
    assert np.corrcoef(at_the_pad, mean)[0, 1] > 0.97


def test_each_whisker_keeps_its_identity_through_overlaps(pad, angles):
    """Marked in every second whisk. Where two whiskers are one line for long, they are lost."""
    off = follow(pad, angles, range(0, FRAMES, 30))
    seen = ~np.isnan(off)
    # neighbours are 7 px apart at the middle radius when they do not overlap
    assert (off[seen] > 1.5).mean() < 0.005
    assert np.median(off[seen]) < 0.1
    assert seen.mean() > 0.5


def test_whisker_marked_once_is_lost_sooner_than_it_is_taken_for_another(pad, angles):
    off = follow(pad, angles, range(1))
    seen = ~np.isnan(off)
    assert (off[seen] > 1.5).mean() < 0.02
    assert seen.sum() < np.count_nonzero(~np.isnan(follow(pad, angles, range(0, FRAMES, 15))))


def test_profile_of_a_whisking_whisker_has_its_marks_and_reasons(pad, angles):
    whisking = Whisking(fan=FAN, marks=((mark(angles, 0, 0),), (mark(angles, 3, 0),)))
    calibration = Calibration(frame_rate=200.0, pixel_size=1e-4)
    data = track([pad[:40]], calibration=calibration, whisking=whisking, search=2, threshold=3.0)
    assert json.loads(data.attrs["marks"])[0][0][0] == 0
    seen = ~np.isnan(data.y.values).all(axis=2)
    for w, runs in enumerate(json.loads(data.attrs["lost"])):
        assert sum(last - first + 1 for first, last, _ in runs) == np.count_nonzero(~seen[w])
    assert not np.isnan(data.y.values[..., -1]).all()


def test_bad_fans_and_marks_are_told(pad):
    with refusal("range", "Fan.radii"):
        Fan(pivot=(0.0, 0.0), radii=(50.0, 20.0))
    with refusal("range", "Fan.angles"):
        Fan(pivot=(0.0, 0.0), radii=(20.0, 50.0), angles=(30.0, -30.0))
    with refusal("too-few", "Whisking.marks"):
        Whisking(fan=FAN, marks=((),))
    with refusal("range", "Whisking.marks"):
        Whisking(fan=FAN, marks=(((3, 90.0, 90.0), (1, 90.0, 90.0)),))
    calibration = Calibration(frame_rate=200.0, pixel_size=1e-4)

    def refused(fields, blocks, **settings):
        with refusal(*fields):
            track(blocks, calibration=calibration, **settings)

    off_line = Whisking(fan=FAN, marks=(((0, 90.0, 30.0),),))
    refused(("range", "mark", "(0, 90.0, 30.0)"), [pad[:2]], whisking=off_line)
    refused(("range", "mark", "2"), [pad[:2]], whisking=Whisking(fan=FAN, marks=(((2, 90.0, 30.0),),)))
    refused(("format", "blocks"), iter([pad[:2]]), whisking=off_line)
    refused(("missing", "seeds"), [pad[:2]])
    refused(("missing", "seeds"), [pad[:2]], whisking=off_line, seeds=[(90, 90)])
    refused(("too-few", "blocks"), [], whisking=off_line)


def base_of(segment) -> tuple[float, float]:
    """The end nearest to the pivot of the mouse's fan, which is left of the image."""
    end = int(np.argmin(np.hypot(segment.x + 16, segment.y - 192)))
    return segment.x[end], segment.y[end]


def distance_along(row: np.ndarray, segment) -> float:
    """Median distance [px] of a segment from a line, across the line; NaN where they have no columns in common."""
    columns = np.flatnonzero(~np.isnan(row))
    columns = columns[(columns >= segment.x.min()) & (columns <= segment.x.max())]
    if columns.size < 10:
        return np.nan
    course_of_segment = np.interp(columns, segment.x, segment.y)
    return float(np.median(np.abs(row[columns] - course_of_segment) / np.hypot(1, np.gradient(course_of_segment))))


@pytest.fixture(scope="module")
def mouse():
    """Rows of the two whiskers of the example, and rows of the lines that they are linked by; over the whole movie."""
    path = real("whiskiwrap-movies/test_video2.mp4")
    movie = read_study(Path(__file__).parents[3] / "examples" / "mouse-field.toml").movie
    columns = (movie.region[0], movie.region[2])
    search = Search(columns=columns, search=movie.search, threshold=movie.threshold)
    parts = list(whisking_centrelines(lambda: read_blocks(path), whisking=movie.whisking, search=search))
    fan = movie.whisking.fan
    found = [fan_lines(image, NO_BACKGROUND, 1.0, fan) for block in read_blocks(path) for image in block]
    linked = [
        np.array([course(fan, *line, 320) for line in zip(one.angle, one.offset, strict=True)])
        for one in whiskers(np.stack(found), movie.whisking)
    ]
    return np.concatenate([part.row for part in parts], axis=1), np.array(linked)


@pytest.mark.parametrize(("whisker", "frames", "share"), [(0, 430, 0.95), (1, 700, 0.95)])
def test_whiskers_of_a_whisking_mouse_agree_with_whisk(mouse, whisker, frames, share):
    """Frames in which WHISK has a segment over 80 px of the whisker, its base within 5 px of the whisker's.

    Of the whisker: along its line, within 1.5 px where it is followed and 3 px where it is lost, as the fan is
    so dense that bases of others are within 5 px too.
    """
    rows, linked = mouse[0][whisker], mouse[1][whisker]
    found, lost = {}, set()
    for segment in whisk_segments(real("whiskiwrap-movies/test_video2.whiskers")):
        if np.hypot(np.diff(segment.x), np.diff(segment.y)).sum() <= 80:
            continue
        seen = not np.isnan(rows[segment.frame]).all()
        row = (rows if seen else linked)[segment.frame]
        off = distance_along(row, segment)
        columns = np.flatnonzero(~np.isnan(row))
        if not off < (1.5 if seen else 3):
            continue
        (slope, height), (x, y) = np.polyfit(columns[:15], row[columns[:15]], 1), base_of(segment)
        if abs(height + slope * x - y) / np.hypot(1, slope) > 5:
            continue
        if seen:
            found[segment.frame] = min(off, found.get(segment.frame, np.inf))
        else:
            lost.add(segment.frame)
    assert len(found) + len(lost) > frames
    assert len(found) / (len(found) + len(lost)) >= share
    assert np.median(list(found.values())) < 0.3
