"""The ragged dataset of line segments as flat arrays, and sums over the points of each segment."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import FormatError, ShapeError, TooFewError
from vibrissa.quantities import require

if TYPE_CHECKING:
    import xarray as xr

CELL = np.array([0.1, 6.0, 40.0])  # turn [rad], distance across and along [px] within which a line is where it was
STILL = 0.03  # share of the frames


class Pieces(NamedTuple):
    """Segments of a movie; points of segment i are ``start[i]`` to ``stop[i]``, the latter not included.

    Attributes
    ----------
    frames : int
        Frames of the movie.
    frame, start, stop : (S,) arrays
        Frame and range of points of each segment.
    column, row, width, contrast, sd : (P,) arrays
        Of the points, as in the dataset ``segments`` [px, grey levels].
    """

    frames: int
    frame: Integers
    start: Integers
    stop: Integers
    column: Array
    row: Array
    width: Array
    contrast: Array
    sd: Array

    @property
    def owner(self) -> Integers:
        """Segment of each point, (P,)."""
        return np.repeat(np.arange(self.frame.size), self.stop - self.start)

    @property
    def ends(self) -> tuple[Array, Array]:
        """First and last point of each segment, (S, 2) each [px]."""
        first, last = (np.stack([self.column[at], self.row[at]], axis=1) for at in (self.start, self.stop - 1))
        return first, last

    def sums(self, values: Array) -> Array:
        """Sum of values of points (P, ...) over each segment, (S, ...)."""
        out: Array = np.add.reduceat(values, self.start, axis=0)
        return out


def novelty(pieces: Pieces) -> Array:
    """Weight of each segment (S,), small for lines that are in one place for long: edges of things, not whiskers.

    Parameters
    ----------
    pieces : Pieces
        Segments.

    Returns
    -------
    (S,) array
        From 0 to 1; alike for all where nothing moves.
    """
    x = np.stack([pieces.column[pieces.start], pieces.column[pieces.stop - 1]])
    y = np.stack([pieces.row[pieces.start], pieces.row[pieces.stop - 1]])
    angle = np.arctan2(y[1] - y[0], x[1] - x[0]) % np.pi
    normal, way = np.stack([-np.sin(angle), np.cos(angle)]), np.stack([np.cos(angle), np.sin(angle)])
    middle = np.stack([x.mean(axis=0), y.mean(axis=0)])
    off, along = (normal * middle).sum(axis=0), (way * middle).sum(axis=0)
    cells = np.stack([angle // CELL[0], off // CELL[1], along // CELL[2]], axis=1)
    _, where, count = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    return np.asarray(1 / (1 + count[where.ravel()] / (STILL * pieces.frames)))


def pieces_of(segments: xr.Dataset) -> Pieces:
    """Arrays of the dataset ``segments``.

    Parameters
    ----------
    segments : Dataset
        ``segments``, see :mod:`vibrissa.quantities.segments`.

    Returns
    -------
    Pieces
        Its arrays; width and contrast are 1 where unknown.

    Raises
    ------
    InputError
        If it is not such a dataset, holds no segment, or a segment without points, or its frames are not in order.
    """
    require(segments, "segment_frame", "segment_start", "column", "row", "line_width", "line_contrast")
    frame, start = (segments[name].values.astype(np.int64) for name in ("segment_frame", "segment_start"))
    if not frame.size:
        raise TooFewError("segments", "must hold at least one segment")
    stop = np.append(start[1:], segments.sizes["point"])
    if start[0] != 0 or np.any(stop - start < 1):
        raise ShapeError("segment_start", "must begin at 0 and give every segment at least one point")
    frames = int(segments.attrs.get("frames", frame[-1] + 1))
    if np.any(np.diff(frame) < 0) or frame[0] < 0 or frame[-1] >= frames:
        raise FormatError("segment_frame", f"must ascend within the {frames} frames of the movie")
    column, row, width, contrast = (
        segments[name].values.astype(float) for name in ("column", "row", "line_width", "line_contrast")
    )
    sd = segments["position_sd"].values.astype(float) if "position_sd" in segments else np.full(column.size, np.nan)
    width, contrast = (np.where(np.isfinite(x) & (x > 0), x, 1.0) for x in (width, contrast))
    return Pieces(frames, frame, start, stop, column, row, width, contrast, sd)
