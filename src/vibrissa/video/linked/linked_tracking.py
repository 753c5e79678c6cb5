"""From movie to profile without marks: lines of every frame, linked over the whole movie."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import RangeError, TooFewError
from vibrissa.head_pose import HeadPose, with_head
from vibrissa.quantities import dataset
from vibrissa.quantities.identity import SURE
from vibrissa.quantities.kinds import Progress
from vibrissa.video.find.movie_segments import Background, LineSearch, find_segments
from vibrissa.video.follow.background import reference
from vibrissa.video.io.movie import open_movie, read_blocks
from vibrissa.video.link.starts.whisker_discovery import LEAST
from vibrissa.video.link.thorough_linking import link_thoroughly
from vibrissa.video.link.whisker_linking import Linking
from vibrissa.video.linked.line_marks import LineMark, apply_marks, marked_lines, require_in_movie, snapped
from vibrissa.video.linked.linked_profile import profile_from_linking, whiskers_seen
from vibrissa.video.profile.turning import Region
from vibrissa.video.tracking import Calibration

if TYPE_CHECKING:
    import xarray as xr

Frames = NDArray[Any]
MOST_THREADS = 8  # more do not help, as decoding takes its part


class LinkedTracks(NamedTuple):
    """``profile`` of the whiskers; ``segments``, all lines of the movie and whose they are."""

    profile: xr.Dataset
    segments: xr.Dataset


def track_linked(
    movie: str | Path | Frames,
    *,
    calibration: Calibration,
    marks: Sequence[LineMark] = (),
    polarity: Literal["dark", "bright"] = "dark",
    background: str | Path | Frames = "space",
    region: Region | None = None,
    node_spacing: float | None = None,
    least_probability: float = SURE,
    head: HeadPose | None = None,
    skin: Sequence[tuple[float, float]] | None = None,
    drop_frames: Literal["nan"] | None = None,
    start: int = 0,
    stop: int | None = None,
    progress: Progress | None = None,
    watch: Callable[[Frames], None] | None = None,
) -> LinkedTracks:
    """Track all whiskers of a movie of whisking animals: find the lines of every frame, and link them.

    Parameters
    ----------
    movie : path or (T, height, width) array
        A file, or grey frames.
    calibration : Calibration
        Frame rate and pixel size.
    marks : sequence of LineMark
        Names of lines; marked whiskers come first in the profile, in the order of their names' first marks.
    polarity : {"dark", "bright"}
        Whether whiskers are darker or brighter than the background.
    background : "space", "mean", "median", path or (height, width) array
        What is subtracted from every frame: nothing, as each line is placed on the background beside it; what stays
        over time, see :class:`vibrissa.video.find.movie_segments.LineSearch`; or an image, or the mean of a movie,
        without whiskers.
    region : (first column, first row, last column, last row), optional
        Part of the image that is searched [px].
    node_spacing : float, optional
        Arc length between nodes [m]; 5 pixels if not given.
    least_probability : float
        Probability of a name from which on a line is called that whisker's.
    head : HeadPose, optional
        The head in every frame that is tracked: lines are linked in coordinates that move with it. Without it they are
        in those that move as the lines show, if they show a motion.
    skin : sequence of (column, row), optional
        Where whiskers leave the skin [px], in the first frame in which the head is known, or the first one; each is
        that of the whisker whose bases are nearest, the other whiskers begin at the median of their bases.
    drop_frames : {"nan"}, optional
        Frames that are missing in the movie repeat the one before, so that later ones have their place in time.
    start, stop : int
        First frame that is tracked, from 0, and the first after it that is not; all by default.
    progress : callable, optional
        Called with a name of the work, the frames done, and their number.
    watch : callable, optional
        Called with every block of frames.

    Returns
    -------
    LinkedTracks
        The profile as of :func:`vibrissa.video.linked.linked_profile.profile_from_linking`, time 0 at ``start``; the
        segments with the variables of ``identity``, whose frames are the movie's.

    Raises
    ------
    InputError
        If the movie cannot be read, has too few frames, no whisker is found, a setting is out of range, or a mark is on
        no line.
    """
    behind, name = _behind(background, movie)
    search = LineSearch(polarity=polarity, background=behind, region=region, threads=_threads())
    _require_in_image(skin or (), movie)
    if drop_frames is None:  # else frames count otherwise
        _require_in_movie(marks, movie, start, stop)
    segments = find_segments(
        movie, search, start=start, stop=stop, drop_frames=drop_frames, progress=progress, watch=watch
    )
    _require_lines(segments)
    marked_lines(segments, marks)  # what cannot be is refused before linking, which takes minutes
    if progress is not None:
        progress("link whiskers", 0, 0)
    segments, linking = link_thoroughly(segments if head is None else _in_head(segments, head, calibration.frame_rate))
    named: dict[str, int] = {}
    said: list[str] = []
    unmarked = whiskers_seen(linking, least_probability) if marks else np.zeros(0, np.int64)
    if marks:
        linking, named, said = apply_marks(linking, segments, marks)
    asked = {"background": name, "polarity": polarity}
    asked |= {} if region is None else {"region": json.dumps(region)}
    asked |= {"marks": json.dumps(marks)} if marks else {}
    profile = profile_from_linking(
        linking,
        calibration,
        source=str(movie) if isinstance(movie, str | Path) else "movie",
        node_spacing=node_spacing,
        least_probability=least_probability,
        skin=skin,
        first=list(named.values()),
        attrs=asked,
    )
    if named:
        profile.attrs["names"] = json.dumps(_names(profile, named))
    identified = _identified(segments, linking, calibration.frame_rate)
    said += [*_unkept(profile, linking, segments, marks, named), *_renumbered(profile, unmarked.tolist())]
    if marks and said:
        profile.attrs["remarks"] = json.dumps([*said, *json.loads(profile.attrs.get("remarks", "[]"))])
    return LinkedTracks(profile, identified)


def _require_in_movie(marks: Sequence[LineMark], movie: str | Path | Frames, start: int, stop: int | None) -> None:
    """Refuse marks off the movie before its frames are searched, as far as the movie states its length."""
    if not marks or (isinstance(movie, np.ndarray) and movie.ndim != 3):
        return
    count, height, width, guessed = _shape_of(movie)
    if guessed:
        count = max(count, *(mark.frame + 1 for mark in marks))
    end = count if stop is None else min(stop, count)
    for mark in marks if 0 <= start < end else ():
        require_in_movie(mark, (start, end), (width, height))


def _require_in_image(skin: Sequence[tuple[float, float]], movie: str | Path | Frames) -> None:
    """Refuse places off the image at which whiskers would leave the skin."""
    if not skin or (isinstance(movie, np.ndarray) and movie.ndim != 3):
        return
    _, height, width, _ = _shape_of(movie)
    for column, row in skin:
        if not (0 <= column <= width - 1 and 0 <= row <= height - 1):
            raise RangeError("skin", f"must lie in the image of {width} × {height} pixels", f"{column:g},{row:g}")


def _shape_of(movie: str | Path | Frames) -> tuple[int, int, int, bool]:
    """Frames, height and width of a movie, and whether the number of frames is an estimate."""
    if isinstance(movie, np.ndarray):
        return (*movie.shape, False)
    about = open_movie(movie)
    return about.frame_count, about.height, about.width, about.frame_count_is_estimate


def _require_lines(segments: xr.Dataset) -> None:
    """Refuse movies whose lines cannot be linked."""
    if not segments.sizes["segment"]:
        rule, remedy = "must show whiskers", "say whether they are dark or bright, or give a larger region"
        raise TooFewError("movie", rule, "no line in any frame", remedy)
    if int(segments.attrs["frames"]) < LEAST:
        rule, remedy = f"must have at least {LEAST} frames to be linked", "follow whiskers from seeds instead"
        raise TooFewError("movie", rule, str(segments.attrs["frames"]), remedy)


def _behind(background: str | Path | Frames, movie: str | Path | Frames) -> tuple[Background | Frames, str]:
    """What the finder subtracts, and its name."""
    if isinstance(background, str):
        if background == "space":
            return "none", "space"
        if background in ("mean", "median"):
            return background, background  # type: ignore[return-value]
    image, name = reference(background, lambda: [movie] if isinstance(movie, np.ndarray) else read_blocks(movie))
    return "none" if image is None else image, name


def _in_head(segments: xr.Dataset, head: HeadPose, frame_rate: float) -> xr.Dataset:
    """Segments with the head in every frame."""
    count = int(segments.attrs["frames"])
    time = dataset(time=(int(segments.attrs.get("first_frame", 0)) + np.arange(count)) / frame_rate)
    return with_head(segments.merge(time, combine_attrs="override"), head)


def _threads() -> int:
    return min(os.cpu_count() or 1, MOST_THREADS)


def _names(profile: xr.Dataset, named: dict[str, int]) -> list[str]:
    """Names of all whiskers of a profile, those without a mark by their number."""
    numbers = {who: name for name, who in named.items()}
    return [numbers.get(who, f"whisker {k}") for k, who in enumerate(json.loads(profile.attrs["identities"]))]


def _renumbered(profile: xr.Dataset, unmarked: list[int]) -> list[str]:
    """Say which numbers whiskers would have without marks, where marked ones coming first has changed them."""
    now = json.loads(profile.attrs["identities"])
    were = [(k, unmarked.index(who)) for k, who in enumerate(now) if who in unmarked]
    moved = [f"{k} would be {was}" for k, was in were if k != was]
    return [f"marked whiskers come first; without marks, whisker {', '.join(moved)}"] if moved and unmarked else []


def _unkept(
    profile: xr.Dataset, linking: Linking, segments: xr.Dataset, marks: Sequence[LineMark], named: dict[str, int]
) -> list[str]:
    """Say which marked lines are not their whisker's in the end, and why."""
    lost, whose = json.loads(profile.attrs["lost"]), linking.identity().segment_whisker.values
    first, names, lines = int(segments.attrs.get("first_frame", 0)), list(named), []
    for mark in marks:
        frame, whisker = mark.frame - first, names.index(mark.whisker)
        reasons = [why for begin, end, why in lost[whisker] if begin <= frame <= end]
        if whose[snapped(segments, mark)] != named[mark.whisker]:
            reasons = ["another line there is this whisker's"]
        at = f"{mark.whisker} in frame {mark.frame}, column {mark.column:g}, row {mark.row:g}"
        lines += [f"{at} ({reasons[0]})"] if reasons else []
    text = f"{len(lines)} of {len(marks)} marks are not kept: {', '.join(lines)}; marks may contradict one another"
    return [text] if lines else []


def _identified(segments: xr.Dataset, linking: Linking, frame_rate: float) -> xr.Dataset:
    """Segments and whose they are; time counts from the movie's first frame."""
    identity = linking.identity()
    time = (int(segments.attrs.get("first_frame", 0)) + np.arange(linking.pieces.frames)) / frame_rate
    places = dataset(whisker=np.arange(linking.whiskers), time=time)
    whole = segments.merge(identity, combine_attrs="override").merge(places, combine_attrs="override")
    return whole.assign_attrs(segments.attrs, reasons=identity.attrs["reasons"])
