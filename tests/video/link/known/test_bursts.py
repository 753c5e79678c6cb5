"""A mark on a whisker that strays farther than it ever did: its lines in the frames about it are taken up, too."""

import numpy as np
import pytest
from simulated_segments import Pad, simulate

from vibrissa.video.link.known.known_names import chains_of, gone_on, names_with
from vibrissa.video.link.known.renamed_linking import line_names
from vibrissa.video.link.whisker_linking import link_segments

MIDDLE, LONG = 105, 11  # frame and frames of the burst
CENTRE = Pad().centre


def with_burst(segments, truth, whisker, turn):
    """Lines of a whisker that turns by so many degrees more and back again in a few frames."""
    column, row = segments.column.values.copy(), segments.row.values.copy()
    ends = np.append(segments.segment_start.values, segments.sizes["point"])
    for t in range(LONG):
        now = segments.segment_frame.values == MIDDLE - LONG // 2 + t
        for segment in np.flatnonzero((truth.segment == whisker) & now):
            a, b = ends[segment], ends[segment + 1]
            point = column[a:b] + 1j * row[a:b]
            base = point[np.abs(point - complex(*CENTRE)).argmin()]
            point = base + (point - base) * np.exp(1j * np.deg2rad(turn * np.sin(np.pi * (t + 1) / (LONG + 1))))
            column[a:b], row[a:b] = point.real, point.imag
    return segments.assign(column=("point", column), row=("point", row))


def taken_up(seed, turn):
    """Share of the lines of the burst that have the whisker's name before and after a mark in its middle."""
    segments, truth = simulate([Pad(whiskers=4, frames=200, missing=0.0, broken=0.0, junk=1.0)], seed)
    linking, frame = link_segments(with_burst(segments, truth, 0, turn)), segments.segment_frame.values
    burst = np.flatnonzero((truth.segment == 0) & (np.abs(frame - MIDDLE) <= LONG // 2))
    names = line_names(linking)
    before = names.whisker
    own = int(np.bincount(before[(truth.segment == 0) & (before >= 0)]).argmax())
    free = burst[before[burst] < 0]
    assert {gone_on(linking, names, int(line)) for line in free} <= {own}  # one mark says which whisker it is
    after = names_with(chains_of(linking), names, burst[frame[burst] == MIDDLE], own, {})[1].whisker
    others = truth.segment > 0
    np.testing.assert_array_equal(after[others], before[others])
    return (before[burst] == own).mean(), (after[burst] == own).mean()


@pytest.mark.parametrize("turn", [-16.0, -20.0])  # away from the other whiskers
def test_lines_about_a_mark_are_taken_up(turn):
    """The whisker goes farther than it ever did, by up to 5° from frame to frame."""
    before, after = np.transpose([taken_up(seed, turn) for seed in range(2, 8)])
    assert before.mean() < 0.5
    assert (after == 1).all()
