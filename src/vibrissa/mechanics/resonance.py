"""Resonance and damping of tracked modes, with the texture's forcing known or taken for white."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.dynamics import Drive, amplitudes
from vibrissa.mechanics.superposition import Prediction
from vibrissa.quantities import dataset, require
from vibrissa.signals.spectra import Line, Resonance, fit_resonance, lorentzian, power_spectrum

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Forcing = Literal["texture", "white"]

PARTS = 5  # instants of one exposure: what is above half the frame rate folds back in the model as in the movie


def texture_line(
    prediction: Prediction, mode: int, time: Array, *, exposure: float = 0.0, instants: int = PARTS
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
        Instants of each exposure whose mean stands for it.

    Returns
    -------
    callable
        frequency → (resonant frequency [Hz], ζ) → power.
    """
    rate = _sampling_rate(time)
    instants = instants if exposure else 1
    t = (time[:, None] + exposure * ((np.arange(instants) + 0.5) / instants - 0.5)).ravel()
    whole = prediction.mode_drive
    drive = Drive(whole.time, whole.coefficients[mode : mode + 1], whole.before[mode : mode + 1])
    steady = drive(t)[0]

    def on(frequency: Array) -> Line:
        def line(resonance: float, zeta: float) -> Array:
            q = amplitudes(t, drive, 2 * np.pi * resonance, zeta, prediction.scan.jump)[0]
            grid, power = power_spectrum((q + steady).reshape(-1, instants).mean(axis=1), rate)
            first = int(np.searchsorted(grid, frequency[0]))
            return power[first : first + len(frequency)]

        return line

    return on


def fit_modes(
    modal: xr.Dataset,
    guess: Array,
    *,
    prediction: Prediction | None = None,
    exposure: float = 0.0,
    instants: int = PARTS,
) -> tuple[xr.Dataset, xr.Dataset]:
    """Resonant frequency and damping of each mode, and the spectra they were fitted to.

    Parameters
    ----------
    modal : Dataset
        ``mode_displacement`` (mode, time) on an even grid, without NaN; ``time``.
    guess : (M,) array
        About where the resonances stand [Hz].
    prediction : Prediction, optional
        Knows the texture's forcing; without it the forcing is taken for white (Eq. 5, the paper's way).
    exposure : float
        Time over which each sample averages [s].
    instants : int
        Instants of each exposure whose mean stands for it; those of a virtual film, if it is one.

    Returns
    -------
    resonance : Dataset
        ``resonant_frequency``, ``damping`` (mode) and the ends of their 95 % intervals; attribute ``forcing``. NaN
        where a fit found no maximum; the attribute ``left_out`` then says which and why.
    spectra : Dataset
        ``frequency``, ``power`` and ``power_fit`` (mode, frequency); ``power_fit`` is NaN outside the fitted band.
    """
    require(modal, "mode_displacement", "time")
    time, signal = modal.time.values, modal.mode_displacement.values
    if not np.all(np.isfinite(signal)):
        raise InputError("mode_displacement", "must have no NaN to be fitted", remedy="cut it to where it was followed")
    frequency, power = power_spectrum(signal, _sampling_rate(time))
    fits: list[Resonance | None] = []
    left_out, drawn = [], np.full(power.shape, np.nan)
    for i, start in enumerate(guess):
        line = (
            lorentzian
            if prediction is None
            else texture_line(prediction, i, time, exposure=exposure, instants=instants)
        )
        try:
            fit = fit_resonance(frequency, power[i], guess=float(start), line=line)
        except ConvergenceError as error:
            left_out.append(f"mode {i + 1}: {error}")
            fits.append(None)
            continue
        band = (frequency >= 0.5 * start) & (frequency <= 1.6 * start)
        drawn[i, band] = fit.gain * line(frequency[band])(fit.frequency, fit.damping) + fit.floor
        fits.append(fit)
    forcing: Forcing = "white" if prediction is None else "texture"
    mode = modal.mode.values[: len(fits)]
    spectra = dataset({"forcing": forcing}, mode=mode, frequency=frequency, power=power, power_fit=drawn)
    resonance = _labelled(fits, mode, forcing)
    if left_out:
        resonance.attrs["left_out"] = "; ".join(left_out)
    return resonance, spectra


def _labelled(fits: list[Resonance | None], mode: Array, forcing: Forcing) -> xr.Dataset:
    names = {"resonant_frequency": "frequency", "damping": "damping"}
    columns: dict[str, Any] = {
        name + end: [getattr(fit, short + end) if fit else np.nan for fit in fits]
        for name, short in names.items()
        for end in ("", "_low", "_high")
    }
    return dataset({"forcing": forcing}, mode=mode, **columns)


def _sampling_rate(time: Array) -> float:
    step = np.diff(time)
    if not np.allclose(step, step.mean(), rtol=1e-6, atol=0):
        raise InputError("time", "must be evenly sampled")
    return float(1 / step.mean())
