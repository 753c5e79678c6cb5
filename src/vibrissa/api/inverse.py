"""Backward from tracks: posture, modal amplitudes, resonance and damping."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.api.motion import Motion
from vibrissa.api.remarks import remark_left_out
from vibrissa.api.shared.arguments import names_arguments
from vibrissa.errors import ConflictError, FormatError, MissingError, ShapeError
from vibrissa.mechanics.free_end.free_end_prediction import FreeEndPrediction
from vibrissa.mechanics.inverse.decomposition import Method
from vibrissa.mechanics.inverse.resonance import fit_modes
from vibrissa.mechanics.inverse.stationary_posture import Line, fit_profile
from vibrissa.mechanics.modes.basis import Modes
from vibrissa.mechanics.rod.rod_prediction import RodPrediction
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.slow_prediction import SlowPrediction
from vibrissa.mechanics.whisking.swing_prediction import SwingPrediction
from vibrissa.quantities import one_whisker
from vibrissa.quantities.schema import conforming
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr


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
    remark_left_out(modal)
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
    if motion is not None and not isinstance(motion, Motion):
        raise FormatError(
            "motion", "must be of vb.scan", f"a {type(motion).__name__}", "approximate resonances: guess="
        )
    if motion is not None and isinstance(motion.prediction, SlowPrediction | SwingPrediction):
        raise ConflictError("motion", "must be of one posture", "one that changes")
    if motion is not None and isinstance(motion.prediction, RodPrediction | FreeEndPrediction):
        raise ConflictError("motion", "must be predicted by modes", "the whole whisker", "vb.scan without model")
    known = None if motion is None else motion.prediction
    if guess is None:
        if "expected_frequency" not in modal:
            raise MissingError("guess", "must be given", remedy="approximate resonances in Hz")
        start = modal.expected_frequency.to_numpy()
    else:
        start = np.asarray(guess, float)
        if start.size != modal.sizes["mode"]:
            raise ShapeError("guess", f"must be {modal.sizes['mode']} frequencies, one for each mode", start.size)
    assert not isinstance(known, SlowPrediction | RodPrediction | SwingPrediction | FreeEndPrediction)
    found = fit_modes(conforming(modal), start, prediction=known, exposure=exposure)[0]
    remark_left_out(found)
    return found
