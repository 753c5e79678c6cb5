"""Figure 4: the deformation of one instant in its modes, and the modes' amplitudes in time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.exact import cone_modes
from vibrissa.figures.canvas import FOUND, TRUTH, house_style, new_figure
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

SHOWN = 0.3  # [s] of amplitudes


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Deformation at the instant of largest mode-1 displacement, its modes, and an excerpt of the amplitudes.

    Parameters
    ----------
    study : mapping
        ``modal``; ``prediction`` if the truth is known.

    Returns
    -------
    Dataset
        ``s``; ``deformation`` (s) and ``mode_part`` (mode, s) [m]; ``mode_displacement`` (mode, time) and, where known,
        ``mode_displacement_true``, over L; ``variance_explained`` (mode).
    """
    modal = study["modal"]
    length, contact = modal.attrs["whisker_length"], float(modal.contact)
    q = modal.mode_displacement.values
    instant = int(np.nanargmax(np.abs(q[0])))
    s = 1 - modal.arc_length.values / length
    seen = np.isfinite(modal.displacement.values[instant]) & (s >= contact)
    parts = q[:, instant, None] * cone_modes(modal.kappa.values, contact, s[seen]) * length
    start = max(0, min(instant - 100, len(modal.time) - 2))
    stop = start + int(np.searchsorted(modal.time.values - modal.time.values[0], SHOWN))
    columns: dict[str, Any] = {}
    if "prediction" in study:
        true = study["prediction"].mode_displacement.values[: len(q)]
        columns["mode_displacement_true"] = (true - true.mean(axis=1, keepdims=True))[:, start:stop]
    return dataset(
        {"instant": float(modal.time[instant])},
        s=s[seen],
        mode=modal.mode.values,
        time=modal.time.values[start:stop],
        deformation=modal.displacement.values[instant, seen],
        mode_part=parts,
        mode_displacement=q[:, start:stop],
        variance_explained=modal.variance_explained.values,
        **columns,
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Deformation and modes on the left, amplitudes on the right."""
    n = data.sizes["mode"]
    figure, axes = new_figure(7.2, 1.3 + 1.2 * n, n, 2, sharex="col", width_ratios=[1, 1.4])
    for axis in axes[:, 0]:
        axis.remove()
    shape = figure.add_subplot(axes[0, 0].get_gridspec()[:, 0])
    shape.plot(data.s, 1e6 * data.deformation, color="0.6", lw=2.5, label="tracked")
    for i in range(n):
        shape.plot(data.s, 1e6 * data.mode_part[i], label=f"mode {i + 1}")
    shape.plot(data.s, 1e6 * data.mode_part.sum("mode"), "k--", label="sum of modes")
    title = f"Deformation at {data.attrs['instant']:.3f} s"
    shape.set(xlabel="s = distance from the cone's tip / L", ylabel="transverse displacement [µm]", title=title)
    shape.legend()
    for i, axis in enumerate(axes[:, 1]):
        if "mode_displacement_true" in data:
            axis.plot(data.time, 1e3 * data.mode_displacement_true[i], color=TRUTH, lw=2.6, label="truth")
        axis.plot(data.time, 1e3 * data.mode_displacement[i], color=FOUND, lw=0.9, label="found")
        share = 100 * float(data.variance_explained[i])
        axis.set(ylabel=f"mode {i + 1}\n[10⁻³ L]", title=f"{share:.2g} % of the variance")
    axes[0, 1].legend(ncols=2, loc="upper right")
    axes[-1, 1].set_xlabel("time [s]")
    return figure
