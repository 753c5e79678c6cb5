"""Movies and the tracks of whiskers in them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrissa.api.arguments import names_arguments
from vibrissa.api.progress import notebook_bar
from vibrissa.api.remarks import remark
from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError
from vibrissa.netcdf import load

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from vibrissa.video.kernel.estimator_table import Estimator

Point = tuple[float, float]
Side = Literal["left", "right", "top", "bottom"]


@names_arguments
def track(
    movie: str | Path | NDArray[Any],
    *,
    pixel_size: float,
    frame_rate: float | None = None,
    seeds: Sequence[Point] | None = None,
    skin: Sequence[Point] | None = None,
    base: Side | None = None,
    polarity: Literal["dark", "bright"] = "dark",
    region: tuple[int, int, int, int] | None = None,
    background: str = "space",
    estimator: Estimator = "matched",
    search: int = 4,
    least_contrast: float = 3.0,
    node_spacing: float | None = None,
    substrate: tuple[Point, Point] | None = None,
    whisker_length: float | None = None,
    start: int = 0,
    stop: int | None = None,
    drop_frames: Literal["nan"] | None = None,
) -> xr.Dataset:
    """Centrelines of the whiskers of a movie, at nodes of fixed arc length.

    Parameters
    ----------
    movie : path or (T, height, width) array
        A file (AVI, MP4, MKV, TIFF, folder of images, Photron, ``.npy``), or grey frames of uint8 or uint16.
    pixel_size : float
        Side of a pixel in the plane of the whiskers [m].
    frame_rate : float, optional
        Rate of acquisition [Hz]; needed unless a camera's header holds it.
    seeds : sequence of (column, row), optional
        A point of each whisker in the first frame [pixels]; whiskers are found and counted without them.
    skin : sequence of (column, row), optional
        Where each whisker leaves the skin [pixels]; without it arc length counts from where each is first seen.
    base : {"left", "right", "top", "bottom"}, optional
        Side of the image on which the whiskers leave the skin; as found with the whiskers, else left.
    polarity : {"dark", "bright"}
        Whiskers darker or brighter than the background.
    region : (first column, first row, last column, last row), optional
        Part of the image that is searched [pixels].
    background : str
        ``"space"`` (estimated in every frame), ``"mean"`` (of the movie), or an image or movie without whiskers.
    estimator, search, node_spacing
        As of :func:`vibrissa.video.tracking.track`.
    least_contrast : float
        Signal to noise of the contrast below which a column is lost.
    substrate : ((column, row), (column, row)), optional
        Two points of the line along which the whiskers touch the substrate [pixels]: then skin and contact are
        extrapolated.
    whisker_length : float, optional
        Length of the cones [m], for the contact.
    start, stop : int
        First frame that is tracked, from 0, and the first after it that is not; all by default. Points are of frame
        ``start``.
    drop_frames : {"nan"}, optional
        Frames that the movie's time stamps show to be missing become missing frames (NaN); by default they are reported
        alone.

    Returns
    -------
    Dataset
        ``x``, ``y`` (whisker, time, node) and ``arc_length`` (whisker, node) [m]; NaN where a whisker was not seen.
        ``time`` counts from the movie's first frame, also where a part of it is tracked; the attributes ``first_frame``
        and ``last_frame`` say which.

    Raises
    ------
    InputError
        If the movie cannot be read, no whisker is found, or a setting is out of range.

    Examples
    --------
    >>> import vibrissa as vb
    >>> profile = vb.track(vb.sample_data("movie.mkv"), frame_rate=2000, pixel_size=95e-6, skin=[(50.5, 57)])
    >>> profile.sizes["whisker"]
    1
    """
    refuse_points("skin", skin)
    refuse_points("seeds", seeds)
    how: dict[str, Any] = {
        "polarity": polarity,
        "region": region,
        "background": background,
        "estimator": estimator,
        "search": search,
        "threshold": least_contrast,
        "node_spacing": node_spacing,
        "skin": None if skin is None else tuple(skin),
        "base": base or "left",
        "seeds": () if seeds is None else tuple(seeds),
    }
    if seeds is None:
        how |= _found(movie, start, drop_frames, polarity=polarity, base=base, region=region)
    if isinstance(movie, str | Path):
        ends: dict[str, Any] = {"substrate": substrate, "whisker_length": whisker_length, "start": start, "stop": stop}
        ends["drop_frames"] = drop_frames
        return _track_file(path=str(movie), pixel_size=pixel_size, frame_rate=frame_rate, **ends, **how)
    if frame_rate is None:
        raise MissingError("frame_rate", "must be given with frames in memory", remedy="the camera's rate in Hz")
    if substrate is not None:
        raise ConflictError("substrate", "must go with a movie file", remedy="write the frames with a lossless codec")
    return _track_frames(np.asarray(movie), (start, stop), frame_rate, pixel_size, how)


def _found(
    movie: str | Path | NDArray[Any], start: int, drop_frames: Literal["nan"] | None, **how: Any
) -> dict[str, Any]:
    """Seeds and base of the whiskers in one frame."""
    from vibrissa.video.find.finding import find_seeds
    from vibrissa.video.io.movie import read_blocks

    if isinstance(movie, str | Path):
        image = next(iter(read_blocks(movie, 1, start, drop_frames=drop_frames)))[0]
    else:
        image = _part(np.asarray(movie), start, None)[0]
    base, found = find_seeds(image, **how)
    return {"seeds": tuple(one.seed for one in found), "base": base}


def _track_file(**settings: Any) -> xr.Dataset:
    from vibrissa.study.movie.backward import track_file
    from vibrissa.study.spec.settings import MovieFile

    with notebook_bar() as progress:
        tracked = track_file(MovieFile(**settings), Path(), progress)
    remark(*json.loads(tracked.attrs.get("remarks", "[]")))
    return tracked


def _track_frames(
    frames: NDArray[Any], part: tuple[int, int | None], rate: float, size: float, how: dict[str, Any]
) -> xr.Dataset:
    from vibrissa.video.tracking import Calibration, numbered_from
    from vibrissa.video.tracking import track as track_frames

    tracked = track_frames([_part(frames, *part)], calibration=Calibration(frame_rate=rate, pixel_size=size), **how)
    return tracked if part == (0, None) else numbered_from(tracked, part[0])


def _part(frames: NDArray[Any], start: int, stop: int | None) -> NDArray[Any]:
    """Frames of a part of a movie in memory."""
    if not 0 <= start < (len(frames) if stop is None else stop) <= len(frames):
        raise RangeError("start, stop", f"must lie within the {len(frames)} frames of the movie", (start, stop))
    return frames[start:stop]


def refuse_points(name: str, points: Sequence[Point] | None) -> None:
    """Refuse one point where a list of points is meant.

    Parameters
    ----------
    name : str
        The argument.
    points : sequence of (column, row), optional
        What was given.

    Raises
    ------
    InputError
        Shows the list.
    """
    if points is not None and any(not isinstance(point, Sequence | np.ndarray) for point in points):
        raise FormatError(name, "must be a list of points, one for each whisker", points, f"{name}=[(50.5, 57)]")


@names_arguments
def read_tracks(
    tracks: Any, *, frame_rate: float | None = None, pixel_size: float | None = None, **how: Any
) -> xr.Dataset:
    """Whiskers that another program has tracked, as ``track`` gives them.

    Parameters
    ----------
    tracks : path or Dataset
        A file of WHISK, WhiskiWrap, WhiskerMan, DeepLabCut, SLEAP or of ``track`` itself; or a poses dataset of
        movement.
    frame_rate : float, optional
        [Hz], where the file does not state it.
    pixel_size : float, optional
        [m], where the file does not state it.
    **how
        As of :func:`vibrissa.video.foreign.tracks.read_tracks`: identities, likelihood, skin.

    Returns
    -------
    Dataset
        ``x``, ``y`` (whisker, time, node) and ``arc_length`` [m].

    Raises
    ------
    InputError
        If the tracks cannot be read, or rate or pixel size must be given.

    Examples
    --------
    >>> from tempfile import NamedTemporaryFile
    >>> import vibrissa as vb
    >>> profile = vb.track(vb.sample_data("movie.mkv"), frame_rate=2000, pixel_size=95e-6)
    >>> with NamedTemporaryFile(suffix=".nc") as file:
    ...     vb.save(profile, file.name)
    ...     vb.read_tracks(file.name).sizes["time"]
    400
    """
    from vibrissa.api.objects.tracks import as_tracks

    if isinstance(tracks, str | Path) and Path(tracks).suffix == ".nc":
        tracks = load(tracks)
    return as_tracks(tracks, frame_rate=frame_rate, pixel_size=pixel_size, **how)
