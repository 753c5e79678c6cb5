"""The panels of Figure 1, each on its axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import key_above
from vibrissa.figures.colours import FITTED, LAND, MEASURED
from vibrissa.figures.sources import printed_name, whisker_marks

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

LINES = (  # of C, and their looks in D too
    ("course", "-", MEASURED, 3.0, "mean profile"),
    ("fitted", "-", FITTED, 1.2, "Eq. 1"),
    ("parabola", "--", "0.2", 1.0, "polynomial of degree 2"),
)
ANGLES = (("course_s", "course_angle"), ("s", "angle"), ("parabola_s", "parabola_angle"))
_THIN = {"arrowstyle": "-", "lw": 0.6, "color": "0.5"}


def draw_sketch(axis: Axes, data: xr.Dataset) -> None:
    """The cone and its parameters; thickness not to scale.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig1.compute`.
    """
    tip, contact = data.attrs["tip"], data.attrs["contact"]
    axis.fill([tip, 1, 1, tip], np.array([tip, 1, -1, -tip]) / 2, color="0.85", ec="0.3", lw=0.8)
    axis.plot([0, tip, np.nan, 0, tip], np.array([0, tip, np.nan, 0, -tip]) / 2, "--", color="0.5", lw=0.8)
    axis.plot([0, 1], [0, 0], ":", color="0.5", lw=0.7)
    axis.plot([contact], [-contact / 2], "^", color="k", ms=6)
    about: dict[str, Any] = {"textcoords": "offset points", "ha": "center"}
    axis.annotate("contact, s = ε", (contact, -contact / 2), (0, -14), **about)
    axis.annotate("", (0, -0.72), (1, -0.72), arrowprops={"arrowstyle": "<->", "lw": 0.8})
    axis.text(0.5, -0.7, "L", ha="center", va="bottom")
    axis.annotate("", (1.04, -0.5), (1.04, 0.5), arrowprops={"arrowstyle": "<->", "lw": 0.8})
    axis.text(1.06, 0, "2b = 2αL", va="center")
    axis.text(0, -0.12, "s = 0", ha="center")
    axis.annotate("physical tip", (tip, tip / 2), (6, 26), textcoords="offset points", color="0.3", arrowprops=_THIN)
    axis.text(1, 0.54, "s = 1, skin", ha="center")
    arc = 0.45 * np.exp(1j * np.linspace(0, np.arctan(0.5), 20))  # the cone rises by 1/2 in this sketch
    axis.plot(arc.real, arc.imag, color="0.5", lw=0.7)
    axis.text(0.47, 0.09, "α", color="0.3")
    axis.set(xlim=(-0.08, 1.28), ylim=(-0.85, 0.75), title="A  Truncated cone")
    axis.axis("off")


def draw_cones(axis: Axes, data: xr.Dataset) -> None:
    """Measured diameters, and the lines through them down to the tip of the cone.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig1.compute`.
    """
    inset, names = axis.inset_axes((0.68, 0.55, 0.32, 0.45)), data.cone.values.tolist()
    apex = 1e3 * float(data.cone_length.max())
    for panel in (axis, inset):
        for i, name in enumerate(names):
            distance, diameter = 1e3 * data.cone_distance[i], 1e6 * data.cone_diameter[i]
            look: dict[str, Any] = {"marker": whisker_marks(names)[name], "ms": 4.5, "label": printed_name(name)}
            panel.plot(distance, diameter, color=MEASURED, **look)
            length = 1e3 * float(data.cone_length[i])
            beyond = np.array([float(distance.max()), length])  # from the last point to the apex
            line = 1e6 * float(data.cone_base[i]) * (1 - beyond / length)
            panel.plot(beyond, line, "--", color=FITTED, lw=1.4, zorder=2.5)
            panel.plot([length], [0], "o", color="k", ms=4, clip_on=panel is inset, zorder=3)
    inset.set(
        xlim=(0.95 * apex, 1.01 * apex), ylim=(-1, 65e3 * float(data.cone_base.max())), xlabel="close to the tips"
    )
    axis.set(xlabel="distance from the base [mm]", ylabel="diameter [µm]", xlim=(0, None), ylim=(0, None))
    axis.set_title("B  Measured diameters; black: L")
    key_above(axis)


def draw_profile(axis: Axes, data: xr.Dataset) -> None:
    """Mean profile, Eq. 1 and polynomial, over the image where it is known.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig1.compute`.
    """
    if known := "image" in data:
        size = 1e3 * data.attrs["pixel_size"]
        rows, columns = data.image.shape
        extent = (-0.5 * size, (columns - 0.5) * size, (rows - 0.5) * size, -0.5 * size)
        axis.imshow(data.image, extent=extent, cmap="gray")
    for name, style, colour, width, label in LINES:
        if not data[f"{name}_x"].size:
            continue
        axis.plot(1e3 * data[f"{name}_x"], 1e3 * data[f"{name}_y"], style, color=colour, lw=width, label=label)
    ends = np.array([1e3 * data.fitted_x.values[:2], 1e3 * data.fitted_y.values[:2]])
    along = (ends[:, 1] - ends[:, 0]) / np.hypot(*(ends[:, 1] - ends[:, 0]))
    line = ends[:, :1] + along[:, None] * np.array([-4.0, 8.0])
    axis.plot(*line, color=LAND, lw=2, zorder=1.5, label="substrate")
    axis.plot(*ends[:, :1], "o", color=FITTED, ms=4)
    axis.set(xlabel="x [mm]", ylabel="y [mm]", title="C  Mean profile", aspect="equal")
    if not known:
        axis.invert_yaxis()
    key_above(axis, columns=2)


def draw_others(axis: Axes, data: xr.Dataset) -> None:
    """The whiskers of the sweeps, each from its contact.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig1.compute`.
    """
    axis.axhspan(-1, 0, color=LAND, lw=0)
    marks = whisker_marks(data.other.values.tolist())
    for k, name in enumerate(data.other.values.tolist()):
        x, y = 1e3 * data.other_course_x.values[k], 1e3 * data.other_course_y.values[k]
        axis.plot(x, y, color=MEASURED, lw=3.0)
        fitted = 1e3 * data.other_fitted_x.values[k], 1e3 * data.other_fitted_y.values[k]
        axis.plot(*fitted, color=FITTED, lw=1.2, marker=marks[name], markevery=[-1], ms=4.5, label=printed_name(name))
    axis.plot([0], [0], "o", color=FITTED, ms=4)
    axis.set(xlabel="from the contact [mm]", ylabel="height [mm]", title="C  One sweep of each whisker", aspect="equal")
    axis.set_ylim(-1, None)
    key_above(axis)


def draw_angle(axis: Axes, data: xr.Dataset) -> None:
    """The same as angle to the substrate.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig1.compute`.
    """
    for (_, style, colour, width, _), (s, angle) in zip(LINES, ANGLES, strict=True):
        axis.plot(data[s], data[angle], style, color=colour, lw=width)
    axis.axhline(0, color=LAND, lw=1)
    axis.plot([data.attrs["contact"]], [0], "o", color=FITTED, ms=4, clip_on=False)
    if np.isfinite(data.attrs["contact_true"]):
        axis.plot([data.attrs["contact_true"]], [0], "x", color="k", ms=7)
    axis.set(xlabel="s", ylabel="θ [rad]", xlim=(0, 1), title="D  Angle to the substrate")
