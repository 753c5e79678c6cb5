"""One line read in one image, where it is expected: the settings of a search as the kernels take them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import ShapeError
from vibrissa.video.follow.search import Search
from vibrissa.video.kernel.band import Image, Rows, Single
from vibrissa.video.kernel.centreline import read_line
from vibrissa.video.kernel.estimator_table import code_of
from vibrissa.video.kernel.local_quadratic import SMOOTH
from vibrissa.video.kernel.tracking_kernel import expect

GROW_REACH = 2  # rows about the straight continuation in which a line is carried on


def background_of(search: Search, shape: tuple[int, ...]) -> Single:
    """The image without the whisker, or an array of size 0 if it is to be estimated.

    Parameters
    ----------
    search : Search
        How whiskers are sought.
    shape : (int, int)
        Of the frames.

    Returns
    -------
    (height, width) array
        Grey levels, or an array of size 0.

    Raises
    ------
    InputError
        If the background has another shape.
    """
    if isinstance(search.background, str):
        return np.zeros((0, 0), np.float32)
    if search.background.shape != shape:
        raise ShapeError("background", f"must have the frames' shape {shape}", search.background.shape)
    return np.ascontiguousarray(search.background, np.float32)


@dataclass(frozen=True)
class Reader:
    """Reads lines in one image.

    Attributes
    ----------
    image : (height, width) array of uint8 or uint16
        Grey levels.
    background : (height, width) array
        As of :func:`background_of`.
    search : Search
        How lines are sought.
    """

    image: Image
    background: Single
    search: Search

    @property
    def sign(self) -> NDArray[np.signedinteger]:
        """1 for dark whiskers, −1 for bright ones, (1,), in a type that holds sums of the image's grey levels."""
        return np.array([self.search.sign], np.int16 if self.image.dtype == np.uint8 else np.int32)

    @property
    def how(self) -> tuple[int, float, int]:
        """Reach, threshold and estimator, as of :func:`vibrissa.video.kernel.centreline.read_line`."""
        return self.search.search, self.search.threshold, code_of(self.search.estimator)

    @property
    def columns(self) -> tuple[int, int]:
        """First and last column that are read."""
        low, high = self.search.columns or (0, self.image.shape[-1] - 1)
        return max(low, 0), min(high, self.image.shape[-1] - 1)

    def limited(self, expected: Rows) -> Rows:
        """Expected rows, NaN outside the columns that are read.

        Parameters
        ----------
        expected : (width,) array
            Rows [px].

        Returns
        -------
        (width,) array
        """
        columns, (low, high) = np.arange(expected.size), self.columns
        return np.where((columns >= low) & (columns <= high), expected, np.nan)

    def read(self, expected: Rows, reach: int) -> tuple[Rows, Rows, Rows]:
        """Row, standard deviation and contrast of a line.

        Parameters
        ----------
        expected : (width,) array
            Expected rows [px]; NaN in columns not to be read.
        reach : int
            Rows to search on either side.

        Returns
        -------
        row, sd, contrast : (width,) arrays
            As in :class:`vibrissa.video.follow.following.Centrelines`.
        """
        line = np.empty((3, expected.size))
        ceiling, how = np.full(expected.size, np.nan), (reach, *self.how[1:])
        read_line(self.image, self.background, self.sign, expected, ceiling, how, (line[0], line[1], line[2]))
        return line[0], line[1], line[2]

    def beyond(self, line: Rows) -> tuple[Rows, Rows, Rows]:
        """A line read again, its ends carried straight on.

        Parameters
        ----------
        line : (width,) array
            Rows [px].

        Returns
        -------
        row, sd, contrast : (width,) arrays
            As of :meth:`read`.
        """
        expected = np.empty(line.size)
        expect(line, np.full(line.size, np.nan), *self.columns, expected)
        return self.read(expected, GROW_REACH)

    def grown(self, line: Rows) -> Rows:
        """A line continued to both ends.

        Parameters
        ----------
        line : (width,) array
            Rows [px].

        Returns
        -------
        (width,) array
        """
        longest, stalled, course = 0, 0, line
        # a faint stretch may cost columns once: give up when nothing was gained three times
        while stalled < 3 and np.count_nonzero(~np.isnan(course)) > SMOOTH // 2:
            course = self.beyond(course)[0]
            count = int(np.count_nonzero(~np.isnan(course)))
            stalled = 0 if count > longest else stalled + 1
            if count > longest:
                longest, line = count, course
        return line
