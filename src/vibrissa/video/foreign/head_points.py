"""The head of an animal from points that another program tracked, or from a table."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Sequence
from pathlib import Path
from typing import cast

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import FormatError, RangeError, TooFewError, UnknownError
from vibrissa.files import existing
from vibrissa.head_pose import HeadPose
from vibrissa.tables.reader import read_table
from vibrissa.tables.units import PURE
from vibrissa.video.foreign.keypoints import LIKELIHOOD, Keypoints, Software, read_keypoints
from vibrissa.video.foreign.tracks import kind_of
from vibrissa.video.kernel.local_quadratic import local_quadratic

COLUMNS = {"frame": PURE, "column": PURE, "row": PURE, "angle": "rad"}
LONGEST = 4096  # bytes of the first line by which a table is known
SMOOTHED = 4  # frames on either side over which tracked points are smoothed
BRIDGED = 5  # frames without the head that are taken on a straight line


def read_head(path: str | Path, frames: int, points: Sequence[str] = (), pictures: Integers | None = None) -> HeadPose:
    """The head in every frame of a movie, from a file.

    Parameters
    ----------
    path : path
        DeepLabCut ``.csv`` or ``.h5``, SLEAP ``.slp`` or analysis ``.h5``; or a table of comma-separated values with
        ``frame``, ``column``, ``row`` [px] and ``angle_deg``.
    frames : int
        Frames of the movie.
    points : sequence of str
        Two of the file's keypoints, the caudal one first; by default its two.
    pictures : (P,) array of int, optional
        Frames of which the movie has a picture, where dropped ones are counted too; default: all. Rows of keypoints
        are pictures, or frames if there are more rows than pictures; a table gives frames.

    Returns
    -------
    HeadPose
        Its place is that of the rostral point; its angle leads there from the caudal one. Gaps of five frames or fewer
        are bridged by straight lines; then places and angle are smoothed by a quadratic over nine frames.

    Raises
    ------
    InputError
        If the file cannot be read, holds frames beyond the movie, several animals, or other points; if DeepLabCut's
        of one animal has rows for a part of the movie.
    """
    with existing(path).open("rb") as stream:
        header = re.split(rb"[,;\t]", stream.readline(LONGEST).removeprefix(BOM_UTF8))
    table = b"frame" in map(bytes.strip, header)
    head = _of_table(path, frames) if table else _of_keypoints(path, frames, points, pictures)
    if not head.known.any():
        raise TooFewError(str(path), "must hold the head in a frame at least")
    return smoothed(bridged(head, BRIDGED))


def _of_table(path: str | Path, frames: int) -> HeadPose:
    read = read_table(Path(path), COLUMNS)
    frame = read.whole_numbers("frame", f"must be from 0 to {frames - 1}", 0, frames - 1)
    again = np.ones(frame.size, bool)
    again[np.unique(frame, return_index=True)[1]] = False
    read.refuse_first(again, "frame", "must give each frame once")
    values = np.full((3, frames), np.nan)
    for one, name in zip(values, ("column", "row", "angle"), strict=True):
        one[frame] = read.numbers(name, blanks=True)
    if read.column("angle") == "angle":
        remedy = "it is taken in radians: call it angle_deg if it is in degrees, angle_rad if not"
        read.refuse_first(np.abs(read.numbers("angle", blanks=True)) > 2 * np.pi, "angle", "must be within ±2π", remedy)
    return HeadPose(values[0], values[1], _continuous(values[2]))


def _of_keypoints(path: str | Path, frames: int, points: Sequence[str], pictures: Integers | None) -> HeadPose:
    kind = kind_of(path)
    if kind not in LIKELIHOOD:
        rule, remedy = "must hold keypoints of the head", "give a file of DeepLabCut or SLEAP, or a table"
        raise FormatError(str(path), rule, f"a file of {kind}", remedy)
    found = read_keypoints(path, cast(Software, kind))
    pictures = np.arange(frames) if pictures is None else pictures
    _refuse_rows(str(path), found, len(pictures), frames)
    if found.x.shape[1] <= len(pictures) < frames:
        found = _in_frames(found, pictures, frames)
    return head_of_keypoints(str(path), found, LIKELIHOOD[kind], frames, points)


def _refuse_rows(path: str, found: Keypoints, pictures: int, frames: int) -> None:
    """Refuse rows that are neither the movie's pictures nor its frames."""
    rows = found.x.shape[1]
    if rows in (pictures, frames) or (found.trimmed and rows < frames):
        return
    whole = f"{frames} frames" if pictures == frames else f"{pictures} pictures, or of its {frames} frames"
    remedy = "give the tracks of this movie, or a table of frame, column, row and angle_deg"
    raise RangeError(path, f"must have a row for each of the movie's {whole}", rows, remedy)


def _in_frames(found: Keypoints, pictures: Integers, frames: int) -> Keypoints:
    """Keypoints of a movie's pictures in its frames, NaN in dropped ones."""
    animals, rows, points = found.x.shape
    placed = np.full((3, animals, frames, points), np.nan)
    placed[:, :, pictures[:rows]] = found.x, found.y, found.likelihood
    return Keypoints(found.names, *placed)


def head_of_keypoints(
    source: str, found: Keypoints, least_likelihood: float, frames: int, points: Sequence[str] = ()
) -> HeadPose:
    """The head by two keypoints.

    Parameters
    ----------
    source : str
        The file, for errors.
    found : Keypoints
        Of one animal.
    least_likelihood : float
        Keypoints below it are not taken.
    frames : int
        Frames of the movie.
    points : sequence of str
        As of :func:`read_head`.

    Returns
    -------
    HeadPose
        NaN where one of the two is not seen.

    Raises
    ------
    InputError
        If there are several animals, other numbers of frames, or other points.
    """
    animals, count, _ = found.x.shape
    if animals != 1 or count > frames:
        rule = f"must hold one animal in at most {frames} frames"
        raise RangeError(source, rule, f"{animals} in {count}", "give the tracks of this movie")
    names = list(points) or found.names
    if len(names) != 2 or len(set(names)) < 2:
        remedy = f"name two of {', '.join(found.names)}, the caudal one first"
        raise TooFewError("head_points", "must be two keypoints", ", ".join(names), remedy)
    if unknown := [name for name in names if name not in found.names]:
        raise UnknownError("head_points", f"must be among {', '.join(found.names)}", ", ".join(unknown))
    caudal, rostral = (_seen(found, found.names.index(name), least_likelihood, frames) for name in names)
    angle = np.arctan2(rostral[1] - caudal[1], rostral[0] - caudal[0])
    return HeadPose(rostral[0], rostral[1], _continuous(np.where(np.isfinite(caudal[0]), angle, np.nan)))


def _seen(found: Keypoints, number: int, least: float, frames: int) -> Array:
    """Columns and rows (2, frames) of a keypoint of the first animal, NaN where it is not seen."""
    out = np.full((2, frames), np.nan)
    likelihood = found.likelihood[0, :, number]
    seen = ~(likelihood < least)
    for one, values in zip(out, (found.x, found.y), strict=True):
        one[: seen.size] = np.where(seen, values[0, :, number], np.nan)
    out[:, ~np.isfinite(out).all(axis=0)] = np.nan
    return out


def _continuous(angle: Array) -> Array:
    """Angles [rad] without jumps of a full turn, in degrees."""
    out, known = np.full(angle.size, np.nan), np.isfinite(angle)
    out[known] = np.rad2deg(np.unwrap(angle[known]))
    return out


def smoothed(head: HeadPose) -> HeadPose:
    """The head smoothed by a quadratic over nine frames: errors of every frame by itself look like swings of the pad.

    Parameters
    ----------
    head : HeadPose
        As tracked.

    Returns
    -------
    HeadPose
        NaN where it was; as tracked where too few neighbours are known.
    """
    values = []
    for one in head:
        smooth, _ = local_quadratic(one, SMOOTHED)
        values.append(np.where(np.isfinite(one) & np.isfinite(smooth), smooth, one))
    return HeadPose(*values)


def bridged(head: HeadPose, longest: int) -> HeadPose:
    """The head with short gaps bridged by straight lines.

    Parameters
    ----------
    head : HeadPose
        With gaps.
    longest : int
        Frames of the longest gap that is bridged.

    Returns
    -------
    HeadPose
        NaN in longer gaps, before the first and after the last frame in which the head is known.
    """
    known = np.flatnonzero(head.known)
    frame = np.arange(head.column.size)
    after = np.searchsorted(known, frame)
    inside = (after > 0) & (after < known.size)
    gap = np.full(frame.size, longest + 1)
    gap[inside] = known[after[inside]] - known[after[inside] - 1] - 1
    kept = head.known | (gap <= longest)
    values = (np.where(kept, np.interp(frame, known, one[known]), np.nan) for one in head)
    return HeadPose(*values)
