"""The part of the image that is tracked, turned so that whiskers run across it from column to column."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.errors import InputError, RangeError, UnknownError
from vibrissa.video.identity.whisker_fan import Fan
from vibrissa.video.identity.whisking import Whisking

Side = Literal["left", "right", "top", "bottom"]
Region = tuple[int, int, int, int]
Point = tuple[float, float]
Image = NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class View:
    """What is seen of the image: a region of it, its columns and rows exchanged if the base is at top or bottom.

    Whatever a user gives or gets is in columns and rows of the whole image, as the camera took it; whiskers are sought
    in the view, in which the base is on the left (of top too) or on the right (of bottom too).

    Attributes
    ----------
    base : {"left", "right", "top", "bottom"}
        Side of the image on which whiskers leave the skin.
    region : (first column, first row, last column, last row), optional
        What is read of the image, both ends included [px]; all of it by default.
    cut : bool
        Whether the view ends with the region; else only ``limits`` gives it.
    """

    base: Side = "left"
    region: Region | None = None
    cut: bool = True

    def __post_init__(self) -> None:
        if self.base not in get_args(Side):
            raise UnknownError("base", f"must be one of {', '.join(get_args(Side))}", repr(self.base))
        if self.region is not None and not (
            len(self.region) == 4 and 0 <= self.region[0] < self.region[2] and 0 <= self.region[1] < self.region[3]
        ):
            rule = "must be first column, first row, last column and last row, in this order"
            raise RangeError("region", rule, self.region)

    @property
    def turned(self) -> bool:
        """Whether columns and rows are exchanged."""
        return self.base in ("top", "bottom")

    @property
    def side(self) -> Literal["left", "right"]:
        """Side of the view on which the base is."""
        return "left" if self.base in ("left", "top") else "right"

    @property
    def first(self) -> tuple[int, int]:
        """Column and row of the image at which the view begins."""
        return (0, 0) if self.region is None or not self.cut else self.region[:2]

    @property
    def limits(self) -> tuple[tuple[int, int] | None, tuple[int, int] | None]:
        """First and last column, and first and last row, of the region in a view that is not cut; None for all."""
        if self.region is None:
            return None, None
        columns, rows = self.region[::2], self.region[1::2]
        return (rows, columns) if self.turned else (columns, rows)

    def of(self, frames: Image) -> Image:
        """Frames as they are in the view, contiguous.

        Parameters
        ----------
        frames : (…, height, width) array
            Of the whole image.

        Returns
        -------
        (…, height, width) array
            Cut to the region and turned.

        Raises
        ------
        InputError
            If the region does not lie in the image.
        """
        if self.region is not None:
            column, row, last_column, last_row = self.region
            height, width = frames.shape[-2:]
            if not (last_column < width and last_row < height):
                raise RangeError("region", f"must lie in the image of {width} × {height} pixels", self.region)
            if self.cut:
                frames = frames[..., row : last_row + 1, column : last_column + 1]
        return np.ascontiguousarray(np.swapaxes(frames, -1, -2) if self.turned else frames)

    def point(self, point: Point) -> Point:
        """Column and row in the view of a point of the image.

        Parameters
        ----------
        point : (column, row)
            In the image [px].

        Returns
        -------
        (column, row)
            In the view [px].
        """
        column, row = point[0] - self.first[0], point[1] - self.first[1]
        return (row, column) if self.turned else (column, row)

    def whisking(self, whisking: Whisking) -> Whisking:
        """Fan and marks as they are in the view.

        Parameters
        ----------
        whisking : Whisking
            Given in columns and rows of the image.

        Returns
        -------
        Whisking
            In those of the view.
        """
        first, last = whisking.fan.angles
        if self.turned:  # exchanging x and y mirrors an angle at 45°
            first, last = 90 - last, 90 - first
        fan: Fan = replace(whisking.fan, pivot=self.point(whisking.fan.pivot), angles=(first, last))
        marks = tuple(tuple((frame, *self.point((c, r))) for frame, c, r in one) for one in whisking.marks)
        return Whisking(fan=fan, marks=marks)

    def back(self, along: Array, across: Array) -> tuple[Array, ...]:
        """Columns and rows of the image of places in the view.

        Parameters
        ----------
        along, across : arrays
            Columns and rows of the view [px].

        Returns
        -------
        x, y : arrays
            Columns and rows of the image [px].
        """
        x, y = (across, along) if self.turned else (along, across)
        return x + self.first[0], y + self.first[1]

    @contextmanager
    def located(self) -> Iterator[None]:
        """Say of errors met in the view how its pixels lie in the image.

        Raises
        ------
        InputError
            The error met, with a remedy that says so.
        """
        try:
            yield
        except InputError as error:
            if (not self.turned and self.first == (0, 0)) or error.quantity == "region":
                raise
            exchanged = "columns and rows exchanged, " if self.turned else ""
            where = f"({exchanged}counted from column {self.first[0]}, row {self.first[1]} of the image)"
            remedy = f"{error.remedy} {where}".strip()
            raise type(error)(error.quantity, error.rule, error.value, remedy) from error
