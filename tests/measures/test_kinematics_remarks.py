"""Remarks on kinematics that rest on little."""

import numpy as np

from vibrissa.measures.kinematics_remarks import remark_on_touches


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
