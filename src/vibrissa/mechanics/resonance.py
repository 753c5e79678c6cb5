"""Resonance and damping of tracked modes, with the texture's forcing known or taken for white."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.dynamics import Drive, amplitudes
from vibrissa.mechanics.motion import Motion
from vibrissa.mechanics.seen import Seen, seen_motion
from vibrissa.quantities import dataset, require
from vibrissa.signals.spectra import Line, Resonance, fit_resonance, lorentzian, power_spectrum

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Forcing = Literal["texture", "white"]

_WIDE = float(norm.ppf(0.975))
PARTS = 5  # instants of one exposure: what is above half the frame rate folds back in the model as in the movie


def texture_line(
    prediction: Motion,
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
        Instants of each exposure whose mean stands for it.
    seen : Seen, optional
        What a decomposition finds of the prediction at :func:`moments`; the modes themselves by default.

    Returns
    -------
    callable
        frequency → (resonant frequency [Hz], ζ) → power.
    """
    rate = _sampling_rate(time)
    t, instants = moments(time, exposure, instants)
    whole = prediction.mode_drive
    drive = Drive(whole.time, whole.coefficients[mode : mode + 1], whole.before[mode : mode + 1])
    own, beside = (1.0, drive(t)[0]) if seen is None else (seen.own[mode], seen.beside[mode])

    def on(frequency: Array) -> Line:
        def line(resonance: float, zeta: float) -> Array:
            q = amplitudes(t, drive, 2 * np.pi * resonance, zeta, prediction.scan.jump)[0]
            grid, power = power_spectrum((own * q + beside).reshape(-1, instants).mean(axis=1), rate)
            first = int(np.searchsorted(grid, frequency[0]))
            return power[first : first + len(frequency)]

        return line

    return on


def moments(time: Array, exposure: float, instants: int) -> tuple[Array, int]:
    """Instants of the exposures about these times [s], ascending, and how many there are of each."""
    count = instants if exposure else 1
    return (time[:, None] + exposure * ((np.arange(count) + 0.5) / count - 0.5)).ravel(), count


def fit_modes(
    modal: xr.Dataset,
    guess: Array,
    *,
    prediction: Motion | None = None,
    exposure: float = 0.0,
    instants: int = PARTS,
    near: xr.Dataset | None = None,
) -> tuple[xr.Dataset, xr.Dataset]:
    """Resonant frequency and damping of each mode, and the spectra they were fitted to.

    Parameters
    ----------
    modal : Dataset
        ``mode_displacement`` (mode, time) on an even grid, without NaN; ``time``. With the nodes' ``displacement`` the
        model is seen through the same decomposition: :func:`vibrissa.mechanics.seen.seen_motion`.
    guess : (M,) array
        About where the resonances stand [Hz].
    prediction : Prediction, optional
        Knows the texture's forcing; without it the forcing is taken for white (Eq. 5, the paper's way).
    exposure : float
        Time over which each sample averages [s].
    instants : int
        Instants of each exposure whose mean stands for it; those of a virtual film, if it is one.
    near : Dataset, optional
        ``resonance`` of nearly the same signals, to begin from.

    Returns
    -------
    resonance : Dataset
        ``resonant_frequency``, ``damping`` (mode) and the ends of their 95 % intervals, which hold what the noise of
        the spectrum does; attribute ``forcing``. NaN where a fit found no maximum or the spectrum does not reach; the
        attribute ``left_out`` then says which and why. What an error of the posture does: :func:`widened`.
    spectra : Dataset
        ``frequency``, ``power`` and ``power_fit`` (mode, frequency); ``power_fit`` is NaN outside the fitted band.
    """
    require(modal, "mode_displacement", "time")
    time, signal = modal.time.values, modal.mode_displacement.values
    rate = _sampling_rate(time)
    if not np.all(np.isfinite(signal)):
        raise InputError("mode_displacement", "must have no NaN to be fitted", remedy="cut it to where it was followed")
    frequency, power = power_spectrum(signal, rate)
    fits: list[Resonance | None] = []
    left_out, drawn = [], np.full(power.shape, np.nan)
    shutter: dict[str, Any] = {"exposure": exposure, "instants": instants}
    seen = None if prediction is None else seen_motion(prediction, modal, moments(time, exposure, instants)[0])
    for i, start in enumerate(guess):
        line = lorentzian if prediction is None else texture_line(prediction, i, time, seen=seen, **shutter)
        try:
            if start >= rate / 2:
                raise ConvergenceError("resonance fit (it stands above half the frame rate)", float(start), 0)
            fit = fit_resonance(frequency, power[i], guess=float(start), line=line, start=_begin(near, i))
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
        ``resonance`` with wider intervals; NaN where a displaced posture told nothing.
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
    """
    power, line = spectra.power.values, spectra.power_fit.values
    here = np.isfinite(line)
    count = np.where(here.any(axis=1), here.sum(axis=1), np.nan)
    mean = np.where(here, power, 0).sum(axis=1) / count
    left, about = (np.where(here, power - one, 0.0) for one in (line, mean[:, None]))
    return np.asarray(1 - (left**2).sum(axis=1) / np.where(here.any(axis=1), (about**2).sum(axis=1), np.nan))


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
