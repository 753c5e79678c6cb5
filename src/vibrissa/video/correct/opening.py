"""What is corrected, from files: a profile, its movie, the lines of all frames, and the edits of an earlier time."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.errors import ConflictError, FormatError
from vibrissa.head_pose import head_of, with_head
from vibrissa.netcdf import load, save
from vibrissa.quantities import dataset, require
from vibrissa.quantities.kinds import Progress
from vibrissa.video.correct.correction import Correction
from vibrissa.video.correct.edit_file import EditedMovie, read_edits
from vibrissa.video.find.movie_segments import LineSearch, find_segments
from vibrissa.video.foreign.segment_tables import read_segments
from vibrissa.video.foreign.tracks import kind_of
from vibrissa.video.io.about import Movie
from vibrissa.video.io.movie import open_movie, sure_frame_times, with_missing_frames
from vibrissa.video.link.agreement import numbers_in_common
from vibrissa.video.link.known.known_lines import LineNames
from vibrissa.video.link.thorough_linking import IDENTIFIED, linked_before
from vibrissa.video.link.whisker_linking import Linking
from vibrissa.video.tracking import Calibration

if TYPE_CHECKING:
    import xarray as xr

BEYOND = 1.2  # lines may be carried on a little beyond the edge of the image


class OpenedTracks(NamedTuple):
    """What is corrected.

    Attributes
    ----------
    correction : Correction
        The movie's lines, with the edits of an earlier time.
    movie : EditedMovie
        What edits belong to.
    profile : Dataset
        As it was before.
    numbers : (n,) array of int
        Number of each whisker of the profile's linking in this one; −1 where it has no line.
    missing : (N,) array of int or None
        Numbers of the frames that are not in the movie; None where all frames are pictures.
    """

    correction: Correction
    movie: EditedMovie
    profile: xr.Dataset
    numbers: Integers
    missing: Integers | None


def open_tracks(
    profile: Path,
    movie: Path,
    *,
    segments: Path | None,
    edits: Path,
    polarity: Literal["dark", "bright"] = "dark",
    tell: Callable[[str], None],
    progress: Progress,
) -> OpenedTracks:
    """Read what is corrected, link its lines, and make the edits of an earlier time again.

    Parameters
    ----------
    profile : Path
        Tracked profiles; their frame rate, pixel size and node spacing are kept.
    movie : Path
        The movie.
    segments : Path or None
        Lines of all frames: dataset (NetCDF), .whiskers of WHISK or HDF5 of WhiskiWrap; if None the file that the
        profile names, else the lines are sought in the movie.
    edits : Path
        File of the edits; it need not exist.
    polarity : {"dark", "bright"}
        Whether whiskers are darker or brighter than the background, where lines are sought.
    tell : callable
        Called with remarks.
    progress : callable
        Called with (stage, done, total).

    Returns
    -------
    OpenedTracks
        Ready for more edits.

    Raises
    ------
    InputError
        If a file cannot be read, they do not belong together, or an edit cannot be made.
    """
    before = load(profile)
    require(before, "x", "y", "arc_length")
    calibration_of(before, str(profile))
    _refuse_lost_edits(profile, before, edits)
    about = open_movie(movie)
    _refuse_other_movie(profile, before, movie, about)
    if segments is None:
        _refuse_unlinked(profile, before, movie)
    if (own := before.attrs.get("movie", movie.name)) != movie.name:
        tell(f"{profile} was tracked in {own}, not in {movie.name}: is that the same movie?")
    lines = _lines(profile, before, movie, segments, polarity, tell, progress)
    first = int(lines.attrs.get("first_frame", 0))
    lines = _fitted(lines, with_missing_frames(about, before.attrs.get("drop_frames")))
    movie_of = EditedMovie(movie.name, int(lines.attrs["frames"]), about.width, about.height)
    made = read_edits(edits, movie_of, first) if edits.exists() else []
    progress("linking", 0, 0)
    lines, linking = linked_before(lines)
    said, numbers = said_of(lines, linking)
    labels = marked_names(before, numbers)
    correction = Correction(linking, said, labels)
    correction.apply_all(made, str(edits))
    if made:
        tell(f"{len(made)} edit{'s' * (len(made) != 1)} of {edits} made again")
    if before.attrs.get("identity_from") != "link":
        tell(f"{profile} was not linked from lines: its whiskers may have other numbers here")
    shown = profile_numbers(before, numbers, linking.whiskers)
    if given := [f"{shown[n]} is {name}" for n, name in sorted(labels.items())]:
        tell(f"whisker {', '.join(given)}")
    missing = sure_frame_times(movie).missing if "drop_frames" in before.attrs else None
    return OpenedTracks(correction, movie_of, before, numbers, missing)


def _refuse_lost_edits(profile: Path, before: xr.Dataset, edits: Path) -> None:
    """Refuse a corrected profile without its edits: the lines have the names that they had before."""
    made = int(before.attrs.get("edits", 0))
    if made and not edits.exists():
        rule = "must come with the file of the edits that it was corrected by"
        remedy = "correct the profile that it was made from, or give that file too"
        raise ConflictError(str(profile), rule, f"{made} edit{'s' * (made != 1)} and no {edits}", remedy)


def _refuse_other_movie(profile: Path, before: xr.Dataset, movie: Path, about: Movie) -> None:
    """Refuse a movie of another length than that which was tracked, as far as the profile knows it."""
    kept = before.attrs
    dropped, part = "drop_frames" in kept, "first_frame" in kept  # frames count otherwise; some were not tracked
    tracked = 0 if dropped else int(kept.get("last_frame", before.sizes["time"] - 1)) + 1
    known, frames = "movie_frames" in kept, int(kept.get("movie_frames", tracked))
    whole = known or not (dropped or part or "format" in kept)  # other programs leave out frames without lines
    spare = 2 + about.frame_count // 100 if about.frame_count_is_estimate else 0
    if about.frame_count < frames - spare or (whole and about.frame_count > frames + spare):
        rule = f"must be the movie of {profile}, {'' if whole else 'at least '}{frames} frames"
        raise ConflictError(str(movie), rule, about.frame_count, "give the movie that was tracked")


def _refuse_unlinked(profile: Path, before: xr.Dataset, movie: Path) -> None:
    """Refuse a profile whose whiskers were not linked from lines, and that names no lines."""
    if before.attrs.get("identity_from") == "link" or "segments" in before.attrs:
        return
    rule = "must be linked from lines: whiskers of lines that are found now are other ones"
    source = before.attrs.get("format", "tracks that were not linked")
    remedy = f"track it first: vibrissa track {movie} --tracking link --segments lines.nc --out profile.nc"
    raise ConflictError(str(profile), rule, f"whiskers of {source}", f"{remedy}; or give the lines by `segments`")


def marked_names(profile: xr.Dataset, numbers: Integers) -> dict[int, str]:
    """Names that marks gave whiskers of a profile, by their numbers in the linking that is corrected.

    Parameters
    ----------
    profile : Dataset
        As it was before.
    numbers : (n,) array of int
        Of :func:`said_of`.

    Returns
    -------
    dict
        Of whiskers that have lines.
    """
    if not {"names", "identities"} <= set(profile.attrs):
        return {}
    were = zip(json.loads(profile.attrs["identities"]), json.loads(profile.attrs["names"]), strict=True)
    named = {n: name for k, (n, name) in enumerate(were) if name != f"whisker {k}" and n < numbers.size}
    return {int(numbers[n]): name for n, name in named.items() if numbers[n] >= 0}


def profile_numbers(profile: xr.Dataset, numbers: Integers, whiskers: int) -> Integers:
    """Numbers that whiskers of a linking have in a profile; those that it does not keep follow.

    Parameters
    ----------
    profile : Dataset
        As it was before.
    numbers : (n,) array of int
        Of :func:`said_of`.
    whiskers : int
        How many there are in the linking.

    Returns
    -------
    (whiskers,) array of int
        Each of 0 to ``whiskers`` − 1 once.
    """
    kept = kept_whiskers(profile, numbers)
    return np.argsort([*kept, *np.setdiff1d(np.arange(whiskers), kept)])


def kept_whiskers(profile: xr.Dataset, numbers: Integers) -> list[int]:
    """Whiskers of a linking that a profile keeps, in its order.

    Parameters
    ----------
    profile : Dataset
        As it was before.
    numbers : (n,) array of int
        Of :func:`said_of`.

    Returns
    -------
    list of int
        None if the profile was not linked from lines.
    """
    if profile.attrs.get("identity_from") != "link":
        return []
    kept = [int(numbers[n]) for n in json.loads(profile.attrs["identities"]) if n < numbers.size]
    return [n for n in kept if n >= 0]


def calibration_of(profile: xr.Dataset, source: str) -> Calibration:
    """Frame rate and pixel size of a profile.

    Parameters
    ----------
    profile : Dataset
        ``profile``.
    source : str
        Its file, for errors.

    Returns
    -------
    Calibration
        As it was tracked with.

    Raises
    ------
    InputError
        If it does not hold them.
    """
    try:
        return Calibration(**{name: float(profile.attrs[name]) for name in ("frame_rate", "pixel_size")})
    except KeyError as error:
        remedy = "give a profile of track or import-tracks"
        raise FormatError(source, "must hold frame_rate and pixel_size", remedy=remedy) from error


def said_of(lines: xr.Dataset, linking: Linking) -> tuple[LineNames | None, Integers]:
    """Names that lines had before, in the numbers of their linking.

    Parameters
    ----------
    lines : Dataset
        With ``segment_whisker``, and perhaps ``segment_other`` and ``segment_probability``.
    linking : Linking
        Of these lines.

    Returns
    -------
    LineNames or None
        The names; None where their probabilities are not known.
    (n,) array of int
        Number in the linking of each whisker of ``lines``; −1 where it has none.
    """
    whisker, now = lines.segment_whisker.values.astype(np.int64), linking.identity().segment_whisker.values
    both, count = (whisker >= 0) & (now >= 0), int(whisker.max(initial=-1)) + 1
    common = np.zeros((count, linking.whiskers))
    np.add.at(common, (whisker[both], now[both]), 1)
    numbers = numbers_in_common(common)
    if not all(name in lines for name in IDENTIFIED):
        return None, numbers[:-1]
    other, sure = lines.segment_other.values.astype(np.int64), lines.segment_probability.values
    return LineNames(numbers[whisker], numbers[other], np.where(numbers[whisker] >= 0, sure, 0.0)), numbers[:-1]


def _lines(
    profile: Path,
    before: xr.Dataset,
    movie: Path,
    segments: Path | None,
    polarity: Literal["dark", "bright"],
    tell: Callable[[str], None],
    progress: Progress,
) -> xr.Dataset:
    """Lines of all frames: those given, those beside the profile, or those that are found now and kept there."""
    beside = profile.with_name(before.attrs.get("segments", f"{profile.stem}.segments.nc"))
    if segments is None and not beside.is_file():
        found = find_segments(
            movie, LineSearch(polarity=polarity), drop_frames=before.attrs.get("drop_frames"), progress=progress
        )
        save(found, beside)
        tell(f"the lines of all frames are in {beside}")
        return found
    path = segments or beside
    if path.suffix == ".nc":
        return load(path)
    kind = kind_of(path)
    if kind not in ("WHISK", "WhiskiWrap"):
        raise FormatError(
            str(path), "must hold lines of frames", f"a file of {kind}", "give .nc, .whiskers or WhiskiWrap's"
        )
    return read_segments(path, kind)


def _fitted(lines: xr.Dataset, movie: Movie) -> xr.Dataset:
    """Lines whose frames are the movie's, once they can be of this movie."""
    require(lines, "segment_frame", "segment_start", "column", "row")
    frames, size = movie.frame_count, (movie.width, movie.height)
    last = int(lines.segment_frame.values.max(initial=-1)) + 1
    reach = tuple(int(np.ceil(lines[name].values.max(initial=0))) for name in ("column", "row"))
    unsure = 2 + frames // 100 if movie.frame_count_is_estimate else 0  # a container may not know it
    most = frames + unsure
    own = lines.attrs["width"], lines.attrs["height"]
    others = "typical_width" in lines.attrs and own != size  # of lines found in a movie the size is known
    if others or last > most or reach[0] > BEYOND * size[0] or reach[1] > BEYOND * size[1]:
        rule = f"must be of this movie, {frames} frames of {size[0]} × {size[1]} pixels"
        found = f"lines up to frame {last - 1}, column {reach[0]}, row {reach[1]}"
        found = f"lines of a movie of {own[0]} × {own[1]} pixels" if others else found
        raise ConflictError("segments", rule, found, "give those of this movie")
    if (head := head_of(lines)) is not None:
        whole = head.within(max(frames, last), int(lines.attrs.get("first_frame", 0)))
        lines = lines.drop_dims("time").merge(dataset(time=np.arange(max(frames, last), dtype=float)))
        lines = with_head(lines, whole)
    fitted = lines.assign_attrs(frames=max(frames, last), width=size[0], height=size[1])
    fitted.attrs.pop("first_frame", None)
    return fitted
