"""Backward: from a movie, or tracks, to posture, modal amplitudes, resonance and damping."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrissa.api.arguments import names_arguments
from vibrissa.api.motion import Motion
from vibrissa.api.progress import notebook_bar
from vibrissa.api.remarks import remark
from vibrissa.errors import ConflictError, FormatError, MissingError
from vibrissa.files import load
from vibrissa.mechanics.inverse.decomposition import Method
from vibrissa.mechanics.inverse.resonance import fit_modes
from vibrissa.mechanics.inverse.stationary_posture import Line, fit_profile
from vibrissa.mechanics.modes.basis import Modes
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.slow_prediction import SlowPrediction
from vibrissa.quantities import one_whisker
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from vibrissa.video.kernel.estimator_table import Estimator

Point = tuple[float, float]


@names_arguments
def track(
    movie: str | Path | NDArray[Any],
    *,
    pixel_size: float,
    frame_rate: float | None = None,
    seeds: Sequence[Point] | None = None,
    skin: Sequence[Point] | None = None,
    base: Literal["left", "right", "top", "bottom"] | None = None,
    polarity: Literal["dark", "bright"] = "dark",
    region: tuple[int, int, int, int] | None = None,
    background: str = "space",
    estimator: Estimator = "matched",
    search: int = 4,
    least_contrast: float = 3.0,
    node_spacing: float | None = None,
    substrate: tuple[Point, Point] | None = None,
    whisker_length: float | None = None,
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

    Returns
    -------
    Dataset
        ``x``, ``y`` (whisker, time, node) and ``arc_length`` (whisker, node) [m]; NaN where a whisker was not seen.

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
    from vibrissa.study.movie.backward import track_file
    from vibrissa.study.spec.settings import MovieFile
    from vibrissa.video.find.finding import find_seeds
    from vibrissa.video.io.movie import read_blocks
    from vibrissa.video.tracking import Calibration
    from vibrissa.video.tracking import track as track_frames

    how: dict[str, Any] = {
        "polarity": polarity,
        "region": region,
        "background": background,
        "estimator": estimator,
        "search": search,
        "threshold": least_contrast,
        "node_spacing": node_spacing,
        "skin": None if skin is None else tuple(skin),
    }
    refuse_points("skin", skin)
    refuse_points("seeds", seeds)
    stored = isinstance(movie, str | Path)
    if seeds is None:
        image = next(iter(read_blocks(movie, 1)))[0] if isinstance(movie, str | Path) else movie[0]
        base, found = find_seeds(image, polarity=polarity, base=base, region=region)
        seeds = [one.seed for one in found]
    how |= {"seeds": tuple(seeds), "base": base or "left"}
    if stored:
        file = MovieFile(
            path=str(movie),
            pixel_size=pixel_size,
            frame_rate=frame_rate,
            substrate=substrate,
            whisker_length=whisker_length,
            **how,
        )
        with notebook_bar() as progress:
            tracked = track_file(file, Path(), progress)
        remark(*json.loads(tracked.attrs.get("remarks", "[]")))
        return tracked
    if frame_rate is None:
        raise MissingError("frame_rate", "must be given with frames in memory", remedy="the camera's rate in Hz")
    if substrate is not None:
        raise ConflictError("substrate", "must go with a movie file", remedy="write the frames with a lossless codec")
    return track_frames(
        [np.asarray(movie)], calibration=Calibration(frame_rate=frame_rate, pixel_size=pixel_size), **how
    )


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


@names_arguments
def fit_posture(
    profile: xr.Dataset,
    whisker: Whisker,
    *,
    friction: float | None = 0.4,
    substrate: Line | None = None,
    excursion: tuple[float, float] = (0.0, 0.0),
    length_sd: float = 0.0,
    skin_sd: float = 0.0,
) -> xr.Dataset:
    """Posture of a tracked whisker by Eq. 1 fitted to its mean profile, with 95 % intervals.

    Parameters
    ----------
    profile : Dataset
        Tracks of one whisker.
    whisker : Whisker
        Gives its length.
    friction : float or None
        Coefficient of friction; None to estimate it too.
    substrate : ((x, y), (x, y)), optional
        Two points of the substrate's line, in the profile's frame [m].
    excursion : (float, float)
        Mean excursion of the contact by a texture and its standard deviation [m].
    length_sd, skin_sd : float
        Standard deviations of the length and of the skin's place on the shaft [m].

    Returns
    -------
    Dataset
        As :func:`vibrissa.mechanics.inverse.stationary_posture.fit_profile` gives it: ``contact``, ``base_angle``,
        ``base_height``, each with ``_low`` and ``_high``.

    Raises
    ------
    InputError
        If the tracks are of several whiskers or too few nodes.

    Examples
    --------
    >>> import vibrissa as vb
    >>> profile = vb.track(vb.sample_data("movie.mkv"), frame_rate=2000, pixel_size=95e-6, skin=[(50.5, 57)])
    >>> posture = vb.fit_posture(profile, vb.Whisker(length=0.04, cone_angle=1.5e-3))
    >>> print(f"{float(posture.contact):.2f}")
    0.29
    """
    how: dict[str, Any] = {"friction": friction, "substrate": substrate, "excursion": excursion}
    return fit_profile(one_whisker(profile), whisker, **how, length_sd=length_sd, skin_sd=skin_sd)


@names_arguments
def decompose(
    profile: xr.Dataset,
    whisker: Whisker,
    contact: float | Posture,
    *,
    n_modes: int = 3,
    method: Method = "least-squares",
    modes: Modes = "straight",
) -> xr.Dataset:
    """Modal amplitudes of a tracked whisker and their envelopes.

    Parameters
    ----------
    profile : Dataset
        Tracks of one whisker; arc length counts from the skin.
    whisker : Whisker
        Its cone.
    contact : float or Posture
        Position of the contact over L, from the tip of the cone; the posture for curved modes.
    n_modes : int
        Number of modes.
    method : {"least-squares", "paper2014"}
        Least squares on the visible nodes, or the paper's projection of an extrapolated profile.
    modes : str
        Straight (the paper's) or curved modes.

    Returns
    -------
    Dataset
        ``mode_displacement`` over L, ``envelope`` [m] and ``phase`` (mode, time), ``kappa``, ``variance_explained``.
        Where frames were lost there is no envelope.

    Raises
    ------
    InputError
        If the tracks have too few nodes, or curved modes are wanted without a posture.

    Examples
    --------
    >>> import vibrissa as vb
    >>> profile = vb.track(vb.sample_data("movie.mkv"), frame_rate=2000, pixel_size=95e-6, skin=[(50.5, 57)])
    >>> modal = vb.decompose(profile, vb.Whisker(length=0.04, cone_angle=1.5e-3), contact=0.29)
    >>> modal.envelope.dims
    ('mode', 'time')
    """
    from vibrissa.study.movie.backward import modal_amplitudes

    posture = contact if isinstance(contact, Posture) else None
    place = contact.contact if isinstance(contact, Posture) else contact
    curved = None if modes == "straight" else posture
    modal = modal_amplitudes(
        one_whisker(profile), whisker, place, n_modes=n_modes, method=method, modes=modes, posture=curved
    )
    remark(*filter(None, [modal.attrs.get("left_out")]))
    return modal


@names_arguments
def fit_resonances(
    modal: xr.Dataset, motion: Motion | None = None, *, exposure: float = 0.0, guess: Sequence[float] | None = None
) -> xr.Dataset:
    """Resonant frequency and damping of each mode, with 95 % intervals.

    Parameters
    ----------
    modal : Dataset
        From :func:`decompose`, without lost frames.
    motion : Motion, optional
        Prediction over the texture that was scanned, which knows its forcing; without it the forcing is taken for
        white (Eq. 5, the paper's way).
    exposure : float
        Time over which each frame averages [s].
    guess : sequence of float, optional
        Approximate resonances [Hz]; those of the straight cone by default.

    Returns
    -------
    Dataset
        ``resonant_frequency`` [Hz] and ``damping`` (mode), each with ``_low`` and ``_high``; attribute ``forcing``.
        With white forcing over a texture both are biased: here 119 to 123 Hz for 123.1, damping 0.24 for 0.11.

    Raises
    ------
    InputError
        If frames were lost, or the motion is of a posture that changes.

    Examples
    --------
    >>> import vibrissa as vb
    >>> whisker = vb.Whisker(length=0.04, cone_angle=1.5e-3)
    >>> profile = vb.track(vb.sample_data("movie.mkv"), frame_rate=2000, pixel_size=95e-6, skin=[(50.5, 57)])
    >>> found = vb.fit_resonances(vb.decompose(profile, whisker, contact=0.29))
    >>> print(f"{float(found.resonant_frequency[0]):.0f} Hz")
    123 Hz
    """
    if motion is not None and isinstance(motion.prediction, SlowPrediction):
        raise ConflictError("motion", "must be of one posture", "one that changes")
    known = None if motion is None else motion.prediction
    if guess is None:
        if "expected_frequency" not in modal:
            raise MissingError("guess", "must be given", remedy="approximate resonances in Hz")
        start = modal.expected_frequency.to_numpy()
    else:
        start = np.asarray(guess, float)
    assert not isinstance(known, SlowPrediction)
    found = fit_modes(modal, start, prediction=known, exposure=exposure)[0]
    remark(*filter(None, [found.attrs.get("left_out")]))
    return found
