"""Whiskers that are a part of another one, on simulated pads in which one whisker's lines are broken."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from simulated_segments import Pad, simulate

from vibrissa.video.link.courses import parts
from vibrissa.video.link.courses.parts import without_parts
from vibrissa.video.link.whisker_linking import Linking, link_segments

WHISKERS, BROKEN = 5, 2  # whiskers of the pad, and the one whose lines are broken


def broken(seed: int, aside: float = 0.0) -> tuple[xr.Dataset, np.ndarray]:
    """Lines of a pad, every line of one whisker in two pieces, and whose each is.

    Six points between the pieces are missing, the further piece is ``aside`` [px].
    """
    segments, truth = simulate(
        [Pad(whiskers=WHISKERS, frames=120, spread=90.0, missing=0.05, broken=0.0, junk=0.0)], seed
    )
    bounds = np.append(segments.segment_start.values, segments.sizes["point"])
    row, points, first, source = segments.row.values.copy(), [], [], []
    for number, whisker in enumerate(truth.segment):
        a, b = bounds[number : number + 2]
        parts = [np.arange(a, b)]
        if whisker == BROKEN:
            middle = (a + b) // 2
            parts = [np.arange(a, middle - 3), np.arange(middle + 3, b)]
            further = max(parts, key=lambda part: segments.column.values[part].max())
            row[further] += aside
        for part in parts:
            first.append(sum(map(len, points)))
            points.append(part)
            source.append(number)
    out = segments.assign(row=("point", row, segments.row.attrs)).isel(point=np.concatenate(points), segment=source)
    return out.assign(segment_start=("segment", np.array(first), segments.segment_start.attrs)), truth.segment[source]


def followed(linking: Linking, owner: np.ndarray) -> np.ndarray:
    """Share of the frames of each whisker in which its likeliest name is at one of its lines."""
    main, frame = linking.identity().whisker_segment.values, linking.pieces.frame
    out = []
    for whisker in range(WHISKERS):
        mine = (main >= 0) & (owner[main] == whisker)
        out.append(mine.sum(axis=1).max() / np.unique(frame[owner == whisker]).size)
    return np.array(out)


def as_two(seed: int, aside: float = 0.0) -> tuple[Linking, np.ndarray]:
    """A pad whose broken whisker has a name for either piece, and whose each line is."""
    segments, owner = broken(seed, aside)
    linking = link_segments(segments)
    solution = linking.solutions[0]
    models = [one.model for one in solution.labels]
    number = int(linking.identity().segment_whisker.values[owner == BROKEN].max())
    mine = (owner == BROKEN) & (linking.lines.pad >= 0)  # the shortest pieces are of no pad
    further = mine & (linking.lines.look[:, 1] > np.median(linking.lines.look[mine, 1]))
    for piece in (mine & ~further, further):
        look = np.median(linking.lines.look[piece], axis=0)
        models.append(models[number]._replace(look=look, look_sd=np.full(2, 0.2)))
    models.pop(number)
    solution.place(models)
    solution.settle()
    return linking, owner


@pytest.mark.parametrize("seed", range(4))
def test_a_further_piece_that_goes_on_as_a_whisker_does_is_no_whisker(seed):
    linking, owner = as_two(seed)
    assert linking.whiskers == WHISKERS + 1
    assert without_parts(linking) is linking
    assert linking.whiskers == WHISKERS
    assert followed(linking, owner).min() > 0.9


@pytest.mark.parametrize(("aside", "gap"), [(4.0, parts.GAP), (0.0, 1.0)])
def test_a_further_piece_that_does_not_go_on_or_is_far_is_a_whisker(monkeypatch, aside, gap):
    linking, _ = as_two(1, aside)
    names = linking.identity()
    assert linking.whiskers == WHISKERS + 1
    monkeypatch.setattr(parts, "GAP", gap)
    without_parts(linking)
    xr.testing.assert_equal(linking.identity(), names)


@pytest.mark.parametrize("seed", range(4))
def test_a_whisker_that_is_in_two_pieces_in_every_frame_is_followed(seed):
    """Either piece may go on as the other in the next frame; only how far from the pad they are tells them apart."""
    segments, owner = broken(seed)
    linking = link_segments(segments)
    assert linking.whiskers == WHISKERS
    assert followed(linking, owner).min() > 0.9


@pytest.mark.parametrize("seed", range(3))
def test_whiskers_that_are_whole_stay(seed):
    segments, _ = simulate([Pad(whiskers=8, frames=120, spread=60.0)], seed)
    linking = link_segments(segments)
    count = linking.whiskers
    assert without_parts(linking).whiskers == count
