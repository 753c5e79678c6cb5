"""Which feature of the motion each unit follows: how well every drive predicts its spikes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import add_caption, bars, counted, house_style, new_figure, say_absent
from vibrissa.figures.colours import KINDS, TRUTH

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = KINDS[:4]  # of the drives
MOST = 40  # units that are drawn


def compute(data: xr.Dataset) -> xr.Dataset:
    """Choose the units that are drawn.

    Parameters
    ----------
    data : Dataset
        From :func:`vibrissa.neural.coding.drive_choice.compare_drives`.

    Returns
    -------
    Dataset
        Its first units; attribute ``caption``.
    """
    count, drives = data.sizes["unit"], [str(name) for name in data.drive.values]
    named = {name: int((data.best_drive.values == name).sum()) for name in [*drives, "cannot tell"]}
    carriers = ", ".join(f"{one:.0f}" for one in data.carrier_frequency.values)
    found = ", ".join(f"{n} {name}" for name, n in named.items())
    caption = (
        f"{counted(count, 'unit')}, stimuli with carriers of {carriers} Hz: {found}. A: bits by which a drive foresees "
        "a spike that it was not fitted to better than a steady rate does. B: how far it is behind the unit's best "
        "drive, which lies at 0; a drive is excluded where its interval lies above 0. Bars: intervals over pieces of "
        "the stimuli. A unit without points has too few spikes."
        + (f" The first {MOST} units are drawn." if count > MOST else "")
    )
    return data.isel(unit=slice(0, MOST)).assign_attrs(caption=caption)


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw the gain and the loss of every drive.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Two panels.
    """
    figure, axes = new_figure(9.6, 2.8 + 0.32 * data.sizes["unit"], 1, 2, sharey=True)
    _draw(axes[0, 0], data, "drive_gain")
    axes[0, 0].set(xlabel="bits for each spike over a steady rate", title="A  Gain")
    _draw(axes[0, 1], data, "drive_loss")
    axes[0, 1].set(xlabel="bits for each spike behind the best drive", title="B  Loss")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", title="drive")
    return add_caption(figure, data)


def _draw(axis: Axes, data: xr.Dataset, name: str) -> None:
    place = np.arange(data.sizes["unit"])
    if not np.isfinite(data[name].values).any():
        say_absent(axis, "no unit has enough spikes; see reason")
        return
    axis.axvline(0, color=TRUTH, lw=0.8)
    for k, (drive, colour) in enumerate(zip(data.drive.values, COLOURS, strict=True)):
        value, low, high = (data[f"{name}{end}"].sel(drive=drive).values for end in ("", "_low", "_high"))
        reach = np.maximum(np.nan_to_num(bars(value, low, high)), 0)
        look: dict[str, Any] = {"fmt": "o", "ms": 4, "lw": 0.9, "color": colour, "label": str(drive)}
        axis.errorbar(value, place + 0.16 * (k - 1.5), xerr=reach, **look)
    axis.set_yticks(place, [str(one) for one in data.unit_name.values], parse_math=False)
    axis.set(ylim=(len(place) - 0.5, -0.5))
