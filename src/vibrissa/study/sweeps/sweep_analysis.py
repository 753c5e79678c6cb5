"""One sweep, from its profile to its row of the table and its time series."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import TooFewError
from vibrissa.mechanics.inverse.decomposition import decompose
from vibrissa.mechanics.inverse.profile_fit import mean_course
from vibrissa.mechanics.inverse.resonance import fit_modes, line_r2, widened
from vibrissa.mechanics.inverse.spectral_line import PARTS, moments
from vibrissa.mechanics.inverse.stationary_posture import Line
from vibrissa.mechanics.inverse.substrate_frame import SubstrateFrame
from vibrissa.mechanics.modes.straight import resonances
from vibrissa.mechanics.scan.contact_travel import contact_travel
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.forward.base_signals import fitted_columns
from vibrissa.study.movie.backward import analyse
from vibrissa.study.movie.resting import at_rest, posture_at_rest
from vibrissa.study.store.result_store import SweepRow
from vibrissa.study.sweeps.sweep_table import N_MODES
from vibrissa.study.sweeps.truth import TrueMotion
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import DAMPING, Whisker

if TYPE_CHECKING:
    import xarray as xr

_LITTLE = 0.3  # of a standard error, whose square adds less than a tenth to a variance
_LEAST_SEEN = 0.9  # share of the frames in which a whisker must be followed


@dataclass(frozen=True, kw_only=True)
class SweepFacts:
    """What an experimenter knows of a sweep besides the movie.

    Attributes
    ----------
    whisker : Whisker
        Its geometry, with the nominal E and ρ.
    scan_speed : float
        v [m/s].
    base_height : float
        H [m]; NaN if it was not measured.
    texture : Gaps, optional
        Scanned so that x = 0 meets the contact at time 0; nothing is predicted without it.
    substrate : ((x, y), (x, y)), optional
        Two points of the substrate's line in the image [m].
    contact, base_angle : float, optional
        ε over L and θ_b [rad], both, if they are known and not to be found from the mean profile.
    friction : float
        μ.
    exposure : float
        Time of one exposure [s].
    instants : int
        Instants over which an exposure is averaged.
    """

    whisker: Whisker
    scan_speed: float
    base_height: float = np.nan
    texture: Gaps | None = None
    substrate: Line | None = None
    contact: float | None = None
    base_angle: float | None = None
    friction: float = 0.4
    exposure: float = 0.0
    instants: int = PARTS


def analyse_sweep(profile: xr.Dataset, known: SweepFacts) -> tuple[SweepRow, xr.Dataset]:
    """Posture, modes, resonances and prediction of one sweep.

    The posture is that of Eq. 1 fitted to the mean profile. Over a texture that mean is not the profile on the flat,
    since the contact spends its time off it. Where the texture is known, its mean is removed as
    :func:`vibrissa.study.movie.resting.posture_at_rest` does; otherwise ε is too large by some 0.0015 and θ_b too
    small by some 0.013 rad, which is worth 0.4 % of κ₁ and up to 5 % of ζ.

    The prediction is made from nothing but what was found: that posture, ω of mode 1 (which gives E, the geometry
    being known) and ζ of mode 1, each of the forcing whose line explains more of the spectrum: a tip that wanders by a
    tenth of a millimetre spoils the forcing that is known, and not the white one.

    Parameters
    ----------
    profile : Dataset
        One whisker.
    known : SweepFacts
        What else is known.

    Returns
    -------
    row : dict
        For :func:`vibrissa.study.sweeps.sweep_table.sweep_table`.
    series : Dataset
        ``mode_displacement`` over L and ``envelope`` [m] (mode, time); ``mode_displacement_model`` and
        ``envelope_model`` if there is a prediction, and ``power``, ``power_fit`` (mode, frequency), the fit to it;
        ``trough_start``, ``trough_width`` (trough) of a texture that is known; ``course_along``, ``course_height``
        (course_node), the mean profile, where Eq. 1 was fitted to it.
        The attribute ``not_fitted`` says which modes lack the fit of white forcing, and why.

    Raises
    ------
    InputError
        If the whisker was lost in more than a tenth of the frames, or in the midst of the sweep, or its posture is one
        that the model refuses.
    """
    rest = _at_rest(profile, known)
    row = _posture(rest, known)
    found = analyse(profile, known.whisker, row["contact"], n_modes=N_MODES)
    modal = found["modal"]
    if "left_out" in modal.attrs:
        raise TooFewError("the whisker", "must be followed in every frame", modal.attrs["left_out"])
    row |= {
        "mode_rms": modal.mode_displacement.values.std(axis=1),
        "variance_explained": modal.variance_explained.values,
        **_resonance(found["resonance_white"], found["spectra_white"], "_white"),
    }
    series: dict[str, Any] = {name: modal[name].values for name in ("mode_displacement", "envelope")}
    series |= {} if rest is None else _course(profile, rest)
    if known.texture is not None:
        series |= {"trough_start": known.texture.position, "trough_width": known.texture.width}
        predicted, spectra = _predicted(profile, modal, known, row)
        series |= {name: spectra[name].values for name in ("frequency", "power", "power_fit")}
        row["mode_rms_model"] = predicted.std(axis=1)
        series["mode_displacement_model"] = predicted - predicted.mean(axis=1, keepdims=True)
        series["envelope_model"] = known.whisker.length * analytic_envelope(series["mode_displacement_model"])[0]
    why = {"not_fitted": found["resonance_white"].attrs.get("left_out", "")}  # of white forcing
    return row, dataset(why, mode=modal.mode.values, time=modal.time.values, **series)


def _at_rest(profile: xr.Dataset, known: SweepFacts) -> xr.Dataset | None:
    """Eq. 1 fitted to the mean profile; None where the posture was given."""
    if known.contact is not None and known.base_angle is not None:
        return None
    scan = None if known.texture is None else Scan(speed=known.scan_speed, damping=DAMPING)
    how: dict[str, Any] = {"substrate": known.substrate, "friction": known.friction}
    return posture_at_rest(profile, known.whisker, **how, texture=known.texture, scan=scan)


def _posture(rest: xr.Dataset | None, known: SweepFacts) -> SweepRow:
    """Contact, base angle, their errors and R² of the mean profile."""
    if rest is None:
        return {"contact": known.contact, "base_angle": known.base_angle}
    names = ("contact", "contact_se", "base_angle", "base_angle_se", "posture_correlation", "profile_r2")
    return {name: float(rest[name]) for name in names}


def _course(profile: xr.Dataset, rest: xr.Dataset) -> dict[str, Array]:
    """The mean profile to which Eq. 1 was fitted, along the substrate from the contact found and above it."""
    course = mean_course(at_rest(profile, rest))
    place = course.place.conj() if course.mirrored else course.place
    met = SubstrateFrame(rest.fitted_x.values + 1j * rest.fitted_y.values).from_image(place)
    return {"course_along": met.real, "course_height": met.imag}


def _resonance(fit: xr.Dataset, spectra: xr.Dataset, forcing: str) -> SweepRow:
    """Columns of a fit, and the share of the spectrum's variance on its line."""
    return fitted_columns(fit, forcing) | {f"fit_r2{forcing}": line_r2(spectra)}


def _predicted(profile: xr.Dataset, modal: xr.Dataset, known: SweepFacts, row: SweepRow) -> tuple[Array, xr.Dataset]:
    """Fit with the texture's forcing, into the row; the prediction from what was found, (M, T), and the spectra."""
    nominal, guess = _nominal(known, row["contact"], row["base_angle"]), _guess(known, row["contact"])
    row |= {"jump_count": nominal.allowed_jumps.size, "jumps_allowed": int(nominal.allowed_jumps.sum())}
    row["contact_travel"] = float(np.median(contact_travel(nominal)))
    shutter: dict[str, Any] = {"exposure": known.exposure, "instants": known.instants}
    fit, spectra = fit_modes(modal, guess, prediction=nominal, **shutter)
    displaced = [_refitted(profile, known, *place, guess, fit) for place in _displaced(row)]
    row |= _resonance(widened(fit, displaced), spectra, "")
    better = "" if row["fit_r2"][0] > row["fit_r2_white"][0] else "_white"
    frequency, damping = (float(row[name + better][0]) for name in ("resonant_frequency", "damping"))
    tuned = nominal
    if np.isfinite(frequency) and 0 <= damping < 1:
        stiffness = known.whisker.youngs_modulus * (frequency / guess[0]) ** 2
        whisker = replace(known.whisker, youngs_modulus=stiffness)
        tuned = replace(nominal, whisker=whisker, scan=replace(nominal.scan, damping=damping))
    return exposed_displacement(tuned, modal.time.values, known.exposure, known.instants), spectra


def _nominal(known: SweepFacts, contact: float, base_angle: float) -> Prediction:
    """Prediction of a posture, with the nominal E and the paper's ζ."""
    posture = Posture(contact=contact, base_angle=base_angle, friction=known.friction)
    if known.texture is None:
        raise ValueError("a prediction needs a texture")
    return predict(known.whisker, posture, known.texture, Scan(speed=known.scan_speed, damping=DAMPING))


def _guess(known: SweepFacts, contact: float) -> Array:
    """Approximate resonant frequencies [Hz], (M,)."""
    return np.asarray(resonances(known.whisker, contact, N_MODES).resonant_frequency.values)


def _displaced(row: SweepRow) -> list[tuple[float, float]]:
    """Postures one standard error away, in directions whose errors are independent; none if the posture was given.

    ε and θ_b err together: what is left of θ_b when ε is right is mostly too little to count.
    """
    if "contact_se" not in row:
        return []
    mixed = row["posture_correlation"]
    steps = [(1.0, mixed)] + [(0.0, np.sqrt(1 - mixed**2))] * bool(1 - mixed**2 > _LITTLE**2)
    return [(row["contact"] + a * row["contact_se"], row["base_angle"] + b * row["base_angle_se"]) for a, b in steps]


def _refitted(
    profile: xr.Dataset, known: SweepFacts, contact: float, base_angle: float, guess: Array, near: xr.Dataset
) -> xr.Dataset:
    """Resonances of the same movie with another posture."""
    modal = decompose(profile, known.whisker, contact, n_modes=N_MODES)
    shutter: dict[str, Any] = {"exposure": known.exposure, "instants": known.instants, "near": near}
    return fit_modes(modal, guess, prediction=_nominal(known, contact, base_angle), **shutter)[0]


def exposed_displacement(motion: Prediction | TrueMotion, time: Array, exposure: float, instants: int) -> Array:
    """Displacements of the first modes, averaged over each exposure about these times [s], (M, T).

    Parameters
    ----------
    motion : Prediction or TrueMotion
        Predicted or true.
    time : (T,) array
        Middles of the exposures [s].
    exposure : float
        Length of each [s].
    instants : int
        Over which each is averaged.

    Returns
    -------
    (M, T) array
        Over L.
    """
    t, count = moments(time, exposure, instants)
    return np.asarray(motion.mode_displacement(t)[:N_MODES].reshape(N_MODES, -1, count).mean(axis=2))


def followed_throughout(profile: xr.Dataset) -> None:
    """Refuse a profile of one whisker that was lost in too many frames.

    Parameters
    ----------
    profile : Dataset
        One whisker.

    Raises
    ------
    InputError
        If it was seen in less than 90 % of them.
    """
    seen = float(np.isfinite(profile.x.values).any(axis=1).mean())
    if seen < _LEAST_SEEN:
        raise TooFewError("the whisker", f"must be followed in {_LEAST_SEEN:.0%} of the frames", f"{seen:.0%}")
