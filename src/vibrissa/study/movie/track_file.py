"""A movie file tracked: whiskers followed or linked, what the movie shows beside, the ends that it does not show."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Frames
from vibrissa.errors import ConflictError, MissingError
from vibrissa.head_pose import HeadPose
from vibrissa.netcdf import save
from vibrissa.quantities.kinds import Progress
from vibrissa.study.movie.track_plan import TrackPlan, acquisition_rate, plan_tracking
from vibrissa.study.spec.settings import MovieFile
from vibrissa.video.checks.gop_artifact import GopArtifactWatch
from vibrissa.video.checks.trial_led import led_frame, with_led
from vibrissa.video.find.head_finding import find_head
from vibrissa.video.follow.background import OF_THE_MOVIE
from vibrissa.video.foreign.head_points import BRIDGED, bridged, read_head
from vibrissa.video.io.about import IN_COLOUR, Movie
from vibrissa.video.io.frame_times import FrameTimes
from vibrissa.video.io.movie import (
    frame_times_of,
    frames_within,
    key_frames_of,
    open_movie,
    read_blocks,
    sure_frame_times,
    with_missing_frames,
)
from vibrissa.video.linked.line_marks import LineMark
from vibrissa.video.linked.linked_tracking import track_linked
from vibrissa.video.profile.ends import ends
from vibrissa.video.profile.missing_frames import without_frames
from vibrissa.video.tracking import Calibration, numbered_from, track

if TYPE_CHECKING:
    import xarray as xr

TRACKED = (  # settings of a movie that the tracker takes as they are
    "seeds", "skin", "polarity", "background", "region", "search", "threshold", "estimator", "node_spacing", "whisking",
)  # fmt: skip
LINKED = (
    "polarity", "background", "region", "node_spacing", "least_probability", "skin", "drop_frames", "start", "stop",
)  # fmt: skip


def counted(blocks: Iterable[Frames], stage: str, total: int, progress: Progress) -> Iterator[Frames]:
    """Pass blocks of frames on; report the progress before the first and after each.

    Parameters
    ----------
    blocks : iterable of arrays
        Frames (T, height, width).
    stage : str
        Name under which progress is reported.
    total : int
        Frames in all.
    progress : callable
        Called with (stage, done, total).

    Yields
    ------
    array
        The same blocks.
    """
    done = 0
    progress(stage, done, total)
    for block in blocks:
        yield block
        done += len(block)
        progress(stage, done, total)


def track_file(movie: MovieFile, folder: Path, progress: Progress) -> xr.Dataset:
    """Track the whiskers of a movie file, in the way of :func:`vibrissa.study.movie.track_plan.plan_tracking`.

    Parameters
    ----------
    movie : MovieFile
        The file, its calibration and its seeds.
    folder : Path
        Where a relative path starts.
    progress : callable
        Called with (stage, frames done, frames in all).

    Returns
    -------
    Dataset
        As of :func:`track_planned`.

    Raises
    ------
    InputError
        If the movie cannot be read or tracked, or a part of it is asked for that it does not have.
    """
    return track_planned(plan_tracking(movie, folder), folder, progress)


def track_planned(plan: TrackPlan, folder: Path, progress: Progress, segments: Path | None = None) -> xr.Dataset:
    """Track the whiskers of a movie file.

    Parameters
    ----------
    plan : TrackPlan
        How.
    folder : Path
        Where a relative path starts.
    progress : callable
        Called with (stage, frames done, frames in all).
    segments : Path, optional
        Where the lines of all frames and whose they are are written, if they are linked.

    Returns
    -------
    Dataset
        ``profile``, with the attribute ``tracking``, the whiskers' ``names`` (JSON) where they have some, and
        ``remarks`` (JSON) on the movie where there are any; ``movie``, the name of its file, and ``movie_frames``, its
        number of frames where the file states it; with skin and contact where the substrate is given, and
        ``led_frame`` where a lamp is. Of a part of the movie also ``first_frame`` and ``last_frame``; time counts from
        the movie's first frame.

    Raises
    ------
    InputError
        If the movie cannot be read or tracked, or a part of it is asked for that it does not have.
    """
    movie, path = plan.movie, folder / plan.movie.path
    about = open_movie(path)
    times = frame_times_of(path) if movie.drop_frames is None else sure_frame_times(path)
    part = movie.start != 0 or movie.stop is not None
    if part and movie.whisking is not None:
        raise ConflictError("start, stop", "must be left out with marks of whisking", (movie.start, movie.stop))
    if movie.tracking == "follow":
        _refuse_segments(segments)
    count = frames_within(with_missing_frames(about, movie.drop_frames), movie.start, movie.stop)

    def blocks(stage: str) -> Iterator[Frames]:
        read = read_blocks(path, start=movie.start, stop=movie.stop, drop_frames=movie.drop_frames)
        return counted(read, stage, count, progress)

    calibration = Calibration(frame_rate=acquisition_rate(movie, about), pixel_size=movie.pixel_size)
    watched = _Watched(about, calibration.frame_rate, times, movie.drop_frames is not None)
    if movie.background not in OF_THE_MOVIE:
        movie = dataclasses.replace(movie, background=str(folder / movie.background))
    if movie.head not in (None, "find"):
        movie = dataclasses.replace(movie, head=str(folder / movie.head))
    if movie.tracking == "link":
        watched.begin()
        profile = _linked(movie, path, calibration, segments, progress, watched.block)
    else:
        profile = _followed(plan.own_seeds, movie, calibration, lambda: watched.see(blocks("tracking")))
    profile = numbered_from(profile, movie.start) if part else profile
    if movie.drop_frames is not None and times is not None:
        profile = without_frames(profile, times.missing)
    profile.attrs["movie"] = path.name
    if not about.frame_count_is_estimate:
        profile.attrs["movie_frames"] = about.frame_count
    if movie.names:
        profile.attrs["names"] = json.dumps(movie.names)
    of_movie = watched.remarks()
    remarks = list(dict.fromkeys([*json.loads(profile.attrs.get("remarks", "[]")), *of_movie]))
    said = {"remarks": remarks, "movie_remarks": of_movie}
    profile.attrs |= {name: json.dumps(lines, ensure_ascii=False) for name, lines in said.items() if lines}
    if movie.lamp is not None:
        profile = with_led(profile, led_frame(blocks("lamp"), None if movie.lamp == "find" else movie.lamp))
    return profile if movie.substrate is None else with_ends(profile, movie)


def track_in_memory(plan: TrackPlan, frames: Frames, segments: Path | None = None) -> xr.Dataset:
    """Track the whiskers of frames in memory.

    Parameters
    ----------
    plan : TrackPlan
        How; the path of its movie is not used.
    frames : (T, height, width) array
        The whole movie.
    segments : Path, optional
        As of :func:`track_planned`.

    Returns
    -------
    Dataset
        ``profile``.

    Raises
    ------
    InputError
        As of :func:`track_planned`.
    """
    movie = plan.movie
    calibration = Calibration(frame_rate=movie.frame_rate or np.nan, pixel_size=movie.pixel_size)
    if movie.tracking == "link":
        profile = _linked(movie, frames, calibration, segments, None, None)
    else:
        _refuse_segments(segments)
        profile = _followed(plan.own_seeds, movie, calibration, lambda: [frames[movie.start : movie.stop]])
    return numbered_from(profile, movie.start) if (movie.start, movie.stop) != (0, None) else profile


def _refuse_segments(segments: Path | None) -> None:
    """Refuse to write lines that are not sought."""
    if segments is not None:
        rule = "must be left out where whiskers are followed"
        raise ConflictError("segments", rule, str(segments), "or `tracking='link'`")


def _followed(
    own_seeds: bool, movie: MovieFile, calibration: Calibration, blocks: Callable[[], Iterable[Frames]]
) -> xr.Dataset:
    """Profile of whiskers that are followed."""
    how = {name: getattr(movie, name) for name in TRACKED}
    profile = track(blocks, calibration=calibration, base=movie.base or "left", own_seeds=own_seeds, **how)
    return profile.assign_attrs(tracking="follow")


def _linked(
    movie: MovieFile,
    source: Path | Frames,
    calibration: Calibration,
    segments: Path | None,
    progress: Progress | None,
    watch: Callable[[Frames], None] | None,
) -> xr.Dataset:
    """Profile of whiskers that are linked; their lines go to a file if one is named."""
    profile, lines = track_linked(
        source,
        calibration=calibration,
        marks=[LineMark(*mark) for mark in movie.marks],
        head=_head(movie, source),
        progress=progress,
        watch=watch,
        **{name: getattr(movie, name) for name in LINKED},
    )
    if segments is not None:
        save(lines, segments)
        profile.attrs["segments"] = segments.name
    return profile.assign_attrs(tracking="link")


def _head(movie: MovieFile, source: Path | Frames) -> HeadPose | None:
    """The head in the frames that are tracked, from a file or found."""
    if movie.head is None:
        return None
    if movie.head != "find":
        pictures = None
        if movie.drop_frames is not None and not isinstance(source, np.ndarray):
            pictures = sure_frame_times(source).slots
        head = read_head(movie.head, sum(map(len, _blocks_of(source, movie, 0, None))), movie.head_points, pictures)
        return HeadPose(*(one[movie.start : movie.stop] for one in head))
    blocks = _blocks_of(source, movie, movie.start, movie.stop)
    return bridged(find_head(blocks, 1.0 if movie.polarity == "dark" else -1.0), BRIDGED)


def _blocks_of(source: Path | Frames, movie: MovieFile, start: int, stop: int | None) -> Iterable[Frames]:
    """Frames of a file, or in memory."""
    if isinstance(source, np.ndarray):
        return [source[start:stop]]
    return read_blocks(source, 64, start, stop, drop_frames=movie.drop_frames)


class _Watched:
    """What a movie shows while it passes that its reader should know."""

    def __init__(self, about: Movie, frame_rate: float, times: FrameTimes | None, kept: bool) -> None:
        self._about, self._frame_rate, self._times, self._kept = about, frame_rate, times, kept
        self._pumping: GopArtifactWatch | None = None

    def see(self, blocks: Iterable[Frames]) -> Iterator[Frames]:
        """Pass blocks of frames on; those of a lossy codec are watched."""
        self.begin()
        for block in blocks:
            self.block(block)
            yield block

    def begin(self) -> None:
        """Begin with the first frame."""
        if self._about.lossy:
            keys = key_frames_of(self._about.path)
            keys = self._times.slots[keys] if self._times is not None and self._kept else keys
            self._pumping = GopArtifactWatch(self._frame_rate, keys)

    def block(self, block: Frames) -> None:
        """Watch the next frames."""
        if self._pumping is not None:
            self._pumping.see(block)

    def remarks(self) -> list[str]:
        """One sentence each."""
        rate, remarks = self._about.frame_rate, []
        if np.isfinite(rate) and not np.isclose(rate, self._frame_rate):
            remarks.append(f"the camera's header has {rate:g} frames/s, not {self._frame_rate:g}")
        if self._about.colour:
            remarks.append(IN_COLOUR)
        codec = self._about.codec
        unchecked = "" if self._about.checksums else "has no checksums: damaged bytes may pass unseen"
        if self._about.lossy:
            remarks.append(" and ".join(filter(None, [f"{codec} may have altered the grey levels", unchecked])))
            remarks[-1] += "; record without loss, FFV1 best"
        elif unchecked:
            remarks.append(f"{codec} {unchecked}")
        if self._times is not None:
            remarks += self._times.remarks(self._kept)
        pumping = self._pumping.remark() if self._pumping else None
        return [*remarks, *filter(None, [pumping])]


def with_ends(profile: xr.Dataset, movie: MovieFile) -> xr.Dataset:
    """The profile with the skin and the contact of every whisker, by :func:`vibrissa.video.profile.ends.ends`.

    The attribute ``rejected`` (JSON) holds a reason for each whisker whose contact is inconsistent with the substrate,
    "" for the others.

    Parameters
    ----------
    profile : Dataset
        From :func:`vibrissa.video.tracking.track`.
    movie : MovieFile
        Its substrate, pixel size and length of the cone.

    Returns
    -------
    Dataset
        With the variables of that function by ``whisker``.

    Raises
    ------
    InputError
        If the substrate is not given.
    """
    import xarray as xr

    if movie.substrate is None:
        raise MissingError("substrate", "must be given", remedy="two points of the substrate's line")
    (a, b), size = movie.substrate, movie.pixel_size
    line = (a[0] * size, a[1] * size), (b[0] * size, b[1] * size)
    how: dict[str, Any] = {"method": "cone" if movie.whisker_length else "paper2014"}
    how["whisker_length"] = movie.whisker_length
    found = [ends(profile.isel(whisker=w), line, **how) for w in range(profile.sizes["whisker"])]
    both = xr.concat(found, dim=profile.whisker, combine_attrs="drop_conflicts")
    rejected = json.dumps([one.attrs["rejected"] for one in found])
    attrs = {"rejected": rejected, "contact_from": how["method"], "substrate": found[0].attrs["substrate"]}
    return profile.merge(both).assign_attrs(attrs)
