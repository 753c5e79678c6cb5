"""The line that a point is on."""

import numpy as np
import pytest

from vibrissa.errors import InputError
from vibrissa.video.link.line_at import line_at

FRAME, START = np.array([0, 0, 3]), np.array([0, 5, 12])  # lines of 5, 7 and 4 points
OWNER = np.repeat(np.arange(3), [5, 7, 4])
COLUMN, ROW = np.arange(16) * 4.0, np.repeat([10.0, 30.0, 50.0], [5, 7, 4])


def on(*point):
    return line_at(FRAME, START, COLUMN, ROW, point, "point", "here")


@pytest.mark.parametrize("seed", range(20))
def test_a_point_is_on_the_line_of_its_frame_whose_point_is_nearest(seed):
    rng = np.random.default_rng(seed)
    point = int(rng.integers(16))
    column, row = COLUMN[point] + rng.uniform(-1.9, 1.9), ROW[point] + rng.uniform(-5, 5)
    assert on(FRAME[OWNER[point]], column, row) == OWNER[point]


def test_a_point_on_no_line_is_refused_with_the_place_of_the_nearest():
    with pytest.raises(InputError, match=r"within 6 px .* frame 0 passes at column 8\.0, row 10\.0, 6\.5 px away"):
        on(0, 8.0, 3.5)
    with pytest.raises(InputError, match="the nearest line of frame 3 passes"):
        on(2, COLUMN[-1], ROW[-1])
