"""Figure 5: spectra of the modes and the resonance lines fitted to them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import FOUND, OTHER, TRUTH, house_style, new_figure
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

SMOOTH = 5.0  # [Hz] half width of the running mean that shows a periodogram


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Smoothed spectra of the tracked modes (and of the true ones), with the fitted lines smoothed alike.

    Parameters
    ----------
    study : mapping
        ``spectra_white``, ``resonance_white``; where the texture is known ``spectra``, ``resonance``, ``spectra_true``.

    Returns
    -------
    Dataset
        ``frequency``; ``power``, ``power_white_fit`` and, where known, ``power_fit``, ``power_true`` (mode, frequency)
        [1/Hz, over L²]; ``resonant_frequency``, ``damping`` of the best fit (mode).
    """
    white = study["spectra_white"]
    best = study["resonance"] if "resonance" in study else study["resonance_white"]
    step = float(white.frequency[1] - white.frequency[0])
    columns = {"power": white.power, "power_white_fit": white.power_fit}
    if "spectra" in study:
        columns |= {"power_fit": study["spectra"].power_fit, "power_true": study["spectra_true"].power}
    smoothed: dict[str, Any] = {
        name: _running_mean(values.values, max(1, round(SMOOTH / step))) for name, values in columns.items()
    }
    return dataset(
        {"forcing": best.attrs["forcing"]},
        mode=white.mode.values,
        frequency=white.frequency.values,
        resonant_frequency=best.resonant_frequency.values,
        damping=best.damping.values,
        **smoothed,
    )


def _running_mean(power: np.ndarray, half: int) -> np.ndarray:
    """Mean over 2·half + 1 bins where all of them are known, else NaN."""
    kernel = np.ones(2 * half + 1) / (2 * half + 1)
    out = np.full(power.shape, np.nan)
    for i, row in enumerate(power):
        out[i, half:-half] = np.convolve(row, kernel, mode="valid")
    return out


@house_style
def draw(data: xr.Dataset) -> Figure:
    """One panel for each mode, on logarithmic axes."""
    n = data.sizes["mode"]
    figure, axes = new_figure(7.8, 3.2, 1, n)
    known = data.attrs["forcing"] == "texture"
    for i, axis in enumerate(axes[0]):
        if known:
            axis.loglog(data.frequency, data.power_true[i], color=TRUTH, lw=3, label="truth")
        axis.loglog(data.frequency, data.power[i], color=FOUND, lw=0.9, label="tracked")
        if known:
            axis.loglog(data.frequency, data.power_fit[i], "k--", lw=1.2, label="fit, texture known")
        axis.loglog(data.frequency, data.power_white_fit[i], color=OTHER, lw=1.2, label="fit, white (Eq. 5)")
        f, zeta = float(data.resonant_frequency[i]), float(data.damping[i])
        axis.axvline(f, color="0.7", lw=0.7, zorder=0)
        axis.set(xlabel="frequency [Hz]", xlim=(10, None), title=f"mode {i + 1}\n{f:.1f} Hz, ζ = {zeta:.3f}")
    axes[0, 0].set_ylabel("power density [L²/Hz]")
    axes[0, 0].legend(loc="lower left")
    return figure
