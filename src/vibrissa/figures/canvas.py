"""One look for every figure."""

from __future__ import annotations

from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TRUTH, FOUND, OTHER = "0.35", "C0", "C1"


def new_figure(width: float, height: float, rows: int = 1, columns: int = 1, **layout: Any) -> tuple[Figure, Any]:
    """Figure and its axes in the house's style, tied to no window.

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
    from matplotlib import style
    from matplotlib.figure import Figure

    with as_file(files("vibrissa.figures") / "style.mplstyle") as path, style.context(path):
        figure = Figure(figsize=(width, height))
        return figure, figure.subplots(rows, columns, squeeze=False, **layout)
