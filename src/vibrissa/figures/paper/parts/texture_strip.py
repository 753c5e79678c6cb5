"""The texture as a strip below what it does: over time as it passes the contact, or over the distance scanned."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibrissa.figures.colours import GAP, LAND

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def draw_passing(axis: Axes, data: xr.Dataset, of: str, span: tuple[float, float], place: tuple[float, float]) -> None:
    """The texture as it passes the contact, gaps pale.

    Parameters
    ----------
    axis : Axes
        Over time [s].
    data : Dataset
        With ``trough_start`` and ``trough_width`` [m] and the attribute ``speed`` [m/s].
    of : str
        Beginning of these names.
    span : (float, float)
        Times shown.
    place : (float, float)
        Lower edge and height of the strip.
    """
    start, width = (data[f"{of}trough_{x}"].values / data.attrs[f"{of}speed"] for x in ("start", "width"))
    inside = (start < span[1]) & (start + width > span[0])
    axis.broken_barh([(span[0], span[1] - span[0])], place, color=LAND, lw=0)
    axis.broken_barh(list(zip(start[inside].tolist(), width[inside].tolist(), strict=True)), place, color=GAP, lw=0)


def draw_scanned(axis: Axes, data: xr.Dataset) -> None:
    """Strip of the texture over the distance scanned, gaps pale.

    Parameters
    ----------
    axis : Axes
        A low panel below the examples.
    data : Dataset
        With what :func:`vibrissa.figures.paper.parts.examples.drawn_by_distance` gives.
    """
    x = 1e3 * data.distance_scanned.values
    axis.broken_barh([(x[0], x[-1] - x[0])], (0, 1), color=LAND, lw=0)
    start, width = (1e3 * data[f"trough_{name}"].values for name in ("start", "width"))
    axis.broken_barh(list(zip(start.tolist(), width.tolist(), strict=True)), (0, 1), color=GAP, lw=0)
    axis.set(xlim=(x[0], x[-1]), ylim=(0, 1), yticks=[], xlabel="distance scanned [mm]")
    axis.set_ylabel("texture", rotation=0, ha="right", va="center")
    axis.spines["left"].set_visible(False)
