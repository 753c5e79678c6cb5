"""The panels of a unit's page, each on its axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import say_absent, shown_in, whole_numbers
from vibrissa.figures.colours import ENVELOPE, FITTED, OF_QUALITY, SINGLE, TRUTH

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

MANY = 3000  # spikes: more are drawn as pixels


def ink(data: xr.Dataset) -> str:
    """Colour of the firing of a unit.

    Parameters
    ----------
    data : Dataset
        From :func:`vibrissa.figures.spikes.unit_page.compute`.

    Returns
    -------
    str
        That of multi-units where the unit is one, else that of single units.
    """
    return OF_QUALITY.get(str(data.unit_quality.values) if "unit_quality" in data else "", SINGLE)


def times(axes: Sequence[Axes], data: xr.Dataset) -> None:
    """Spikes of each trial, mean rate with the fit, envelope.

    Parameters
    ----------
    axes : (3,) sequence of Axes
        That share their time.
    data : Dataset
        From :func:`vibrissa.figures.spikes.unit_page.compute`.
    """
    raster, rate, envelope = axes
    width = data.attrs["bin_width"]
    edges, centres = [*data.bin.values, data.bin.values[-1] + width], data.bin.values + width / 2
    many, trials = data.sizes["spike"] > MANY, int(data.attrs["n_trials"])
    size: dict[str, Any] = {"ms": max(1.0, min(8.0, 90 / trials)), "mew": 0.5 if many else 0.6}
    raster.plot(data.spike_time, data.spike_trial, "|", color=ink(data), rasterized=many, **size)
    raster.set(ylabel="trial", ylim=(trials - 0.5, -0.5), title="A  Spikes", xlim=(edges[0], edges[-1]))
    whole_numbers(raster.yaxis)
    rate.stairs(data.firing_rate, edges, color=ink(data), lw=0.8)
    if np.isfinite(data.predicted_rate.values).any():
        rate.plot(centres, data.predicted_rate, color=FITTED, lw=0.9)
    rate.set(ylabel="rate [Hz]", ylim=(0, None), title="B  Mean rate over trials")
    factor, unit = shown_in(str(data.bin_envelope.attrs["units"]))
    envelope.plot(centres, factor * data.bin_envelope, color=ENVELOPE)
    envelope.set(xlabel="time from the onset [s]", ylabel=f"envelope [{unit}]", title="C  Envelope of the stimulus")
    for axis in (raster, rate):
        axis.tick_params(labelbottom=False)


def curve(axis: Axes, data: xr.Dataset) -> None:
    """Mean rate in classes of the envelope, and the fit.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.spikes.unit_page.compute`.
    """
    axis.set_title("D  Rate against envelope")
    if not np.isfinite(data.response_rate.values).any():
        say_absent(axis, "the unit was observed in no trial")
        return
    factor, _ = shown_in(str(data.response_envelope.attrs["units"]))
    at = factor * data.response_envelope
    axis.errorbar(at, data.response_rate, _errors(data), fmt="s", ms=4, color=ink(data), capsize=2)
    if np.isfinite(data.response_rate_fitted.values).any():
        axis.plot(at, data.response_rate_fitted, color=FITTED)
    axis.set(ylabel="rate [Hz]", ylim=(0, None))
    axis.tick_params(labelbottom=False)


def residuals(axis: Axes, data: xr.Dataset) -> None:
    """What the fit leaves of the rate in each class.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.spikes.unit_page.compute`.
    """
    factor, unit = shown_in(str(data.response_envelope.attrs["units"]))
    axis.set(xlabel=f"envelope [{unit}]", ylabel="rate − fit [Hz]")
    left = data.response_rate - data.response_rate_fitted
    if not np.isfinite(left.values).any():
        axis.tick_params(left=False, labelleft=False)
        axis.set(ylabel="", title="no fit: see the caption")
        axis.spines["left"].set_visible(False)
        return
    axis.axhline(0, color=FITTED, lw=0.8)
    axis.errorbar(factor * data.response_envelope, left, _errors(data), fmt="s", ms=4, color=ink(data), capsize=2)


def _errors(data: xr.Dataset) -> Any:
    """Standard errors; none of one trial."""
    error = data.response_rate_se.values
    return error if np.isfinite(error).all() else None


def correlogram(axis: Axes, data: xr.Dataset) -> None:
    """Correlation of rate and envelope at each lag, and what chance gives.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.spikes.unit_page.compute`.
    """
    axis.set_title("E  Rate and envelope")
    if not np.isfinite(data.correlogram.values).any():
        say_absent(axis, "no correlation: the rate is constant")
        return
    attrs, lag = data.attrs, 1e3 * data.correlogram_lag.values
    if np.isfinite(attrs["chance_low"]):
        axis.axhspan(attrs["chance_low"], attrs["chance_high"], color=TRUTH, alpha=0.5, lw=0)
        axis.axhline(attrs["chance_level"], color="0.4", ls="--", lw=0.9)
    axis.axvline(0, color=TRUTH, lw=0.8)
    axis.plot(lag, data.correlogram, color="0.5")
    low, high = (1e3 * attrs[name] * attrs["bin_width"] for name in ("lag_low", "lag_high"))
    tested = (lag >= low - 1e-6) & (lag <= high + 1e-6)
    axis.plot(lag[tested], data.correlogram.values[tested], "o", ms=3, color="k")
    axis.set(xlabel="lag of the rate [ms]", ylabel="correlation", xlim=(lag[0], lag[-1]))


def own_lags(axis: Axes, data: xr.Dataset) -> None:
    """Rate of the unit after its own spikes.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.spikes.unit_page.compute`.
    """
    axis.set_title("F  Autocorrelogram")
    if not np.isfinite(data.autocorrelogram.values).any():
        binned = "counted_bin" in data.attrs
        say_absent(axis, "no times of spikes: the file has counts in bins" if binned else "no spike")
        return
    lag = 1e3 * data.after_spike.values
    axis.stairs(data.autocorrelogram, [*lag, lag[-1] + lag[1] - lag[0]], color=ink(data), fill=True, alpha=0.6)
    axis.axhline(float(data.unit_rate), color=ink(data), ls=":", lw=0.9)
    axis.set(xlabel="time after a spike [ms]", ylabel="rate [Hz]", xlim=(0, 2 * lag[-1] - lag[-2]), ylim=(0, None))


def waveform(axis: Axes, data: xr.Dataset) -> None:
    """Mean waveform of the unit, where the file has one.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.spikes.unit_page.compute`.
    """
    axis.set_title("G  Mean waveform")
    if "unit_waveform" not in data or not np.isfinite(data.unit_waveform.values).any():
        say_absent(axis, "no waveform in the file")
        return
    sample = np.arange(data.sizes["sample"])
    rate = data.attrs.get("sampling_rate")
    time, label = (sample, "sample") if rate is None else (1e3 * sample / float(rate), "time [ms]")
    axis.axhline(0, color=TRUTH, lw=0.8)
    axis.plot(time, 1e6 * data.unit_waveform, color=ink(data))
    axis.set(xlabel=label, ylabel="voltage [µV]")
