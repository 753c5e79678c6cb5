"""The figures of a report, drawn from the results in a folder by whoever has time."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from vibrissa.figures.canvas import caption_of
from vibrissa.quantities.kinds import Progress
from vibrissa.study.report.gallery import made
from vibrissa.study.report.pages import svg_of
from vibrissa.study.report.stored_results import StoredResults
from vibrissa.study.stages.figure_table import FIGURES
from vibrissa.study.sweeps.sweeps import read_series
from vibrissa.sweep.engine import Engine, each


class Drawing(NamedTuple):
    """A figure to be drawn.

    Attributes
    ----------
    figure : int
        Its place in ``FIGURES``.
    end : str
        End of the names of its results, where they are numbered.
    """

    figure: int
    end: str


class Picture(NamedTuple):
    """A figure as SVG and its caption, or why it cannot be made."""

    svg: str
    caption: str
    left_out: str


def drawn(
    drawings: Sequence[Drawing], folder: Path, sweeps: Path, engine: Engine | None, progress: Progress
) -> list[Picture]:
    """Draw figures, several at a time where processes are there already: to start some takes as long as a figure.

    Parameters
    ----------
    drawings : sequence of Drawing
        Which ones.
    folder : Path
        Holds the results.
    sweeps : Path
        Folder whose ``sweeps`` holds the time series of sweeps.
    engine : Engine, optional
        Whose crew draws, if it has one.
    progress : callable
        Called with ("report", figures drawn, figures in all).

    Returns
    -------
    list of Picture
        In order.
    """
    progress("report", 0, len(drawings))
    staffed = engine is not None and engine.crew is not None and engine.crew.processes
    here = engine if engine is not None and staffed else Engine(scheduler="synchronous")
    return each(partial(_picture, folder=folder, sweeps=sweeps), drawings, here, partial(progress, "report"))


def _picture(drawing: Drawing, folder: Path, sweeps: Path) -> Picture:
    """One figure; a fault in its drawing leaves it out, and the run whole."""
    try:
        figure = made(FIGURES[drawing.figure], StoredResults(folder, drawing.end), partial(read_series, sweeps))
        return Picture("", "", figure) if isinstance(figure, str) else Picture(svg_of(figure), caption_of(figure), "")
    except Exception as error:
        return Picture("", "", f"it could not be drawn ({type(error).__name__}: {' '.join(str(error).split())})")
