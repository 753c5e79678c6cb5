"""Lines that a person would not call a whisker's, and whiskers that a pole bends far from where they swing."""

import numpy as np
import pytest
from drawn_fan import curve, segments, swing

from vibrissa.video.link.thorough_linking import link_thoroughly

FRAMES, HAIR = 150, 9
BASES = [(200.0, 400.0 + 25 * k) for k in range(5)]
REST = [-40.0, -20.0, 0.0, 20.0, 40.0]
LENGTHS = [90, 110, 130, 120, 100]


def _whiskers(turn):
    return [curve(base, rest + turn, length, 0.08) for base, rest, length in zip(BASES, REST, LENGTHS, strict=True)]


def _names(made):
    lines, linking = link_thoroughly(made)
    return lines, linking.identity()


@pytest.mark.parametrize("seed", range(3))
def test_a_hair_that_does_not_swing_has_no_name(seed):
    """It is as long as whiskers are, in every frame, and leads away from the pad."""
    rng = np.random.default_rng(seed)
    frames, owners = [], []
    for turn in swing(FRAMES):
        hair = curve((255.0, 540.0), 62 + 0.12 * turn + rng.normal(0, 0.3), 60)
        frames.append([*_whiskers(turn), hair])
        owners.append([*range(5), HAIR])
    made, owner = segments(frames, owners, seed)
    _, identity = _names(made)
    name = identity.segment_whisker.values
    assert name.size == owner.size  # nothing was cut
    assert (name[owner == HAIR] < 0).mean() > 0.95
    assert [np.unique(name[owner == k]).tolist() for k in range(5)] == [[0], [1], [2], [3], [4]]


def test_all_are_named_where_nothing_swings():
    made, owner = segments([_whiskers(0.0)] * FRAMES, [list(range(5))] * FRAMES, 0)
    assert (_names(made)[1].segment_whisker.values == owner).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_whisker_that_a_pole_bends_keeps_its_name(seed):
    """In six frames of a hundred it is bent by 70°; it begins where it always does, and where no other begins."""
    frames, owners, bent = [], [], np.arange(FRAMES) % 50 < 3
    for t, turn in enumerate(swing(FRAMES)):
        lines = _whiskers(turn)
        if bent[t]:
            lines[0] = curve(BASES[0], REST[0] + turn, LENGTHS[0], 0.08, kink=-70.0, at=15)
        frames.append(lines)
        owners.append(list(range(5)))
    made, owner = segments(frames, owners, seed)
    lines, identity = _names(made)
    assert lines.sizes["segment"] == owner.size
    mine = owner == 0
    np.testing.assert_array_equal(identity.segment_whisker.values[mine], 0)
    sure = identity.segment_probability.values[mine]
    assert (sure[bent] >= 0.7).all()
    assert (sure[bent] < sure[~bent].min()).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_shadow_that_is_seen_now_and_then_takes_no_frames_from_its_whisker(seed):
    """Where it is not seen, it might run along the whisker's line; but it is seen too rarely to be believed."""
    rng = np.random.default_rng(seed)
    frames, owners = [], []
    for turn in swing(FRAMES):
        lines, who = _whiskers(turn), list(range(5))
        if rng.random() < 0.25:
            lines, who = [*lines, lines[2] + np.array([[0.5], [2.0]])], [*who, HAIR]
        frames.append(lines)
        owners.append(who)
    made, owner = segments(frames, owners, seed)
    _, identity = _names(made)
    assert len(np.unique(identity.segment_whisker.values[owner == 2])) == 1
    assert (identity.segment_other.values[owner == 2] < 0).all()
