"""Where the head is in every frame of a movie, and places in coordinates that move with it.

Head coordinates are those of the image in the first frame in which the head is known: there both agree.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import ShapeError, TooFewError
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr

NAMES = ("head_column", "head_row", "head_angle")


class HeadPose(NamedTuple):
    """Place and direction of the head.

    Attributes
    ----------
    column, row : (T,) arrays
        Place of a point of the head [px], NaN where the head is not known.
    angle : (T,) array
        Direction of the head [°]: 0 to the right, 90 down; without jumps of a full turn.
    """

    column: Array
    row: Array
    angle: Array

    @property
    def known(self) -> Mask:
        """Frames in which the head is known, (T,)."""
        return np.isfinite(self.column) & np.isfinite(self.row) & np.isfinite(self.angle)

    @property
    def first(self) -> int:
        """First frame in which it is known."""
        return int(self.known.argmax())

    def to_head(self, frame: Integers, column: Array, row: Array) -> tuple[Array, Array]:
        """Places of the image in head coordinates.

        Parameters
        ----------
        frame : array of int
            Frames of the places; where the head is not known, it is taken on a straight line between its neighbours.
        column, row : arrays
            Places [px], of shapes that go with that of ``frame``.

        Returns
        -------
        tuple of arrays
            Column and row [px].
        """
        at, home, turn = self._way(frame)
        cos, sin = np.cos(turn), np.sin(turn)
        x, y = column - at[0], row - at[1]
        return home[0] + cos * x + sin * y, home[1] - sin * x + cos * y

    def to_image(self, frame: Integers, column: Array, row: Array) -> tuple[Array, Array]:
        """Places in head coordinates in the image.

        Parameters
        ----------
        frame, column, row
            As of :meth:`to_head`.

        Returns
        -------
        tuple of arrays
            Column and row [px].
        """
        at, home, turn = self._way(frame)
        cos, sin = np.cos(turn), np.sin(turn)
        x, y = column - home[0], row - home[1]
        return at[0] + cos * x - sin * y, at[1] + sin * x + cos * y

    def turned(self) -> Array:
        """Angle of the head since the first frame in which it is known, (T,) [rad]."""
        return np.deg2rad(self.angle - self.angle[self.first])

    def with_motion(self, left: HeadPose) -> HeadPose:
        """The head where it moves as this one and, in coordinates that move with it, as another one.

        Parameters
        ----------
        left : HeadPose
            Known in every frame.

        Returns
        -------
        HeadPose
            Its place is that of the other one in the image.
        """
        column, row = self.to_image(np.arange(left.angle.size), left.column, left.row)
        return HeadPose(column, row, self.angle + left.angle)

    def within(self, frames: int, first: int) -> HeadPose:
        """The same in a movie of which these frames are a part.

        Parameters
        ----------
        frames : int
            Frames of the movie.
        first : int
            Number of the first of these frames in it.

        Returns
        -------
        HeadPose
            NaN in the other frames.
        """
        values = np.full((3, frames), np.nan)
        values[:, first : first + self.column.size] = self
        return HeadPose(*values)

    def _way(self, frame: Integers) -> tuple[Array, Array, Array]:
        """Place of the head in the frames, its place at first [px], and how far it has turned since [rad]."""
        known = np.flatnonzero(self.known)
        if not known.size:
            raise TooFewError("head", "must be known in a frame")
        x, y, angle = (np.interp(np.arange(len(v)), known, v[known])[frame] for v in self)
        home = np.array([self.column[known[0]], self.row[known[0]]])
        return np.stack([x, y]), home, np.deg2rad(angle - self.angle[known[0]])


def head_of(data: xr.Dataset) -> HeadPose | None:
    """The head of a dataset ``profile`` or ``segments``.

    Parameters
    ----------
    data : Dataset
        With or without ``head_column``, ``head_row`` and ``head_angle``.

    Returns
    -------
    HeadPose or None
        None where it has none.
    """
    if not all(name in data for name in NAMES):
        return None
    return HeadPose(*(data[name].values.astype(float) for name in NAMES))


def with_head(data: xr.Dataset, head: HeadPose) -> xr.Dataset:
    """A dataset with the head of its frames.

    Parameters
    ----------
    data : Dataset
        With ``time``.
    head : HeadPose
        Of as many frames.

    Returns
    -------
    Dataset
        With ``head_column``, ``head_row`` and ``head_angle``.

    Raises
    ------
    InputError
        If the numbers of frames differ.
    """
    if len(head.column) != data.sizes["time"]:
        raise ShapeError("head", f"must have the {data.sizes['time']} frames that are tracked", len(head.column))
    column, row, angle = head
    places = dataset(time=data.time.values, head_column=column, head_row=row, head_angle=angle)
    return data.merge(places, combine_attrs="override")


def profile_in_head(profile: xr.Dataset, head: HeadPose) -> tuple[Array, Array]:
    """Nodes of a profile in head coordinates.

    Parameters
    ----------
    profile : Dataset
        ``x``, ``y`` ([whisker,] time, node) [m] with ``pixel_size``.
    head : HeadPose
        Of its frames.

    Returns
    -------
    tuple of arrays
        ``x`` and ``y`` [m]; NaN where the head is not known.
    """
    size, frame = float(profile.attrs["pixel_size"]), np.arange(len(head.column))[:, None]
    x, y = head.to_head(frame, profile.x.values / size, profile.y.values / size)
    gone = ~head.known[:, None]
    return np.where(gone, np.nan, x * size), np.where(gone, np.nan, y * size)
