"""Where pads are: beside a lamp and its cables, which have most lines, and on both sides of a face."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_segments import Pad, simulate

from vibrissa.quantities import dataset
from vibrissa.video.link.pad.pad_finding import find_pads
from vibrissa.video.link.pad.pieces import pieces_of

PLAIN = Pad(whiskers=7, frames=120, spread=50.0, amplitude=10.0)


def with_a_lamp(segments, lines: int, seed: int):
    """The same with so many lines a frame about a round thing 200 px before the pad; none is twice in one place."""
    rng, frames = np.random.default_rng(seed), int(segments.attrs["frames"])
    way = rng.uniform(0, 2 * np.pi, (frames, lines))
    place = (PLAIN.centre[0] + 200 + 1j * PLAIN.centre[1]) + rng.uniform(5, 45, way.shape) * np.exp(1j * way)
    along = np.arange(45.0) * np.exp(1j * rng.uniform(0, 2 * np.pi, way.shape))[..., None]
    bent = place[..., None] + along * np.exp(1j * np.arange(45.0) / rng.uniform(40, 90, way.shape)[..., None])
    few, start = bent.reshape(-1, 45), segments.sizes["point"]
    values = {
        "segment_frame": np.concatenate([segments.segment_frame.values, np.repeat(np.arange(frames), lines)]),
        "segment_start": np.concatenate([segments.segment_start.values, start + 45 * np.arange(len(few))]),
        "column": np.concatenate([segments.column.values, few.real.ravel()]),
        "row": np.concatenate([segments.row.values, few.imag.ravel()]),
        "line_width": np.concatenate([segments.line_width.values, rng.uniform(1.5, 2.5, few.size)]),
        "line_contrast": np.concatenate([segments.line_contrast.values, rng.uniform(10, 40, few.size)]),
        "position_sd": np.full(start + few.size, 0.2),
    }
    order = np.argsort(values["segment_frame"], kind="stable")
    return _ordered(values, order, dict(segments.attrs))


def _ordered(values, order, attrs):
    """Segments sorted by their frames, with their points."""
    stop = np.append(values["segment_start"][1:], values["column"].size)
    size = (stop - values["segment_start"])[order]
    first = np.concatenate([[0], np.cumsum(size)[:-1]])
    point = np.repeat(values["segment_start"][order] - first, size) + np.arange(size.sum())
    sorted_ = {name: one[point] if one.size == point.size else one[order] for name, one in values.items()}
    return dataset(attrs, **{**sorted_, "segment_start": first})


@pytest.mark.parametrize("lines", [4, 8])
@pytest.mark.parametrize("seed", range(3))
def test_a_pad_is_found_where_it_is_beside_a_lamp(lines, seed):
    segments, _ = simulate([PLAIN], seed)
    alone = find_pads(pieces_of(segments))[0]
    beside = find_pads(pieces_of(with_a_lamp(segments, lines, seed)))[0]
    assert len(alone) == len(beside) == 1
    assert np.hypot(*(alone[0].pivot - beside[0].pivot)) < 25
    assert abs(alone[0].middle - beside[0].middle) < np.deg2rad(10)
    assert abs(alone[0].inner - beside[0].inner) < 25


@pytest.mark.parametrize("apart", [60, 150, 200])
@pytest.mark.parametrize("seed", [0, 1, 5])
def test_pads_of_both_sides_are_found_however_far_they_are_apart(apart, seed):
    """A wide pad, and one behind it with as many or half as many whiskers."""
    right = Pad(whiskers=6, frames=60, spread=120.0, centre=(320 + apart / 2, 240.0))
    left = Pad(whiskers=3 if seed % 2 else 6, frames=60, spread=120.0, centre=(320 - apart / 2, 240.0), direction=180.0)
    segments, truth = simulate([right, left], seed)
    pads, pad, _ = find_pads(pieces_of(segments))
    assert len(pads) == 2
    ways = [pad[(truth.segment >= 0) & (truth.segment < 6)], pad[truth.segment >= 6]]
    own = [np.bincount(one[one >= 0], minlength=2) / one.size for one in ways]
    assert own[0].argmax() != own[1].argmax()
    assert min(one.max() for one in own) > 0.9
