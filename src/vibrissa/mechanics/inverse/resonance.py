"""Resonance and damping of tracked modes, with the texture's forcing known or assumed to be white."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import norm

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, TooFewError
from vibrissa.mechanics.inverse.observation_model import seen_motion
from vibrissa.mechanics.inverse.spectral_line import (
    PARTS,
    Forcing,
    fitted_line,
    labelled_fits,
    moments,
    texture_line,
)
from vibrissa.mechanics.scan.motion import PredictedMotion
from vibrissa.quantities import dataset, require
from vibrissa.signals.even_times import even_rate
from vibrissa.signals.spectra import FEWEST_BINS, Resonance, fit_resonance, lorentzian, power_spectrum

_WIDE = float(norm.ppf(0.975))
BAND = (0.5, 1.6)  # of the resonance: the bins of a fit


def fit_modes(
    modal: xr.Dataset,
    guess: Array,
    *,
    prediction: PredictedMotion | None = None,
    exposure: float = 0.0,
    instants: int = PARTS,
    near: xr.Dataset | None = None,
) -> tuple[xr.Dataset, xr.Dataset]:
    """Resonant frequency and damping of each mode, and the spectra they were fitted to.

    Parameters
    ----------
    modal : Dataset
        ``mode_displacement`` (mode, time) on an even grid, without NaN; ``time``. With the nodes' ``displacement`` the
        model is seen through the same decomposition: :func:`vibrissa.mechanics.inverse.observation_model.seen_motion`.
    guess : (M,) array
        Approximate resonances [Hz].
    prediction : Prediction, optional
        Knows the texture's forcing; without it the forcing is taken for white (Eq. 5, the paper's way).
    exposure : float
        Time over which each sample averages [s].
    instants : int
        Instants of each exposure whose mean represents it; those of a virtual film, if it is one.
    near : Dataset, optional
        ``resonance`` of nearly the same signals, to begin from.

    Returns
    -------
    resonance : Dataset
        ``resonant_frequency``, ``damping`` (mode) and the ends of their 95 % intervals, which hold what the noise of
        the spectrum does; attribute ``forcing``. NaN where a fit found no maximum, or the spectrum has too few bins or
        does not reach; the attribute ``left_out`` then says which and why. What an error of the posture does:
        :func:`widened`.
    spectra : Dataset
        ``frequency``, ``power`` and ``power_fit`` (mode, frequency); ``power_fit`` is NaN outside the fitted band.

    Raises
    ------
    InputError
        If the amplitudes hold NaN or are not evenly sampled.
    """
    require(modal, "mode_displacement", "time")
    time, signal = modal.time.values, modal.mode_displacement.values
    rate = even_rate(time)
    if not np.all(np.isfinite(signal)):
        raise TooFewError(
            "mode_displacement", "must have no NaN to be fitted", remedy="cut it to where it was followed"
        )
    frequency, power = power_spectrum(signal, rate)
    fits: list[Resonance | None] = []
    left_out, drawn = [], np.full(power.shape, np.nan)
    shutter: dict[str, Any] = {"exposure": exposure, "instants": instants}
    seen = None if prediction is None else seen_motion(prediction, modal, moments(time, exposure, instants)[0])
    for i, start in enumerate(guess):
        line = lorentzian if prediction is None else texture_line(prediction, i, time, seen=seen, **shutter)
        if start >= rate / 2:
            left_out.append(folded(i, float(start), rate))
            fits.append(None)
            continue
        try:
            fit = fit_resonance(frequency, power[i], guess=float(start), line=line, band=BAND, start=_begin(near, i))
        except (ConvergenceError, TooFewError) as error:
            left_out.append(f"mode {i + 1}: {error}")
            fits.append(None)
        else:
            fits.append(fit)
            drawn[i] = fitted_line(frequency, fit, line, float(start), BAND)
    forcing: Forcing = "white" if prediction is None else "texture"
    mode = modal.mode.values[: len(fits)]
    spectra = dataset({"forcing": forcing}, mode=mode, frequency=frequency, power=power, power_fit=drawn)
    resonance = labelled_fits(fits, mode, forcing)
    if left_out:
        resonance.attrs["left_out"] = "; ".join(left_out)
    return resonance, spectra


def fittable(frames: int, rate: float, guess: Array) -> bool:
    """Whether a record has enough bins for the fit of a resonance.

    Parameters
    ----------
    frames : int
        Of the record.
    rate : float
        Frame rate [Hz].
    guess : (M,) array
        Approximate resonances [Hz].

    Returns
    -------
    bool
        True if one of them below half the frame rate can be fitted.
    """
    frequency = np.arange(frames // 2 + 1) * (rate / frames)
    low, high = BAND
    bins = [np.sum((frequency >= low * one) & (frequency <= high * one)) for one in guess if one < rate / 2]
    return max(bins, default=0) >= FEWEST_BINS


def folded(mode: int, frequency: float, rate: float) -> str:
    """Why a mode is not fitted whose line is above half the frame rate.

    Parameters
    ----------
    mode : int
        From 0.
    frequency, rate : float
        Of the line, and of the frames [Hz].

    Returns
    -------
    str
        Where it is expected, where it is seen, and what to do.
    """
    seen = abs(frequency - rate * round(frequency / rate))
    place = f"mode {mode + 1} is expected at {frequency:.0f} Hz, above half the frame rate of {rate:g} Hz"
    return f"{place}: it folds to {seen:.0f} Hz; record faster"


def _begin(near: xr.Dataset | None, mode: int) -> tuple[float, float] | None:
    """Frequency [Hz] and ζ of an earlier fit, if there is one."""
    if near is None or not np.isfinite(near.damping.values[mode]):
        return None
    return float(near.resonant_frequency.values[mode]), float(near.damping.values[mode])


def widened(resonance: xr.Dataset, displaced: Sequence[xr.Dataset]) -> xr.Dataset:
    """Intervals that hold what an error of the posture does, too.

    To first order, as independent errors add. A wrong ε mixes the modes, and with θ_b changes the forcing that is
    taken for known.

    Parameters
    ----------
    resonance : Dataset
        Of the posture found.
    displaced : sequence of Datasets
        Fits of the same movie, each with a posture one standard error away, in directions whose errors are independent.

    Returns
    -------
    Dataset
        ``resonance`` with wider intervals; NaN where the fit of a displaced posture failed.
    """
    columns = {}
    for name in ("resonant_frequency", "damping"):
        value = resonance[name].values
        moves = [np.log(one[name].values / value) for one in displaced]
        for end, sign in (("_low", -1), ("_high", 1)):
            own = np.log(resonance[name + end].values / value)
            columns[name + end] = value * np.exp(
                sign * np.sqrt(own**2 + np.sum((_WIDE * np.array(moves)) ** 2, axis=0))
            )
    return resonance.assign({name: (("mode",), values, resonance[name].attrs) for name, values in columns.items()})


def line_r2(spectra: xr.Dataset) -> Array:
    """Share of the variance of each mode's periodogram, over the bins fitted, that lies on its line, (M,).

    The paper's R² of a Lorentzian. A periodogram under random forcing scatters about any line as much as the line is
    high, so a right line keeps it well below 1.

    Parameters
    ----------
    spectra : Dataset
        ``power`` and ``power_fit`` (mode, frequency) of :func:`fit_modes`.

    Returns
    -------
    (M,) array
        R²; NaN without a fit.
    """
    power, line = spectra.power.values, spectra.power_fit.values
    here = np.isfinite(line)
    count = np.where(here.any(axis=1), here.sum(axis=1), np.nan)
    mean = np.where(here, power, 0).sum(axis=1) / count
    left, about = (np.where(here, power - one, 0.0) for one in (line, mean[:, None]))
    return np.asarray(1 - (left**2).sum(axis=1) / np.where(here.any(axis=1), (about**2).sum(axis=1), np.nan))
