"""Figure 8: one unit's firing rate beside the envelope that drives it, and four units side by side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import add_caption, counted, house_style, key_above, new_figure, shown_in, split
from vibrissa.figures.colours import ENVELOPE, FITTED, MEASURED, OF_QUALITY, SINGLE
from vibrissa.figures.paper.parts.fig8_measures import correlogram, largest, levels, pairs
from vibrissa.figures.paper.parts.texture_strip import draw_passing
from vibrissa.neural.io.tables.stimuli import NAMES, in_unit_of, presented
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ZOOM = 0.4  # [s] about the largest envelope
TOGETHER = 2.0  # [s] of B and C
HINGE = ("threshold", "slope", "latency", "baseline")


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Raster, firing rate, envelope, their correlation at all lags and by chance, and rate against envelope.

    Parameters
    ----------
    study : mapping
        ``spikes`` and ``response``, whose envelope may be in any unit. Where there are any, the stimulus ``motion`` (as
        in :func:`vibrissa.neural.io.tables.stimuli.presented`), or else the ``prediction`` that drove the unit, is
        drawn under its envelope, and with the latter the texture of ``apparatus``; ``unit_examples`` are other units,
        side by side; and the hinge of ``unit``, one row of :func:`vibrissa.neural.coupling.analysis.analyse_units`,
        goes through the classes; the caption says so if it is not identified, and ends in the response's attribute
        ``note``.

    Returns
    -------
    Dataset
        ``response`` with ``spike_time``, ``spike_trial``; ``correlogram``; mean rate and its standard error in classes
        of the envelope, at the best lag; ``scaled_envelope`` and ``together_scaled``, A times the factor that comes
        nearest to the rate; ``shown_stimulus`` [``shown_unit``]. Attributes ``correlation``, ``lag`` [bins], ``zoom``
        [s], ``shown_unit``, ``shown_factor`` (of the stimulus), ``chance``: what the largest correlation at the lags
        tested exceeds in 1 % of all circular shifts. The lags tested are those of the response (``lag_low``,
        ``lag_high``), or ±1 bin as in the paper.
    """
    response, spikes = study["response"], study["spikes"]
    rate, envelope, width = response.firing_rate.values, response.bin_envelope.values, response.attrs["bin_width"]
    tested = int(response.attrs.get("lag_low", -1)), int(response.attrs.get("lag_high", 1))
    lag, r = largest(rate, envelope, tested)
    lags, at_lags, chance = correlogram(rate, envelope, width, tested)
    origin = str(spikes.attrs.get("source", "simulated"))
    factor, unit = shown_in(str(response.bin_envelope.attrs.get("units", "m")))
    attrs = {**response.attrs, "correlation": r, "lag": lag, "chance": chance, "lags_tested": tested, "origin": origin}
    attrs |= {"shown_factor": factor, "shown_unit": unit}
    attrs |= _hinge(study["unit"]) if "unit" in study else {}
    moved, about = _stimulus(study, factor)
    together, of_others = _side_by_side(study.get("unit_examples"))
    attrs |= about | of_others | {"zoom": _zoom(response.bin.values, envelope)}
    classes: dict[str, Any] = levels(*pairs(envelope, rate, lag))
    data = dataset(
        attrs,
        bin=response.bin.values,
        firing_rate=rate,
        bin_envelope=envelope,
        scaled_envelope=_scaled(envelope, rate),
        spike_time=spikes.spike_time.values,
        spike_trial=spikes.spike_trial.values,
        correlogram_lag=lags,
        correlogram=at_lags,
        **classes,
        **moved,
        **together,
    )
    data = in_unit_of(data, study["motion"]) if "motion" in study else data
    return data.assign_attrs(caption=_caption(data) + str(study["response"].attrs.get("note", "")))


def _stimulus(study: Mapping[str, xr.Dataset], factor: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """What was presented, or the motion that drove a simulated unit while a texture passed."""
    name = next((name for name in ("motion", "prediction") if any(one in study.get(name, ()) for one in NAMES)), "")
    if not name:
        return {}, {}
    time, values, *_ = presented(study[name])
    moved = {"time": time, "shown_stimulus": factor * values}
    if name == "motion" or "apparatus" not in study:
        return moved, {}
    passed = study["apparatus"]
    texture = {column: passed[column].values for column in ("trough_start", "trough_width")}
    return moved | texture, {"speed": passed.attrs["speed"], "stimulus": "computed with the one-contact model"}


def _zoom(bins: Array, envelope: Array) -> Array:
    """Start and end of the part about the largest envelope [s]."""
    middle = bins[int(np.nanargmax(envelope))] if np.isfinite(envelope).any() else bins[0]
    start = max(float(bins[0]), min(float(middle) - ZOOM / 2, float(bins[-1]) - ZOOM))
    return np.array([start, min(start + ZOOM, float(bins[-1]))])


def _scaled(envelope: Array, rate: Array) -> Array:
    """The envelope times the factor that makes it come nearest to the rate."""
    known = np.isfinite(envelope) & np.isfinite(rate)
    square = float(envelope[known] @ envelope[known])
    return np.asarray(envelope * (float(envelope[known] @ rate[known]) / square if square > 0 else 1.0))


def _side_by_side(examples: xr.Dataset | None) -> tuple[dict[str, Any], dict[str, Any]]:
    """Rates of a few units, and each one's envelope scaled to it."""
    if examples is None or examples.sizes.get("example_unit", 0) < 2:
        return {}, {}
    shown = examples.bin.values - examples.bin.values[0] <= TOGETHER
    rate, envelope = examples.example_rate.values, examples.example_bin_envelope.values
    columns = {
        "example_unit": examples.example_unit.values,
        "example_bin": examples.bin.values[shown],
        "together_rate": rate[:, shown],
        "together_scaled": np.array([_scaled(*pair) for pair in zip(envelope, rate, strict=True)])[:, shown],
        "example_quality": examples.example_quality.values,
    }
    sessions = len(set(examples.example_session.values.tolist()))
    return columns, {"example_trials": examples.attrs["n_trials"], "example_sessions": sessions,
                     "example_bin_width": examples.attrs["bin_width"]}  # fmt: skip


def _hinge(unit: xr.Dataset) -> dict[str, Any]:
    """The threshold-linear fit, as attributes; of the paper's fit, which has no intervals, as it was found."""
    known = bool(unit.get("identified", True)) or unit.attrs.get("fit") == "paper2014"
    return {name: float(unit[name]) for name in HINGE} if known else {"not_identified": "threshold"}


def _caption(data: xr.Dataset) -> str:
    attrs, factor, unit = data.attrs, data.attrs["shown_factor"], data.attrs["shown_unit"]
    neuron = "simulated unit" if attrs["origin"] == "simulated" else f"unit of {attrs['origin']}"
    hinge = ""
    if "threshold" in attrs:
        hinge = (
            " Orange, the fitted threshold-linear curve, seen through the bins: threshold "
            f"{factor * attrs['threshold']:.3g} {unit}, slope {attrs['slope'] / factor:.3g} AP/s/{unit}, latency "
            f"{1e3 * attrs['latency']:.1f} ms; means over classes lie off it where the envelope changes within a bin."
        )
    elif "not_identified" in attrs:
        hinge = " Threshold: not identified."
    low, high = (1e3 * attrs["bin_width"] * lag for lag in attrs["lags_tested"])
    chance = (
        f"dashed, {attrs['chance']:.2f}: what the largest of the lags tested ({low:g} to {high:g} ms) exceeds in 1 % "
        "of all circular shifts of the envelope. The paper's null, shuffled bins, is narrower: of units that do not "
        "follow the envelope more than 1 % exceed it."
        if np.isfinite(attrs["chance"])
        else "too few bins to estimate chance."
    )
    return (
        f"Figure 8. One {neuron}, {counted(attrs['n_trials'], 'presentation')}, bins of "
        f"{1e3 * attrs['bin_width']:.0f} ms{_stimulus_words(data)}. A, from top to bottom: spikes, firing rate, "
        "stimulus and its envelope A (black; the mean in each bin, so below the peaks); right: the shaded part"
        f"{_texture_words(data)}. B, firing rate and A, scaled to it. {_together_words(data)} Not in the paper: D, "
        f"rate against the envelope {counted(attrs['lag'], 'bin')} before; dots, bins; squares, mean ± SEM of "
        f"{data.sizes['level']} equally full classes.{hinge} E, correlation at every lag (positive: the rate is late); "
        f"{chance}"
    )


def _stimulus_words(data: xr.Dataset) -> str:
    """Where the stimulus is from, and how large it is."""
    if "stimulus" not in data.attrs:
        return ""
    text = f"; stimulus: motion {data.attrs['stimulus']}, A up to {1e6 * float(np.nanmax(data.bin_envelope)):.0f} µm"
    return text + "; that of C and of Figure 9 is scaled to larger motion" * ("together_rate" in data)


def _texture_words(data: xr.Dataset) -> str:
    if "trough_start" in data:
        return ", with the texture as it passes (pale: gaps)"
    return "; the texture behind the stimulus is not in these results"


def _together_words(data: xr.Dataset) -> str:
    """C: which units, and whether they were recorded together."""
    if "together_rate" not in data:
        return "C, several units: none is given beside this one."
    quality = data.example_quality.values.astype(str)
    kinds = " and ".join(f"{(quality == one).sum()} {one or 'unsorted'}" for one in dict.fromkeys(quality.tolist()))
    together = "of one session" if data.attrs["example_sessions"] == 1 else "of several sessions"
    return (
        f"C, {kinds} {together} ({data.attrs['example_trials']} presentations), and the envelope at each one's whisker "
        "(black), scaled to the rate."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """A whole and close up; B; C, where there are several units; D and E on the right.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    together, rows = "together_rate" in data, [1.2, 1, 1, *([0.22] * ("trough_start" in data))]
    figure, axes = new_figure(9.0, 9.6 if together else 7.2, 3, 1, height_ratios=[2.5, 1, 3.4 if together else 1.5])
    whole, close = split(figure, axes[0, 0], widths=[1.7, 1])
    name = "A  One unit" + (", simulated" if data.attrs["origin"] == "simulated" else "")
    ends = float(data.bin[0]), float(data.bin[-1]) + data.attrs["bin_width"]
    zoom = tuple(data.attrs["zoom"])
    left = split(figure, whole, heights=rows)
    _draw_times(left, data, ends, name)
    for axis in left[:3]:
        axis.axvspan(*zoom, color="0.92", lw=0, zorder=0)
    _draw_times(split(figure, close, heights=rows), data, zoom, "A  The shaded part")
    _draw_overlay(axes[1, 0], data)
    if together:
        others, right = split(figure, axes[2, 0], widths=[1.7, 1])
        against, lags = split(figure, right, heights=[1, 1])
        _draw_together(figure, others, data)
    else:
        against, lags = split(figure, axes[2, 0], widths=[1, 1])
    _draw_levels(against, data)
    _draw_correlogram(lags, data)
    return add_caption(figure, data)


def _draw_times(axes: list[Axes], data: xr.Dataset, span: tuple[float, ...], title: str) -> None:
    """Spikes, rate, stimulus and, if it is known, texture in one part of the time."""
    raster, rate, stimulus = axes[:3]
    inside = ((data.spike_time >= span[0]) & (data.spike_time <= span[1])).values
    many = inside.sum() > 5000
    size: dict[str, Any] = {
        "ms": 0.6 if many else 1.8,
        "mew": 0.4 if many else 0.9,
        "color": "0.15",
        "rasterized": True,
    }
    raster.plot(data.spike_time.values[inside], data.spike_trial.values[inside], "," if many else "|", **size)
    raster.set(ylabel="trial", title=title)
    if int(data.attrs["n_trials"]) == 1:
        raster.set(ylabel="spikes", yticks=[])
    rate.stairs(data.firing_rate, _edges(data.bin.values, data.attrs["bin_width"]), color=SINGLE)
    rate.set(ylabel="rate [Hz]", ylim=(0, None))
    if "shown_stimulus" in data:
        part = ((data.time >= span[0]) & (data.time <= span[1])).values
        stimulus.plot(data.time.values[part], data.shown_stimulus.values[part], color=MEASURED, lw=0.5)
    centre = data.bin + data.attrs["bin_width"] / 2
    stimulus.plot(centre, data.attrs["shown_factor"] * data.bin_envelope, color=ENVELOPE, lw=1.0)
    stimulus.set(ylabel=f"stimulus\n[{data.attrs['shown_unit']}]")
    for axis in axes:
        axis.set_xlim(*span)
        axis.tick_params(labelbottom=axis is axes[-1])
    for strip in axes[3:]:
        draw_passing(strip, data, "", (span[0], span[1]), (0.0, 1.0))
        strip.set(yticks=[], ylim=(0, 1))
        strip.set_ylabel("texture", rotation=0, ha="right", va="center")
    axes[-1].set_xlabel("time [s]")


def _edges(bins: Array, width: float) -> list[float]:
    return [*bins.tolist(), float(bins[-1]) + width]


def _draw_overlay(axis: Axes, data: xr.Dataset) -> None:
    """Rate, and the envelope scaled to it."""
    axis.stairs(data.firing_rate, _edges(data.bin.values, data.attrs["bin_width"]), color=SINGLE, label="rate")
    centre = data.bin + data.attrs["bin_width"] / 2
    axis.plot(centre, data.scaled_envelope, color=ENVELOPE, lw=1.0, label="envelope, scaled")
    first = float(data.bin[0])
    axis.set(xlabel="time [s]", ylabel="rate [Hz]", ylim=(0, None), title="B  Rate and envelope")
    axis.set_xlim(first, min(first + TOGETHER, float(data.bin[-1])))
    key_above(axis)


def _draw_together(figure: Figure, place: Axes, data: xr.Dataset) -> None:
    """Several units, one below the other."""
    axes = split(figure, place, heights=[1] * data.sizes["example_unit"])
    edges = _edges(data.example_bin.values, data.attrs["example_bin_width"])
    centre = data.example_bin + data.attrs["example_bin_width"] / 2
    for i, axis in enumerate(axes):
        quality = str(data.example_quality.values[i])
        axis.stairs(data.together_rate[i], edges, color=OF_QUALITY.get(quality, SINGLE), fill=True, alpha=0.6)
        axis.plot(centre, data.together_scaled[i], color=ENVELOPE, lw=0.9)
        axis.set(ylim=(0, None), xlim=(edges[0], edges[-1]), ylabel=str(data.example_unit.values[i]))
        axis.tick_params(labelbottom=axis is axes[-1])
    axes[0].set_title("C  Rates [Hz] of several units, and envelopes")
    axes[-1].set_xlabel("time [s]")


def _draw_levels(axis: Axes, data: xr.Dataset) -> None:
    """Rate against envelope, as bins, as classes, and as the curve that was fitted."""
    factor = data.attrs["shown_factor"]
    before, after = pairs(data.bin_envelope.values, data.firing_rate.values, data.attrs["lag"])
    axis.plot(factor * before, after, "o", ms=2, color=SINGLE, alpha=0.5, mew=0)
    look: dict[str, Any] = {"fmt": "s", "ms": 4, "color": SINGLE, "mec": "0.2", "capsize": 2, "ecolor": "0.2"}
    axis.errorbar(factor * data.level_envelope, data.level_rate, data.level_rate_se, **look)
    unit, envelope = data.attrs["shown_unit"], data.bin_envelope.values
    first, last = float(np.nanmin(envelope)) if unit == "dB" else 0.0, float(np.nanmax(envelope))
    if "threshold" in data.attrs:
        corner, slope, baseline = (data.attrs[name] for name in ("threshold", "slope", "baseline"))
        at = np.array([first, max(corner, first), last])
        axis.plot(factor * at, baseline + slope * np.maximum(at - corner, 0), color=FITTED)
    axis.set(xlabel=f"envelope [{unit}]", ylabel="firing rate [Hz]", xlim=(factor * first, None), ylim=(0, None))
    axis.set_title("D  Rate against envelope")


def _draw_correlogram(axis: Axes, data: xr.Dataset) -> None:
    """Correlation at each lag, and the level of chance."""
    shift = 1e3 * data.attrs["lag"] * data.attrs["bin_width"]
    axis.axvline(0, color="0.7", lw=0.8)
    axis.plot(1e3 * data.correlogram_lag, data.correlogram, "-o", ms=2.5, color=SINGLE)
    if data.attrs["chance"] > -1:
        axis.axhline(data.attrs["chance"], color="0.3", ls="--")
    axis.set(xlabel="lag of the rate [ms]", ylabel="correlation")
    axis.set_title(f"E  r = {data.attrs['correlation']:.3f} at {shift:.0f} ms")
