"""Pads of both sides: which whiskers are of which, the axis between them, and their names."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.measures.face import Face, face_through, whisker_names
from vibrissa.measures.sides import axis_between, sides_of


def head(turn=0.0, downwards=True, seed=0, lean=0.0):
    """Bases, directions and sides of an animal seen from above whose nose points up, then turned by an angle [rad]."""
    rng = np.random.default_rng(seed)
    side = np.repeat([-1.0, 1.0], 6)  # the animal's left is the image's
    bases = np.column_stack([side * rng.normal(5e-3, 4e-4, 12), np.tile(np.linspace(-2e-3, 2e-3, 6), 2)])
    angle = lean + rng.uniform(-0.5, 0.5, 12)
    ways = np.column_stack([side * np.cos(angle), np.sin(angle)])
    c, s = np.cos(turn), np.sin(turn)
    flip = np.array([1.0, -1.0 if downwards else 1.0])  # made with y upwards
    return tuple((one @ np.array([[c, s], [-s, c]])) * flip for one in (bases, ways)), side


@pytest.mark.parametrize("turn", [-0.6, 0.0, 0.4])
@pytest.mark.parametrize("downwards", [True, False])
def test_the_axis_is_that_of_the_head_and_each_side_is_numbered_by_itself(turn, downwards):
    (bases, ways), _ = head(turn, downwards)
    face = face_through(bases, "top", ways=ways, downwards=downwards)
    assert face.origin == "the axis between pads of 6 and 6 whiskers"
    up = np.array([-np.sin(turn), np.cos(turn) * (-1 if downwards else 1)])
    assert face.direction @ up > np.cos(np.deg2rad(8))
    with refusal("range", "nose") as caught:
        face_through(bases, "left", ways=ways, downwards=downwards)
    assert "across the line from one pad to the other" in str(caught.value)
    assert caught.value.rule.endswith("the other, top or bottom")
    names = whisker_names(bases, face, ways=ways, downwards=downwards)
    assert names == [f"{letter}{number}" for letter in "LR" for number in range(1, 7)]
    rows = whisker_names(bases, Face(caudal=(0, 0), rostral=(1, 0)), ways=ways, downwards=downwards)
    assert sorted(rows, key=int) == [str(k) for k in range(1, 13)]  # across the head there are no sides


def test_sides_are_seen_where_the_head_is_turned_from_the_side_of_the_nose():
    (bases, ways), _ = head(turn=0.7, lean=0.45)  # 40°, its whiskers forwards
    assert not sides_of(bases, ways, np.array([0.0, -1.0])).any()
    face = face_through(bases, "top", ways=ways)
    assert face.origin == "the axis between pads of 6 and 6 whiskers"
    assert face.direction @ [-np.sin(0.7), -np.cos(0.7)] > np.cos(np.deg2rad(8))
    with refusal("range", "nose", "left") as caught:
        face_through(bases, "left", ways=ways)
    assert caught.value.rule.endswith("the other, top or bottom")


def test_whiskers_that_point_far_to_the_nose_have_names_of_their_side():
    """The sides are seen along the side of the nose that was given, but not along the axis between the pads."""
    (bases, ways), side = head(turn=0.25, lean=0.85, seed=3)
    ways[side > 0] = head(turn=0.25, lean=0.4, seed=3)[0][1][side > 0]
    face = face_through(bases, "top", ways=ways)
    assert face.between
    assert not sides_of(bases, ways, face.direction).any()
    names = whisker_names(bases, face, ways=ways)
    assert names == [f"{letter}{number}" for letter in "LR" for number in range(1, 7)]


def test_a_whisker_that_was_never_seen_is_on_no_side():
    (bases, ways), side = head()
    ways[3] = bases[3] = np.nan
    found = sides_of(bases, ways, np.array([0.0, -1.0]))
    assert found[3] == 0
    np.testing.assert_array_equal(np.delete(found, 3), np.delete(side, 3))
    axis = axis_between(bases, found, np.array([0.0, -1.0]))
    assert np.hypot(*axis) == pytest.approx(1)


def test_one_pad_on_an_arc_or_with_one_false_line_is_one_side():
    (bases, ways), side = head()
    towards = np.array([0.0, -1.0])
    assert not sides_of(bases[side > 0], ways[side > 0], towards).any()
    false = np.append(np.flatnonzero(side > 0), 0)  # one line of the other side
    assert not sides_of(bases[false], ways[false], towards).any()
    angle = np.linspace(-2.0, 2.0, 12)  # those at the ends point across the other way
    arc = np.column_stack([np.cos(angle), np.sin(angle)])
    assert not sides_of(5e-3 * arc, arc, towards).any()
    assert face_through(bases[side > 0], "top", ways=ways[side > 0]).origin.startswith("a line fitted")
