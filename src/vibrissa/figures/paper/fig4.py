"""Figure 4: the deformation of one instant in its modes, and the modes' amplitudes in time."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import MissingError
from vibrissa.figures.canvas import add_caption, house_style, key_above, merged, new_figure
from vibrissa.figures.colours import MEASURED, TRUTH, ordered
from vibrissa.figures.sources import of_movie
from vibrissa.mechanics.inverse.decomposition import transverse_shapes
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 0.3  # [s] of amplitudes
SEEN = 0.06  # of the profile's length: what the largest displacement is enlarged to in A
PAPER = "66.4 ± 10.7, 18.6 ± 5.6 and 5.6 ± 2.9"


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Deformation at the instant of largest mode-1 displacement, its modes, and an excerpt of the amplitudes.

    Parameters
    ----------
    study : mapping
        ``modal``, of curved modes with the posture in its attributes; ``profile`` for A; ``prediction`` if the truth is
        known; ``apparatus`` of a virtual film, whose free end may not allow its jumps.

    Returns
    -------
    Dataset
        ``s``; ``deformation`` (s) and ``mode_part`` (mode, s) [m]; ``mode_displacement`` (mode, time) and, where known,
        ``mode_displacement_true``, over L; ``variance_explained`` (mode); with a profile ``shape_x``, ``shape_y`` (s)
        [m], its mean, and ``shape_x_instant``, ``shape_y_instant``, displaced from it ``enlarged`` times. Attributes
        ``instant`` [s], ``enlarged``, ``whisker_length`` [m], ``caption``.

    Raises
    ------
    InputError
        If the modes are curved and the posture that they are about is not known.
    """
    modal = study["modal"]
    length, contact = modal.attrs["whisker_length"], float(modal.contact)
    q = modal.mode_displacement.values
    instant = int(np.nanargmax(np.abs(q[0])))
    s = 1 - modal.arc_length.values / length
    seen = np.isfinite(modal.displacement.values[instant]) & (s >= contact)
    parts = q[:, instant, None] * _modes_at(modal, s[seen]) * length
    start = max(0, min(instant - 100, len(modal.time) - 2))
    stop = start + int(np.searchsorted(modal.time.values - modal.time.values[0], SHOWN))
    columns: dict[str, Any] = {}
    if "prediction" in study:
        true = study["prediction"].mode_displacement.values[: len(q)]
        columns["mode_displacement_true"] = (true - true.mean(axis=1, keepdims=True))[:, start:stop]
    attrs: dict[str, Any] = {"instant": float(modal.time[instant]), "whisker_length": length}
    if "profile" in study:
        shape, attrs["enlarged"] = _shapes(study["profile"], instant, seen)
        columns |= shape
    data = dataset(
        attrs,
        s=s[seen],
        mode=modal.mode.values,
        time=modal.time.values[start:stop],
        deformation=modal.displacement.values[instant, seen],
        mode_part=parts,
        mode_displacement=q[:, start:stop],
        variance_explained=modal.variance_explained.values,
        **columns,
    )
    return data.assign_attrs(caption=_caption(data, of_movie(study)) + _validity(study.get("apparatus")))


def _modes_at(modal: xr.Dataset, s: Array) -> Array:
    """Transverse displacement of the modes that were fitted, (M, S)."""
    attrs, posture = modal.attrs, None
    modes, contact = attrs.get("modes", "straight"), float(modal.contact)
    if modes != "straight":
        if "base_angle" not in attrs:
            remedy = "decompose the profile again"
            raise MissingError("modal", f"must hold the posture that its {modes} modes are about", remedy=remedy)
        posture = Posture(contact=contact, base_angle=float(attrs["base_angle"]), friction=float(attrs["friction"]))
    return transverse_shapes(modes, posture, contact, modal.sizes["mode"], s)[1]


def _shapes(profile: xr.Dataset, instant: int, seen: Mask) -> tuple[dict[str, Array], float]:
    """Mean profile and that of the instant, enlarged by a round number so that one sees it."""
    one = profile.isel(whisker=0) if "whisker" in profile.dims else profile
    place = np.array([one.x.values[:, seen], one.y.values[:, seen]])
    mean = np.nanmean(place, axis=1)
    away = place[:, instant] - mean
    wanted = SEEN * float(np.hypot(*np.ptp(mean, axis=1))) / float(np.nanmax(np.hypot(*away)))
    enlarged = max(1.0, float(f"{wanted:.0e}"))
    moved = mean + enlarged * away
    names = ("shape_x", "shape_y", "shape_x_instant", "shape_y_instant")
    return dict(zip(names, [*mean, *moved], strict=True)), enlarged


def _caption(data: xr.Dataset, source: str) -> str:
    """Panels, and the modes' shares here and in the paper."""
    shares = ", ".join(f"{100 * share:.1f}" for share in data.variance_explained.values)
    left = data.deformation - data.mode_part.sum("mode")
    rest = 100 * float(np.nansum(left.values**2) / np.nansum(data.deformation.values**2))
    largest = 1e6 * float(np.nanmax(np.abs(data.deformation.values)))
    shape = (
        f"A, the mean profile and that of one instant ({data.attrs['instant']:.3f} s), whose displacement is drawn "
        f"{data.attrs['enlarged']:g} times too large (thin lines: of single points). "
        if "shape_x" in data
        else "A, the profile: not given. "
    )
    true = "; grey: the truth" if "mode_displacement_true" in data else ""
    return (
        f"Figure 4. {source.capitalize()}. {shape}B, the deformation u of that instant, {largest:.0f} µm where it is "
        "largest, and its modes; "
        f"left in units of L, right in µm. Their sum leaves {rest:.1f} % of its square. C, amplitudes of the modes "
        f"(q + Q, as a movie shows them){true}; cross: the instant of B. Modes 1, 2, … explain {shares} % of the "
        f"variance of this sweep (paper, over sweeps: {PAPER} %)."
    )


def _validity(film: xr.Dataset | None) -> str:
    """What a virtual film shows that a whisker of its length would not do; of a recorded movie nothing."""
    if film is None or "jump_count" not in film or int(film.jumps_allowed) == int(film.jump_count):
        return ""
    free = f"a free end of {1e3 * float(film.free_end_length):.3g} mm"
    return (
        f" The film is of the model of one contact: {free} allows {int(film.jumps_allowed)} of its "
        f"{int(film.jump_count)} jumps. At the others a whole whisker would bridge the gap and not dive as in B."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """A over B on the left, C on the right.

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
    figure, axes = new_figure(9.0, 1.2 + 1.25 * n, n, 2, sharex="col", width_ratios=[1, 1.3])
    both = merged(axes[:, 0]).subgridspec(2, 1)
    if "shape_x" in data:
        _draw_profile(figure.add_subplot(both[0]), data)
    _draw_modes(figure.add_subplot(both[1] if "shape_x" in data else both[:]), data)
    for i, axis in enumerate(axes[:, 1]):
        if "mode_displacement_true" in data:
            axis.plot(data.time, 1e3 * data.mode_displacement_true[i], color=TRUTH, lw=2.6, label="truth")
        axis.plot(data.time, 1e3 * data.mode_displacement[i], color=MEASURED, lw=0.9, label="measured")
        at = data.mode_displacement[i].sel(time=data.attrs["instant"], method="nearest")
        axis.plot(at.time, 1e3 * at, "kx", ms=6, mew=1.6)
        share = 100 * float(data.variance_explained[i])
        axis.set(ylabel=f"mode {i + 1}\n[10⁻³ L]", title=f"{'C  ' if i == 0 else ''}{share:.1f} % of the variance")
    key_above(axes[0, 1])
    figure.align_ylabels(axes[:, 1])
    axes[-1, 1].set_xlabel("time [s]")
    return add_caption(figure, data)


def _draw_profile(axis: Axes, data: xr.Dataset) -> None:
    axis.plot(1e3 * data.shape_x, 1e3 * data.shape_y, "k", lw=1.2, label="mean")
    label = f"instant, × {data.attrs['enlarged']:g}"
    axis.plot(1e3 * data.shape_x_instant, 1e3 * data.shape_y_instant, color=MEASURED, lw=1.2, label=label)
    pairs = [(data[f"shape_{way}"].values[::12], data[f"shape_{way}_instant"].values[::12]) for way in "xy"]
    axis.plot(*(1e3 * np.array(pair) for pair in pairs), color=MEASURED, lw=0.4, alpha=0.6)
    axis.set(xlabel="x [mm]", ylabel="y, down [mm]", title="A  Profile")
    axis.set_aspect("equal", adjustable="datalim")
    axis.invert_yaxis()
    key_above(axis)


def _draw_modes(axis: Axes, data: xr.Dataset) -> None:
    axis.plot(
        data.s,
        1e3 * data.deformation / data.attrs["whisker_length"],
        color=MEASURED,
        lw=3,
        alpha=0.45,
        label="measured",
    )
    for i, colour in enumerate(ordered(data.sizes["mode"])):
        axis.plot(data.s, 1e3 * data.mode_part[i] / data.attrs["whisker_length"], color=colour, label=f"{i + 1}")
    axis.plot(data.s, 1e3 * data.mode_part.sum("mode") / data.attrs["whisker_length"], "k--", lw=0.9, label="sum")
    scale = 1e3 * data.attrs["whisker_length"]
    right = axis.secondary_yaxis("right", functions=(partial(np.multiply, scale), partial(np.multiply, 1 / scale)))
    right.set_ylabel("[µm]")
    axis.set(xlabel="s = distance from the cone's tip / L", ylabel="u [10⁻³ L]", title="B  Deformation, modes 1, 2, …")
    key_above(axis)
