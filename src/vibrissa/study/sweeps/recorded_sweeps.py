"""A recorded sweep: tracked or read, then analysed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.errors import TooFewError
from vibrissa.mechanics.inverse.stationary_posture import Line
from vibrissa.netcdf import load
from vibrissa.study.movie.track_file import track_file
from vibrissa.study.spec.recorded_sweeps import RecordedSweep, refuse_long
from vibrissa.study.spec.settings import MovieFile
from vibrissa.study.store.result_store import SweepRow
from vibrissa.study.sweeps.sweep_analysis import SweepFacts, analyse_sweep, followed_throughout
from vibrissa.texture.io import read_gaps
from vibrissa.video.foreign.tracks import read_tracks
from vibrissa.video.io.movie import open_movie
from vibrissa.video.tracking import Calibration

if TYPE_CHECKING:
    import xarray as xr


def recorded_sweep(sweep: RecordedSweep) -> tuple[SweepRow, xr.Dataset]:
    """Track or read one recorded sweep, and analyse it.

    Parameters
    ----------
    sweep : RecordedSweep
        A line of the table.

    Returns
    -------
    row, series
        As :func:`vibrissa.study.sweeps.sweep_analysis.analyse_sweep`.

    Raises
    ------
    InputError
        If a file is missing or bad, or the whisker was lost.
    """
    if sweep.movie is not None and (sweep.folder / sweep.movie).exists():
        refuse_long(open_movie(sweep.folder / sweep.movie).frame_count)
    profile, known = known_sweep(sweep)
    refuse_long(profile.sizes["time"], profile.sizes["node"])
    followed_throughout(profile)
    return analyse_sweep(since_start(profile, sweep), known)


def known_sweep(sweep: RecordedSweep) -> tuple[xr.Dataset, SweepFacts]:
    """Track or read the profile of a sweep's whisker, and gather what else is known of the sweep.

    Parameters
    ----------
    sweep : RecordedSweep
        A line of the table.

    Returns
    -------
    profile : Dataset
    known : SweepFacts
        What else is known.
    """
    profile = _profile(sweep)
    known = SweepFacts(
        whisker=sweep.whisker,
        scan_speed=sweep.scan_speed,
        base_height=sweep.base_height,
        texture=None if sweep.texture is None else read_gaps(sweep.folder / sweep.texture),
        substrate=_substrate(sweep, profile),
        contact=sweep.contact,
        base_angle=sweep.base_angle,
        friction=sweep.friction,
        exposure=sweep.exposure,
    )
    return profile, known


def since_start(profile: xr.Dataset, sweep: RecordedSweep) -> xr.Dataset:
    """The profile in the time of the texture, whose x = 0 meets the contact at time 0.

    Parameters
    ----------
    profile : Dataset
        One whisker, in the time of the movie.
    sweep : RecordedSweep
        A line of the table.

    Returns
    -------
    Dataset
        The profile; the attribute ``movie_begins`` [s] is the time of the movie's first frame.
    """
    return profile.assign_coords(time=profile.time - sweep.start).assign_attrs(movie_begins=-sweep.start)


def _profile(sweep: RecordedSweep) -> xr.Dataset:
    """Profile of the sweep's whisker."""
    if sweep.movie is not None and sweep.pixel_size is not None and sweep.seed is not None:
        profile = track_file(_movie(sweep, sweep.movie, sweep.pixel_size, sweep.seed), sweep.folder, lambda *_: None)
    else:
        path = sweep.folder / str(sweep.track)
        profile = load(path) if path.suffix == ".nc" else _imported(path, sweep)
    if "whisker" not in profile.dims:
        return profile
    count = profile.sizes["whisker"]
    if count != 1 and (sweep.which is None or not 0 <= sweep.which < count):
        raise TooFewError(str(sweep.track), f"must hold one whisker, or which must be 0 to {count - 1}", sweep.which)
    return profile.isel(whisker=0 if count == 1 else sweep.which)


def _imported(path: Path, sweep: RecordedSweep) -> xr.Dataset:
    """Profile of a track file of another program; of WHISK's, of the whisker that is meant."""
    which = None if sweep.which is None else [sweep.which]
    return read_tracks(path, _calibration(sweep), identity=sweep.identity, base=sweep.base, whiskers=which)


def _movie(sweep: RecordedSweep, path: str, pixel_size: float, seed: tuple[float, ...]) -> MovieFile:
    return MovieFile(
        path=path,
        pixel_size=pixel_size,
        frame_rate=sweep.frame_rate,
        seeds=((seed[0], seed[1]),),
        skin=None if sweep.skin is None else ((sweep.skin[0], sweep.skin[1]),),
        base=sweep.base or "left",
        polarity=sweep.polarity,
    )


def _calibration(sweep: RecordedSweep) -> Calibration | None:
    if sweep.pixel_size is None or sweep.frame_rate is None:
        return None
    return Calibration(frame_rate=sweep.frame_rate, pixel_size=sweep.pixel_size)


def _substrate(sweep: RecordedSweep, profile: xr.Dataset) -> Line | None:
    if sweep.substrate is None:
        return None
    size = sweep.pixel_size or profile.attrs["pixel_size"]
    a, b, c, d = (float(value * size) for value in sweep.substrate)
    return (a, b), (c, d)
