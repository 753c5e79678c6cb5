"""Pages of units that were analysed: one of the population, one for each unit that is chosen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import RangeError, UnknownError
from vibrissa.neural.coupling.unit_view import UnitViews
from vibrissa.quantities.kinds import Progress
from vibrissa.study.neurons.neurons import Analysed
from vibrissa.study.report import pages as files
from vibrissa.study.report.unit_table import unit_table

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

MOST = 100  # pages, unless more are wanted: each takes a second and a tenth of a megabyte
SINGLE = (".png", ".svg")  # hold one figure


def write_unit_pages(
    found: Analysed,
    path: Path,
    *,
    named: Sequence[str] = (),
    most: int = MOST,
    remarks: Sequence[str] = (),
    progress: Progress | None = None,
) -> str:
    """Draw the population and its units.

    Parameters
    ----------
    found : Analysed
        From :func:`vibrissa.study.neurons.neurons.analyse_neurons`.
    path : Path
        Ends in .html or .pdf, or is a folder. A .png or .svg holds one figure: the population, or the unit named.
    named : sequence of str
        Units that have a page; by default those of :func:`chosen`.
    most : int
        Largest number of pages of units where none is named.
    remarks : sequence of str
        What a reader should know, written at the top of the page.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    str
        What is not drawn, and why; empty where all is.

    Raises
    ------
    InputError
        If a unit is named that is not there, or several for a picture of one.
    """
    places = _named(found.units, named) if named else chosen(found.units, most)
    figures = _figures(found, places, progress)
    if path.suffix in SINGLE:
        if len(named) > 1:
            raise RangeError(
                "unit page", f"must be one for a picture in {path.suffix}", len(named), "draw .html or .pdf"
            )
        files.write_picture(next(figures) if named else _population(found.units), path)
        return "" if named else f"{path.name} is the population; .html, .pdf or a folder has pages of its units too"
    if path.suffix == ".pdf":
        files.write_pdf(path, _all(_population(found.units), figures))
    else:
        single = path.suffix == ".html"
        names = {place: f"unit-{place + 1:04d}" for place in places}
        links = {place: f"#{name}" if single else f"{name}.html" for place, name in names.items()}
        table = unit_table(found.units, range(found.units.sizes["unit"]), links)
        drawn = (files.page_of(figure, name) for name, figure in zip(names.values(), figures, strict=True))
        write = files.write_html if single else files.write_folder
        write(path, table, files.page_of(_population(found.units), ""), drawn, remarks)
    left = found.units.sizes["unit"] - len(places)
    return (
        ""
        if named or not left
        else (
            f"{len(places)} of {found.units.sizes['unit']} units have a page: those that pass the test, then by their "
            "correlation; `unit_page` chooses units by name, `most_pages` draws more"
        )
    )


def chosen(units: xr.Dataset, most: int) -> list[int]:
    """Units that have a page: those that pass first, then those whose rate is most like the envelope.

    Parameters
    ----------
    units : Dataset
        From :func:`vibrissa.neural.coupling.analysis.analyse_units`.
    most : int
        Largest number.

    Returns
    -------
    list of int
        Places in the table, ascending.
    """
    r = np.nan_to_num(units.envelope_correlation.values, nan=-np.inf)
    order = np.lexsort((-r, ~units.significant.values.astype(bool)))
    return sorted(order[:most].tolist())


def _named(units: xr.Dataset, named: Sequence[str]) -> list[int]:
    names = [str(name) for name in units.unit_name.values]
    for name in named:
        if name not in names:
            there = ", ".join(names[:9]) + (" …" if names[9:] else "")
            raise UnknownError("unit page", f"must name one of the units: {there}", repr(name))
    return [names.index(name) for name in dict.fromkeys(named)]


def _population(units: xr.Dataset) -> Figure:
    from vibrissa.figures.spikes import population

    return population.draw(population.compute(units))


def _figures(found: Analysed, places: Sequence[int], progress: Progress | None) -> Iterator[Figure]:
    """The figure of each unit, drawn when it is its turn."""
    from vibrissa.figures.spikes import unit_page

    views = UnitViews.of(found.units, found.spikes, found.stimulus, found.how)
    for done, place in enumerate(places):
        if progress is not None:
            progress("pages of units", done, len(places))
        yield unit_page.draw(unit_page.compute(views.of_unit(place)))


def _all(first: Figure, others: Iterator[Figure]) -> Iterator[Figure]:
    yield first
    yield from others
