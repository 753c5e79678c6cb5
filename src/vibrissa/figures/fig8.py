"""Figure 8: one unit's firing rate beside the envelope that drives it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from vibrissa.figures.canvas import FOUND, OTHER, house_style, new_figure
from vibrissa.neural.coupling import maximal_correlation
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Raster, firing rate, tracked envelope, and their largest correlation within one bin.

    Parameters
    ----------
    study : mapping
        ``spikes`` and ``response``.

    Returns
    -------
    Dataset
        ``response`` with ``spike_time``, ``spike_trial`` and attributes ``correlation`` and ``lag`` [bins].
    """
    response = study["response"]
    r, lag = maximal_correlation(response.firing_rate.values, response.bin_envelope.values)
    spikes = study["spikes"]
    return dataset(
        {**response.attrs, "correlation": r, "lag": lag},
        bin=response.bin.values,
        firing_rate=response.firing_rate.values,
        bin_envelope=response.bin_envelope.values,
        spike_time=spikes.spike_time.values,
        spike_trial=spikes.spike_trial.values,
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Raster, rate and envelope over time; rate against envelope on the right."""
    figure, axes = new_figure(7.2, 4.2, 3, 2, width_ratios=[2.2, 1])
    for axis in axes[:, 1]:
        axis.remove()
    raster, rate, envelope = axes[:, 0]
    width, shift = data.attrs["bin_width"], int(data.attrs["lag"])
    raster.plot(data.spike_time, data.spike_trial, "|", color="0.2", ms=1.5, mew=0.5)
    raster.set(ylabel="trial", title="One simulated unit")
    rate.plot(data.bin + width / 2, data.firing_rate, color=OTHER)
    rate.set_ylabel("rate [Hz]")
    envelope.plot(data.bin + width / 2, 1e6 * data.bin_envelope, color=FOUND)
    envelope.set(xlabel="time [s]", ylabel="tracked\nenvelope [µm]")
    for axis in (raster, rate):
        axis.tick_params(labelbottom=False)
    scatter = figure.add_subplot(axes[0, 1].get_gridspec()[:, 1])
    before, after = data.bin_envelope.values, data.firing_rate.values
    pairs = (before[: len(before) - shift], after[shift:]) if shift >= 0 else (before[-shift:], after[:shift])
    scatter.plot(1e6 * pairs[0], pairs[1], "o", ms=2.5, color="0.4", alpha=0.6)
    scatter.set(xlabel="envelope [µm]", ylabel="firing rate [Hz]", xlim=(0, None), ylim=(0, None))
    scatter.set_title(f"r = {data.attrs['correlation']:.3f}\nat a lag of {shift * width * 1e3:.0f} ms")
    return figure
