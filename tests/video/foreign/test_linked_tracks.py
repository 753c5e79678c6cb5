"""Tracks without identity, linked as they are read."""

from __future__ import annotations

import numpy as np
import pytest
from real_data import real
from refusals import refusal
from simulated_segments import Pad, simulate

from vibrissa.video.correct.correction import Correction
from vibrissa.video.correct.edits import Edit
from vibrissa.video.foreign.segment_tables import read_segments, segments_of
from vibrissa.video.foreign.tracks import read_tracks
from vibrissa.video.foreign.whisk_files import Segment, packed_whiskers
from vibrissa.video.link.thorough_linking import link_thoroughly
from vibrissa.video.link.whisker_linking import link_segments
from vibrissa.video.tracking import Calibration

CALIBRATION = Calibration(frame_rate=200.0, pixel_size=1e-4)


@pytest.fixture(scope="module")
def traced(tmp_path_factory):
    """A file of WHISK of a simulated pad, its segments, and who they are."""
    segments, truth = simulate([Pad(whiskers=4, frames=200, junk=1.0)], 2)
    start, curves = segments.segment_start.values, []
    stop = np.append(start[1:], segments.sizes["point"])
    for i, (a, b) in enumerate(zip(start, stop, strict=True)):
        values = [segments[name].values[a:b] for name in ("column", "row", "line_width", "line_contrast")]
        curves.append(Segment(int(segments.segment_frame[i]), i, *values))
    path = tmp_path_factory.mktemp("linked") / "pad.whiskers"
    path.write_bytes(packed_whiskers(curves))
    return path, segments, truth


def test_segments_of_a_file_are_those_that_were_written(traced):
    path, segments, _ = traced
    again = read_segments(path, "WHISK")
    np.testing.assert_array_equal(again.segment_frame, segments.segment_frame)
    np.testing.assert_array_equal(again.segment_start, segments.segment_start)
    np.testing.assert_allclose(again.column, segments.column, atol=1e-4)


def test_a_linked_profile_lies_on_the_true_lines(traced):
    """Each whisker of the profile is on one true whisker in nearly all frames in which that is seen."""
    path, segments, truth = traced
    profile = read_tracks(path, CALIBRATION, identity="link")
    assert profile.sizes["whisker"] == 4
    assert profile.whisker_probability.mean("time").min() > 0.9
    column, row = segments.column.values, segments.row.values
    frame, who = (
        np.repeat(x, np.diff(np.append(segments.segment_start, column.size)))
        for x in (segments.segment_frame.values, truth.segment)
    )
    found = np.full((4, 200), -1)
    for k, t in np.argwhere(np.isfinite(profile.x.values).sum(axis=2) > 3):
        x, y = (values[k, t][np.isfinite(values[k, t])][2] / 1e-4 for values in (profile.x.values, profile.y.values))
        here = np.flatnonzero(frame == t)
        off = np.hypot(column[here] - x, row[here] - y)
        assert off.min() < 1.5
        found[k, t] = who[here[off.argmin()]]
    for k in range(4):
        names, count = np.unique(found[k][found[k] >= 0], return_counts=True)
        assert count.max() / count.sum() > 0.99
        assert count.max() > 0.9 * truth.visible[names[count.argmax()]].sum()


def test_linking_needs_no_measurements(traced):
    path, _, _ = traced
    with refusal("conflict", "base"):
        read_tracks(path, CALIBRATION, identity="link", base="left")


def test_lines_without_a_length_are_refused():
    with refusal("format", "dots"):
        segments_of([Segment(0, 0, *np.ones((4, 1)))], "dots")


def test_the_pad_of_a_real_mouse_is_where_its_whiskers_converge():
    """By eye its whiskers come together 16 px left of the image, in row 192 (examples/mouse-field.toml)."""
    segments = read_segments(real("whiskiwrap-movies/test_video2.whiskers"), "WHISK")
    linking = link_segments(segments)
    assert len(linking.pads) == 1
    np.testing.assert_allclose(linking.pads[0].pivot / linking.size, [-16.0, 192.0], atol=25.0)


def test_whiskers_of_a_real_mouse_are_found_in_lines_of_another_program():
    segments = read_segments(real("whiskiwrap-movies/test_video2.whiskers"), "WHISK")
    assert link_thoroughly(segments)[1].whiskers >= 5


def test_a_file_of_whisk_without_identity_is_linked_and_corrected():
    """Two names exchanged by hand in a movie of another program: each has the other one's lines from there on."""
    segments = read_segments(real("tracks/test.whiskers"), "WHISK")
    linking = link_segments(segments)
    before = linking.identity()
    seen = (before.whisker_segment.values >= 0).sum(axis=1)
    one, other = (int(k) for k in np.argsort(-seen)[:2])
    assert seen[other] > 190
    correction = Correction(linking)
    correction.apply(Edit(do="swap", whiskers=(one, other), frame=100))
    named = correction.renamed().identity().segment_whisker.values
    late = segments.segment_frame.values >= 100
    was = before.segment_whisker.values
    for old, new in ((one, other), (other, one)):
        mine = was == old
        assert np.mean(named[mine & late] == new) > 0.95
        assert np.mean(named[mine & ~late] == old) > 0.95
