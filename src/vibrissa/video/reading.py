"""One line read in one image, where it is expected: the settings of a search as the kernels take them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.video.centreline import SMOOTH, read_line
from vibrissa.video.kernel import expect
from vibrissa.video.search import Search

Rows = NDArray[np.float64]
Image = NDArray[Any]

GROW_REACH = 2  # rows about the straight continuation in which a line is carried on


def background_of(search: Search, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """The image without the whisker, or an array of size 0 if it is to be estimated."""
    if isinstance(search.background, str):
        return np.zeros((0, 0), np.float32)
    if search.background.shape != shape:
        raise InputError("background", f"must have the frames' shape {shape}", search.background.shape)
    return np.ascontiguousarray(search.background, np.float32)


def sign_of(search: Search) -> float:
    """1 for dark whiskers, −1 for bright ones."""
    return 1.0 if search.polarity == "dark" else -1.0


def read(
    image: Image,
    background: NDArray[np.float32],
    search: Search,
    expected: Rows,
    reach: int,
) -> tuple[Rows, Rows, Rows]:
    """Row, standard deviation and contrast of the line within ``reach`` rows of the expected rows."""
    ceiling = np.full(expected.size, np.nan)
    line = np.empty((3, expected.size))
    match = search.estimator == "matched"
    sign = sign_for(image, search)
    read_line(image, background, sign, expected, ceiling, reach, search.threshold, match, line[0], line[1], line[2])
    return line[0], line[1], line[2]


def sign_for(image: Image, search: Search) -> NDArray[np.signedinteger]:
    """The sign, in a type that holds sums of the image's grey levels."""
    return np.array([sign_of(search)], np.int16 if image.dtype == np.uint8 else np.int32)


def columns_of(search: Search, width: int) -> tuple[int, int]:
    """First and last column that are read."""
    low, high = search.columns or (0, width - 1)
    return max(low, 0), min(high, width - 1)


def limited(expected: Rows, search: Search) -> Rows:
    """Expected rows, NaN outside the columns that are read."""
    if search.columns is None:
        return expected
    columns = np.arange(expected.size)
    return np.where((columns >= search.columns[0]) & (columns <= search.columns[1]), expected, np.nan)


def grow(
    image: Image, background: NDArray[np.float32], search: Search, line: Rows, strength: Rows
) -> tuple[Rows, Rows]:
    """Carry a line and its contrast on to both ends."""
    longest, stalled = 0, 0
    course = line
    # a faint stretch may cost columns once: give up when nothing was gained three times
    while stalled < 3 and np.count_nonzero(~np.isnan(course)) > SMOOTH // 2:
        expected = np.empty(line.size)
        expect(course, np.full(line.size, np.nan), *columns_of(search, line.size), expected)
        course, _, contrast = read(image, background, search, expected, GROW_REACH)
        count = int(np.count_nonzero(~np.isnan(course)))
        stalled = 0 if count > longest else stalled + 1
        if count > longest:
            longest, line, strength = count, course, contrast
    return line, strength
