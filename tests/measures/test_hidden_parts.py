"""Lines near a dark pole: what it hides of them, and whose tip only ends there."""

import numpy as np
import pytest
from pushed_whisker import CHORD, LENGTH, swung
from simulated_whiskers import RATE, profile_of

from vibrissa.measures.face import Face
from vibrissa.measures.hidden_parts import distance_with_hidden_parts
from vibrissa.measures.kinematics import KinematicsSettings, kinematics_of
from vibrissa.measures.touched_object import Pole

RADIUS = 1e-3
ALONG = np.arange(0.0, 10.1e-3, 0.5e-3)  # 21 nodes
HIDDEN = 1e-3


def straight(offset, seen):
    """Lines beside each other, past a pole at 7 mm, with the nodes that are seen (T, N)."""
    y = np.broadcast_to(np.asarray(offset)[:, None], (len(offset), ALONG.size))
    return np.where(seen, ALONG, np.nan), np.where(seen, y, np.nan)


def at(offset):
    return Pole(centre=(7e-3, -offset), radius=RADIUS)


def test_a_part_hidden_between_seen_nodes_lies_on_the_line():
    seen = np.ones((3, ALONG.size), bool)
    seen[1:, 12:17] = False  # 6 to 8 mm
    x, y = straight(np.array([0.0, 0.0, -0.5e-3]), seen)
    distance = distance_with_hidden_parts(at(1.2e-3), x, y, HIDDEN)
    np.testing.assert_allclose(distance, [0.2e-3, 0.2e-3, 0.0], atol=1e-12)  # what is not seen is never inside


def test_a_line_that_ends_short_of_the_pole_goes_on_up_to_it():
    seen = np.ones((5, ALONG.size), bool)
    seen[0, 13:] = False  # the last node is at 6 mm, 1 mm before the place nearest to the pole
    seen[1, 11:] = False  # 5 mm: farther than a pole hides
    x, y = straight(np.zeros(5), seen)
    distance = distance_with_hidden_parts(at(1.2e-3), x, y, HIDDEN)
    assert distance[0] == pytest.approx(0.2e-3, abs=1e-12)
    assert distance[1] == pytest.approx(np.hypot(1e-3, 1.2e-3) - RADIUS, abs=1e-12)


def test_a_tip_that_ends_before_the_pole_does_not_touch_it():
    """In every frame the line is seen to the same length: so long is the whisker."""
    seen = np.broadcast_to(ALONG <= 6e-3, (5, ALONG.size))
    x, y = straight(np.zeros(5), seen)
    expected = np.hypot(1e-3, 1.2e-3) - RADIUS
    np.testing.assert_allclose(distance_with_hidden_parts(at(1.2e-3), x, y, HIDDEN), expected, atol=1e-12)


def test_frames_without_a_line_have_no_distance():
    x, y = straight(np.zeros(2), np.zeros((2, ALONG.size), bool))
    assert np.isnan(distance_with_hidden_parts(at(0.0), x, y, HIDDEN)).all()


@pytest.mark.parametrize("beyond", [True, False])
def test_touches_and_bending_are_those_of_the_statics_though_the_pole_hides_the_line(beyond):
    """Nodes within 0.3 mm of the pole are not seen; in every second frame nothing beyond it is, or never is."""
    time, place = np.arange(1000) / RATE, 0.2
    direction = 0.1 - 0.3 * np.cos(2 * np.pi * 5 * time)
    arc, x, y, _ = swung(direction, place)
    centre = CHORD * LENGTH * np.cos(place), CHORD * LENGTH * np.sin(place)
    off = np.hypot(x - centre[0], y - centre[1])
    first = np.where((off < 0.3e-3).any(axis=1), (off < 0.3e-3).argmax(axis=1), arc.size)
    hidden = off < 0.3e-3
    cut = np.ones(time.size, bool) if not beyond else np.arange(time.size) % 2 == 0
    hidden |= cut[:, None] & (np.arange(arc.size) >= first[:, None])
    profile = profile_of(arc, [np.where(hidden, np.nan, x)], [np.where(hidden, np.nan, y)], sd=3e-6)
    face = Face(caudal=(0.0, 0.0), rostral=(0.0, 1.0))
    found = kinematics_of(profile, KinematicsSettings(face=face, touched=Pole(centre=centre), touch_distance=1e-4))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (direction >= place).astype(int), [0]])))
    np.testing.assert_allclose(found.touch_onset, time[edges[::2]], atol=1.01 / RATE)
    np.testing.assert_allclose(found.touch_offset, time[edges[1::2] - 1], atol=1.01 / RATE)
    whole = profile_of(arc, [x], [y], sd=3e-6)
    plain = kinematics_of(whole, KinematicsSettings(face=face, touched=Pole(centre=centre), touch_distance=1e-4))
    np.testing.assert_allclose(found.touch_curvature_change, plain.touch_curvature_change, rtol=0.02)
