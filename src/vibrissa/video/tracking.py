"""From movie to profile: whiskers followed, and read at nodes of fixed arc length from the skin."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.quantities import dataset
from vibrissa.video.following import REASONS, Image, centrelines
from vibrissa.video.nodes import profile
from vibrissa.video.search import Estimator, Search
from vibrissa.video.whisking import Whisking, whisking_centrelines

if TYPE_CHECKING:
    import xarray as xr

SPACING = 5  # default distance of the nodes [px]


LARGEST_PIXEL = 1e-3  # [m] a whisker seen in coarser pixels is no centreline; millimetres given for metres are


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
        if self.pixel_size > LARGEST_PIXEL:
            raise InputError(
                "Calibration.pixel_size", f"must be at most {LARGEST_PIXEL} m", self.pixel_size, "give it in m"
            )


def track(
    blocks: Iterable[Image] | Callable[[], Iterable[Image]],
    *,
    seeds: Sequence[tuple[float, float]] = (),
    calibration: Calibration,
    polarity: Literal["dark", "bright"] = "dark",
    background: str | NDArray[Any] = "space",
    node_spacing: float | None = None,
    skin: Sequence[tuple[float, float]] | None = None,
    base: Literal["left", "right"] = "left",
    columns: tuple[int, int] | None = None,
    search: int = 4,
    threshold: float = 4.0,
    estimator: Estimator = "matched",
    whisking: Whisking | None = None,
) -> xr.Dataset:
    """Track whiskers that run across the image from column to column (turn the frames of others first).

    In every column the centreline is where a line's profile fits the contrast best, or its five-pixel
    barycentre; nodes stand at fixed arc length, measured along a local quadratic over 31 columns (a sum over
    the raw steps is too long), and take the raw rows of the two columns about them. Between the skin and the
    base end of what is seen, the whisker is taken as straight: nodes there have a position but no standard
    deviation.

    Parameters
    ----------
    blocks : iterable of (T, height, width) arrays of uint8 or uint16, or callable
        The movie, from :func:`vibrissa.video.movie.read_blocks` or from memory; or a function that gives it
        from the start. Whisking movies are read twice, so an iterator does not do for them.
    seeds : sequence of (column, row)
        A point within 4 rows of each whisker in the first frame [px]; the first pixel's centre is (0, 0).
        Small vibrations need no more; whiskers that whisk are marked in ``whisking`` instead.
    calibration : Calibration
        Frame rate and pixel size.
    polarity, background, columns, search, threshold, estimator
        See :class:`vibrissa.video.search.Search`.
    node_spacing : float, optional
        Arc length between nodes [m]; 5 pixels if not given. Nodes reach as far as the line in the first frame,
        of whiskers that whisk as far as in any frame.
    skin : sequence of (column, row), optional
        Where each whisker leaves the skin [px]. If not given, arc length starts at the column of the base end
        of the line in the first frame in which it is followed, and the attribute ``arc_length_from`` says so.
    base : {"left", "right"}
        Side of the image on which the base is.
    whisking : Whisking, optional
        The fan of the pad and marks of the whiskers, if they swing through one another.

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
        If there are no frames, or as :class:`Search`, :func:`vibrissa.video.following.centrelines` and
        :func:`vibrissa.video.whisking.whisking_centrelines`.
    """
    if base not in ("left", "right"):
        raise InputError("base", "must be 'left' or 'right'", repr(base))
    spacing = SPACING if node_spacing is None else node_spacing / calibration.pixel_size
    if not spacing > 0:
        raise InputError("node_spacing", "must be positive", node_spacing)
    if bool(seeds) == (whisking is not None):
        raise InputError("seeds", "must be given, or marks in whisking instead")
    count = len(seeds) if whisking is None else len(whisking.marks)
    if skin is not None and len(skin) != count:
        raise InputError("skin", f"must have one point for each of the {count} whiskers", len(skin))
    how = Search(
        polarity=polarity,
        background=background,
        columns=columns,
        search=search,
        threshold=threshold,
        estimator=estimator,
    )
    if whisking is None:
        lines = centrelines(blocks() if callable(blocks) else blocks, seeds=seeds, search=how)
        where = {"seeds": json.dumps([[float(c), float(r)] for c, r in seeds])}
    else:
        lines = whisking_centrelines(_from_start(blocks), whisking=whisking, search=how)
        where = {"fan": json.dumps(asdict(whisking.fan)), "marks": json.dumps(whisking.marks)}
    x, y, y_sd, arc, reason = profile(lines, count, spacing, skin, base, longest=whisking is not None)
    attrs = {
        **_attributes(calibration, how),
        **where,
        "base": base,
        "arc_length_from": "skin" if skin is not None else "base end of the line in the first frame",
        "lost": json.dumps(_lost(reason)),
    }
    size = calibration.pixel_size
    return dataset(
        attrs,
        lead=("whisker",),
        whisker=np.arange(count),
        time=np.arange(x.shape[1]) / calibration.frame_rate,
        node=np.arange(x.shape[2]),
        x=x * size,
        y=y * size,
        y_sd=y_sd * size,
        arc_length=arc * size,
    )


def _from_start(blocks: Iterable[Image] | Callable[[], Iterable[Image]]) -> Callable[[], Iterable[Image]]:
    """What gives the blocks anew at every call."""
    if callable(blocks):
        return blocks
    if iter(blocks) is blocks:
        raise InputError("blocks", "must be readable twice", remedy="give a function that opens the movie")
    return lambda: blocks


def _attributes(calibration: Calibration, how: Search) -> dict[str, Any]:
    return {
        "frame": "image",
        "frame_rate": calibration.frame_rate,
        "pixel_size": calibration.pixel_size,
        "background": "space" if isinstance(how.background, str) else "image",
        "polarity": how.polarity,
        "search": how.search,
        "threshold": how.threshold,
        "estimator": how.estimator,
    }


def _lost(reason: NDArray[np.int8]) -> list[list[list[Any]]]:
    """Runs of frames lost, for each whisker: first frame, last frame, reason."""
    runs = []
    for codes in reason:
        starts = np.flatnonzero(np.diff(codes, prepend=-1))
        ends = np.append(starts[1:], codes.size) - 1
        runs.append([[int(a), int(b), REASONS[codes[a]]] for a, b in zip(starts, ends, strict=True) if codes[a]])
    return runs
