"""The page of one unit: raster, rate, envelope, tuning curve with its fit, correlogram, its own lags, its waveform."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import add_caption, counted, house_style, new_figure, p_words, shown_in, tail_words
from vibrissa.figures.spikes import unit_panels as panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

MOST_BINS = 500  # drawn in time: of more, rate and fit hide each other
DRIVEN = {
    "envelope": "driven by the envelope",
    "phase": "driven by the carrier's phase",
    "both": "driven by envelope and phase",
    "cannot tell": "by envelope or phase: cannot tell",
}


def compute(view: xr.Dataset) -> xr.Dataset:
    """Choose the stretch of time that is drawn, and write title and caption.

    Parameters
    ----------
    view : Dataset
        From :meth:`vibrissa.neural.coupling.unit_view.UnitViews.of_unit`.

    Returns
    -------
    Dataset
        The same, its bins and spikes those of the stretch; attributes ``title`` and ``caption``.
    """
    first, width, n = float(view.bin[0]), view.attrs["bin_width"], view.sizes["bin"]
    start = min(round(float(view.attrs["skip"]) / width), max(n - MOST_BINS, 0))
    drawn = view.isel(bin=slice(start, start + MOST_BINS))
    low, high = float(drawn.bin[0]), float(drawn.bin[-1]) + width
    time = view.spike_time.values
    drawn = drawn.isel(spike=np.flatnonzero((time >= low) & (time < high)))
    part = f" A to C: {low:g} to {high:g} s of {first:g} to {first + n * width:g} s." if n > MOST_BINS else ""
    return drawn.assign_attrs(title=_title(view), caption=_caption(view) + part)


def _title(view: xr.Dataset) -> str:
    name, quality = str(view.unit_name.values), f" ({view.unit_quality.values})" if "unit_quality" in view else ""
    passed = "passes the test" if bool(view.significant) else "does not pass the test"
    verdict = DRIVEN.get(str(view.envelope_verdict.values), "")
    return f"Unit {name}{quality}: {'; '.join(filter(None, [passed, verdict]))}"


def _caption(view: xr.Dataset) -> str:
    attrs = view.attrs
    factor, unit = shown_in(str(view.bin_envelope.attrs["units"]))
    why = str(view.reason.values)
    reason = f" {why[0].upper()}{why[1:]}." if why else ""
    tested = f"{1e3 * attrs['lag_low'] * attrs['bin_width']:g} to {1e3 * attrs['lag_high'] * attrs['bin_width']:g} ms"
    chance = "all circular shifts" if attrs["null"] == "circular" else "the paper's shuffles"
    tail = f"extrapolated and adjusted over units: {tail_words(float(view.adjusted_p_value))}"
    bins = f"{counted(attrs['trials_observed'], 'presentation')}, bins of {1e3 * attrs['bin_width']:g} ms"
    errors = ", ± standard error of trials" if np.isfinite(view.response_rate_se).any() else ""
    colour = "yellow" if "unit_quality" in view and str(view.unit_quality.values) == "MU" else "purple"
    return (
        f"{bins}; {colour}, firing; black, the envelope; orange, the fit.{_fit_words(view, factor, unit)} D: mean rate "
        f"in {view.sizes['envelope_class']} quantile bins of the envelope at the latency{errors}; below, the "
        "residual. E: correlation of rate and envelope by lag; positive, the rate follows; black, the lags "
        f"tested ({tested}), p = {p_words(float(view.p_value))} against {chance} ({tail}); band, 95 % of chance at one "
        f"lag; dashed, the {100 * (1 - attrs['level']):g}th percentile of the largest correlation by chance. F: rate "
        f"of the unit after each of its spikes; dotted, its mean rate.{reason}"
    )


def _fit_words(view: xr.Dataset, factor: float, unit: str) -> str:
    if not np.isfinite(float(view.threshold)):
        return " No fit."

    def ends(name: str, scale: float, form: str) -> str:
        value, low, high = (scale * float(view[name + end]) for end in ("", "_low", "_high"))
        return f"{value:{form}}" + (f" [{low:{form}}, {high:{form}}]" if np.isfinite(low) else "")

    explained = [f"R² {float(view.tuning_r_squared):.2f}"]
    if np.isfinite(ceiling := float(view.tuning_r_squared_ceiling)):
        explained.append(f"where any function of the stimulus could explain about {ceiling:.2f}")
    return (
        f" Threshold {ends('threshold', factor, '.3g')} {unit}, slope {ends('slope', 1 / factor, '.3g')} AP/s/{unit}, "
        f"latency {ends('latency', 1e3, '.1f')} ms, baseline {ends('baseline', 1, '.3g')} Hz"
        f"{' [95 % intervals]' if np.isfinite(float(view.threshold_low)) else ''}; {' '.join(explained)}."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw the page.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Raster, rate and envelope over time; beside them rate against envelope; below the three of lags and shape.
    """
    figure, axes = new_figure(10.5, 8.2, 2, 1, height_ratios=[1.75, 1])
    outer: Any = axes[0, 0].get_subplotspec().get_gridspec()
    for axis in axes.flat:
        axis.remove()
    top = outer[0].subgridspec(1, 2, width_ratios=[1.9, 1])
    left, right = (
        top[0].subgridspec(3, 1, height_ratios=[1.5, 1, 0.8]),
        top[1].subgridspec(2, 1, height_ratios=[2.4, 1]),
    )
    raster = figure.add_subplot(left[0])
    times = [raster, *(figure.add_subplot(left[k], sharex=raster) for k in (1, 2))]
    panels.times(times, data)
    curve = figure.add_subplot(right[0])
    panels.curve(curve, data)
    panels.residuals(figure.add_subplot(right[1], sharex=curve), data)
    bottom = outer[1].subgridspec(1, 3)
    for k, panel in enumerate((panels.correlogram, panels.own_lags, panels.waveform)):
        panel(figure.add_subplot(bottom[k]), data)
    figure.suptitle(data.attrs["title"], x=0.01, ha="left", fontsize=11, parse_math=False)
    return add_caption(figure, data)
