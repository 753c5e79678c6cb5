"""Lines where they are linked: in coordinates that move with the head, and at one size, whatever that of the image."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import TooFewError
from vibrissa.head_pose import HeadPose
from vibrissa.video.link.pad.pieces import Pieces, novelty

LEAST = 12.0  # length of the longest line in the image [px]
TYPICAL = 80.0  # half of the length of all lines is in lines at least so long, where they are linked
MOVED = 0.1  # novelty of a line that moves; edges of things, which may be longer than whiskers, stay


def in_head(pieces: Pieces, head: HeadPose | None) -> Pieces:
    """Segments in coordinates that move with the head.

    Parameters
    ----------
    pieces : Pieces
        Segments in the image.
    head : HeadPose or None
        The head; the segments stay as they are if None.

    Returns
    -------
    Pieces
        Their places in head coordinates [px].
    """
    if head is None:
        return pieces
    column, row = head.to_head(pieces.frame[pieces.owner], pieces.column, pieces.row)
    return pieces._replace(column=column, row=row)


def linking_size(pieces: Pieces) -> float:
    """Size at which lines are linked, over that in the image: distances in pixels mean the same in all movies then.

    Parameters
    ----------
    pieces : Pieces
        Segments in the image.

    Returns
    -------
    float
        The factor that makes half of the length of all lines be in lines of at least ``TYPICAL``; or of those that
        move, if these are shorter: edges of things must not count.

    Raises
    ------
    InputError
        If no line is long enough to be a whisker's.
    """
    first, last = pieces.ends
    every = np.maximum(np.hypot(*(last - first).T), 1.0)
    if every.max() < LEAST:
        raise TooFewError("segments", f"must hold a line of at least {LEAST:g} px", f"{every.max():g} px")
    moved = every[novelty(resized(pieces, TYPICAL / float(np.median(every)))) > MOVED]
    usual = _half_of_all(every)
    return TYPICAL / (min(usual, _half_of_all(moved)) if moved.max(initial=0.0) >= LEAST else usual)


def _half_of_all(length: Array) -> float:
    """Length of the lines, or of longer ones, that have half of the length of all."""
    length = np.sort(length)
    shorter = np.cumsum(length)
    return float(length[np.searchsorted(shorter, shorter[-1] / 2)])


def resized(pieces: Pieces, size: float) -> Pieces:
    """Segments at another size.

    Parameters
    ----------
    pieces : Pieces
        Segments.
    size : float
        Over the former.

    Returns
    -------
    Pieces
        With other places, widths and standard deviations.
    """
    column, row, width, sd = (size * one for one in (pieces.column, pieces.row, pieces.width, pieces.sd))
    return pieces._replace(column=column, row=row, width=width, sd=sd)
