"""Resonances, envelopes and prediction against measurement of a signal at the base."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.signal import butter, sosfiltfilt

from vibrissa.arrays import Array, Integers
from vibrissa.errors import ConvergenceError, FormatError, MissingError, RangeError, TooFewError
from vibrissa.mechanics.inverse.resonance import BAND
from vibrissa.mechanics.inverse.spectral_line import fitted_line, labelled_fits, line_of
from vibrissa.mechanics.scan.follicle import base_moment, force_unit
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.mechanics.vibration.dynamics import Drive, amplitudes
from vibrissa.quantities import dataset
from vibrissa.signals.correlation import best_correlation
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.signals.spectra import Line, Resonance, fit_resonance, lorentzian, power_spectrum

SIGNALS = ("base_moment", "base_curvature", "transverse_force")
LONGEST_LAG = 0.05  # [s] that the paper allows between prediction and measurement


class Parts(NamedTuple):
    """A signal at the base as a sum: scale × quasi-static row of the drive + weights · q."""

    scale: float
    row: int
    weights: Array


def analyse_base_signal(
    follicle: xr.Dataset, guess: ArrayLike, *, prediction: Prediction | None = None
) -> dict[str, xr.Dataset]:
    """Resonances, damping and envelopes of a base signal, and how a prediction agrees with it.

    Parameters
    ----------
    follicle : Dataset
        From :func:`vibrissa.mechanics.sensor.base_signal.read_base_signal`: ``base_moment``, else ``base_curvature``,
        else ``transverse_force`` is analysed.
    guess : (M,) array
        Approximate resonances [Hz], ascending.
    prediction : Prediction, optional
        Whisker, posture, texture and scan, its time 0 that of the signal to ± 50 ms. It knows the forcing; without
        it, and beside it, the forcing is taken for white (Eq. 5).

    Returns
    -------
    dict of Datasets
        ``resonance_white`` and, with a prediction, ``resonance``: as
        :func:`vibrissa.mechanics.inverse.resonance.fit_modes` gives, each line once: where two guesses lead to one, it
        is that of the nearer, and the other is NaN. With white forcing modes above the first have no interval (NaN):
        the flank of the modes below is fitted as their width. With the prediction, of 60 simulations the intervals of ζ
        hold the truth in 98 % for mode 1, but in 76 % for mode 2: it lies on the flank of the others, its estimate is
        2.6 % low, and its interval is too narrow. ``spectra``: ``base_power`` and the fits. ``envelope``: of each
        mode's band. With a prediction also ``predicted``, the same of the model, and ``agreement``: ``correlation`` of
        the envelopes at the ``best_lag``, and ``rms_ratio``, predicted over measured, (mode).

    Raises
    ------
    InputError
        If there is no signal, or a guess lies too high for the sampling.
    """
    name, signal, time = _signal(follicle)
    rate = (len(time) - 1) / float(time[-1] - time[0])
    at = np.atleast_1d(np.asarray(guess, float))
    if not (np.all(at > 0) and np.all(np.diff(at) > 0)):
        raise RangeError("guess", "must ascend from above 0 (Hz)", at.tolist())
    if not BAND[1] * at[-1] < rate / 2:
        rule = f"must lie below {rate / 2 / BAND[1]:.4g} Hz at {rate:.6g} samples per second"
        raise RangeError("guess", rule, at.tolist(), "leave the mode out, or sample the signal faster")
    mode = np.arange(1, len(at) + 1)
    frequency, power = power_spectrum(signal, rate)
    white = _each_once([_fit(frequency, power, start, lorentzian) for start in at], at)
    spectra: dict[str, Any] = {"base_power": power / signal.var()}
    spectra["base_power_white_fit"] = _drawn(frequency, white, [lorentzian] * len(at), at) / signal.var()
    results = {"resonance_white": _white_fits(white, mode), "envelope": _envelopes(name, signal, time, at)}
    if prediction is not None:
        modelled = predicted_signal(prediction, name, time)
        results["agreement"] = _agreement(signal, modelled, rate, at)
        late = float(results["agreement"].best_lag[0])  # the texture's own spectrum changes with where it is cut
        lines, fits = _informed(prediction, name, time - late, frequency, power, at)
        results["resonance"] = labelled_fits(fits, mode, "texture")
        spectra["base_power_fit"] = _drawn(frequency, fits, lines, at) / signal.var()
        results["predicted"] = _envelopes(name, modelled, time, at)
    return {**results, "spectra": dataset({"signal": name}, mode=mode, frequency=frequency, **spectra)}


def predicted_signal(prediction: Prediction, name: str, time: Array) -> Array:
    """What the model says of a base signal at times [s], (T,), whole: at rest, quasi-static and vibration.

    Parameters
    ----------
    prediction : Prediction
        The model.
    name : str
        One of ``SIGNALS``.
    time : (T,) array
        Times [s].

    Returns
    -------
    (T,) array
        In the unit of the signal.
    """
    scale, row, weights = _parts(prediction, name)
    return scale * prediction.drive(time)[row] + weights @ prediction.amplitudes(time)


def base_line(
    prediction: Prediction, name: str, mode: int, time: Array, omega: Array, damping: Array
) -> Callable[[Array], Line]:
    """Line of one mode in a base signal under the forcing of a known texture.

    All other modes and the quasi-static part stay in the signal: at the base they weigh as much as the mode itself.

    Parameters
    ----------
    prediction : Prediction
        Texture, posture and scan.
    name : str
        The signal, one of ``SIGNALS``.
    mode : int
        Index of the mode, from 0.
    time : (T,) array
        Times of the measured samples [s], even.
    omega, damping : (M,) arrays
        Angular frequency [rad/s] and ζ of all modes of the prediction; those of the mode itself do not matter.

    Returns
    -------
    callable
        frequency → (resonant frequency [Hz], ζ) → power.
    """
    scale, row, weights = _parts(prediction, name)
    rate = (len(time) - 1) / float(time[-1] - time[0])

    def ringing(i: int, resonance: float, zeta: float) -> Array:
        whole = prediction.mode_drive
        drive = Drive(whole.time, whole.coefficients[i : i + 1], whole.before[i : i + 1])
        return weights[i] * amplitudes(time, drive, resonance, zeta, prediction.scan.jump)[0]

    others = [i for i in range(len(omega)) if i != mode]
    rest = scale * prediction.drive(time)[row] + sum(ringing(i, float(omega[i]), float(damping[i])) for i in others)

    return line_of(lambda resonance, zeta: rest + ringing(mode, 2 * np.pi * resonance, zeta), rate)


def _parts(prediction: Prediction, name: str) -> Parts:
    whisker, basis, n = prediction.whisker, prediction.response.basis, len(prediction.kappa)
    if name == "transverse_force":
        return Parts(force_unit(whisker), n + 1, force_unit(whisker) * basis.transverse_force)
    scale = 1 / whisker.length
    if name == "base_moment":
        scale = float(base_moment(whisker, np.array([scale]))[0])
    return Parts(scale, n, scale * basis.base_curvature)


def _signal(follicle: xr.Dataset) -> tuple[str, Array, Array]:
    name = next((one for one in SIGNALS if one in follicle), None)
    if name is None:
        raise MissingError("follicle", f"must hold {', '.join(SIGNALS[:-1])} or {SIGNALS[-1]}")
    signal, time = follicle[name].values, follicle.time.values
    if signal.ndim != 1 or not np.isfinite(signal).all():
        raise FormatError(name, "must be one signal without NaN")
    if np.ptp(signal) == 0:
        raise TooFewError(name, "must not be constant")
    return name, signal, time


def _fit(frequency: Array, power: Array, guess: float, line: Callable[[Array], Line]) -> Resonance | None:
    try:
        return fit_resonance(frequency, power, guess=guess, line=line, band=BAND)
    except ConvergenceError:
        return None


def _informed(
    prediction: Prediction, name: str, time: Array, frequency: Array, power: Array, guess: Array
) -> tuple[list[Callable[[Array], Line]], list[Resonance | None]]:
    """Fit mode by mode upwards, twice: each with the others as they were found, those above as the one below."""
    omega, damping = prediction.omega.copy(), np.full(len(prediction.omega), prediction.scan.damping)
    if len(guess) > len(omega):
        raise RangeError("guess", f"must be of at most {len(omega)} modes, as the prediction has", len(guess))
    omega[: len(guess)] = 2 * np.pi * guess
    for first in (True, False):
        lines: list[Callable[[Array], Line]] = []
        fits: list[Resonance | None] = []
        for i, start in enumerate(guess):
            lines.append(base_line(prediction, name, i, time, omega.copy(), damping.copy()))
            fits.append(_fit(frequency, power, float(start), lines[-1]))
            if (fit := fits[-1]) is not None:
                same = slice(i, None) if first or i == len(guess) - 1 else slice(i, i + 1)
                omega[same] *= 2 * np.pi * fit.frequency / omega[i]
                damping[same] = fit.damping
    return lines, _each_once(fits, guess)


def _each_once(fits: list[Resonance | None], guess: Array) -> list[Resonance | None]:
    """Fits whose lines differ: of two whose intervals overlap, the one that lies nearer to its guess."""
    kept: list[Resonance | None] = [None] * len(fits)
    away = [np.inf if fit is None else abs(np.log(fit.frequency / at)) for fit, at in zip(fits, guess, strict=True)]
    for i in np.argsort(away, kind="stable"):
        fit = fits[i]
        if fit is not None and not any(_overlap(fit, other) for other in kept if other is not None):
            kept[i] = fit
    return kept


def _overlap(one: Resonance, other: Resonance) -> bool:
    return one.frequency_low <= other.frequency_high and other.frequency_low <= one.frequency_high


def _white_fits(fits: list[Resonance | None], mode: Integers) -> xr.Dataset:
    """Fits with white forcing: above the first mode without an interval, which the flank of those below would belie."""
    labelled = labelled_fits(fits, mode, "white")
    ends = [str(name) for name in labelled.data_vars if str(name).endswith(("_low", "_high"))]
    return labelled.assign({name: labelled[name].where(labelled.mode == mode[0], np.nan) for name in ends})


def _drawn(frequency: Array, fits: list[Resonance | None], lines: list[Callable[[Array], Line]], guess: Array) -> Array:
    rows = zip(fits, lines, guess.tolist(), strict=True)
    return np.array([fitted_line(frequency, fit, line, start, BAND) for fit, line, start in rows])


def _in_band(signal: Array, rate: float, guess: float) -> Array:
    """What lies about one resonance; forwards and backwards, so nothing is delayed."""
    filtered = butter(3, [BAND[0] * guess, BAND[1] * guess], "bandpass", fs=rate, output="sos")
    return np.asarray(sosfiltfilt(filtered, signal - signal.mean()), float)


def band_envelopes(signal: Array, rate: float, guess: Array) -> tuple[Array, Array]:
    """Envelope and phase [rad] of what a signal (T,) at ``rate`` [Hz] holds about each resonance [Hz], (M, T) each.

    Parameters
    ----------
    signal : (T,) array
        Evenly sampled, any unit.
    rate : float
        Sampling rate [Hz].
    guess : (M,) array
        Resonances [Hz].

    Returns
    -------
    envelope, phase : (M, T) arrays
        In the unit of the signal, and [rad].
    """
    return analytic_envelope(np.array([_in_band(signal, rate, float(one)) for one in guess]))


def _envelopes(name: str, signal: Array, time: Array, guess: Array) -> xr.Dataset:
    envelope, phase = band_envelopes(signal, (len(time) - 1) / float(time[-1] - time[0]), guess)
    labelled: dict[str, Any] = {name: signal, f"{name}_envelope": envelope, "phase": phase}
    return dataset({"signal": name}, mode=np.arange(1, len(guess) + 1), time=time, **labelled)


def _agreement(signal: Array, modelled: Array, rate: float, guess: Array) -> xr.Dataset:
    lag, correlation, ratio = [], [], []
    for one in guess:
        measured, predicted = (_in_band(values, rate, float(one)) for values in (signal, modelled))
        envelopes = analytic_envelope(np.array([measured, predicted]))[0]
        best, r = best_correlation(envelopes[0], envelopes[1], round(LONGEST_LAG * rate))
        lag.append(best / rate)
        correlation.append(r)
        ratio.append(predicted.std() / measured.std())
    mode = np.arange(1, len(guess) + 1)
    return dataset(mode=mode, correlation=correlation, best_lag=lag, rms_ratio=ratio)
