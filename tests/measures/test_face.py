"""Angles to the face grow with protraction on either side of any face; names follow the places of the bases."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibrissa.errors import InputError
from vibrissa.measures.face import Face, face_through, whisker_names
from vibrissa.measures.kinematics_remarks import remark_on_face

ANGLES = st.floats(-np.pi, np.pi)


@settings(deadline=None)
@given(heading=ANGLES, angle=st.floats(0.2, 2.9), side=st.sampled_from([-1, 1]))
def test_angles_are_those_set_up_whatever_way_the_animal_looks(heading, angle, side):
    face = Face(caudal=(0.0, 0.0), rostral=(float(np.cos(heading)), float(np.sin(heading))))
    direction = np.array([heading + np.pi + side * angle])
    turn = face.turn(direction)
    assert turn == side
    assert face.angle(direction, turn)[0] == pytest.approx(angle, abs=1e-9)


def test_whiskers_on_both_sides_of_a_midline_protract_to_the_nose():
    face = Face(caudal=(0.0, 1.0), rostral=(0.0, 0.0))  # the nose at the top of the image
    right, left = np.array([-0.5]), np.array([np.pi + 0.5])  # both point up, that is forwards
    for direction in (right, left):
        assert face.angle(direction, face.turn(direction))[0] == pytest.approx(np.pi / 2 + 0.5)


def test_the_line_is_fitted_to_three_bases_or_more():
    along = np.linspace(0, 3e-3, 4)
    bases = np.column_stack([along * np.cos(2.0), along * np.sin(2.0)])
    face = face_through(bases, "bottom")
    np.testing.assert_allclose(face.direction, [np.cos(2.0), np.sin(2.0)], atol=1e-12)
    assert "4 whiskers" in face.origin
    np.testing.assert_allclose(face_through(bases, "top").direction, [-np.cos(2.0), -np.sin(2.0)], atol=1e-12)
    np.testing.assert_allclose(face_through(bases[:2], "top").direction, [0, -1])
    np.testing.assert_allclose(face_through(bases[:2], "top", downwards=False).direction, [0, 1])
    with pytest.raises(InputError, match="nose must be a side"):
        face_through(np.column_stack([along, 0 * along]), "top")
    slanting = np.column_stack([along * np.cos(0.4), along * np.sin(0.4)])  # 23° from the right, 67° from the bottom
    assert face_through(slanting, "right").direction @ [1, 0] > 0
    with pytest.raises(InputError, match="nose must be a side"):
        face_through(slanting, "bottom")


def test_a_base_counts_as_often_as_it_is_seen():
    along = np.linspace(0, 3e-3, 4)
    bases = np.column_stack([np.append(along, 3e-3), np.append(0 * along, 1.5e-3)])  # the last one is a false whisker
    tilted = face_through(np.delete(bases, [1], axis=0), "right").direction
    face = face_through(np.delete(bases, [1], axis=0), "right", np.array([500, 500, 500, 1]))
    assert abs(tilted[1]) > 0.02
    assert abs(face.direction[1]) < 0.1 * abs(tilted[1])


def test_the_standard_error_of_a_fitted_line_is_its_scatter():
    rng, along = np.random.default_rng(6), np.linspace(-2e-3, 2e-3, 6)
    sets = [np.column_stack([along, 0.2e-3 * rng.standard_normal(6)]) for _ in range(2000)]
    faces = [face_through(bases, "right") for bases in sets]
    turned = np.array([np.arctan2(face.direction[1], face.direction[0]) for face in faces])
    told = np.sqrt(np.mean([face.direction_sd**2 for face in faces]))
    # of 2,000 draws a standard deviation is known to 1.6 %
    assert told == pytest.approx(turned.std(), rel=0.06)
    weighted = face_through(sets[0], "right", np.full(6, 500.0)).direction_sd
    assert weighted == pytest.approx(faces[0].direction_sd)
    assert np.isnan(face_through(sets[0][:2], "right").direction_sd)  # an axis of the image


def test_the_tilt_of_a_fitted_line_is_said_with_its_error_and_the_remedy():
    along = np.array([-2.0, -1.0, 1.0, 2.0])
    off = 0.1 * np.array([1.0, -2.0, 2.0, -1.0])  # across the line, without a slope: 0.1² · 10/2/10 = 0.0707²
    turn = np.radians(10)
    bases = np.column_stack([along * np.cos(turn) - off * np.sin(turn), along * np.sin(turn) + off * np.cos(turn)])
    face = face_through(bases, "right")
    assert remark_on_face(face, "right", known=False, downwards=True) == [
        "angles are to a line fitted to the bases of 4 whiskers, 10.0 ± 4.1° (standard error) from the image's axis to "
        "the right: an error of this line shifts all angles alike; `face` gives it by two points"
    ]
    axis = face_through(bases[:2], "right")
    assert remark_on_face(axis, "right", known=False, downwards=True) == [f"angles are to {axis.origin}"]


def test_two_points_that_are_one_are_refused():
    with pytest.raises(InputError, match="face must be two points"):
        Face(caudal=(1.0, 1.0), rostral=(1.0, 1.0))


def test_names_count_from_caudal_to_rostral():
    face = Face(caudal=(0.0, 0.0), rostral=(0.0, -1.0))
    bases = np.array([[0.0, -2e-3], [1e-4, 0.0], [0.0, -1e-3]])
    assert whisker_names(bases, face) == ["3", "1", "2"]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({1: "C2"}, ["1", "C2", "3", "4"]),
        ({2: "7"}, ["1", "2", "7", "4"]),
        ({0: "1"}, ["1", "2", "3", "4"]),
        ({3: "1", 2: "C2"}, ["2", "3", "C2", "1"]),
        ({0: "2"}, ["2", "3", "4", "5"]),
        ({0: "4", 3: "1"}, ["4", "2", "3", "1"]),
        (dict(enumerate("4321")), ["4", "3", "2", "1"]),
    ],
)
def test_numbers_given_as_names_stay_and_are_given_to_no_other_whisker(given, expected):
    face = Face(caudal=(0.0, 0.0), rostral=(1.0, 0.0))
    bases = np.column_stack([np.arange(4) * 1e-3, np.zeros(4)])
    names = [given.get(k, "") for k in range(4)]
    assert whisker_names(bases, face, given=names) == expected
    order = [2, 0, 3, 1]
    assert whisker_names(bases[order], face, given=[names[k] for k in order]) == [expected[k] for k in order]


@pytest.mark.parametrize(("given", "first"), [("B1", ["A1", "A2"]), ("A1", ["A2", "A3"]), ("a1", ["A2", "A3"])])
def test_a_row_and_column_given_as_a_name_is_given_to_no_other_whisker(given, first):
    face = Face(caudal=(0.0, 0.0), rostral=(1.0, 0.0))
    bases = 1e-3 * np.array([(0, 0), (1, 0), (0, 5), (1, 5)])
    second = [given, "B2"]
    assert whisker_names(bases, face, "top", given=["", "", given, ""]) == first + second


def test_rows_and_columns_of_a_view_from_the_side():
    face = Face(caudal=(0.0, 0.0), rostral=(1.0, 0.0))
    rng = np.random.default_rng(2)
    row, column = np.divmod(np.arange(12), 4)
    bases = np.column_stack([column * 1.5e-3 + row * 2e-4, row * 2e-3]) + 1e-4 * rng.uniform(-1, 1, (12, 2))
    expected = [f"{'ABC'[r]}{c + 1}" for r, c in zip(row, column, strict=True)]
    mixed = rng.permutation(12)
    assert whisker_names(bases[mixed], face, "top") == [expected[k] for k in mixed]
    assert whisker_names(bases[mixed], face) != [expected[k] for k in mixed]


def test_bases_that_form_no_rows_are_named_along_the_face():
    face = Face(caudal=(0.0, 0.0), rostral=(1.0, 0.0))
    bases = np.column_stack([np.arange(5) * 1e-3, np.arange(5) * 1e-3])
    assert whisker_names(bases, face, "top") == ["1", "2", "3", "4", "5"]
