"""Whiskers too many, and lines whose tips gather: simulated pads with known truth."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_segments import Pad, simulate

from vibrissa.video.link.chains.superfluous import without_superfluous
from vibrissa.video.link.chains.whisker_models import Model, refit
from vibrissa.video.link.pad.pad_finding import find_pads
from vibrissa.video.link.pad.pieces import pieces_of
from vibrissa.video.link.whisker_linking import link_segments

FEW = {"whiskers": 5, "frames": 120, "spread": 60.0}


@pytest.mark.parametrize("apart", [0.0, 0.5])
def test_a_whisker_whose_lines_others_explain_is_taken_away(apart):
    segments, truth = simulate([Pad(**FEW)], 2)
    solution = link_segments(segments).solutions[0]
    models = [one.model for one in solution.labels]
    assert len(models) == len(truth.visible)
    double = models[2]._replace(place=models[2].place + apart)
    solution.place([*models, double])
    solution.settle()
    without_superfluous(solution, lambda: [one.model for one in solution.labels])
    places = sorted(one.model.place[1] for one in solution.labels)
    # the two share their lines, so either may be the one that is left
    np.testing.assert_allclose(places, sorted(one.place[1] for one in models), atol=apart + 1e-9)


def test_a_whisker_that_is_at_two_places_in_turn_is_one():
    """Blocks of ten frames; neither place explains the lines at the other, a whisker fitted to all does."""
    segments, truth = simulate([Pad(**FEW)], 2)
    solution = link_segments(segments).solutions[0]
    models = [one.model for one in solution.labels]
    own = solution.labels[2].seen[solution.labels[2].chance > 0.5]
    there = own[solution.frame[own] // 10 % 2 == 1]
    place = solution.lines.place.copy()
    place[there] += 5.0
    solution.lines = solution.lines._replace(place=place)
    solution.tracklet = np.full_like(solution.tracklet, -1)
    solution.__post_init__()
    narrow = models[2]._replace(spread=np.diag([0.3, 0.3, 0.3]))
    solution.place([*models[:2], narrow, *models[3:], narrow._replace(place=narrow.place + 5.0)])
    solution.settle()
    assert len(solution.labels) == 6
    gain = np.stack([solution.lever, np.zeros(3)])

    def refitted() -> list[Model]:
        every = ((one.model, solution.lines, one.seen, one.chance) for one in solution.labels)
        return [refit(*one, solution.phase, solution.frame, gain) for one in every]

    without_superfluous(solution, refitted)
    assert len(solution.labels) == len(truth.visible)
    nearest = min(solution.labels, key=lambda one: abs(one.model.place[1] - models[2].place[1] - 2.5))
    assert np.isin(own, nearest.seen[nearest.chance > 0.5]).mean() > 0.9


def test_a_line_that_comes_from_the_pad_has_its_base_there_wherever_tips_gather():
    segments, truth = simulate([Pad(whiskers=8, frames=120, spread=70.0)], 5)
    pieces = pieces_of(segments)
    # an edge hides what is right of column 270, 90 px from the pad, so the tips of long whiskers are on one line
    seen = pieces.column < 270
    size = pieces.sums(seen.astype(int))
    some = (size > 25) & (truth.segment >= 0)
    points = np.flatnonzero(seen & some[pieces.owner])
    stop = np.cumsum(size[some])
    first, last = points[stop - size[some]], points[stop - 1]
    cut = pieces._replace(
        frame=pieces.frame[some],
        start=stop - size[some],
        stop=stop,
        column=pieces.column[points],
        row=pieces.row[points],
        width=np.full(points.size, 2.0),
        contrast=np.full(points.size, 30.0),
        sd=pieces.sd[points],
    )
    pads, pad, turned = find_pads(cut)
    assert len(pads) == 1
    np.testing.assert_array_equal(pad, 0)
    near, far = (np.hypot(pieces.column[k] - 180, pieces.row[k] - 240) for k in (first, last))
    np.testing.assert_array_equal(turned, far < near)
