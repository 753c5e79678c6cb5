"""Tracklets that are joined over gaps: those of one whisker."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_segments import Pad, simulate

from vibrissa.video.link.pad.pad_finding import find_pads
from vibrissa.video.link.pad.pads import Lines, lines_of
from vibrissa.video.link.pad.pieces import pieces_of
from vibrissa.video.link.pad_linking import stretches
from vibrissa.video.link.starts.joined_tracklets import GAP, LEAST, carried, joined

LEVER = np.ones(3)


def _lines(across):
    """Lines at these places [°], all alike."""
    count = len(across)
    place = np.repeat(np.array(across, float)[:, None], 3, axis=1)
    covariance, reach = np.tile(0.05 * np.eye(3), (count, 1, 1)), np.tile([-1.0, 1.0], (count, 1))
    return Lines(np.zeros(count, int), np.zeros(count, bool), place, covariance, reach, np.zeros((count, 2)))


def _stretch(first, across, name):
    """Six lines of a whisker that stays at its place."""
    return [(first + k, across, name) for k in range(6)]


def _names_after(*parts):
    frame, across, name = (np.array(column) for column in zip(*[one for part in parts for one in part], strict=True))
    motion = np.zeros((frame.max() + 1, 2, 3))
    found = joined(frame, name, _lines(across), motion, LEVER)
    return [found[np.flatnonzero(name == n)[0]] for n in range(name.max() + 1)]


@pytest.mark.parametrize(("gap", "one"), [(1, True), (GAP // 2, True), (GAP + 1, False)])
def test_a_tracklet_goes_on_over_a_gap_that_is_not_too_long(gap, one):
    before, after = _names_after(_stretch(0, 3.0, 0), _stretch(5 + gap, 3.2, 1))
    assert (before == after) == one


def test_of_two_that_could_go_on_the_nearer_one_does():
    names = _names_after(_stretch(0, 3.0, 0), _stretch(8, 3.2, 1), _stretch(8, 9.0, 2))
    assert names[0] == names[1] != names[2]


def test_tracklets_shorter_than_the_least_stay_alone():
    few = _stretch(8, 3.0, 1)[: LEAST - 1]
    assert len(set(_names_after(_stretch(0, 3.0, 0), few))) == 2


@pytest.mark.parametrize("seed", range(4))
def test_joined_tracklets_of_a_simulated_pad_are_longer_and_hardly_less_pure(seed):
    segments, truth = simulate([Pad(whiskers=8, frames=200, missing=0.2, drift=3.0)], seed)
    pieces = pieces_of(segments)
    pads, pad, back = find_pads(pieces)
    lines = lines_of(pieces, pads, pad, back)
    plain = stretches(pieces.frames, pieces.frame, lines, 0, pads[0])
    motion = carried(pieces.frames, pieces.frame, plain.name, lines, plain.swing, plain.lever)
    whole = joined(pieces.frame, plain.name, lines, motion, plain.lever)
    (length, pure), (length_after, pure_after) = (_judged(name, truth.segment) for name in (plain.name, whole))
    assert length_after > 1.5 * length
    assert pure_after > pure - 0.03
    assert pure_after > 0.95


def _judged(name, whisker):
    """Mean length of the tracklet that a line is in, and share of lines of the whisker that most of it are."""
    size = np.bincount(name[name >= 0])
    most = [np.bincount(whisker[name == n] + 1)[1:].max(initial=0) for n in range(size.size)]
    return (size**2).sum() / size.sum(), sum(most) / ((name >= 0) & (whisker >= 0)).sum()
