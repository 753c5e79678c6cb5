"""The size at which lines are linked: names do not depend on that of the image."""

import numpy as np
import pytest
from refusals import refusal
from simulated_segments import Pad, score, simulate

from vibrissa.video.link import whisker_linking
from vibrissa.video.link.pad.pieces import pieces_of
from vibrissa.video.link.pad.placing import TYPICAL, linking_size, resized
from vibrissa.video.link.whisker_linking import link_segments

LENGTHS = "column", "row", "line_width", "position_sd"


def enlarged(segments, size):
    """Lines of the same movie, filmed with so many times as many pixels."""
    return segments.assign({name: size * segments[name] for name in LENGTHS})


def with_lines(segments, frame, first, column, row):
    """Segments with these lines instead, of one width."""
    about = {name: segments[name].attrs for name in segments}
    points = {"column": column, "row": row, "line_width": np.full(column.size, 2.0)}
    points |= {"line_contrast": np.full(column.size, 30.0), "position_sd": np.full(column.size, 0.2)}
    lines = {"segment_frame": np.array(frame), "segment_start": np.array(first)}
    made = segments.drop_dims(["point", "segment"])
    made = made.assign({name: ("point", values, about[name]) for name, values in points.items()})
    return made.assign({name: ("segment", values, about[name]) for name, values in lines.items()})


def straight(*lengths):
    """A line of each length in one frame."""
    points = np.concatenate([np.stack([np.arange(n + 1.0), np.full(n + 1, 9.0 * k)]) for k, n in enumerate(lengths)], 1)
    start = np.cumsum([0, *(n + 1 for n in lengths[:-1])])
    return with_lines(simulate([Pad(whiskers=2, frames=2)], 0)[0], np.zeros(len(lengths), np.int64), start, *points)


def test_half_of_the_length_is_in_lines_of_the_typical_length():
    # 300 of 570 px are in the longest two lines, 170 in the longest
    assert linking_size(pieces_of(straight(170, 130, 100, 90, 80))) == pytest.approx(TYPICAL / 130)


@pytest.mark.parametrize("size", [0.25, 3.0])
def test_the_size_is_taken_back(size):
    pieces = pieces_of(simulate([Pad(whiskers=4, frames=20)], 1)[0])
    assert linking_size(resized(pieces, size)) == pytest.approx(linking_size(pieces) / size)


@pytest.mark.parametrize("size", [0.5, 2.0, 4.0])
def test_names_do_not_depend_on_the_size_of_the_image(size):
    segments, _ = simulate([Pad(whiskers=8, frames=150, missing=0.2, broken=0.2)], 3)
    one, other = (link_segments(some).identity() for some in (segments, enlarged(segments, size)))
    np.testing.assert_array_equal(one.segment_whisker, other.segment_whisker)
    np.testing.assert_allclose(one.segment_probability, other.segment_probability, atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_curved_whiskers_of_a_large_image_are_of_their_pad(seed):
    """The straight lines through their ends pass the pad by more than a hundred pixels."""
    segments, truth = simulate([Pad(whiskers=4, frames=150, amplitude=28.0)], seed)
    linking = link_segments(enlarged(segments, 2.5))
    found = score(segments, truth, linking.identity().segment_whisker.values)
    long = np.diff(np.append(segments.segment_start, segments.sizes["point"])) >= 60
    assert (linking.lines.pad[long & (truth.segment >= 0)] >= 0).mean() > 0.99
    assert found.followed > 0.99
    assert found.wrong < 0.01


@pytest.mark.parametrize(("count", "length"), [(2, 500), (4, 800)])
def test_long_edges_that_stay_leave_the_whiskers_their_size(count, length):
    """They may have most of the length of all lines, and be longer than whiskers."""
    segments, truth = simulate([Pad(whiskers=6, frames=100, amplitude=15.0)], 1)
    pieces = pieces_of(segments)
    points = length * np.arange(length) / (length - 1)
    frame, first, column, row = [], [], [], []
    for t in range(100):
        mine = np.flatnonzero(pieces.frame == t)
        lines = [
            (pieces.column[a:b], pieces.row[a:b]) for a, b in zip(pieces.start[mine], pieces.stop[mine], strict=True)
        ]
        for x, y in [*lines, *((points, np.full(length, 600.0 + 20 * k)) for k in range(count))]:
            frame.append(t)
            first.append(sum(map(len, column)))
            column.append(x)
            row.append(y)
    owner = np.concatenate([[*truth.segment[pieces.frame == t], *[-2] * count] for t in range(100)])
    made = with_lines(segments, frame, first, np.concatenate(column), np.concatenate(row))
    assert linking_size(pieces_of(made)) == pytest.approx(linking_size(pieces), rel=0.1)
    found = score(made, truth._replace(segment=owner), link_segments(made).identity().segment_whisker.values)
    assert found.followed > 0.95
    assert found.wrong < 0.02


def test_a_movie_without_a_line_that_can_be_a_whisker_is_refused():
    with refusal("too-few", "segments") as told:
        link_segments(straight(11, 9))
    assert "at least 12 px" in str(told.value)


def test_lines_of_no_pad_are_refused(monkeypatch):
    segments, _ = simulate([Pad(whiskers=2, frames=10)], 0)
    find = whisker_linking.find_pads

    def nobodys(pieces):
        pads, pad, back = find(pieces)
        return pads, np.full_like(pad, -1), back

    monkeypatch.setattr(whisker_linking, "find_pads", nobodys)
    with refusal("too-few", "segments") as told:
        link_segments(segments)
    assert "search a region" in str(told.value)
