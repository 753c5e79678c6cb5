"""The motion of the head that lines show, against simulated lines that were moved in a known way."""

import numpy as np
import pytest
from moved_heads import moved
from simulated_segments import Pad, score, simulate

from vibrissa.head_pose import with_head
from vibrissa.quantities import dataset
from vibrissa.quantities.identity import SURE
from vibrissa.video.link.pad import pad_motion
from vibrissa.video.link.pad.pad_motion import base_parts, motion_of
from vibrissa.video.link.pad.pads import Lines
from vibrissa.video.link.pad.pieces import Pieces
from vibrissa.video.link.whisker_linking import Linking, link_segments
from vibrissa.video.linked.linked_profile import profile_from_linking
from vibrissa.video.tracking import Calibration

FRAMES = 150
PAD = Pad(whiskers=8, frames=FRAMES)


def _fan(shift, turn, bent=0.0, frames=120):
    """Straight whiskers of a fan that turn about follicles of a head that moves about (100, 100); six tracklets."""
    rng, count = np.random.default_rng(2), 6
    follicle = np.stack([np.zeros(count), np.linspace(-40, 40, count)], axis=1)
    whisk = 15 * np.sin(2 * np.pi * np.arange(frames) / 25)
    points, s = [], np.arange(12.0, 80.0)
    for t in range(frames):
        cos, sin = np.cos(turn[t]), np.sin(turn[t])
        for k in range(count):
            angle = np.deg2rad(-50 + 20 * k + whisk[t]) + bent * s / 80
            own = follicle[k] + np.stack([s * np.cos(angle), s * np.sin(angle)], axis=1)
            place = own @ np.array([[cos, sin], [-sin, cos]]) + shift[t] + 100
            points.append(place + rng.normal(0, 0.1, place.shape))
    x = np.concatenate(points)
    start = np.arange(frames * count) * s.size
    one = np.ones(len(x))
    pieces = Pieces(frames, np.repeat(np.arange(frames), count), start, start + s.size, x[:, 0], x[:, 1], one, one, one)
    alike = np.zeros((start.size, 3))
    lines = Lines(
        alike[:, 0].astype(int), np.zeros(start.size, bool), alike, alike[:, None], alike[:, :2], alike[:, :2]
    )
    return pieces, lines, np.tile(np.arange(count), frames), np.ones(start.size)


def test_base_parts_are_those_near_the_base():
    pieces, lines, tracklet, novel = _fan(np.zeros((120, 2)), np.zeros(120))
    parts = base_parts(pieces, lines, tracklet, novel)
    assert parts.frame.size == 720
    np.testing.assert_allclose(np.hypot(*parts.way.T), 1)
    far = np.hypot(*(parts.middle - 100 - [0, -40])[0])
    assert 20 < far < 30  # from 12 px on, some 24 px of 67
    turned = lines._replace(turned=np.ones(720, bool))
    back = base_parts(pieces, turned, tracklet, novel)
    np.testing.assert_allclose((parts.way * back.way).sum(axis=1), -1, atol=1e-3)
    few = np.where(pieces.frame < 4, tracklet, -1)  # four lines each
    assert base_parts(pieces, lines, few, novel).frame.size == 0
    assert motion_of(pieces, lines, few, novel) is None


@pytest.mark.parametrize("cycles", [0.5, 1.5])
def test_the_motion_of_whiskers_that_turn_about_their_follicles_is_found(cycles):
    """The follicles are hidden, and whisk by 15°: the true motion is known."""
    t = np.arange(120) / 120
    shift = np.stack([9 * np.sin(2 * np.pi * cycles * t), 6 * np.cos(2 * np.pi * cycles * t)], axis=1)
    turn = np.deg2rad(4) * np.sin(2 * np.pi * cycles * t + 1)
    found = motion_of(*_fan(shift, turn))
    assert found is not None
    np.testing.assert_allclose(found.angle - found.angle.mean(), np.rad2deg(turn - turn.mean()), atol=1.2)
    # where a point of the head is, by either
    frame, x, y = np.arange(120), np.full(120, 100.0), np.full(120, 110.0)
    cos, sin = np.cos(turn), np.sin(turn)
    true = shift + 100 + np.stack([-10 * sin, 10 * cos], axis=1)
    x, y = found.to_image(frame, *found.to_head(np.zeros(1, int), *true[0]))
    off = np.stack([x, y], axis=1) - true
    assert np.sqrt(np.mean((off - off.mean(axis=0)) ** 2)) < 0.4


@pytest.mark.parametrize("bent", [0.0, 0.8])
def test_whiskers_that_only_whisk_show_no_motion(bent):
    assert motion_of(*_fan(np.zeros((120, 2)), np.zeros(120), bent)) is None


def test_a_motion_that_swerves_less_than_needed_is_not_taken(monkeypatch):
    t = np.arange(120) / 120
    shift = np.stack([9 * np.sin(2 * np.pi * 4 * t), 0 * t], axis=1)
    fast = motion_of(*_fan(shift, 0 * t))
    monkeypatch.setattr(pad_motion, "SWERVES", (0.02,))
    monkeypatch.setattr(pad_motion, "EXPLAINED", (3.0,))
    slow = motion_of(*_fan(shift, 0 * t))
    assert fast is not None
    assert np.sqrt(np.mean((fast.column - fast.column.mean() - shift[:, 0]) ** 2)) < 1.5  # of 6.4
    assert slow is None or np.std(slow.column) < 0.5 * np.std(fast.column)


def test_frames_without_lines_change_nothing():
    t = np.arange(120) / 120
    shift = np.stack([9 * np.sin(2 * np.pi * t), 6 * np.cos(2 * np.pi * t)], axis=1)
    pieces, *rest = _fan(shift, 0 * t)
    alone = motion_of(pieces, *rest)
    part = motion_of(pieces._replace(frames=2000, frame=pieces.frame + 1500), *rest)
    np.testing.assert_allclose(np.stack(part)[:, 1500:1620], np.stack(alone))
    np.testing.assert_array_equal(part.column[[0, 1499, -1]], alone.column[[0, 0, -1]])


def test_edges_of_things_and_few_whiskers_show_no_motion():
    """A third of the lines stays in the image; they have little weight, so the motion is that of the head."""
    t = np.arange(120) / 120
    shift = np.stack([9 * np.sin(2 * np.pi * t), 6 * np.cos(2 * np.pi * t)], axis=1)
    pieces, lines, tracklet, novel = _fan(shift, 0 * t)
    still = _fan(0 * shift, 0 * t)[0]
    edge = tracklet < 2
    points = edge[pieces.owner]
    column, row = np.where(points, still.column, pieces.column), np.where(points, still.row, pieces.row)
    mixed = pieces._replace(column=column, row=row)
    found = motion_of(mixed, lines, tracklet, np.where(edge, 0.02, novel))
    true = shift[:, 0] - shift[:, 0].mean()
    assert np.sqrt(np.mean((found.column - found.column.mean() - true) ** 2)) < 0.5
    two = np.where(tracklet < 2, tracklet, -1)
    assert motion_of(pieces, lines, two, novel) is None


def test_a_pad_that_has_no_line_in_the_moved_image_is_empty():
    """One whisker in eight frames: its lines are of no pad once the motion is known, or there is no motion."""
    segments, _ = simulate([Pad(whiskers=1, frames=8)], 18)
    assert link_segments(moved(segments, 18)[0]).whiskers == 0


def _followed(segments, truth):
    identity = link_segments(segments).identity()
    sure = identity.segment_probability.values >= SURE
    return score(segments, truth, np.where(sure, identity.segment_whisker.values, -1))[:2]


def test_whiskers_of_a_head_that_moves_are_followed_though_it_is_not_given():
    """15 px and 5° within 0.75 s: where whiskers are in the image says little of who they are."""
    scores = []
    for seed in (0, 3, 5):
        segments, truth = simulate([PAD], seed)
        segments, _ = moved(segments, seed)
        scores.append(_followed(segments, truth))
    followed, wrong = np.array(scores).T
    assert followed.min() > 0.9  # 0.05 to 0.5 where the motion is not sought
    assert wrong.max() < 0.02


def test_the_motion_is_that_of_the_head_unless_one_is_given():
    segments, _ = simulate([PAD], 3)
    assert link_segments(segments).motion is None
    shifted, head = moved(segments, 3)
    alone = link_segments(shifted)
    assert isinstance(alone, Linking)
    assert alone.head is None
    assert alone.motion is not None
    # the pad, at rest in either: a place of the head in the first frame goes with it
    where = alone.pads[0].pivot / alone.size
    frame = np.arange(FRAMES)
    seen = np.stack(alone.motion.to_image(frame, *(np.full(FRAMES, one) for one in where)))
    true = np.stack(
        head.to_image(frame, *(np.full(FRAMES, one) for one in head.to_head(np.zeros(1, int), *seen[:, :1])))
    )
    off = seen - true
    assert np.sqrt(np.mean((off - off.mean(axis=1, keepdims=True)) ** 2)) < 3.0  # of 18
    # the profile begins on the head, and says that it moves
    profile = profile_from_linking(alone, Calibration(frame_rate=200.0, pixel_size=1e-4), source="lines")
    base = np.stack([profile.x.values[:, :, 0], profile.y.values[:, :, 0]]) / 1e-4
    place = np.stack([head.column, head.row])[:, None]
    assert np.nanstd(base - place, axis=2).max() < 0.5 * np.std(place)
    assert "the head moves" in profile.attrs["remarks"]
    given = link_segments(with_head(shifted.merge(dataset(time=np.arange(FRAMES) / 200)), head))
    assert given.motion is given.head
