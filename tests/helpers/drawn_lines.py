"""Images of lines whose places are known: Gaussian profiles on even light with noise, drawn here."""

from typing import NamedTuple

import numpy as np


class DrawnLine(NamedTuple):
    """A straight line: angle [rad], distance from the image's middle across it [px], half its length [px], depth."""

    angle: float
    offset: float
    half_length: float = 45.0
    depth: float = 45.0
    sigma: float = 0.764


def across(line, size, column, row):
    """Distance of points to a line, and place along it [px]."""
    x, y = column - (size - 1) / 2, row - (size - 1) / 2
    c, s = np.cos(line.angle), np.sin(line.angle)
    return y * c - x * s - line.offset, x * c + y * s


def draw(lines, size=128, light=180.0, noise=3.0, rng=None):
    """A square image of dark lines, grey levels rounded to eight bits."""
    row, column = np.indices((size, size))
    image = np.full((size, size), light)
    for line in lines:
        off, along = across(line, size, column, row)
        ends = 1 / (1 + np.exp(-(line.half_length - np.abs(along)) / 0.3))
        image -= line.depth * np.exp(-0.5 * (off / line.sigma) ** 2) * ends
    if rng is not None:
        image += noise * rng.standard_normal(image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def parts(found):
    """Frame, and points (n, 5) of column, row, width, contrast and SD, of each segment of a dataset."""
    names = ("column", "row", "line_width", "line_contrast", "position_sd")
    points = np.stack([found[name].values for name in names], axis=1).astype(float)
    return list(zip(found.segment_frame.values, np.split(points, found.segment_start.values[1:]), strict=True))
