"""One look for every figure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TRUTH, FOUND, OTHER = "0.72", "#0072B2", "#D55E00"  # the truth lies behind, broad and pale
Draw = Callable[["xr.Dataset"], "Figure"]


def house_style(draw: Draw) -> Draw:
    """Run a ``draw`` function in the house's style."""

    @wraps(draw)
    def styled(data: xr.Dataset) -> Figure:
        from matplotlib import style

        with as_file(files("vibrissa.figures") / "style.mplstyle") as path, style.context(path):
            return draw(data)

    return styled


def new_figure(width: float, height: float, rows: int = 1, columns: int = 1, **layout: Any) -> tuple[Figure, Any]:
    """Figure and its axes, tied to no window.

    Parameters
    ----------
    width, height : float
        Size [inch].
    rows, columns : int
        Panels.
    **layout
        Passed on to ``Figure.subplots`` (``sharex``, ``width_ratios``, …).

    Returns
    -------
    figure, axes
        As ``Figure.subplots`` gives them, never squeezed.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    return figure, figure.subplots(rows, columns, squeeze=False, **layout)


def split(
    figure: Figure, axis: Axes, *, heights: Sequence[float] = (1.0,), widths: Sequence[float] = (1.0,)
) -> list[Axes]:
    """Share the place of an axis among panels of these heights and widths, row by row."""
    place = axis.get_subplotspec()
    axis.remove()
    cells = place.subgridspec(len(heights), len(widths), height_ratios=heights, width_ratios=widths)  # type: ignore[union-attr]
    return [figure.add_subplot(cells[i, j]) for i in range(len(heights)) for j in range(len(widths))]
