"""Units by what they follow: the envelope, or the carrier's phase."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import add_caption, bars, house_style, key_above, new_figure
from vibrissa.figures.colours import KINDS, TRUTH

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {"envelope": KINDS[0], "phase": KINDS[1], "both": KINDS[2], "cannot tell": "0.7"}
MOST = 60  # units whose names are written


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Sort the units by their index.

    Parameters
    ----------
    study : mapping
        ``demodulation``, of :func:`vibrissa.neural.coding.demodulation.demodulation`. Where ``true_index`` (unit) is
        in its attributes, it is drawn behind.

    Returns
    -------
    Dataset
        The same units, the highest index first, those without one last; attribute ``caption``.
    """
    data = study["demodulation"]
    index = data.demodulation_index.values
    order = np.argsort(np.where(np.isnan(index), 9.0, -index), kind="stable")
    sorted_units = data.isel(unit=order)
    if "true_index" in data.attrs:
        sorted_units = sorted_units.assign_attrs(true_index=np.asarray(data.attrs["true_index"], float)[order])
    return sorted_units.assign_attrs(caption=_caption(sorted_units))


def _caption(data: xr.Dataset) -> str:
    named = {name: int(np.sum(data.demodulated.values == name)) for name in COLOURS}
    truth = " Vertical lines: what was put in." if "true_index" in data.attrs else ""
    carrier, trials = data.carrier_frequency.values[0], data.attrs["n_trials"]
    return (
        f"{data.sizes['unit']} units, {trials} presentations, a carrier of {carrier:.0f} Hz. Units that "
        f"follow the envelope: {named['envelope']}, the phase: {named['phase']}, both: {named['both']}; that cannot be "
        f"assigned: {named['cannot tell']}. A: part of the rate that follows each, over the mean rate, taken between "
        "different presentations, so that noise adds nothing. B: index (V_E − V_C)/(V_E + V_C) of the two variances; "
        f"bars, 95 % intervals.{truth} C: coherence of the mean rate with the envelope (below half the carrier's "
        "frequency) and with the carrier (0.75 to 1.25 of it)."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Both modulations, the index, both coherences.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(9.6, 4.2, 1, 3, width_ratios=[1, 1.2, 1])
    _draw_pair(axes[0, 0], data, "phase_modulation", "envelope_modulation", intervals=True)
    axes[0, 0].set(xlabel="part that follows the phase", ylabel="part that follows the envelope")
    axes[0, 0].set_title("A  Modulation over the mean rate")
    key_above(axes[0, 0], columns=2)
    _draw_index(axes[0, 1], data)
    _draw_pair(axes[0, 2], data, "carrier_coherence", "envelope_coherence", intervals=False)
    axes[0, 2].set(xlabel="with the carrier", ylabel="with the envelope")
    axes[0, 2].set_title("C  Coherence of the mean rate")
    return add_caption(figure, data)


def _draw_pair(axis: Axes, data: xr.Dataset, x: str, y: str, *, intervals: bool) -> None:
    top = 1.1 * float(np.nanmax(np.array([data[x].values, data[y].values]), initial=0.1))
    axis.plot([0, top], [0, top], color=TRUTH, lw=0.8)
    sides = (("xerr", x), ("yerr", y)) if intervals else ()
    for name, colour in COLOURS.items():
        own = data.isel(unit=np.flatnonzero(data.demodulated.values == name))
        if not own.sizes["unit"]:
            continue
        every = ((side, bars(own[of], own[f"{of}_low"], own[f"{of}_high"])) for side, of in sides)
        ends: dict[str, Any] = {side: np.abs(reach) for side, reach in every}
        axis.errorbar(own[x], own[y], **ends, fmt="o", ms=4, lw=0.8, color=colour, label=name)
    axis.set(aspect="equal", xlim=(-0.05 * top, top), ylim=(-0.05 * top, top))


def _draw_index(axis: Axes, data: xr.Dataset) -> None:
    place = np.arange(data.sizes["unit"])
    axis.axvline(0, color=TRUTH, lw=0.8)
    if "true_index" in data.attrs:
        axis.plot(data.attrs["true_index"], place, "|", color="k", ms=9)
    value = data.demodulation_index.values
    for name, colour in COLOURS.items():
        own = (data.demodulated.values == name) & np.isfinite(value)
        if own.any():
            low, high = (np.clip(data[f"demodulation_index_{end}"].values[own], -1, 1) for end in ("low", "high"))
            reach = np.maximum(bars(value[own], low, high), 0)
            axis.errorbar(value[own], place[own], xerr=reach, fmt="o", ms=4, lw=0.8, color=colour)
    axis.set(xlim=(-1.05, 1.05), ylim=(len(place) - 0.5, -0.5), xlabel="phase  ←  demodulation index  →  envelope")
    names = [str(name) for name in data.unit_name.values] if len(place) <= MOST else []
    axis.set_yticks(place[: len(names)], names, fontsize=7)
    axis.set_title("B  Demodulation index")
