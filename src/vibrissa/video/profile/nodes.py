"""Nodes at fixed arc length from the skin, read along the centrelines of the frames."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import MissingError, RangeError, TooFewError
from vibrissa.loops import njit
from vibrissa.video.follow.following import REASONS, Centrelines
from vibrissa.video.kernel.local_quadratic import SMOOTH, local_quadratic
from vibrissa.video.profile.base_end import first_frames, mean_course, whisker_from

Values = NDArray[np.float64]
REACH = 20  # columns by which the base end may draw back behind its place in the first frame, else arc is unknown
SKIN_REACH = 5.0  # distance of the skin point from the line [px]
FINEST = 0.01  # least distance of nodes [px]
BASE_END = 30  # measured columns that show where the line comes from
BASE_HIDDEN = REASONS.index("base end hidden")


def profile(
    lines: Iterable[Centrelines],
    count: int,
    spacing: float,
    skin: Sequence[tuple[float, float]] | None,
    base: str,
    longest: bool,
) -> tuple[Values, Values, Values, Values, NDArray[np.int8]]:
    """x, y, the standard deviation of y and arc length at the nodes [px], and why frames have none.

    Parameters
    ----------
    lines : iterable of Centrelines
        Blocks of a movie.
    count : int
        Number of whiskers.
    spacing : float
        Arc length between nodes [px].
    skin : sequence of (column, row) or None
        Where each whisker leaves the skin [px]; None for the base end of its line in the first frame.
    base : {"left", "right"}
        Side on which the base is.
    longest : bool
        Whether nodes reach as far as the line in any frame, not only in the first.

    Returns
    -------
    x, y, sd : (whisker, T, node) arrays
        Places and standard deviation of y [px]; NaN where not seen.
    arc : (whisker, node) array
        Arc length [px].
    reason : (whisker, T) array
        Index into ``REASONS``.

    Raises
    ------
    InputError
        If there are no frames, a whisker is not seen in the first one, or skin or spacing does not fit its line.
    """
    parts: list[list[Values]] = []
    reasons: list[NDArray[np.int8]] = []
    origins: list[_Origin | None] = [None] * count
    for block in lines if skin is None or longest else _without_fur(lines, count, base):
        origins = [origin or _origin(block, w, spacing, skin, base, longest) for w, origin in enumerate(origins)]
        *found, reason = _at_nodes(block, origins, spacing, base)
        parts.append(found)
        reasons.append(reason)
    if not parts:
        raise TooFewError("blocks", "must hold at least one frame")
    nodes = max((origin.count for origin in origins if origin), default=0)
    kinds = [list(kind) for kind in zip(*parts, strict=True)]
    parts.clear()
    x, y, sd = (_joined(kind, nodes) for kind in kinds)
    if longest:
        nodes = int(np.max(np.flatnonzero(~np.isnan(x).all(axis=(0, 1))), initial=-1)) + 1
        x, y, sd = x[..., :nodes], y[..., :nodes], sd[..., :nodes]
    arc = np.full((count, nodes), np.nan)
    for w, origin in enumerate(origins):
        if origin:
            arc[w, : origin.count] = (np.arange(origin.count) * spacing)[:nodes]
    return x, y, sd, arc, np.concatenate(reasons, axis=1)


def _without_fur(lines: Iterable[Centrelines], count: int, base: str) -> Iterator[Centrelines]:
    """The lines from where each is the whisker; what was followed nearer to the skin is not."""
    first, lines = first_frames(lines)
    if first is None:
        return
    start = np.array([whisker_from(_from_base(mean_course(first, w), base)) for w in range(count)])
    column = _from_base(np.arange(first.row.shape[2], dtype=float), base)
    hidden = (column < start[:, None])[:, None]
    for block in lines:
        yield block._replace(row=np.where(hidden, np.nan, block.row)) if hidden.any() else block


def _joined(blocks: list[Values], nodes: int) -> Values:
    """Blocks one after the other; each is given up as it is copied, so that a long movie is held once."""
    whole = np.empty((len(blocks[0]), sum(block.shape[1] for block in blocks), nodes))
    first = 0
    while blocks:
        block = blocks.pop(0)
        here = whole[:, first : first + block.shape[1]]
        here[..., : block.shape[2]], here[..., block.shape[2] :] = block, np.nan
        first += block.shape[1]
    return whole


@dataclass(frozen=True)
class _Origin:
    """Where arc length starts: column (counted from the base's side), row (NaN: unknown), number of nodes."""

    column: float
    row: float
    furthest: float
    count: int


def _from_base(values: Values, base: str) -> Values:
    """Columns counted from the side of the image on which the base is."""
    return values if base == "left" else values[..., ::-1]


def _origin(
    lines: Centrelines, w: int, spacing: float, skin: Sequence[tuple[float, float]] | None, base: str, longest: bool
) -> _Origin | None:
    """Of the first frame in which the whisker is followed; None if there is none."""
    followed = np.flatnonzero(lines.reason[w] == 0)
    if not followed.size or (not longest and followed[0] > 0):
        if longest:
            return None
        rule = f"must be seen in the first frame, where it is {REASONS[lines.reason[w, 0]]!r}"
        raise MissingError(f"whisker {w}", rule, remedy="move its seed")
    row = np.ascontiguousarray(_from_base(lines.row[w, followed[0] if longest else 0], base))
    first = float(np.flatnonzero(~np.isnan(row))[0])
    column, height = (first, np.nan) if skin is None else map(float, skin[w])
    if skin is not None and base == "right":
        column = row.size - 1 - column
    if skin is not None and not longest:
        _refuse_skin_off_line(row, column, height)
    # the base of a whisker that whisks moves, and its line is known to be straight there
    furthest = float(max(first, column) + (2 * REACH if longest else REACH))
    _, arc = arc_length(row, column, height, furthest)
    # no line that runs from column to column at less than 60° is longer than twice the image is wide
    reach = 2 * row.size if longest else np.nanmax(arc)
    if not FINEST <= spacing <= reach:
        rule = f"must be {FINEST} pixels to the length of the line, {reach:.0f} pixels"
        raise RangeError("node_spacing", rule, f"{spacing:g} pixels")
    return _Origin(column, height, furthest, int(reach / spacing) + 1)


def _refuse_skin_off_line(row: Values, column: float, height: float) -> None:
    """Refuse a skin point that the line, carried straight on from its base end, passes at a distance."""
    seen = np.flatnonzero(~np.isnan(row))
    slope, at_zero = np.polyfit(seen[:BASE_END], row[seen[:BASE_END]], 1)
    off = np.min(np.hypot(seen - column, row[seen] - height))
    if column < seen[0]:
        off = abs(height - (at_zero + slope * column))
    if off > SKIN_REACH + max(seen[0] - column, 0) / 2:
        rule, place = (
            "must lie where the whisker leaves the skin",
            f"column {column:g} from the base's side, row {height:g}",
        )
        raise RangeError("skin", rule, place, f"its line passes {off:.0f} pixels away")


def _at_nodes(
    lines: Centrelines, origins: Sequence[_Origin | None], spacing: float, base: str
) -> tuple[Values, Values, Values, NDArray[np.int8]]:
    """x, y and the standard deviation of y at the nodes [px], and why frames have none."""
    whiskers, frames, width = lines.row.shape
    shape = (whiskers, frames, max((origin.count for origin in origins if origin), default=0))
    x, y, sd = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    reason = lines.reason.copy()
    rows, sds = _from_base(lines.row, base), _from_base(lines.sd, base)
    for w, origin in enumerate(origins):
        if origin is None:
            continue
        for i in np.flatnonzero(reason[w] == 0):
            row = np.ascontiguousarray(rows[w, i])
            at = origin.column, origin.row, origin.furthest, float(spacing)  # the loop is compiled for each type
            nodes = _read_nodes(row, sds[w, i], *at, origin.count)
            x[w, i, : origin.count], y[w, i, : origin.count], sd[w, i, : origin.count] = nodes
            reason[w, i] = BASE_HIDDEN if np.all(np.isnan(nodes[1])) else 0
    return (x if base == "left" else width - 1 - x), y, sd, reason


@njit(cache=True)
def arc_length(row: Values, column: float, height: float, furthest: float) -> tuple[Values, Values]:
    """Smooth course of a line and arc length along it from its origin [px], per column.

    Parameters
    ----------
    row : (width,) array
        Raw rows, NaN where not measured; the base is on the side of column 0.
    column, height : float
        Column and row of the origin; with a row of NaN the line is carried straight on to that column.
    furthest : float
        Column beyond which the first measured one says nothing of the distance to the origin.

    Returns
    -------
    course, arc : (width,) arrays
        NaN before the first measured column and after the last.
    """
    course, arc = np.full(row.size, np.nan), np.full(row.size, np.nan)
    measured = np.flatnonzero(~np.isnan(row))
    if measured.size < 2 or measured[0] > furthest:
        return course, arc
    first, last = measured[0], measured[-1]
    value, slope = local_quadratic(row, np.int64(SMOOTH))
    known = measured[~np.isnan(value[measured])]
    if known.size < 2:
        return course, arc
    # arc length along the smooth course: the raw steps from column to column would add the noise
    columns = np.arange(first, last + 1).astype(np.float64)
    course[first : last + 1] = np.interp(columns, known.astype(np.float64), value[known])
    if np.isnan(height):
        start = (first - column) * np.sqrt(1 + np.mean(slope[known[:SMOOTH]]) ** 2)
    else:
        start = np.sign(first - column) * np.sqrt((first - column) ** 2 + (course[first] - height) ** 2)
    if first < column:
        start = 0.0
    arc[first] = start
    for j in range(first + 1, last + 1):
        arc[j] = arc[j - 1] + np.sqrt(1 + (course[j] - course[j - 1]) ** 2)
    if first < column:
        arc -= np.interp(column, columns, arc[first : last + 1])
    return course, arc


@njit(cache=True)
def _read_nodes(
    row: Values, sd: Values, column: float, height: float, furthest: float, spacing: float, count: int
) -> tuple[Values, Values, Values]:
    """x, y and the standard deviation of y at ``count`` nodes from the origin [px]; NaN where not seen."""
    x, y, y_sd = np.full(count, np.nan), np.full(count, np.nan), np.full(count, np.nan)
    course, arc = arc_length(row, column, height, furthest)
    measured = np.flatnonzero(~np.isnan(arc))
    if measured.size < 2:
        return x, y, y_sd
    first, last = measured[0], measured[-1]
    slope = (course[min(first + SMOOTH, last)] - course[first]) / max(min(SMOOTH, last - first), 1)
    at_origin = course[first] - slope * (first - column) if np.isnan(height) else height
    columns = np.arange(first, last + 1).astype(np.float64)
    for i in range(count):
        s = i * spacing
        if s < arc[first]:
            share = s / arc[first]
            x[i] = column + share * (first - column)
            y[i] = at_origin + share * (course[first] - at_origin)
        elif s <= arc[last]:
            x[i] = np.interp(s, arc[first : last + 1], columns)
            j = min(int(x[i]), last - 1)
            f = x[i] - j
            if f == 0:
                y[i], y_sd[i] = row[j], sd[j]
            else:
                y[i] = (1 - f) * row[j] + f * row[j + 1]
                y_sd[i] = np.sqrt((1 - f) ** 2 * sd[j] ** 2 + f**2 * sd[j + 1] ** 2)
            if np.isnan(y[i]):
                x[i] = np.nan
    return x, y, y_sd
