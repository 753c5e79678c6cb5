"""A path of postures says how the whisker is held at any of its times, and at no other."""

import numpy as np
import pytest
from refusals import refusal

import vibrissa as vb

PATH = vb.PosturePath(time=[-0.1, 2.0, 4.0], base_angle=[1.1, 1.2, 1.3], contact=[0.29, 0.29, 0.29])


@pytest.mark.parametrize("t", [-0.1, 1.0, 4.0, 4.0 + 1e-12])
def test_a_path_has_a_posture_at_each_of_its_times(t):
    line = np.interp(t, PATH.time, PATH.base_angle)  # a spline through three points is a parabola
    assert PATH.at(t).base_angle == pytest.approx(line, abs=0.01)


@pytest.mark.parametrize("t", [-0.2, 4.001, 9.0, np.nan])
def test_a_path_is_not_prolonged_beyond_its_times(t):
    with refusal("range", "t"):
        PATH.at(t)
