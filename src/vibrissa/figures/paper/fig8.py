"""Figure 8: one unit's firing rate beside the envelope that drives it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.figures.canvas import FOUND, OTHER, TRUTH, add_caption, house_style, merged, new_figure
from vibrissa.neural.coupling.nulls import Circular, Record, circular_correlogram
from vibrissa.quantities import dataset
from vibrissa.signals.correlation import best_correlation, lagged_correlation

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

REACH, GUARD = 0.2, 0.06  # [s] lags shown, at most; shifts left out about 0, where the envelope is like itself
FEWEST_BINS = 60  # below these chance is not estimated
LEVELS = 12  # classes of the envelope, equally full
HINGE = ("threshold", "slope", "latency", "baseline")


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Raster, firing rate, envelope, their correlation at all lags and by chance, and rate against envelope.

    Parameters
    ----------
    study : mapping
        ``spikes`` and ``response``. Where there are any, ``motion`` (``time``, ``point_displacement``) is drawn under
        its envelope, and the hinge of ``unit``, one row of :func:`vibrissa.neural.coupling.analysis.analyse_units`,
        through the classes; if it is not identified, the caption says so. An attribute ``note`` of the response ends
        the caption.

    Returns
    -------
    Dataset
        ``response`` with ``spike_time``, ``spike_trial``; ``correlogram``; mean rate and its standard error in classes
        of the envelope, at the best lag. Attributes ``correlation``, ``lag`` [bins], ``chance``: what the largest
        correlation within one bin exceeds in 1 % of all circular shifts.
    """
    response, spikes = study["response"], study["spikes"]
    rate, envelope, width = response.firing_rate.values, response.bin_envelope.values, response.attrs["bin_width"]
    lag, r = best_correlation(rate, envelope, 1)
    lags, correlogram, chance = _correlogram(rate, envelope, width)
    origin = str(spikes.attrs.get("source", "simulated"))
    attrs = {**response.attrs, "correlation": float(r), "lag": int(lag), "chance": chance, "origin": origin}
    attrs |= _hinge(study["unit"]) if "unit" in study else {}
    moved: dict[str, Any] = {}
    if "point_displacement" in study.get("motion", ()):
        moved = {name: study["motion"][name].values for name in ("time", "point_displacement")}
    levels: dict[str, Any] = _levels(*_pairs(envelope, rate, int(lag)))
    data = dataset(
        attrs,
        bin=response.bin.values,
        firing_rate=rate,
        bin_envelope=envelope,
        spike_time=spikes.spike_time.values,
        spike_trial=spikes.spike_trial.values,
        correlogram_lag=lags,
        correlogram=correlogram,
        **levels,
        **moved,
    )
    return data.assign_attrs(caption=_caption(data) + str(study["response"].attrs.get("note", "")))


def _hinge(unit: xr.Dataset) -> dict[str, Any]:
    """The fitted hinge, as attributes; of the paper's fit, which has no intervals, as it was found."""
    known = bool(unit.get("identified", True)) or unit.attrs.get("fit") == "paper2014"
    return {name: float(unit[name]) for name in HINGE} if known else {"not_identified": "threshold"}


def _correlogram(rate: Array, envelope: Array, width: float) -> tuple[Array, Array, float]:
    """Lags [s], correlation at each, and the 99th percentile of the largest of three lags under circular shifts."""
    n = len(rate)
    lags, correlogram = lagged_correlation(rate, envelope, min(round(REACH / width), max(1, n // 4)))
    chance = np.array([np.nan])
    if n >= FEWEST_BINS and np.isfinite(correlogram).all():
        record = Record.whole(rate, envelope)
        around = circular_correlogram(record.rates, record.rate_valid, envelope, record.envelope_valid)[0]
        chance = Circular(guard=max(1, round(GUARD / width))).values(record, 0, around, (-1, 1))
    return np.asarray(lags * width, float), correlogram, float(np.quantile(chance, 0.99))


def _pairs(envelope: Array, rate: Array, lag: int) -> tuple[Array, Array]:
    """Envelope and the rate that follows it by a lag [bins], where both are there."""
    n = len(rate)
    return envelope[max(-lag, 0) : n - max(lag, 0)], rate[max(lag, 0) : n + min(lag, 0)]


def _levels(envelope: Array, rate: Array) -> dict[str, Array]:
    """Means over classes of the envelope that hold equally many bins."""
    classes = np.array_split(np.argsort(envelope), min(LEVELS, len(rate) // 3))
    return {
        "level_envelope": np.array([envelope[one].mean() for one in classes]),
        "level_rate": np.array([rate[one].mean() for one in classes]),
        "level_rate_se": np.array([rate[one].std(ddof=1) / np.sqrt(one.size) for one in classes]),
    }


def _caption(data: xr.Dataset) -> str:
    attrs = data.attrs
    unit = "simulated unit" if attrs["origin"] == "simulated" else f"unit of {attrs['origin']}"
    hinge = ""
    if "threshold" in attrs:
        hinge = (
            f" Orange, hinge seen through the bins: threshold {1e6 * attrs['threshold']:.1f} µm, slope "
            f"{1e-6 * attrs['slope']:.2f} AP/s/µm, latency {1e3 * attrs['latency']:.1f} ms; means over classes lie off "
            "it where the envelope changes within a bin."
        )
    elif "not_identified" in attrs:
        hinge = " Threshold: not identified."
    chance = (
        "dashed, what the largest of the three lags about 0 exceeds in 1 % of all circular shifts of the envelope. The "
        "paper's null, shuffled bins, is narrower and lets more than 1 % of units pass that answer something else."
        if np.isfinite(attrs["chance"])
        else "too few bins to estimate chance."
    )
    return (
        f"One {unit}, {attrs['n_trials']} presentations, bins of "
        f"{1e3 * attrs['bin_width']:.0f} ms. D: rate against the envelope {attrs['lag']} bin(s) before; dots, bins; "
        f"squares, mean ± standard error of {data.sizes['level']} equally full classes.{hinge} E: correlation at every "
        f"lag (positive: the rate is late); {chance}"
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Raster, rate and envelope over time; on the right, rate against envelope and the correlogram.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(9.6, 5.6, 3, 2, width_ratios=[2.2, 1])
    right = merged(axes[:, 1]).subgridspec(2, 1)
    for axis in axes[1:, 0]:
        axis.sharex(axes[0, 0])
    _draw_times(axes[:, 0], data)
    _draw_levels(figure.add_subplot(right[0]), data)
    _draw_correlogram(figure.add_subplot(right[1]), data)
    return add_caption(figure, data)


def _draw_times(axes: NDArray[Any], data: xr.Dataset) -> None:
    raster, rate, envelope = axes
    centre = data.bin + data.attrs["bin_width"] / 2
    many = data.sizes["spike"] > 5000
    size = {"ms": 0.6 if many else 1.5, "mew": 0.3 if many else 0.5}
    raster.plot(data.spike_time, data.spike_trial, "," if many else "|", color="0.2", rasterized=True, **size)
    raster.set(ylabel="trial", title="A  One unit" + (", simulated" if data.attrs["origin"] == "simulated" else ""))
    rate.stairs(data.firing_rate, [*data.bin.values, data.bin.values[-1] + data.attrs["bin_width"]], color=OTHER)
    rate.set(ylabel="rate [Hz]", ylim=(0, None), title="B  Firing rate, mean over trials")
    if "point_displacement" in data:
        envelope.plot(data.time, 1e6 * data.point_displacement, color=TRUTH, lw=0.4, label="displacement")
    envelope.plot(centre, 1e6 * data.bin_envelope, color=FOUND, label="envelope")
    envelope.set(xlabel="time [s]", ylabel="[µm]", title="C  Envelope near the whisker's base")
    if "point_displacement" in data:
        envelope.legend(loc="upper right", ncols=2)
    for axis in (raster, rate):
        axis.tick_params(labelbottom=False)


def _draw_levels(axis: Axes, data: xr.Dataset) -> None:
    """Rate against envelope, as bins, as classes, and as the hinge that was fitted."""
    before, after = _pairs(data.bin_envelope.values, data.firing_rate.values, int(data.attrs["lag"]))
    axis.plot(1e6 * before, after, "o", ms=2, color="0.6", alpha=0.5, mew=0)
    axis.errorbar(1e6 * data.level_envelope, data.level_rate, data.level_rate_se, fmt="s", ms=4, color=FOUND, capsize=2)
    if "threshold" in data.attrs:
        corner, slope, baseline = (data.attrs[name] for name in ("threshold", "slope", "baseline"))
        last = float(np.nanmax(data.bin_envelope.values))
        axis.plot([0, 1e6 * corner, 1e6 * last], [baseline, baseline, baseline + slope * (last - corner)], color=OTHER)
    if "not_identified" in data.attrs:
        axis.text(0.03, 0.97, "threshold not identified", transform=axis.transAxes, va="top", color=OTHER)
    axis.set(xlabel="envelope [µm]", ylabel="firing rate [Hz]", xlim=(0, None), ylim=(0, None))
    axis.set_title("D  Rate against envelope")


def _draw_correlogram(axis: Axes, data: xr.Dataset) -> None:
    """Correlation at each lag, and the level of chance."""
    shift = 1e3 * data.attrs["lag"] * data.attrs["bin_width"]
    axis.axvline(0, color=TRUTH, lw=0.8)
    axis.plot(1e3 * data.correlogram_lag, data.correlogram, "-o", ms=2.5, color=FOUND)
    if data.attrs["chance"] > -1:
        axis.axhline(data.attrs["chance"], color=OTHER, ls="--", label=f"1 % by chance: {data.attrs['chance']:.2f}")
        axis.legend(loc="upper right")
        axis.set_ylim(None, 1.25 * max(float(np.nanmax(data.correlogram.values)), data.attrs["chance"]))
    axis.set(xlabel="lag of the rate [ms]", ylabel="correlation")
    axis.set_title(f"E  r = {data.attrs['correlation']:.3f} at {shift:.0f} ms")
