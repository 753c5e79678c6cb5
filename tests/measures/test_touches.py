"""Touches of a whisker that is pushed against a pole by statics: when, how long, and how much it bends."""

import numpy as np
import pytest
from pushed_whisker import CHORD, LENGTH, swung
from simulated_whiskers import RATE, circle_profile, profile_of

from vibrissa.errors import InputError
from vibrissa.measures.bending import bending, bent_frames
from vibrissa.measures.face import Face
from vibrissa.measures.kinematics import KinematicsSettings, kinematics_of
from vibrissa.measures.touched_object import Pole, Wall, held_place
from vibrissa.measures.touches import long_touches, touch_events

DOWN = Face(caudal=(0.0, 0.0), rostral=(0.0, 1.0))  # protraction turns the whisker from x towards y
PLACE = 0.2  # [rad] direction of the pole from the base
POLE = (CHORD * LENGTH * np.cos(PLACE), CHORD * LENGTH * np.sin(PLACE))
TIME = np.arange(1000) / RATE


@pytest.fixture(scope="module")
def pole():
    """Whisk at 5 Hz about the direction 0.1 rad, by 0.3 rad: the pole is met in every cycle."""
    direction = 0.1 - 0.3 * np.cos(2 * np.pi * 5 * TIME)
    arc, x, y, curvature = swung(direction, PLACE)
    noise = 3e-6 * np.random.default_rng(4).standard_normal(y.shape)
    return direction, profile_of(arc, [x], [y + noise], sd=3e-6), curvature


def onsets_and_offsets(touching):
    edges = np.flatnonzero(np.diff(np.concatenate([[0], touching.astype(int), [0]])))
    return edges[::2], edges[1::2] - 1


def test_touches_are_those_of_the_statics_where_the_pole_is_given(pole):
    direction, profile, _ = pole
    found = kinematics_of(profile, KinematicsSettings(face=DOWN, touched=Pole(centre=POLE), touch_distance=5e-5))
    first, last = onsets_and_offsets(direction >= PLACE)
    assert found.sizes["touch"] == first.size == 10
    # the whisker moves by up to 0.17 mm a frame where it meets the pole: a frame is the resolution
    np.testing.assert_allclose(found.touch_onset, TIME[first], atol=1.01 / RATE)
    np.testing.assert_allclose(found.touch_offset, TIME[last], atol=1.01 / RATE)
    np.testing.assert_allclose(found.touch_duration, (last - first + 1) / RATE, atol=2.01 / RATE)
    np.testing.assert_allclose(found.touch_angle, np.pi / 2 + PLACE, atol=0.02)
    assert (found.touch_onset_seen == 1).all()
    assert (found.touch_offset_seen == 1).all()
    # onset in protraction: −arccos((0.2 − 0.1)/0.3)
    known = np.isfinite(found.touch_phase.values)
    assert known.sum() == 9  # the first touch is in the half period left out at the start
    np.testing.assert_allclose(found.touch_phase[known], -np.arccos(1 / 3), atol=0.15)


def test_the_curvature_is_that_of_the_force_at_the_pole():
    """κ = F × lever / EI at the base; an arc has that of the middle of its part, off by a share of its length."""
    direction = np.concatenate([np.linspace(-0.3, PLACE, 60), np.linspace(PLACE, PLACE + 0.25, 60)])
    arc, x, y, curvature = swung(direction, PLACE, nodes=401)
    profile = profile_of(arc, [x], [y])
    pressed = direction > PLACE + 0.02
    off = []
    for length in (1.5e-3, 0.75e-3):
        settings = KinematicsSettings(
            face=DOWN,
            touched=Pole(centre=POLE),
            touch_distance=5e-5,
            base_part=(0.0, length),
            whisking_band=(4.0, 30.0),
        )
        change = kinematics_of(profile, settings).curvature_change.values[0]
        off.append((change[pressed] / curvature[pressed] - 1).max())
        assert np.abs(change[direction < PLACE - 0.02]).max() < 1e-3 * np.abs(curvature).max()
    assert off[1] < 0.04
    assert off[0] / off[1] == pytest.approx(2, rel=0.15)
    assert (curvature[pressed] < 0).all()  # protraction into a pole holds the tip back


def test_pole_and_touches_are_found_from_the_bending(pole):
    direction, profile, _ = pole
    found = kinematics_of(profile, KinematicsSettings(face=DOWN, find_touches=True, least_frames=3))
    place = found.object_x.item(), found.object_y.item()
    assert np.hypot(place[0] - POLE[0], place[1] - POLE[1]) < 2e-4  # two pixels
    first, last = onsets_and_offsets(direction >= PLACE)
    assert found.sizes["touch"] == first.size
    # two pixels are passed in two frames
    np.testing.assert_allclose(found.touch_onset, TIME[first], atol=3 / RATE)
    np.testing.assert_allclose(found.touch_offset, TIME[last], atol=3 / RATE)


def test_a_free_whisker_is_found_to_touch_nothing():
    direction = 0.1 - 0.3 * np.cos(2 * np.pi * 5 * TIME)
    profile = circle_profile(direction, 20.0 + 30.0 * direction)
    profile.y.values[0] += 3e-6 * np.random.default_rng(5).standard_normal(profile.y.shape[1:])
    found = kinematics_of(profile, KinematicsSettings(face=DOWN, find_touches=True, least_frames=2))
    assert found.sizes["touch"] == 0
    assert "0 are held" in found.attrs["remarks"]
    # the curvature of the free whisker goes with its angle: that is no bending
    assert np.abs(found.curvature_change.values).mean() < 2 * np.nanstd(found.whisker_curvature - 20 - 30 * direction)


def test_whiskers_without_a_phase_are_remarked_on_with_the_remedy():
    profile = circle_profile(0.1 - 0.3 * np.cos(2 * np.pi * 5 * TIME), 20.0 + 0 * TIME)
    assert "no phase" not in kinematics_of(profile, KinematicsSettings(face=DOWN)).attrs["remarks"]
    profile.x.values[:, ::40] = profile.y.values[:, ::40] = np.nan  # never 0.25 s on end
    assert "1 of 1 whiskers has no phase" in kinematics_of(profile, KinematicsSettings(face=DOWN)).attrs["remarks"]
    bridged = kinematics_of(profile, KinematicsSettings(face=DOWN, bridged=1))
    assert "no phase" not in bridged.attrs["remarks"]


def test_phases_of_a_part_are_remarked_on():
    """In the later 60 % of the frames the whisker is lost every 40 frames, 0.08 s."""
    profile = circle_profile(0.1 - 0.3 * np.cos(2 * np.pi * 5 * TIME), 20.0 + 0 * TIME)
    late = slice(2 * TIME.size // 5, None, 40)
    profile.x.values[:, late] = profile.y.values[:, late] = np.nan
    found = kinematics_of(profile, KinematicsSettings(face=DOWN))
    share = np.isfinite(found.whisking_phase.values).sum() / np.isfinite(found.whisker_angle.values).sum()
    assert 0.2 < share < 0.41
    assert f"{100 * share:.0f} % of the angles have a phase" in found.attrs["remarks"]
    bridged = kinematics_of(profile, KinematicsSettings(face=DOWN, bridged=1))
    assert "of the angles" not in bridged.attrs["remarks"]


def test_distance_to_poles_and_walls_by_hand():
    x, y = np.array([[0.0, 1.0, 2.0], [0.0, 1.0, np.nan]]), np.array([[0.0, 0.0, 0.0], [1.0, 1.0, np.nan]])
    np.testing.assert_allclose(Pole(centre=(1.5, 0.5), radius=0.1).distance(x, y), [0.4, np.hypot(0.5, 0.5) - 0.1])
    np.testing.assert_allclose(Pole(centre=(3.0, 0.0)).distance(x, y), [1.0, np.hypot(2, 1)])
    wall = Wall(ends=((1.5, -1.0), (1.5, 4.0)))
    np.testing.assert_allclose(wall.distance(x, y), [-0.5, 0.5])
    nothing = np.full((1, 3), np.nan)
    assert np.isnan(wall.distance(nothing, nothing)).all()
    assert np.isnan(Pole(centre=(0.0, 0.0)).distance(nothing, nothing)).all()
    with pytest.raises(InputError, match="wall must be two points"):
        Wall(ends=((1.0, 1.0), (1.0, 1.0)))
    with pytest.raises(InputError, match="pole_radius"):
        Pole(centre=(1.0, 1.0), radius=-1.0)


def test_lines_that_meet_nowhere_are_held_nowhere():
    direction = np.linspace(-0.5, 0.5, 50)
    arc = np.linspace(0, 0.01, 30)
    x, y = arc * np.cos(direction)[:, None], arc * np.sin(direction)[:, None]
    assert held_place(x, y, np.ones(50, bool), 1e-4) is None
    assert held_place(x, y, np.zeros(50, bool), 1e-4) is None


def test_rest_is_held_beyond_the_angles_of_the_free_whisker():
    angle = np.linspace(0, 0.4, 200)
    curvature = 10 * angle
    found = bending(angle, curvature, angle < 0.2)
    assert found.held[angle < 0.2].sum() == 0
    assert (found.held[angle > 0.25] == 1).all()
    assert np.nanmax(np.abs(found.change[angle < 0.2])) < 10 * np.radians(2)
    assert found.rest[-1] == pytest.approx(10 * 0.19, abs=10 * np.radians(2))
    assert not bent_frames(np.full(10, np.nan), np.full(10, np.nan)).any()


def test_events_end_at_free_frames_and_survive_short_gaps_only():
    nan = np.nan
    touching = np.array([0, 1, 1, nan, 1, 0, 1, nan, nan, 1, 1], float)
    time, flat = np.arange(11) / 10, np.zeros(11)
    change = np.array([0, 1, -3, nan, 2, 0, 1, nan, nan, 1, 4], float)
    how = {"angle": flat, "phase": flat, "change": change}
    rows = touch_events(time, touching, **how, bridged=1)
    assert [row["touch_onset"] for row in rows] == pytest.approx([0.1, 0.6, 0.9])
    assert [row["touch_duration"] for row in rows] == pytest.approx([0.4, 0.1, 0.2])
    assert [row["touch_curvature_change"] for row in rows] == [-3, 1, 4]
    assert [row["touch_onset_seen"] for row in rows] == [1, 1, 0]
    assert [row["touch_offset_seen"] for row in rows] == [1, 0, 0]
    assert len(touch_events(time, long_touches(touching, 2, 0), **how, bridged=0)) == 2


def test_frames_of_touches_left_out_are_free():
    nan = np.nan
    touching = np.array([0, 1, 1, nan, 1, 0, 1, nan, nan, 1, 1], float)
    np.testing.assert_array_equal(long_touches(touching, 1, 1), touching)
    np.testing.assert_array_equal(long_touches(touching, 2, 1), [0, 1, 1, nan, 1, 0, 0, nan, nan, 1, 1])
    np.testing.assert_array_equal(long_touches(touching, 3, 1), [0, 1, 1, nan, 1, 0, 0, nan, nan, 0, 0])


def test_the_frames_that_touch_are_those_of_the_touches(pole):
    _, profile, _ = pole
    touched = Pole(centre=POLE)
    every = kinematics_of(profile, KinematicsSettings(face=DOWN, touched=touched))
    longest = round(float(every.touch_duration.max()) * RATE)
    some = kinematics_of(profile, KinematicsSettings(face=DOWN, touched=touched, least_frames=longest))
    none = kinematics_of(profile, KinematicsSettings(face=DOWN, touched=touched, least_frames=longest + 1))
    for found in (every, some, none):
        assert found.touching.sum() == pytest.approx(float(found.touch_duration.sum()) * RATE)
    assert none.sizes["touch"] == 0
    assert np.nanmax(np.abs(none.curvature_change)) < np.nanmax(np.abs(every.curvature_change))  # all frames are free
