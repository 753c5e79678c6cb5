"""From movie to profile: whiskers followed, and read at nodes of fixed arc length from the skin."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.quantities import dataset
from vibrissa.video.centreline import SMOOTH, local_quadratic
from vibrissa.video.following import REASONS, Centrelines, Image, centrelines
from vibrissa.video.search import Search

if TYPE_CHECKING:
    import xarray as xr

Values = NDArray[np.float64]
REACH = 20  # columns by which the base end may draw back behind its place in the first frame, else arc is unknown
SPACING = 5  # default distance of the nodes [px]
BASE_HIDDEN = REASONS.index("base end hidden")


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """What turns frames and pixels into seconds and metres; a movie file knows neither.

    Attributes
    ----------
    frame_rate : float
        Frames per second of the acquisition [Hz], not of playback.
    pixel_size : float
        Side of a pixel in the plane of the whisker [m].
    """

    frame_rate: float
    pixel_size: float

    def __post_init__(self) -> None:
        for name, remedy in (
            ("frame_rate", "give the camera's rate, not the movie's playback rate"),
            ("pixel_size", "measure an object of known size in the image"),
        ):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"Calibration.{name}", "must be positive and finite", value, remedy)


def track(
    blocks: Iterable[Image],
    *,
    seeds: Sequence[tuple[float, float]],
    calibration: Calibration,
    polarity: Literal["dark", "bright"] = "dark",
    background: str | NDArray[Any] = "space",
    node_spacing: float | None = None,
    skin: Sequence[tuple[float, float]] | None = None,
    base: Literal["left", "right"] = "left",
    columns: tuple[int, int] | None = None,
    search: int = 4,
    swing: int = 0,
    threshold: float = 4.0,
) -> xr.Dataset:
    """Track whiskers that run across the image from column to column (turn the frames of others first).

    In every column the centreline is the five-pixel barycentre of the contrast; nodes stand at fixed arc
    length, measured along a local quadratic over 31 columns (a sum over the raw steps is too long), and take
    the raw barycentres of the two columns about them. Between the skin and the base end of what is seen, the
    whisker is taken as straight: nodes there have a position but no standard deviation.

    Parameters
    ----------
    blocks : iterable of (T, height, width) arrays of uint8 or uint16
        The movie, from :func:`vibrissa.video.movie.read_blocks` or from memory.
    seeds : sequence of (column, row)
        A point within 4 rows of each whisker in the first frame [px]; the first pixel's centre is (0, 0).
    calibration : Calibration
        Frame rate and pixel size.
    polarity, background, columns, search, swing, threshold
        See :class:`vibrissa.video.search.Search`.
    node_spacing : float, optional
        Arc length between nodes [m]; 5 pixels if not given. Nodes reach as far as the line in the first frame.
    skin : sequence of (column, row), optional
        Where each whisker leaves the skin [px]. If not given, arc length starts at the column of the base end
        of the line in the first frame, and the attribute ``arc_length_from`` says so.
    base : {"left", "right"}
        Side of the image on which the base is.

    Returns
    -------
    Dataset
        ``x``, ``y``, ``y_sd`` (whisker, time, node) and ``arc_length`` (whisker, node) [m]: x = column × pixel
        size, y = row × pixel size, down; time 0 is the first frame. NaN where the whisker was not seen, or
        where ``node`` passes a whisker's end. The attribute ``lost`` is JSON: for each whisker a list of
        [first frame, last frame, reason] of the frames without any node.

    Raises
    ------
    InputError
        If there are no frames, or as :class:`Search` and
        :func:`vibrissa.video.following.centrelines`.
    """
    if base not in ("left", "right"):
        raise InputError("base", "must be 'left' or 'right'", repr(base))
    spacing = SPACING if node_spacing is None else node_spacing / calibration.pixel_size
    if not spacing > 0:
        raise InputError("node_spacing", "must be positive", node_spacing)
    if skin is not None and len(skin) != len(seeds):
        raise InputError("skin", f"must have one point for each of the {len(seeds)} seeds", len(skin))
    how = Search(
        polarity=polarity, background=background, columns=columns, search=search, swing=swing, threshold=threshold
    )
    parts = []
    origins: list[_Origin] = []
    for lines in centrelines(blocks, seeds=seeds, search=how):
        if not origins:
            origins = [_origin(lines, w, spacing, skin, base) for w in range(len(seeds))]
        parts.append(_at_nodes(lines, origins, spacing, base))
    if not parts:
        raise InputError("blocks", "must hold at least one frame")
    x, y, y_sd = (np.concatenate([part[i] for part in parts], axis=1) * calibration.pixel_size for i in range(3))
    arc = np.full((len(seeds), x.shape[2]), np.nan)
    for w, origin in enumerate(origins):
        arc[w, : origin.count] = np.arange(origin.count) * spacing * calibration.pixel_size
    reason = np.concatenate([part[3] for part in parts], axis=1)
    attrs = {
        **_attributes(calibration, how),
        "base": base,
        "seeds": json.dumps([[float(c), float(r)] for c, r in seeds]),
        "arc_length_from": "skin" if skin is not None else "base end of the line in the first frame",
        "lost": json.dumps(_lost(reason)),
    }
    time = np.arange(x.shape[1]) / calibration.frame_rate
    return dataset(
        attrs,
        lead=("whisker",),
        whisker=np.arange(len(seeds)),
        time=time,
        node=np.arange(x.shape[2]),
        x=x,
        y=y,
        y_sd=y_sd,
        arc_length=arc,
    )


def _attributes(calibration: Calibration, how: Search) -> dict[str, Any]:
    return {
        "frame": "image",
        "frame_rate": calibration.frame_rate,
        "pixel_size": calibration.pixel_size,
        "background": "space" if isinstance(how.background, str) else "image",
        "polarity": how.polarity,
        "search": how.search,
        "swing": how.swing,
        "threshold": how.threshold,
    }


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
    lines: Centrelines, w: int, spacing: float, skin: Sequence[tuple[float, float]] | None, base: str
) -> _Origin:
    row = np.ascontiguousarray(_from_base(lines.row[w, 0], base))
    first = float(np.flatnonzero(~np.isnan(row))[0])
    column, height = (first, np.nan) if skin is None else skin[w]
    if skin is not None and base == "right":
        column = row.size - 1 - column
    furthest = max(first, column) + REACH
    _, arc = arc_length(row, column, height, furthest)
    return _Origin(float(column), float(height), furthest, int(np.nanmax(arc) / spacing) + 1)


def _at_nodes(
    lines: Centrelines, origins: Sequence[_Origin], spacing: float, base: str
) -> tuple[Values, Values, Values, NDArray[np.int8]]:
    """x, y and the standard deviation of y at the nodes [px], and why frames have none."""
    whiskers, frames, width = lines.row.shape
    shape = (whiskers, frames, max(origin.count for origin in origins))
    x, y, sd = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    reason = lines.reason.copy()
    rows, sds = _from_base(lines.row, base), _from_base(lines.sd, base)
    for w, origin in enumerate(origins):
        for i in range(frames):
            if reason[w, i]:
                continue
            nodes = read_nodes(
                np.ascontiguousarray(rows[w, i]),
                sds[w, i],
                origin.column,
                origin.row,
                origin.furthest,
                spacing,
                origin.count,
            )
            x[w, i, : origin.count], y[w, i, : origin.count], sd[w, i, : origin.count] = nodes
            reason[w, i] = BASE_HIDDEN if np.all(np.isnan(nodes[1])) else 0
    return (x if base == "left" else width - 1 - x), y, sd, reason


@njit(cache=True)
def arc_length(row, column, height, furthest):  # type: ignore[no-untyped-def]
    """Smooth course of a line and arc length along it from its origin [px], per column.

    Parameters
    ----------
    row : (width,) array
        Raw rows, NaN where not measured; the base is on the side of column 0.
    column, height : float
        Column and row of the origin; with a row of NaN the line is carried straight on to that column.
    furthest : float
        Column beyond which the first measured one tells nothing of the distance to the origin.

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
    value, slope = local_quadratic(row, SMOOTH)
    known = measured[~np.isnan(value[measured])]
    if known.size < 2:
        return course, arc
    course[first : last + 1] = np.interp(np.arange(first, last + 1), known, value[known])
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
        arc -= np.interp(column, np.arange(first, last + 1), arc[first : last + 1])
    return course, arc


@njit(cache=True)
def read_nodes(row, sd, column, height, furthest, spacing, count):  # type: ignore[no-untyped-def]
    """x, y and the standard deviation of y at ``count`` nodes from the origin [px]; NaN where not seen."""
    x, y, y_sd = np.full(count, np.nan), np.full(count, np.nan), np.full(count, np.nan)
    course, arc = arc_length(row, column, height, furthest)
    measured = np.flatnonzero(~np.isnan(arc))
    if measured.size < 2:
        return x, y, y_sd
    first, last = measured[0], measured[-1]
    slope = (course[min(first + SMOOTH, last)] - course[first]) / max(min(SMOOTH, last - first), 1)
    at_origin = course[first] - slope * (first - column) if np.isnan(height) else height
    for i in range(count):
        s = i * spacing
        if s < arc[first]:
            share = s / arc[first]
            x[i] = column + share * (first - column)
            y[i] = at_origin + share * (course[first] - at_origin)
        elif s <= arc[last]:
            x[i] = np.interp(s, arc[first : last + 1], np.arange(first, last + 1))
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


def _lost(reason: NDArray[np.int8]) -> list[list[list[Any]]]:
    """Runs of frames lost, for each whisker: first frame, last frame, reason."""
    runs = []
    for codes in reason:
        starts = np.flatnonzero(np.diff(codes, prepend=-1))
        ends = np.append(starts[1:], codes.size) - 1
        runs.append([[int(a), int(b), REASONS[codes[a]]] for a, b in zip(starts, ends, strict=True) if codes[a]])
    return runs
