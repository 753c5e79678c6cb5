"""Points given in pixels where metres are meant are refused, and points in metres are taken."""

import numpy as np
import pytest
from refusals import refusal

import vibrissa as vb
from vibrissa.quantities import dataset


@pytest.fixture(scope="module")
def profile():
    time, along = np.arange(300) / 500, np.linspace(0, 10e-3, 21)
    angle = 0.3 * np.sin(2 * np.pi * 8 * time)
    x, y = 0.02 + along * np.cos(angle)[:, None], 0.03 + along * np.sin(angle)[:, None]
    about = {"frame": "image", "pixel_size": 1e-4}
    return dataset(about, lead=("whisker",), time=time, x=x[None], y=y[None], arc_length=along[None])


FACE = ((0.02, 0.02), (0.02, 0.04))
PIXELS = {
    "face": {"face": ((200, 200), (200, 400))},
    "pole": {"face": FACE, "pole": (250, 300)},
    "wall": {"face": FACE, "wall": ((250, 300), (260, 300))},
}


@pytest.mark.parametrize("name", PIXELS)
def test_points_in_pixels_are_refused(profile, name):
    with refusal("range", name) as caught:
        vb.kinematics(profile, **PIXELS[name])
    assert "multiply pixels by the size of a pixel" in str(caught.value)


def test_points_in_metres_are_taken(profile):
    found = vb.kinematics(profile, face=FACE, pole=(0.028, 0.03), touch_distance=2e-4)
    assert found.touching.any()
    assert np.ptp(found.whisker_angle.values) == pytest.approx(0.6, abs=0.02)
