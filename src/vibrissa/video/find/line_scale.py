"""How wide the lines of a movie are, measured on some of its frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrissa.video.find.frame_lines import LineShape, find_lines, frame_room, line_shape
from vibrissa.video.find.line_placing import FULL_WIDTH

Single = NDArray[np.float32]

FIRST, NARROWEST = 0.85, 0.5  # standard deviation of a line's profile that is tried first, and at least [px]
WIDER = 1.6  # where no line is found, the next that is tried, over the last
ALIKE = 0.1  # change from which on the width is measured again
ROUNDS = 6
WIDEST = 0.02  # standard deviation at most, over the shorter side of the image


def measured_shape(images: Sequence[Single], least: float | None, zero: float) -> LineShape:
    """Shape of the lines in some images, by turns found and measured until the width stays.

    Parameters
    ----------
    images : sequence of (height, width) arrays
        Grey levels, lines darker than their sides.
    least : float, optional
        Least length of a line [px]; ten widths by default.
    zero : float
        Grey level of no light; −∞ where lines are brighter than the background.

    Returns
    -------
    LineShape
        Of the median width; of the width that is tried first where no line is found.
    """
    sigma = FIRST
    for _ in range(ROUNDS):
        shape = line_shape(sigma, least, zero)
        widths = _widths(images, shape)
        if widths.size == 0:
            if sigma * WIDER > WIDEST * min(images[0].shape):
                break
            sigma *= WIDER
            continue
        found = max(float(np.median(widths)) / FULL_WIDTH, NARROWEST)
        if abs(found - sigma) < ALIKE * sigma:
            return line_shape(found, least, zero)
        sigma = found
    else:
        return line_shape(sigma, least, zero)
    return line_shape(FIRST, least, zero)


def _widths(images: Sequence[Single], shape: LineShape) -> Single:
    """Widths at all points of lines that were measured [px]."""
    room = frame_room(*images[0].shape, shape)
    widths = []
    for image in images:
        lines = find_lines(image, shape, room)
        points = room.found[: room.begin[lines]]
        widths.append(points[np.isfinite(points[:, 4]), 2])
    return np.concatenate(widths)
