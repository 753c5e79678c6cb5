"""Figure 6C of one movie: envelopes predicted from the texture and measured, and the texture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import add_caption, house_style, key_above, new_figure
from vibrissa.figures.colours import MEASURED, PREDICTED
from vibrissa.figures.paper.parts.texture_strip import draw_passing
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

MODES = 2
SHOWN = 0.6  # [s] drawn of the whole


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Envelopes of modes 1 and 2, divided by the mean of the one that was found, and their correlation.

    Parameters
    ----------
    study : mapping
        ``modal`` with ``envelope``; ``prediction`` and ``apparatus``, which has the texture, if there are any.

    Returns
    -------
    Dataset
        ``envelope_found`` and, where predicted, ``envelope_predicted`` (mode, time), relative;
        ``correlation`` (mode); the texture. Attribute ``caption``.
    """
    found = study["modal"].envelope.values[:MODES]
    scale = found.mean(axis=1, keepdims=True)
    columns: dict[str, Any] = {}
    attrs: dict[str, Any] = {}
    if "prediction" in study:
        modes = study["prediction"].mode_displacement.values[: len(found)]
        predicted = study["modal"].attrs["whisker_length"] * analytic_envelope(modes)[0]
        columns["envelope_predicted"] = predicted / scale
        columns["correlation"] = np.array([np.corrcoef(a, b)[0, 1] for a, b in zip(found, predicted, strict=True)])
    if "apparatus" in study:
        about = study["apparatus"]
        columns |= {name: about[name].values for name in ("trough_start", "trough_width")}
        attrs["speed"] = about.attrs["speed"]
    modal = study["modal"]
    data = dataset(
        attrs, mode=modal.mode.values[: len(found)], time=modal.time.values, envelope_found=found / scale, **columns
    )
    return data.assign_attrs(caption=_caption(data))


def _caption(data: xr.Dataset) -> str:
    if "correlation" not in data:
        return "Figure 6C of one movie. Measured envelopes of the modes, over their means; no texture is known."
    rho = ", ".join(f"{one:.4f}" for one in data.correlation.values)
    below = " (below; pale: gaps)" if "trough_start" in data else ""
    return (
        f"Figure 6C of one movie. Envelopes of the modes, measured and predicted from the texture{below}, over the "
        f"mean of the measured one. Correlation over the whole movie, mode by mode: {rho}."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """One panel for each mode, and the texture.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    n, textured = data.sizes["mode"], "trough_start" in data
    figure, axes = new_figure(
        9.0, 0.6 + 1.6 * n, n + textured, 1, sharex=True, height_ratios=[1] * n + [0.18] * textured
    )
    for i, axis in enumerate(axes[:n, 0]):
        title = f"Mode {i + 1}"
        if "envelope_predicted" in data:
            axis.plot(
                data.time, data.envelope_predicted[i], color=PREDICTED, lw=2.2, label="predicted from the texture"
            )
            title += f": correlation {float(data.correlation[i]):.4f} over the whole movie"
        axis.plot(data.time, data.envelope_found[i], color=MEASURED, lw=0.9, label="measured")
        axis.set(ylabel="envelope / its mean", ylim=(0, None), title=title)
    first, last = float(data.time[0]), min(float(data.time[0]) + SHOWN, float(data.time[-1]))
    if textured:
        draw_passing(axes[-1, 0], data, "", (first, last), (0.0, 1.0))
        axes[-1, 0].set(yticks=[], ylim=(0, 1))
        axes[-1, 0].set_ylabel("texture", rotation=0, ha="right", va="center")
    axes[0, 0].set_xlim(first, last)
    key_above(axes[0, 0])
    axes[-1, 0].set_xlabel("time [s]")
    return add_caption(figure, data)
