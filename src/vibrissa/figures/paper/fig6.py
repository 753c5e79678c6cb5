"""Figure 6D: envelopes predicted from the texture and found in the movie."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import FOUND, TRUTH, house_style, new_figure
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
        ``modal`` with ``envelope``; ``prediction`` if there is one.

    Returns
    -------
    Dataset
        ``envelope_found`` and, where predicted, ``envelope_predicted`` (mode, time), relative; ``correlation`` (mode).
    """
    found = study["modal"].envelope.values[:MODES]
    scale = found.mean(axis=1, keepdims=True)
    columns: dict[str, Any] = {}
    if "prediction" in study:
        modes = study["prediction"].mode_displacement.values[: len(found)]
        predicted = study["modal"].attrs["whisker_length"] * analytic_envelope(modes)[0]
        columns["envelope_predicted"] = predicted / scale
        columns["correlation"] = np.array([np.corrcoef(a, b)[0, 1] for a, b in zip(found, predicted, strict=True)])
    modal = study["modal"]
    return dataset(
        mode=modal.mode.values[: len(found)], time=modal.time.values, envelope_found=found / scale, **columns
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """One panel for each mode.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    n = data.sizes["mode"]
    figure, axes = new_figure(7.2, 0.6 + 1.6 * n, n, 1, sharex=True)
    for i, axis in enumerate(axes[:, 0]):
        title = f"mode {i + 1}"
        if "envelope_predicted" in data:
            axis.plot(data.time, data.envelope_predicted[i], color=TRUTH, lw=3, label="predicted from the texture")
            title += f": correlation {float(data.correlation[i]):.4f} over the whole sweep"
        axis.plot(data.time, data.envelope_found[i], color=FOUND, lw=0.9, label="found in the movie")
        axis.set(ylabel="envelope / its mean", ylim=(0, None), title=title)
    axes[0, 0].set_xlim(float(data.time[0]), min(float(data.time[0]) + SHOWN, float(data.time[-1])))
    axes[0, 0].legend(ncols=2, loc="upper right")
    axes[-1, 0].set_xlabel("time [s]")
    return figure
