"""What the page draws: all lines of a movie, thinned, and where each is in the picture of time by angle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.video.correct.correction import Named
from vibrissa.video.link.whisker_linking import Linking

Single = NDArray[np.float32]
EVERY = 4  # points along a line from which one is drawn, besides the ends


def drawn_lines(linking: Linking) -> dict[str, Single]:
    """Lines of all frames, and their angles.

    Parameters
    ----------
    linking : Linking
        The movie.

    Returns
    -------
    dict of arrays
        ``frame``, ``start`` (first point), ``angle`` [°] of each segment (S,); ``column``, ``row`` of points (P,) [px],
        from the base on.
    """
    pieces = linking.pieces
    size = pieces.stop - pieces.start
    at = np.arange(pieces.column.size) - np.repeat(pieces.start, size)
    left = np.repeat(size, size) - 1 - at
    turned = np.repeat(linking.lines.turned, size)
    kept = np.flatnonzero((at % EVERY == 0) | (left == 0))
    # points of a line that was traced from its tip are put in the order of the others
    order = np.lexsort((np.where(turned, left, at)[kept], pieces.owner[kept]))
    kept = kept[order]
    count = np.bincount(pieces.owner[kept], minlength=size.size)
    arrays = {
        "frame": pieces.frame,
        "start": np.append(0, np.cumsum(count)[:-1]),
        "angle": line_angles(linking),
        "column": pieces.column[kept],
        "row": pieces.row[kept],
    }
    return {name: values.astype(np.float32) for name, values in arrays.items()}


def line_angles(linking: Linking) -> Array:
    """Angle of every line, also of those of no pad, so that whiskers of a pad do not cross because they are bent.

    Parameters
    ----------
    linking : Linking
        The movie.

    Returns
    -------
    (S,) array
        Place of the line's middle about its base [°]: that of the middle of the pad in the image (0 to the right, 90
        down) and the degrees of swing from there.
    """
    pieces, lines = linking.placed, linking.lines
    middle = (pieces.start + pieces.stop) // 2
    angle = np.where(lines.pad >= 0, lines.place[:, 1], np.nan)
    centre = np.array([np.rad2deg(one.middle) for one in linking.pads])
    places = np.stack([one.polar(pieces.column[middle], pieces.row[middle])[1] for one in linking.pads])
    nearest = np.where(lines.pad >= 0, lines.pad, np.abs(places).argmin(axis=0))
    angle = np.where(np.isfinite(angle), angle, places[nearest, np.arange(middle.size)])
    return np.asarray(centre[nearest] + angle)


def drawn_names(named: Named) -> dict[str, Single]:
    """Names as the page takes them.

    Parameters
    ----------
    named : Named
        Names now.

    Returns
    -------
    dict of arrays
        ``whisker`` (−1 none, −2 no whisker by hand), ``other``, ``sure``, ``piece`` of each segment (S,).
    """
    whisker = np.where(named.gone, -2, named.whisker)
    arrays = {"whisker": whisker, "other": named.other, "sure": named.sure, "piece": named.piece}
    return {name: values.astype(np.float32) for name, values in arrays.items()}
