"""Panels of the figure of robustness: envelopes over distance, accuracies along an arm, shares kept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import bars, key_above
from vibrissa.figures.colours import KINDS, TRUTH
from vibrissa.figures.others.robustness_chain import CLAIM

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

COLOURS = {"envelope": KINDS[0], "mean rate": "0.35", "spectrum": KINDS[1], "event": KINDS[2]}
TONES = dict(zip(("speed", "height", "angle"), KINDS[3:], strict=True))
STYLES = {"any gain": ("-", "o"), "time": (":", "^"), "sizes": (":", "v")}


def _look(name: str) -> dict[str, Any]:
    """Colour by code, line and marker by what is read of it."""
    colour = next(colour for start, colour in COLOURS.items() if name.startswith(start))
    line, marker = next((style for end, style in STYLES.items() if end in name), ("--", "D"))
    return {"color": colour, "ls": line, "marker": marker, "ms": 4, "lw": 2.2 if name == CLAIM else 1.0}


def draw_envelopes(axis: Axes, data: xr.Dataset) -> None:
    """Draw the envelope of one grating over distance, where taught and at the ends of each arm.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From ``compute``.
    """
    shown = data.shown_envelope / data.shown_envelope.mean("shown_place")
    for arm, tone in TONES.items():
        own = np.flatnonzero(data.tested_arm == arm)
        for k in {*own[:1], *own[-1:]}:
            label = f"other {arm}s" if k == own[0] else None
            axis.plot(1e3 * data.shown_place, shown[k], color=tone, lw=0.8, alpha=0.9, label=label)
    axis.plot(1e3 * data.shown_place, shown[0], color="k", lw=1.8, label="where taught")
    axis.set(xlabel="distance scanned [mm]", ylabel="envelope / its mean", ylim=(0, None))
    axis.set_xlim(*(1e3 * data.shown_place.values[[0, -1]]))
    axis.set_title("A  Envelope of one grating")
    key_above(axis)


def draw_arm(axis: Axes, data: xr.Dataset, arm: str, values: Array) -> None:
    """Draw the accuracy of every decoder over what the arm changes.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From ``compute``.
    arm : str
        What differs: speed, height or angle.
    values : (W,) array
        What the arm changes, of each way.
    """
    used = np.flatnonzero((data.tested_arm == arm) | (data.tested_arm == "taught"))
    used = used[np.argsort(values[used])]
    for name in data.decoder.values:
        one = data.sel(decoder=name).isel(tested=used)
        look = _look(str(name))
        ends = one.decoder_accuracy_low, one.decoder_accuracy_high
        axis.plot(values[used], one.decoder_accuracy, label=str(name), zorder=3 if name == CLAIM else 2, **look)
        axis.fill_between(values[used], *ends, color=look["color"], alpha=0.08, lw=0)
    axis.axhline(data.attrs["chance"], color="k", lw=0.8, ls="--")
    axis.axvline(values[0], color=TRUTH, ls=":", zorder=0)


def draw_kept(axis: Axes, data: xr.Dataset) -> None:
    """Draw the share kept by every decoder over each arm.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From ``compute``.
    """
    names = [str(name) for name in data.decoder.values][::-1]
    for i, arm in enumerate(data.arm.values):
        kept = data.sel(arm=arm, decoder=names)
        at = np.arange(len(names)) + 0.25 * (1 - i)
        ends = bars(kept.kept_share, kept.kept_share_low, kept.kept_share_high)
        look: dict[str, Any] = {"fmt": "o", "ms": 4, "capsize": 2, "color": TONES[str(arm)]}
        axis.errorbar(kept.kept_share, at, xerr=ends, label=f"other {arm}s", **look)
    axis.axvline(0, color="k", lw=0.8, ls="--")
    axis.axvline(1, color=TRUTH, lw=0.8)
    axis.set_yticks(range(len(names)), names)
    axis.set(xlabel="share kept", title="E  Share kept of the accuracy above chance")
    axis.legend(loc="center left", bbox_to_anchor=(1, 0.5))
