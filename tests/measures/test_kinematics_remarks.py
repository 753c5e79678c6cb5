"""Remarks on kinematics that rest on little."""

import numpy as np

from vibrissa.measures.kinematics_remarks import remark_on_object, remark_on_touches


def touched(*runs):
    """Series of one whisker with touches of these lengths, two free frames between them."""
    touching = np.concatenate([[0.0, 0.0], *([1.0] * run + [0.0, 0.0] for run in runs)])
    return {
        "touching": touching[None],
        "rest_held": np.zeros((1, touching.size)),
        "object_x": np.array([np.nan]),
    }


def test_touches_of_one_frame_are_said_where_they_are_half_or_more():
    lines = remark_on_touches(touched(1, 1, 5), 1e-4, found=True)
    assert lines[-1].startswith("2 of 3 stretches of touch last one frame")
    assert len(remark_on_touches(touched(1, 4, 5), 1e-4, found=True)) == 1
    assert len(remark_on_touches(touched(), 1e-4, found=True)) == 1
    assert remark_on_touches(touched(1, 1), 1e-4, found=False) == []  # the object was given
    assert "no touches are sought" in remark_on_touches(touched(1, 1), None, found=False)[0]


def test_of_whiskers_that_were_not_seen_nothing_is_said_of_the_object():
    unseen = {"object_distance": np.full((1, 5), np.nan), "touching": np.full((1, 5), np.nan)}
    assert remark_on_object(unseen, 1e-4) == []
    passing = {"object_distance": np.array([[np.nan, 2e-3]]), "touching": np.array([[np.nan, 0.0]])}
    assert remark_on_object(passing, 1e-4) == ["no whisker touches the object: the nearest line passes 2 mm from it"]
