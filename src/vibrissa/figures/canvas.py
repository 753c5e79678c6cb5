"""One look for every figure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from importlib.resources import as_file, files
from textwrap import fill
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibrissa.arrays import Array, Integers
from vibrissa.figures.colours import FOUND as FOUND
from vibrissa.figures.colours import OTHER as OTHER
from vibrissa.figures.colours import TRUTH as TRUTH
from vibrissa.quantities.tracks import stored_names

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.gridspec import SubplotSpec

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")  # digits of an exponent
_ROW = 11.5  # height of a row of a legend [point]
P_VALUES = ("effect_p", "effect_p_clustered")  # every sweep a draw, every whisker one
F = TypeVar("F", "Figure", "SubFigure")
Draw = Callable[["xr.Dataset"], "Figure"]


def house_style(draw: Draw) -> Draw:
    """Run a ``draw`` function in the house's style.

    Parameters
    ----------
    draw : callable
        Dataset → figure.

    Returns
    -------
    callable
        The same, in that style.
    """

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
    from vibrissa.figures.notebook_figure import NotebookFigure

    figure = NotebookFigure(figsize=(width, height))
    return figure, figure.subplots(rows, columns, squeeze=False, **layout)


def add_caption(figure: F, data: xr.Dataset) -> F:
    """Give a figure its caption, which is text beside the picture and not in it.

    Parameters
    ----------
    figure : Figure or SubFigure
        With its panels.
    data : Dataset
        As drawn; its attribute ``caption`` is the text.

    Returns
    -------
    Figure or SubFigure
        The same.
    """
    vars(figure.get_figure(root=True))["caption"] = data.attrs["caption"]
    return figure


def caption_of(figure: Figure) -> str:
    """Caption of a figure; empty where it has none.

    Parameters
    ----------
    figure : Figure
        Drawn.

    Returns
    -------
    str
        As :func:`add_caption` gave it.
    """
    return str(getattr(figure, "caption", ""))


def key_above(axis: Axes, columns: int = 9, **look: Any) -> None:
    """Legend between the title and the panel, where it covers no data.

    Parameters
    ----------
    axis : Axes
        With labelled lines and its title.
    columns : int
        Largest number of entries in a row.
    **look
        Passed on to ``Axes.legend``.
    """
    labels = axis.get_legend_handles_labels()[1]
    if not labels:
        return
    place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0, 1), "borderaxespad": 0.1, "borderpad": 0.1}
    axis.legend(ncols=min(columns, len(labels)), handlelength=1.5, columnspacing=1.1, **place, **look)
    axis.set_title(axis.get_title(loc="left"), pad=6 + _ROW * -(-len(labels) // columns))


def shown_in(unit: str) -> tuple[float, str]:
    """Factor on values of a stimulus, and the unit that they are then drawn in.

    Parameters
    ----------
    unit : str
        As the data have it: ``m``, ``rad``, ``dB``.

    Returns
    -------
    factor, unit : float, str
        Metres are drawn in micrometres, radians in degrees.
    """
    return {"m": (1e6, "µm"), "rad": (180 / np.pi, "°")}.get(unit, (1.0, unit))


def counted(number: int, thing: str) -> str:
    """Number and noun of a caption.

    Parameters
    ----------
    number : int
        How many.
    thing : str
        One of them.

    Returns
    -------
    str
        ``1 unit``, ``2 units``.
    """
    return f"{number} {thing}{'' if number == 1 else 's'}"


def whole_numbers(axis: Axis) -> None:
    """Tick an axis at whole numbers alone.

    Parameters
    ----------
    axis : Axis
        Of counts.
    """
    from matplotlib.ticker import MaxNLocator

    axis.set_major_locator(MaxNLocator(nbins="auto", integer=True, min_n_ticks=1))


def say_absent(axis: Axes, words: str) -> None:
    """Say in a panel, under its title, why nothing is drawn; its frame is left out.

    Parameters
    ----------
    axis : Axes
        The panel.
    words : str
        Why.
    """
    axis.axis("off")
    axis.text(0.0, 0.9, fill(words, 42), transform=axis.transAxes, va="top", color="0.4", parse_math=False)


def merged(axes: NDArray[Any]) -> SubplotSpec:
    """Remove a column of axes, and give the place that they took.

    Parameters
    ----------
    axes : array of Axes
        Whole, or a part, of a grid.

    Returns
    -------
    SubplotSpec
        For ``Figure.add_subplot``.
    """
    first, last = axes.flat[0].get_subplotspec(), axes.flat[-1].get_subplotspec()
    for axis in axes.flat:
        axis.remove()
    grid = first.get_gridspec()
    return grid[first.rowspan.start : last.rowspan.stop, first.colspan.start : last.colspan.stop]


def bars(value: ArrayLike, low: ArrayLike, high: ArrayLike) -> Array:
    """Lengths of error bars below and above a value, (2, …), from the ends of its interval.

    Parameters
    ----------
    value, low, high : arrays
        Of one shape.

    Returns
    -------
    (2, …) array
        As ``Axes.errorbar`` takes them; 0 where an end is beyond the value, as by round-off of an accuracy of 1.
    """
    return np.maximum([np.subtract(value, low), np.subtract(high, value)], 0.0)


def p_words(value: float) -> str:
    """P-value as a caption prints it.

    Parameters
    ----------
    value : float
        NaN where it was not determined.

    Returns
    -------
    str
        Two digits; from 0.01 down one, from 0.0001 down with its power of ten.
    """
    if not np.isfinite(value):
        return "not determined"
    if value >= 1e-4:
        return f"{value:.2f}" if value >= 0.01 else f"{value:.1g}"
    digit, power = f"{value:.0e}".split("e")
    return f"{digit} × 10{str(int(power)).translate(_RAISED)}"


def tail_words(value: float) -> str:
    """P-value that a tail continues beyond what can be counted; far out its size is not known.

    Parameters
    ----------
    value : float
        NaN where it was not determined.

    Returns
    -------
    str
        As :func:`p_words`; below a millionth that it is less.
    """
    return "< 10⁻⁶" if value < 1e-6 else p_words(value)


def round_length(most: float) -> float:
    """Length of a scale bar: 1, 2 or 5 times a power of ten, the largest that is not longer.

    Parameters
    ----------
    most : float
        Largest length.

    Returns
    -------
    float
        In the same unit.
    """
    decade = 10.0 ** np.floor(np.log10(most))
    return float(max(step * decade for step in (1, 2, 5) if step * decade <= most))


def whisker_names(profile: xr.Dataset) -> list[str]:
    """Names of the tracked whiskers; numbers where they have none.

    Parameters
    ----------
    profile : Dataset
        Nodes by ``whisker``; its attribute ``names`` (JSON) is read.

    Returns
    -------
    list of str
        One for each whisker.
    """
    return stored_names(profile) or [f"whisker {k}" for k in profile.whisker.values]


def spread(places: Integers, count: int) -> Integers:
    """Up to so many places out of some, from the first to the last, evenly.

    Parameters
    ----------
    places : (N,) array of int
        At least one.
    count : int
        How many are wanted.

    Returns
    -------
    (K,) array of int
        K ≤ count of them.
    """
    return places[np.unique(np.linspace(0, len(places) - 1, count).round().astype(int))]


def split(
    figure: Figure, axis: Axes, *, heights: Sequence[float] = (1.0,), widths: Sequence[float] = (1.0,)
) -> list[Axes]:
    """Share the place of an axis among panels of these heights and widths, row by row.

    Parameters
    ----------
    figure : Figure
        That holds the axis.
    axis : Axes
        Is removed.
    heights : sequence of float
        Of the rows, relative.
    widths : sequence of float
        Of the columns, relative.

    Returns
    -------
    list of Axes
        The panels.
    """
    place = axis.get_subplotspec()
    axis.remove()
    cells = place.subgridspec(len(heights), len(widths), height_ratios=heights, width_ratios=widths)  # type: ignore[union-attr]
    return [figure.add_subplot(cells[i, j]) for i in range(len(heights)) for j in range(len(widths))]
