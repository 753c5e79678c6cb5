"""Lines of a fan in single frames."""

import numpy as np
import pytest

from vibrissa.video.identity.whisker_fan import Fan, fan_lines

PIVOT, ANGLES = (20.0, 200.0), np.array([-50.0, -20.0, 20.0, 50.0])


def frame(noise, rng):
    """Four dark whiskers from the pivot on, with noise of a standard deviation in grey levels."""
    row, column = np.mgrid[:400, :300]
    image = 120 + noise * rng.normal(size=row.shape)
    x, y = column - PIVOT[0], row - PIVOT[1]
    for angle in np.deg2rad(ANGLES):
        across, along = y * np.cos(angle) - x * np.sin(angle), x * np.cos(angle) + y * np.sin(angle)
        image -= 40 * np.exp(-0.5 * (across / 1.2) ** 2) * (along > 0)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("noise", [0.0, 6.0])
def test_whiskers_at_every_angle_are_found_in_noise(noise):
    fan, rng = Fan(pivot=PIVOT, radii=(60.0, 140.0)), np.random.default_rng(1)
    for _ in range(5):
        lines = fan_lines(frame(noise, rng), np.empty((0, 0), np.float32), 1.0, fan)
        seen = lines[np.isfinite(lines[:, 0])]
        assert np.all(np.diff(seen[:, 2]) <= 0)  # the densest first
        for angle in ANGLES:
            assert np.any((np.abs(seen[:, 0] - angle) < 0.7) & (np.abs(seen[:, 1]) < 5))
