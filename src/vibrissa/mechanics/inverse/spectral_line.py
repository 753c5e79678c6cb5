"""Lines that modelled modes have in a periodogram, and the fits drawn and labelled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers
from vibrissa.mechanics.inverse.observation_model import Seen
from vibrissa.mechanics.scan.motion import PredictedMotion
from vibrissa.mechanics.vibration.dynamics import Drive, amplitudes
from vibrissa.quantities import dataset
from vibrissa.signals.even_times import even_rate
from vibrissa.signals.spectra import Line, Resonance, power_spectrum

Forcing = Literal["texture", "white"]
PARTS = 5  # instants of one exposure: what is above half the frame rate folds back in the model as in the movie


def texture_line(
    prediction: PredictedMotion,
    mode: int,
    time: Array,
    *,
    exposure: float = 0.0,
    instants: int = PARTS,
    seen: Seen | None = None,
) -> Callable[[Array], Line]:
    """Line of one mode's displacement q + Q(d) under the forcing of a known texture.

    The model's signal is made anew for each (ω, ζ) and goes through the same shutter, sampling and taper as the
    measured one, so leakage, aliases and finite length are the same on both sides. White forcing (Eq. 5) errs by
    several per cent in ω.

    Parameters
    ----------
    prediction : Prediction
        Texture, posture and scan.
    mode : int
        Index of the mode, from 0.
    time : (T,) array
        Times of the measured samples [s], even.
    exposure : float
        Time over which each sample averages [s].
    instants : int
        Instants of each exposure whose mean represents it.
    seen : Seen, optional
        What a decomposition finds of the prediction at :func:`moments`; the modes themselves by default.

    Returns
    -------
    callable
        frequency → (resonant frequency [Hz], ζ) → power.
    """
    rate = even_rate(time)
    t, instants = moments(time, exposure, instants)
    whole = prediction.mode_drive
    drive = Drive(whole.time, whole.coefficients[mode : mode + 1], whole.before[mode : mode + 1])
    own, beside = (1.0, drive(t)[0]) if seen is None else (seen.own[mode], seen.beside[mode])

    def signal(resonance: float, zeta: float) -> Array:
        q = amplitudes(t, drive, 2 * np.pi * resonance, zeta, prediction.scan.jump)[0]
        return (own * q + beside).reshape(-1, instants).mean(axis=1)

    return line_of(signal, rate)


def line_of(signal: Callable[[float, float], Array], rate: float) -> Callable[[Array], Line]:
    """Line that a modelled signal has in a periodogram.

    Parameters
    ----------
    signal : callable
        (resonant frequency [Hz], ζ) → signal (T,).
    rate : float
        Its sampling rate [Hz].

    Returns
    -------
    callable
        frequency (F,), some neighbouring bins [Hz] → (resonant frequency [Hz], ζ) → power (F,).
    """

    def on(frequency: Array) -> Line:
        def line(resonance: float, zeta: float) -> Array:
            grid, power = power_spectrum(signal(resonance, zeta), rate)
            first = int(np.searchsorted(grid, frequency[0]))
            return power[first : first + len(frequency)]

        return line

    return on


def fitted_line(
    frequency: Array, fit: Resonance | None, line: Callable[[Array], Line], guess: float, band: tuple[float, float]
) -> Array:
    """Power of a fitted line in the bins of its band.

    Parameters
    ----------
    frequency : (F,) array
        Bins [Hz].
    fit : Resonance or None
        The fit, if one was found.
    line : callable
        What was fitted: frequency → (resonant frequency, ζ) → power.
    guess : float
        About where the resonance is [Hz].
    band : (float, float)
        Ends of the band, over the guess.

    Returns
    -------
    (F,) array
        Power; NaN outside the band, and everywhere without a fit.
    """
    out, inside = np.full(len(frequency), np.nan), (frequency >= band[0] * guess) & (frequency <= band[1] * guess)
    if fit is not None:
        out[inside] = fit.gain * line(frequency[inside])(fit.frequency, fit.damping) + fit.floor
    return out


def moments(time: Array, exposure: float, instants: int) -> tuple[Array, int]:
    """Instants of the exposures about these times [s], ascending, and how many there are of each.

    Parameters
    ----------
    time : (T,) array
        Middle of the exposures [s].
    exposure : float
        Length of each [s]; 0 for instants.
    instants : int
        Instants of each exposure.

    Returns
    -------
    t : (T · count,) array
        Times [s].
    count : int
        Instants of each.
    """
    count = instants if exposure else 1
    return (time[:, None] + exposure * ((np.arange(count) + 0.5) / count - 0.5)).ravel(), count


def labelled_fits(fits: list[Resonance | None], mode: Array | Integers, forcing: Forcing) -> xr.Dataset:
    """Frequency and damping of fits with the ends of their intervals, by mode.

    Parameters
    ----------
    fits : list of Resonance or None
        One for each mode; None where no maximum was found.
    mode : (M,) array
        Numbers of the modes.
    forcing : {"texture", "white"}
        What the fits took for the forcing.

    Returns
    -------
    Dataset
        ``resonant_frequency`` [Hz] and ``damping`` (mode), with ``_low`` and ``_high``; NaN without a fit.
    """
    names = {"resonant_frequency": "frequency", "damping": "damping"}
    columns: dict[str, Any] = {
        name + end: [getattr(fit, short + end) if fit else np.nan for fit in fits]
        for name, short in names.items()
        for end in ("", "_low", "_high")
    }
    return dataset({"forcing": forcing}, mode=mode, **columns)
