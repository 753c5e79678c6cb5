"""Whisking scenes: the truth is where the picture shows the whiskers, and the motion is what was asked for."""

import dataclasses

import numpy as np
import pytest

from vibrissa.errors import InputError
from vibrissa.video.camera.camera import Camera
from vibrissa.video.camera.pad.curves import scene_curves
from vibrissa.video.camera.pad.filming import film
from vibrissa.video.camera.pad.layout import draw_whiskers
from vibrissa.video.camera.pad.settings import FilmedPole, Head, Paw, WhiskingScene, Whisks
from vibrissa.video.camera.pad.truth import scene_truth
from vibrissa.whisker.measured import atlas_entry

SIDE = 0.2e-3
STEADY = Whisks(variability=0.0, individual=0.0, own=0.0, lag=0.5)


def camera(**changed):
    set_up = {"frame_rate": 500.0, "pixel_size": SIDE, "width": 320, "height": 240, "exposure": 1e-4, "noise": 0.0}
    return Camera(**(set_up | changed))


def scene(**changed):
    """Half of a head at the upper left, whose left pad is in view (it looks down: left of an animal is right here)."""
    head = Head(nose=(30 * SIDE, 120 * SIDE), fur=0.0)
    return WhiskingScene(**({"camera": camera(), "head": head, "sides": ("left",), "whisks": STEADY} | changed))


def points_of(segments, frame, whisker):
    """(column, row) of a whisker in a frame."""
    ends = np.append(segments.segment_start.values, segments.sizes["point"])
    mine = np.flatnonzero((segments.segment_frame.values == frame) & (segments.segment_whisker.values == whisker))
    at = np.concatenate([np.arange(ends[k], ends[k + 1]) for k in mine])
    return np.stack([segments.column.values[at], segments.row.values[at]], axis=1)


@pytest.mark.parametrize("polarity", ["dark", "bright"])
def test_a_lone_whisker_is_where_the_truth_says(polarity):
    """The centroid of the light that is missing (or there) in each pixel column is the curve, to its curvature."""
    one = scene(names=("C1",), polarity=polarity)
    (image,) = next(film(one, 1))
    points = points_of(scene_truth(one, 1).segments, 0, 0)
    sign = 1 if polarity == "dark" else -1
    light = sign * (np.median(image[150:]) - image.astype(float))
    for column in range(100, 180, 10):
        row = np.interp(column, points[:, 0], points[:, 1])
        near = np.arange(int(row) - 5, int(row) + 7)
        weight = light[near, column]
        assert (weight * near).sum() / weight.sum() == pytest.approx(row, abs=0.1)  # levels are rounded


def test_depth_on_the_line_is_the_truths():
    one = scene(names=("C1",))
    (image,) = next(film(one, 1))
    segments = scene_truth(one, 1, least_contrast=10.0).segments
    column, row = (segments[name].values for name in ("column", "row"))
    inner = slice(40, -10)
    shown = one.camera.background - image[np.rint(row).astype(int), np.rint(column).astype(int)]
    # a pixel's centre is up to 0.7 px off the line, which of a line of full width 1.8 px leaves 60 %
    ratio = (shown / segments.line_contrast.values)[inner]
    assert ratio.min() > 0.6
    assert ratio.max() < 1.06
    assert 0.8 < ratio.mean() < 1.0


def test_whiskers_swing_by_the_amplitude_at_8_hz_and_lag_along_the_pad():
    time = np.arange(2000) / 1000
    one = scene(names=("C1", "C2"))
    angle = scene_curves(one, time).angle
    np.testing.assert_allclose(np.ptp(angle, axis=1) / 2, STEADY.amplitude, rtol=1e-3)
    spectrum = np.fft.rfft(angle - angle.mean(axis=1, keepdims=True))
    tone = np.abs(spectrum[0]).argmax()
    assert tone == 16  # 8 Hz in two seconds
    assert np.angle(spectrum[0, tone] / spectrum[1, tone]) == pytest.approx(STEADY.lag, abs=0.01)


def test_cycles_differ_by_the_variability():
    time = np.arange(20_000) / 500
    whisks = dataclasses.replace(STEADY, variability=0.2, lag=0.0)
    angle = scene_curves(scene(names=("C1",), whisks=whisks), time).angle[0]
    tops = angle[1:-1][(angle[1:-1] > angle[:-2]) & (angle[1:-1] > angle[2:])] - angle.mean()
    assert 0.15 < tops.std() / whisks.amplitude < 0.4  # amplitude and set point, 0.2 each: 0.28


def test_whiskers_have_the_length_of_the_atlas_and_pass_through_one_another():
    one = scene(whisks=dataclasses.replace(STEADY, individual=0.2))
    curves = scene_curves(one, np.arange(200) / 500)
    long = np.hypot(np.diff(curves.x), np.diff(curves.y)).sum(axis=2)
    assert np.ptp(long, axis=1).max() < 1e-4 * long.max()  # the shaft keeps its length
    expected = [atlas_entry(name).length for name in one.names]
    assert np.corrcoef(long[:, 0], expected)[0, 1] > 0.8  # rows that point out of the plane look shorter
    middle = np.arctan2(curves.y[..., 40] - curves.y[..., 0], curves.x[..., 40] - curves.x[..., 0])
    order = np.argsort(middle, axis=0)
    assert len(np.unique(order, axis=1).T) > 5


def test_the_head_carries_its_whiskers_rigidly():
    """Without whisking, base and tip keep their distances while the head moves and turns."""
    head = Head(nose=(0.03, 0.02), shift=2e-3, turn=0.1)
    curves = scene_curves(scene(head=head, whisks=Whisks(amplitude=0.0, variability=0.0, own=0.0)), np.arange(9) / 10)
    ends = (curves.x + 1j * curves.y)[..., [0, -1]].transpose(0, 2, 1).reshape(-1, 9)
    distance = np.abs(ends[:, None] - ends[None])
    np.testing.assert_allclose(distance, np.broadcast_to(distance[..., :1], distance.shape), atol=1e-9)
    assert np.ptp(np.abs(ends[0])) > 1e-3


def test_head_and_paw_hide_what_is_under_them():
    wide = camera(width=640, height=480)
    head = Head(nose=(320 * SIDE, 200 * SIDE), fur=0.0)
    one = scene(camera=wide, head=head, paw=Paw(start=-0.1, stop=0.1, side="left"))
    (image,) = next(film(one, 1))
    truth = scene_truth(one, 1)
    free = scene_truth(dataclasses.replace(one, paw=None), 1)
    shown = truth.profile.node_visible.values
    assert shown.sum() < free.profile.node_visible.values.sum()
    column, row = (np.rint(truth.segments[name].values).astype(int) for name in ("column", "row"))
    assert np.mean(image[row, column] > wide.background / 3) > 0.97  # or on the blurred border
    x, y = (np.rint(truth.profile[name].values / SIDE).astype(int) for name in ("x", "y"))
    deep = ~shown & free.profile.node_visible.values
    assert np.mean(image[y[deep], x[deep]] < wide.background / 2) > 0.9  # the rest lies on the paw's blurred border


def test_a_touched_pole_lies_at_the_whiskers_surface_and_the_free_whisker_beyond_it():
    free = scene(names=("C1", "D1"))
    time = np.arange(100) / 500
    curves = scene_curves(free, time)
    rear, front = np.argsort(curves.angle[0])[[10, -10]]
    place = [np.mean([v[0, rear, 60], v[0, front, 60]]) for v in (curves.x, curves.y)]
    pole = FilmedPole(position=tuple(place), touched_by=(0,))
    bent = scene_curves(dataclasses.replace(free, pole=pole), time)
    touching = bent.touching[0]
    assert 0 < touching.sum() < 100
    assert not bent.touching[1].any()
    gap = np.hypot(bent.x[0] - place[0], bent.y[0] - place[1]).min(axis=1)
    np.testing.assert_allclose(gap[touching], pole.radius, atol=0.02 * SIDE + 0.1 * pole.radius)  # nodes are 2 px apart
    assert (gap[~touching] > pole.radius).all()
    np.testing.assert_array_equal(bent.x[:, ~touching], curves.x[:, ~touching])
    # it is held back, on the side from which it protracted
    assert curves.angle[0, touching].min() > curves.angle[0, ~touching].max() - 0.15
    np.testing.assert_allclose(np.hypot(*np.diff([bent.x[0], bent.y[0]])).sum(-1), draw_whiskers(free).length[0])


def test_an_instant_is_the_same_in_a_longer_movie():
    one = scene(whisks=Whisks(), head=Head(nose=(0.01, 0.02), shift=1e-3, turn=0.1))
    short, long = scene_curves(one, np.arange(3) / 50), scene_curves(one, np.arange(90) / 50)
    np.testing.assert_allclose(short.x, long.x[:, :3], atol=1e-12)


def test_equal_seeds_give_equal_movies_and_pieces_of_any_size():
    one = scene(names=("C1",), camera=camera(noise=3.0, width=160, height=120), seed=4)
    whole, pieces = np.concatenate(list(film(one, 5))), np.concatenate(list(film(one, 5, block=2)))
    np.testing.assert_array_equal(whole, pieces)
    assert (whole != next(film(dataclasses.replace(one, seed=5), 5))).any()


@pytest.mark.parametrize(
    ("changed", "thing"),
    [
        ({"names": ("C1", "C1")}, "WhiskingScene.names"),
        ({"names": ("Z9",)}, "WhiskingScene.names"),
        ({"sides": ("upper",)}, "WhiskingScene.sides"),
        ({"polarity": "grey"}, "WhiskingScene.polarity"),
        ({"pole": FilmedPole(position=(0.0, 0.0), touched_by=(12,))}, "FilmedPole.touched_by"),
    ],
)
def test_impossible_scenes_are_refused_by_name(changed, thing):
    with pytest.raises(InputError, match=thing):
        scene(**changed)


def test_a_paw_that_ends_before_it_starts_is_refused():
    with pytest.raises(InputError, match=r"Paw.stop"):
        Paw(start=0.2, stop=0.1)
