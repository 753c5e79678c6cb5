"""Sorted units: the waveform of each, its autocorrelogram, and how it is rated."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.figures.canvas import add_caption, counted, house_style, new_figure, say_absent
from vibrissa.figures.colours import SINGLE, TRUTH
from vibrissa.neural.coupling.unit_view import autocorrelogram
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST = 12  # units that are drawn
COLUMNS = 3  # pairs of panels beside each other
KEPT, BROKEN = SINGLE, "0.45"


def compute(found: xr.Dataset) -> xr.Dataset:
    """Autocorrelogram of each unit that is drawn: those of the most spikes.

    Parameters
    ----------
    found : Dataset
        From :func:`vibrissa.neural.sorting.sorters.sort`, with or without its accuracy.

    Returns
    -------
    Dataset
        ``autocorrelogram`` (unit, after_spike), ``unit_name``, ``unit_rate``, ``kept`` and, where it is known,
        ``unit_waveform``; attributes ``sampling_rate`` and ``caption``.
    """
    unit, time = found.spike_unit.values, found.spike_time.values
    counts = np.bincount(unit, minlength=found.sizes["unit"])
    places = np.sort(np.argsort(-counts, kind="stable")[:MOST])
    stop = float(found.attrs["duration"])
    each = [autocorrelogram(t := time[unit == k], np.zeros(t.size, int), stop) for k in places]
    rated = found[[name for name in ("unit_name", "unit_rate", "kept", "unit_waveform") if name in found]]
    lags = dataset(lead=("unit",), after_spike=each[0][0], autocorrelogram=np.array([one for _, one in each]))
    attrs = {"sampling_rate": float(found.attrs["sampling_rate"]), "caption": _caption(found)}
    return rated.isel(unit=places).merge(lags).assign_attrs(attrs)


def _caption(found: xr.Dataset) -> str:
    count = found.sizes["unit"]
    shown = f" The {MOST} of most spikes are drawn." if count > MOST else ""
    source = f"{counted(count, 'unit')} by {found.attrs['sorter']} in {found.attrs['duration']:.4g} s"
    return (
        f"{source}; purple, units that are kept; grey, those that break the rules for single units (over 1 Hz, no "
        "interval below 1 ms). Left, "
        "mean waveform on the unit's own electrode, 300 to 6,000 Hz; right, rate of the unit after each of its spikes; "
        f"dotted, its mean rate.{shown}"
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw a pair of panels for each unit.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        As many rows as are needed.
    """
    count = data.sizes["unit"]
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    figure, axes = new_figure(3.2 * columns + 0.6, 1.75 * rows + 1.2, rows, 2 * columns)
    for k in range(rows * columns):
        shape, lags = axes[k // columns, 2 * (k % columns) : 2 * (k % columns) + 2]
        if k >= count:
            shape.remove()
            lags.remove()
            continue
        _draw_shape(shape, data.isel(unit=k), last=k + columns >= count)
        _draw_lags(lags, data.isel(unit=k), last=k + columns >= count)
    return add_caption(figure, data)


def _draw_shape(axis: Axes, unit: xr.Dataset, *, last: bool) -> None:
    axis.set_title(str(unit.unit_name.values), parse_math=False)
    if "unit_waveform" not in unit:
        say_absent(axis, "no gain known:\nno waveform")
        return
    time = 1e3 * np.arange(unit.sizes["sample"]) / unit.attrs["sampling_rate"]
    axis.axhline(0, color=TRUTH, lw=0.8)
    axis.plot(time, 1e6 * unit.unit_waveform, color=KEPT if bool(unit.kept) else BROKEN)
    axis.set(ylabel="[µV]", xlabel="[ms]" if last else "")


def _draw_lags(axis: Axes, unit: xr.Dataset, *, last: bool) -> None:
    lag = 1e3 * unit.after_spike.values
    edges = [*lag, 2 * lag[-1] - lag[-2]]
    axis.stairs(unit.autocorrelogram, edges, color=KEPT if bool(unit.kept) else BROKEN, fill=True, alpha=0.7)
    axis.axhline(float(unit.unit_rate), color="k", ls=":", lw=0.9)
    axis.set(ylabel="[Hz]", xlabel="lag [ms]" if last else "", xlim=(0, edges[-1]), ylim=(0, None))
