"""The command of a stimulator: what its whiskers are given, its spectrum within the band, the delays of the copies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.figures.canvas import add_caption, house_style, merged, new_figure
from vibrissa.figures.colours import MEASURED, TRUTH
from vibrissa.quantities import dataset
from vibrissa.signals.spectra import power_spectrum

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 2.0  # [s] of the command
COPIES = 4  # drawn below each other


def compute(command: xr.Dataset) -> xr.Dataset:
    """First seconds of some copies, and the spectrum of the whole.

    Parameters
    ----------
    command : Dataset
        From :func:`vibrissa.stimulus.array.replay_command`.

    Returns
    -------
    Dataset
        ``command`` (whisker, time) of four whiskers spread over the delays; ``node_power``
        (frequency) of the loop; ``delay`` and ``copy_correlation`` of all as attributes; ``caption``.
    """
    time, delay = command.time.values, command.delay.values
    order = np.argsort(delay, kind="stable")
    some = np.unique(order[np.linspace(0, len(order) - 1, COPIES).round().astype(int)])
    some = some[np.argsort(delay[some], kind="stable")]
    frequency, power = power_spectrum(command.command.values[0], float(command.attrs["sampling_rate"]))
    kept = (frequency > 0) & (frequency < 4 * float(command.attrs["filter_high"]))
    drawn = command[["command"]].isel(whisker=some, time=np.flatnonzero(time < time[0] + SHOWN))
    spectrum = dataset(frequency=frequency[kept], node_power=power[kept])
    attrs = {"copy_delays": delay, "copy_correlations": command.copy_correlation.values, "delays_drawn": delay[some]}
    return drawn.merge(spectrum, combine_attrs="drop").assign_attrs(
        {**command.attrs, **attrs, "caption": _caption(command)}
    )


def _caption(command: xr.Dataset) -> str:
    attrs = command.attrs
    first = min(SHOWN, attrs["duration"])
    band = f"{attrs['filter_low']:g} to {attrs['filter_high']:g} Hz"
    return (
        f"A loop of {attrs['duration']:g} s for {command.sizes['whisker']} whiskers, each with its own delay. A: the "
        f"first {first:g} s of four of them. B: power spectrum of the loop; grey, the band of the stimulator, {band}. "
        "C: delay of each copy against its largest correlation with another, at most "
        f"{float(command.largest_correlation):.2f}; above 0.9, dashed, two whiskers are not distinguished. Largest "
        f"travel {1e6 * float(command.peak_travel):.3g} µm, speed {1e3 * float(command.peak_speed):.3g} mm/s, "
        f"acceleration {float(command.peak_acceleration):.3g} m/s²."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw copies, spectrum and delays.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Three panels.
    """
    count = data.sizes["whisker"]
    figure, axes = new_figure(10.5, 5.6, count, 2, width_ratios=[1.9, 1])
    right = merged(axes[:, 1]).subgridspec(2, 1)
    top = 1.05e6 * float(np.abs(data.command).max())
    for k, axis in enumerate(axes[:, 0]):
        axis.plot(data.time, 1e6 * data.command.isel(whisker=k), color=MEASURED, lw=0.6, rasterized=True)
        name, delay = data.whisker.values[k], data.attrs["delays_drawn"][k]
        title = f"{'A  Command of ' if not k else ''}{name}, delayed by {delay:.3g} s"
        axis.set(ylabel="[µm]", ylim=(-top, top), xlim=(float(data.time[0]), float(data.time[-1])), title=title)
        axis.tick_params(labelbottom=k == count - 1)
    axes[-1, 0].set_xlabel("time [s]")
    _draw_spectrum(figure.add_subplot(right[0]), data)
    _draw_delays(figure.add_subplot(right[1]), data)
    return add_caption(figure, data)


def _draw_spectrum(axis: Axes, data: xr.Dataset) -> None:
    axis.axvspan(data.attrs["filter_low"], data.attrs["filter_high"], color=TRUTH, alpha=0.5, lw=0)
    axis.plot(data.frequency, 1e12 * data.node_power, color=MEASURED, lw=0.6, rasterized=True)
    top = 2e12 * float(data.node_power.max())
    axis.set(
        xlabel="frequency [Hz]", ylabel="power [µm²/Hz]", yscale="log", ylim=(1e-8 * top, top), title="B  Spectrum"
    )
    axis.set_xlim(0, float(data.frequency[-1]))


def _draw_delays(axis: Axes, data: xr.Dataset) -> None:
    axis.plot(data.attrs["copy_delays"], data.attrs["copy_correlations"], "o", ms=3.5, color=MEASURED)
    axis.axhline(0.9, color="0.2", ls="--", lw=0.9)
    axis.set(xlabel="delay [s]", ylabel="largest |r| with another", ylim=(0, 1.02), title="C  Delays of the copies")
