"""Keypoints along whiskers, from DeepLabCut and SLEAP, as a profile."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from vibrissa.errors import (
    FormatError,
    InputError,
    MissingError,
    PackageError,
    RangeError,
    TooFewError,
    UnknownError,
    install,
)
from vibrissa.files import existing
from vibrissa.tables.deeplabcut import read_deeplabcut
from vibrissa.video.foreign.sleap import refuse_unassigned
from vibrissa.video.foreign.whisk_files import FURTHEST, Values
from vibrissa.video.linked.traces import labelled_traces
from vibrissa.video.tracking import Calibration

if TYPE_CHECKING:
    import xarray as xr

Software = Literal["DeepLabCut", "SLEAP"]
LIKELIHOOD = {"DeepLabCut": 0.6, "SLEAP": 0.0}  # DeepLabCut guesses everywhere (its pcutoff); SLEAP leaves out
Curve = tuple[Values, Values, Values]  # x, y (T, K) and arc length (K,) [px]
FEWEST = 2  # keypoints of a whisker
MOST = 300_000_000  # values of a profile


class Keypoints(NamedTuple):
    """Keypoints of individuals in the frames of a movie.

    Attributes
    ----------
    names : list of str
        Names of the K keypoints.
    x, y : (I, T, K) arrays
        Column and row [px] of the keypoints of I individuals, as the file gives them.
    likelihood : (I, T, K) array
        What the file thinks of them, NaN where it does not say.
    trimmed : bool
        Whether the file ends with the last frame that has an individual, as SLEAP's and DeepLabCut's of several do.
    """

    names: list[str]
    x: Values
    y: Values
    likelihood: Values
    trimmed: bool = False


def read_keypoints(path: str | Path, software: Software) -> Keypoints:
    """Keypoints of a DeepLabCut (``.csv``, ``.h5``) or SLEAP (``.slp``, analysis ``.h5``) file, through movement.

    A DeepLabCut ``.h5`` holds a pickled table: open only those you trust.

    Parameters
    ----------
    path : path
        The file.
    software : {"DeepLabCut", "SLEAP"}
        The program that wrote it.

    Returns
    -------
    Keypoints
        Of all individuals and frames.

    Raises
    ------
    InputError
        If movement is not installed, the file is missing or not of that kind, or has no frames; as
        :func:`vibrissa.tables.deeplabcut.read_deeplabcut` and
        :func:`vibrissa.video.foreign.sleap.refuse_unassigned`.
    """
    existing(path)
    with _reading(str(path), software):
        table = read_deeplabcut(path) if software == "DeepLabCut" else None
        if table is None:
            refuse_unassigned(path)
        load, log = import_module("movement.io.load_poses"), import_module("loguru").logger
        log.disable("movement")
        try:
            data = load.from_sleap_file(Path(path)) if table is None else load.from_dlc_style_df(table)
            trimmed = table is None or "individuals" in table.columns.names
            return keypoints_of(str(path), data)._replace(trimmed=trimmed)
        finally:
            log.enable("movement")


@contextmanager
def _reading(source: str, software: Software) -> Iterator[None]:
    """Refuse a damaged file in one line, without the warnings of movement and of the readers below it."""
    with warnings.catch_warnings():  # movement takes over the hook by which Python shows warnings
        warnings.simplefilter("ignore")
        try:
            yield
        except InputError:
            raise
        except ImportError as error:
            raise PackageError(source, "needs movement", remedy=install("tracks")) from error
        except Exception as error:  # whatever those readers raise
            cause = (str(error).strip() or type(error).__name__).splitlines()[0]
            raise FormatError(source, f"must be a file of {software}", remedy=cause) from error


def keypoints_of(source: str, data: xr.Dataset) -> Keypoints:
    """Keypoints of a poses dataset of movement.

    Parameters
    ----------
    source : str
        Name of the file, for errors.
    data : Dataset
        ``position`` [px] and ``confidence``.

    Returns
    -------
    Keypoints
        Of all individuals and frames.

    Raises
    ------
    InputError
        If it has no frames, is not in the plane, or has coordinates beyond any frame.
    """
    dims = [next(d for d in data.dims if str(d).startswith(name)) for name in ("individual", "time", "keypoint")]
    position = data.position.transpose(*dims, "space")
    if position.sizes["space"] != 2 or not position.size:
        raise TooFewError(source, "must hold keypoints in the plane of at least one frame", dict(position.sizes))
    names = [str(name) for name in position[dims[2]].values]
    x, y = (position.sel(space=axis).values.astype(float) for axis in ("x", "y"))
    if np.isinf(x).any() or np.isinf(y).any() or max(np.nanmax(np.abs(v), initial=0) for v in (x, y)) > FURTHEST:
        raise FormatError(source, f"must have coordinates below {FURTHEST:g} px", remedy="the file is damaged")
    return Keypoints(names, x, y, data.confidence.transpose(*dims).values.astype(float))


def profile_from_keypoints(
    points: Keypoints,
    *,
    calibration: Calibration,
    keypoints: Sequence[Sequence[str]] | None = None,
    least_likelihood: float = 0.0,
    node_spacing: float | None = None,
    source: str = "the keypoints",
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Profile whose nodes are the keypoints, or are spread evenly over a curve through them.

    Parameters
    ----------
    points : Keypoints
        Of one movie.
    calibration : Calibration
        Frame rate and pixel size; these files know neither.
    keypoints : sequence of sequences of str, optional
        For each whisker the names of its keypoints from base to tip, at least two; default: one whisker, all
        keypoints in the order of the file, which must not turn back. Of several individuals each has these whiskers.
    least_likelihood : float
        Keypoints below it are NaN; the attribute ``keypoints_left_out`` says how many.
    node_spacing : float, optional
        Arc length between nodes [m] on a cubic spline over the chord length through the keypoints seen, where
        steps to hidden ones are the usual ones, scaled to the frame; nodes between two keypoints of which one is not
        seen, and beyond the ends, are NaN. Default: the keypoints.
    source : str
        Name of the file, for errors.
    attrs : mapping, optional
        Further attributes.

    Returns
    -------
    Dataset
        ``profile`` without ``y_sd``. Arc length starts at the first keypoint; of keypoints it is the running sum of
        the median distances of neighbours.

    Raises
    ------
    InputError
        If a name is unknown or given twice, a whisker has fewer than two, or two neighbours are never seen together;
        if no names are given and those of the file do not follow one another along one whisker.
    """
    wanted = [list(one) for one in keypoints] if keypoints is not None else [points.names]
    for one in wanted:
        _refuse_names(source, one, points.names)
    if not np.isfinite(least_likelihood):
        raise FormatError("least_likelihood", "must be a number", least_likelihood)
    out = (points.likelihood < least_likelihood) & np.isfinite(points.x)
    whiskers: list[Curve] = []
    for individual in range(points.x.shape[0]):
        for one in wanted:
            at = [points.names.index(name) for name in one]
            x, y = (np.where(out, np.nan, values)[individual][:, at] for values in (points.x, points.y))
            if keypoints is None and len(one) >= 2 * FEWEST:
                _refuse_turns(source, x, y, one)
            seen = np.isfinite(x) & np.isfinite(y)
            whiskers.append((np.where(seen, x, np.nan), np.where(seen, y, np.nan), _lengths(source, x, y, one)))
    if node_spacing is not None:
        whiskers = _resampled(source, whiskers, node_spacing / calibration.pixel_size)
    most = max(x.shape[1] for x, _, _ in whiskers)
    x, y, arc = (np.stack([_widened(values, most) for values in kind]) for kind in zip(*whiskers, strict=True))
    noted = {
        "arc_length_from": "first keypoint",
        "keypoints": json.dumps(wanted),
        **(attrs or {}),
        "least_likelihood": least_likelihood,
        "keypoints_left_out": int(out.sum()),
    }
    return labelled_traces(x, y, arc, calibration, noted)


def _widened(values: Values, nodes: int) -> Values:
    return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, nodes - values.shape[-1])], constant_values=np.nan)


def _refuse_names(source: str, wanted: list[str], names: list[str]) -> None:
    if unknown := [name for name in wanted if name not in names]:
        raise UnknownError("keypoints", f"must be among those of {source}: {', '.join(names)}", ", ".join(unknown))
    if len(set(wanted)) < len(wanted) or len(wanted) < FEWEST:
        raise TooFewError("keypoints", "must be at least two different ones for each whisker", ", ".join(wanted))


def _refuse_turns(source: str, x: Values, y: Values, names: list[str]) -> None:
    """Refuse keypoints in the order of a file whose line turns back: they are of several whiskers, or not in order."""
    way = np.diff(x, axis=1) + 1j * np.diff(y, axis=1)
    ahead = (way[:, 1:] * way[:, :-1].conj()).real
    back = np.sum(ahead < 0, axis=0) > np.sum(ahead > 0, axis=0)
    if back.any():
        at = names[int(np.argmax(back)) + 1]
        rule = "must be given where the keypoints do not follow one another along one whisker"
        remedy = f"name those of each whisker, base first, from {', '.join(names)}"
        raise MissingError("keypoints", rule, f"a line through those of {source} that turns back at {at}", remedy)


def _lengths(source: str, x: Values, y: Values, names: list[str]) -> Values:
    """Arc length of the keypoints: sum of the median distances of neighbours [px]."""
    steps = np.hypot(np.diff(x, axis=1), np.diff(y, axis=1))
    unseen = np.flatnonzero(~np.isfinite(steps).any(axis=0))
    if unseen.size:
        pair = f"{names[unseen[0]]} and {names[unseen[0] + 1]}"
        raise TooFewError(source, "must show neighbouring keypoints together in a frame", f"never {pair}")
    return np.concatenate([[0.0], np.cumsum(np.nanmedian(steps, axis=0))])


def _resampled(source: str, whiskers: list[Curve], spacing: float) -> list[Curve]:
    if not spacing > 0:
        raise RangeError("node_spacing", "must be positive", spacing)
    even: list[Curve] = []
    for x, y, lengths in whiskers:
        places = np.arange(int(lengths[-1] / spacing) + 1).astype(np.float64) * spacing
        if x.shape[0] * places.size * len(whiskers) > MOST:
            rule = f"must give fewer than {MOST} nodes in {source}"
            raise RangeError("node_spacing", rule, remedy="take a wider one")
        usual = _usual_steps(x, y, lengths)
        rows = np.array([_on_spline(*one, usual, places) for one in zip(x, y, strict=True)])
        even.append((rows[:, 0], rows[:, 1], places))
    return even


def _on_spline(x: Values, y: Values, usual: Values, places: Values) -> Values:
    """Places on a cubic spline through the keypoints seen, (2, N); NaN where a neighbour is not seen."""
    from scipy.interpolate import CubicSpline

    seen = np.isfinite(x)
    out = np.full((2, places.size), np.nan)
    if seen.sum() < 2:
        return out
    every = _chord(x, y, usual)
    after = np.clip(np.searchsorted(every, places, side="left"), 1, x.size - 1)
    between = seen[after - 1] & seen[after]
    arc = every[seen]
    kept = np.diff(arc, prepend=-1.0) > 0
    if kept.sum() > 1:
        inside = between & (places >= arc[0]) & (places <= arc[-1])
        out[:, inside] = CubicSpline(arc[kept], np.array([x[seen][kept], y[seen][kept]]), axis=1)(places[inside])
    return out


def _chord(x: Values, y: Values, usual: Values) -> Values:
    """Chord length of a frame's keypoints; a step that is not seen is the usual one, scaled as those that are."""
    steps = np.hypot(np.diff(x), np.diff(y))
    seen = np.isfinite(steps)
    scale = steps[seen].sum() / usual[seen].sum() if usual[seen].sum() > 0 else 1.0
    return np.concatenate([[0.0], np.cumsum(np.where(seen, steps, scale * usual))])


def _usual_steps(x: Values, y: Values, lengths: Values) -> Values:
    """Steps between keypoints over the whole, median of the frames in which all are seen; of none, those of lengths."""
    steps = np.hypot(np.diff(x, axis=1), np.diff(y, axis=1))
    whole = steps[np.isfinite(steps).all(axis=1) & (steps.sum(axis=1) > 0)]
    return np.median(whole / whole.sum(axis=1, keepdims=True), axis=0) if len(whole) else np.diff(lengths)
