"""A signal measured at the base: spectrum with its resonances, and the signal's envelope beside the one predicted."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import add_caption, house_style, key_above, merged, new_figure
from vibrissa.figures.colours import ENVELOPE, FITTED, MEASURED, PREDICTED
from vibrissa.quantities import dataset
from vibrissa.stats import least_p

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 0.6  # [s] of the signal
BINS = 300  # that a spectrum is drawn with
UNITS = {"base_moment": (1e6, "moment [µN m]"), "base_curvature": (1.0, "curvature [1/m]"),
         "transverse_force": (1e3, "force [mN]")}  # fmt: skip


def compute(found: xr.Dataset) -> xr.Dataset:
    """Spectrum, thinned by means over equal ratios of frequency, and the stretch of the signal that is drawn.

    Parameters
    ----------
    found : Dataset
        From :func:`vibrissa.study.forward.base_signals.analyse_signal`.

    Returns
    -------
    Dataset
        ``base_power``, ``base_power_white_fit`` and, with a texture, ``base_power_fit`` on fewer ``frequency``; signal,
        envelope and what the model says of both, about the strongest envelope (``time``); resonances and agreement
        (mode). Attributes ``signal``, ``label``, ``caption``.
    """
    name, time = found.attrs["signal"], found.time.values
    envelope = found[f"{name}_envelope"].values
    middle = time[int(envelope[0].argmax())]
    start = float(np.clip(middle - SHOWN / 2, time[0], max(time[0], time[-1] - SHOWN)))
    excerpt = found.sel(time=slice(start, start + SHOWN))
    spectra = [one for one in ("base_power", "base_power_white_fit", "base_power_fit") if one in found]
    thin = _thinned(found.frequency.values, _highest(found))
    columns: dict[str, Any] = {one: _means(found[one].values, thin) for one in spectra}
    lines = [str(one) for one in found.data_vars if "frequency" not in found[one].dims]
    data = excerpt[lines].drop_vars("frequency", errors="ignore")
    labelled = dataset(mode=found.mode.values, frequency=_means(found.frequency.values, thin), **columns)
    return data.merge(labelled, combine_attrs="override").assign_attrs({**found.attrs, "caption": _caption(found)})


def _forcing(found: xr.Dataset) -> str:
    """End of the columns by the forcing that is known best: the texture's, else white."""
    return "" if "resonant_frequency" in found else "_white"


def _highest(found: xr.Dataset) -> float:
    """Four times the highest resonance [Hz]; without end where none was found."""
    known = found[f"resonant_frequency{_forcing(found)}"].values
    return 4 * float(np.nanmax(known)) if np.isfinite(known).any() else np.inf


def _thinned(frequency: Array, highest: float) -> list[slice]:
    """Runs of bins that are drawn as one, between 5 Hz and some multiple of the highest resonance."""
    edges = np.unique(np.searchsorted(frequency, np.geomspace(5.0, min(highest, frequency[-1]), BINS)))
    return [slice(a, b) for a, b in pairwise(edges.tolist())]


def _means(values: Array, runs: list[slice]) -> Array:
    return np.stack([values[..., run].mean(axis=-1) for run in runs], axis=-1)


def _caption(found: xr.Dataset) -> str:
    words = [_mode_words(found.sel(mode=mode)) for mode in found.mode.values]
    known = "white forcing, Eq. 5: the texture is not known" if _forcing(found) else "the texture's forcing"
    notes = [found.attrs.get(name, "") for name in ("model_damping_note", "clipped_note", "stuck_note")]
    words += [f"{note[:1].upper()}{note[1:]}." for note in notes if note]
    return f"{found.attrs['label']}. Fits by {known}. {' '.join(words)}"


def _mode_words(one: xr.Dataset) -> str:
    end = _forcing(one)
    if not np.isfinite(one[f"resonant_frequency{end}"]):
        return f"Mode {int(one.mode)}: no maximum."
    frequency, damping = (
        _estimate(one, f"resonant_frequency{end}", ".1f", " Hz"),
        _estimate(one, f"damping{end}", ".3f"),
    )
    text = f"Mode {int(one.mode)}: {frequency}, ζ = {damping}"
    if "correlation" in one:
        text += f"; envelope as predicted, ρ = {float(one.correlation):.2f} at {1e3 * float(one.best_lag):.0f} ms"
        if np.isfinite(one.pseudo_p):
            text += (
                f" (p = {float(one.pseudo_p):.2g} against {int(one.pseudo_count)} shuffled textures, whose least p is "
                f"{float(least_p(one.pseudo_count)):.2g}; mean {float(one.chance_mean):.2f})"
            )
    return text + "."


def _estimate(one: xr.Dataset, name: str, form: str, unit: str = "") -> str:
    """An estimate with its interval, if it has one."""
    value, low, high = (float(one[name + end]) for end in ("", "_low", "_high"))
    return f"{value:{form}}{unit}" + (f" ({low:{form}} to {high:{form}})" if np.isfinite(low) else "")


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Spectrum on the left; signal and envelope of the first mode on the right.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(10.5, 4.6, 2, 2, width_ratios=(1, 1.5), sharex="col")
    _draw_spectrum(figure.add_subplot(merged(axes[:, 0])), data)
    name = data.attrs["signal"]
    scale, words = UNITS[name]
    top, below = axes[:, 1]
    signal = scale * (data[name] - np.nanmean(data[name].values))
    top.plot(data.time, signal, color=MEASURED, lw=0.7, label="measured")
    if f"{name}_model" in data:
        late = float(data.best_lag[0])
        model = scale * (data[f"{name}_model"] - np.nanmean(data[f"{name}_model"].values))
        top.plot(data.time + late, model, color=PREDICTED, lw=0.7, label=f"predicted, {1e3 * late:+.0f} ms")
        below.plot(
            data.time + late, scale * data[f"{name}_envelope_model"][0], color=PREDICTED, lw=1, label="predicted"
        )
    below.plot(data.time, scale * data[f"{name}_envelope"][0], color=ENVELOPE, lw=1, label="measured")
    top.set(ylabel=f"{words},\nabout its mean", title="Signal")
    below.set(xlabel="time [s]", ylabel=f"envelope of\n{words}", ylim=(0, None), title="About the first resonance")
    for axis in (top, below):
        key_above(axis)
    top.set_xlim(float(data.time[0]), float(data.time[-1]))
    return add_caption(figure, data)


def _draw_spectrum(axis: Axes, data: xr.Dataset) -> None:
    axis.loglog(data.frequency, data.base_power, color=MEASURED, lw=0.9, label="measured")
    for i in range(data.sizes["mode"]):
        looks = (("base_power_white_fit", FITTED, "-", "white (Eq. 5)"), ("base_power_fit", "k", "--", "texture known"))
        for name, colour, style, label in looks:
            if name in data:
                axis.loglog(data.frequency, data[name][i], style, color=colour, lw=1.2, label=label if i == 0 else None)
    axis.set(xlabel="frequency [Hz]", ylabel="power density over the variance [1/Hz]", title="Spectrum")
    key_above(axis, columns=2)
