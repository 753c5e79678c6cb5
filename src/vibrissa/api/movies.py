"""Movies and the tracks of whiskers in them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrissa.api.remarks import remark
from vibrissa.api.shared.arguments import names_arguments
from vibrissa.api.shared.progress import notebook_bar
from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError
from vibrissa.netcdf import load
from vibrissa.quantities.identity import SURE

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from vibrissa.quantities.kinds import Method
    from vibrissa.study.spec.settings import MovieFile
    from vibrissa.video.kernel.estimator_table import Estimator

Point = tuple[float, float]
Side = Literal["left", "right", "top", "bottom"]


@names_arguments
def track(
    movie: str | Path | NDArray[Any],
    *,
    pixel_size: float,
    frame_rate: float | None = None,
    tracking: Method = "auto",
    seeds: Sequence[Point] | None = None,
    marks: Sequence[tuple[int, float, float, str]] = (),
    skin: Sequence[Point] | None = None,
    base: Side | None = None,
    head: str | None = None,
    head_points: Sequence[str] = (),
    polarity: Literal["dark", "bright"] = "dark",
    region: tuple[int, int, int, int] | None = None,
    background: str = "space",
    estimator: Estimator = "matched",
    search: int = 4,
    least_contrast: float = 3.0,
    node_spacing: float | None = None,
    least_probability: float = SURE,
    substrate: tuple[Point, Point] | None = None,
    whisker_length: float | None = None,
    start: int = 0,
    stop: int | None = None,
    drop_frames: Literal["nan"] | None = None,
    segments: str | Path | None = None,
) -> xr.Dataset:
    """Centrelines of the whiskers of a movie, at nodes of fixed arc length.

    Whiskers that keep their place, as one that is dragged over a texture, are followed from the first frame on.
    Whiskers that whisk are found in every frame and linked.

    Parameters
    ----------
    movie : path or (T, height, width) array
        A file (AVI, MP4, MKV, TIFF, folder of images, Photron, ``.npy``), or grey frames of uint8 or uint16.
    pixel_size : float
        Side of a pixel in the plane of the whiskers [m].
    frame_rate : float, optional
        Rate of acquisition [Hz]; needed unless a camera's header holds it.
    tracking : {"auto", "follow", "link"}
        Followed, or linked. By default marks say that whiskers are linked; seeds, skin, substrate, and other settings
        of following, that they are followed; without them they are followed if most of them keep their place.
    seeds : sequence of (column, row), optional
        A point of each whisker in the first frame [pixels]; whiskers are found and counted without them.
    marks : sequence of (frame, column, row, name)
        Points of whiskers in any frame [pixels]: each names the linked whisker of the nearest line within 6 pixels, and
        corrects it there.
    skin : sequence of (column, row), optional
        Where each whisker leaves the skin [pixels]; without it arc length counts from where each is first seen.
    base : {"left", "right", "top", "bottom"}, optional
        Side of the image on which the whiskers leave the skin; as found with the whiskers, else left. Not used where
        whiskers are linked.
    head : str, optional
        File with two tracked points of the head (DeepLabCut, SLEAP), or a table of frame, column, row and angle_deg; or
        "find". Lines are linked in coordinates that move with the head, and the profile has ``head_column``,
        ``head_row`` [pixels] and ``head_angle`` [degrees].
    head_points : sequence of str
        Names of a caudal and of a rostral keypoint in that file; by default its two.
    polarity : {"dark", "bright"}
        Whiskers darker or brighter than the background.
    region : (first column, first row, last column, last row), optional
        Part of the image that is searched [pixels].
    background : str
        ``"space"`` (estimated in every frame), ``"mean"`` (of the movie), ``"median"`` (where whiskers are linked), or
        an image or movie without whiskers.
    estimator, search, node_spacing
        As of :func:`vibrissa.video.tracking.track`.
    least_probability : float
        Of whiskers that are linked: probability of a name from which on a line is called that whisker's. A higher one
        leaves fewer frames and fewer wrong names.
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
        Frames that the movie's time stamps, or the numbers of its images, show to be missing become missing frames
        (NaN); by default they are reported alone. Of a file, not of frames in memory.
    segments : path, optional
        File (NetCDF) to which the lines of all frames are written, and which whisker each is linked to.

    Returns
    -------
    Dataset
        ``x``, ``y`` (whisker, time, node) and ``arc_length`` (whisker, node) [m]; NaN where a whisker was not seen. Of
        whiskers that are linked also ``whisker_probability`` (whisker, time), that the line is that whisker's.
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
    from vibrissa.study.spec.settings import MovieFile

    in_memory = not isinstance(movie, str | Path)
    settings = MovieFile(
        path="frames" if in_memory else str(movie),
        pixel_size=pixel_size,
        frame_rate=frame_rate,
        tracking=tracking,
        seeds=tuple(seeds or ()),
        marks=tuple(marks),
        skin=None if skin is None else tuple(skin),
        base=base,
        head=head,
        head_points=tuple(head_points),
        polarity=polarity,
        region=region,
        background=background,
        estimator=estimator,
        search=search,
        threshold=least_contrast,
        node_spacing=node_spacing,
        least_probability=least_probability,
        substrate=substrate,
        whisker_length=whisker_length,
        start=start,
        stop=stop,
        drop_frames=drop_frames,
    )
    lines = None if segments is None else Path(segments)
    if in_memory:
        return _track_frames(np.asarray(movie), settings, lines)
    return _track_file(settings, lines)


def _track_file(settings: MovieFile, segments: Path | None) -> xr.Dataset:
    from vibrissa.study.movie.track_file import track_planned
    from vibrissa.study.movie.track_plan import plan_tracking

    plan = plan_tracking(settings, Path())
    with notebook_bar() as progress:
        tracked = track_planned(plan, Path(), progress, segments)
    remark(*json.loads(tracked.attrs.get("remarks", "[]")))
    return tracked


def _track_frames(frames: NDArray[Any], settings: MovieFile, segments: Path | None) -> xr.Dataset:
    from vibrissa.study.movie.track_file import track_in_memory
    from vibrissa.study.movie.track_plan import plan_of

    if settings.frame_rate is None:
        raise MissingError("frame_rate", "must be given with frames in memory", remedy="the camera's rate in Hz")
    if settings.substrate is not None:
        raise ConflictError("substrate", "must go with a movie file", remedy="write the frames with a lossless codec")
    if settings.drop_frames is not None:
        remedy = "the times of the frames are in the file, not in the array"
        raise ConflictError("drop_frames", "must go with a movie file", settings.drop_frames, remedy)
    part = _part(frames, settings.start, settings.stop)
    tracked = track_in_memory(plan_of(settings, lambda: [part]), frames, segments)
    remark(*json.loads(tracked.attrs.get("remarks", "[]")))
    return tracked


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
        A file of WHISK, WhiskiWrap, DeepLabCut, SLEAP, WhiskerTracker or of ``track`` itself; or a poses dataset of
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
