"""Any figure of ``STAGES`` from a folder of results, or from one file of it."""

from __future__ import annotations

import re
from collections import ChainMap
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.errors import ConvergenceError, InputError, UnknownError
from vibrissa.netcdf import load
from vibrissa.quantities.kinds import Results, Series
from vibrissa.study.report.stored_results import StoredResults
from vibrissa.study.stages.figure_table import best_entry, ends_of, entries, missing, served
from vibrissa.study.stages.stage import FigureEntry
from vibrissa.study.stages.stages import STAGES
from vibrissa.study.sweeps.sweeps import read_series

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

UNITS = {"significant", "threshold", "slope"}  # what a table of units holds, whatever the file's name
RECORDING = {output.name for stage in STAGES if stage.name == "recorded neurons" for output in stage.outputs}


def made(entry: FigureEntry, results: Results, series: Series) -> Figure | str:
    """The figure, or why it cannot be made.

    Parameters
    ----------
    entry : FigureEntry
        Which one.
    results : mapping of Datasets
        Under the names that the entry needs.
    series : callable
        Number of a sweep → its time series.

    Returns
    -------
    Figure or str
        Of matplotlib; or the reason.
    """
    if reason := missing(entry, results):
        return reason
    try:
        return entry.make(results, series)
    except (InputError, ConvergenceError) as error:
        return str(error)


def figure_of(number: str, folder: str | Path) -> Figure:
    """One figure, from a folder of results or a single dataset.

    Parameters
    ----------
    number : str
        One of :func:`vibrissa.study.stages.figure_table.numbers`: 1 … 9 and their panels as in the paper, 10, …
    folder : path
        Folder that ``vibrissa run`` or ``vibrissa recordings`` wrote; or one dataset that is named as a result is
        (``gap.nc``). One of several recordings is given by its table of units (``units_2.nc``), for Figure 8 too, whose
        spikes are looked for beside it. A table of units may have any name.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    InputError
        If the results do not serve the figure: the message says what is missing, and which figures they serve; or if
        they serve it several times, and of which recordings.
    """
    given = Path(folder)
    whole = given.is_dir()
    results = _of_folder(number, given) if whole else _of_file(number, given)
    entry = best_entry(number, results)
    figure = made(entry, results, partial(read_series, given if whole else given.parent))
    if not isinstance(figure, str):
        return figure
    needs, named = [f"{name}.nc" for name in entry.needs], ""
    if not whole and not set(entry.needs) <= set(results):
        named = f"give the folder that holds {' and '.join(needs)}; "
        if len(needs) == 1:
            named = f"a file must have the name of the result, {needs[0]}; "
    remedy = named + _others(number, results)
    raise UnknownError(f"figure {number}", f"cannot be made of {given} ({figure})", None, remedy)


def _others(number: str, results: Results) -> str:
    """Remedy where one figure cannot be made: those that these results serve."""
    found = dict.fromkeys(one.entry.number for one in served(results, str) if one.entry.number != number)
    return f"they serve figure {', '.join(found)}" if found else "they serve no figure"


def _of_folder(number: str, folder: Path) -> Results:
    """Results under their names; those of the only recording that has this figure under the names without a number."""
    results = StoredResults(folder)
    ends = [(entry, end) for entry in entries(number) for end in ends_of(entry, results)]
    if not ends or not missing(best_entry(number, results), results):
        return results
    if len(ends) > 1:
        several = [(f"{_label_name(entry)}{end}", end) for entry, end in ends]
        labels = ", ".join(f"{name}.nc ({results[name].attrs.get('label', '')})" for name, _ in several)
        rule = f"must be of one recording, and {folder} holds {len(ends)}: {labels}"
        raise UnknownError(f"figure {number}", rule, remedy=f"give {folder / f'{several[-1][0]}.nc'}, say")
    return ChainMap(StoredResults(folder, ends[0][1]), results)  # type: ignore[arg-type] # neither is written to


def _label_name(entry: FigureEntry) -> str:
    """Name of the dataset that carries the label of a recording, or of a signal."""
    return "units" if set(entry.needs) <= RECORDING else entry.needs[0]


def label_of(results: Results, name: str) -> str:
    """What a recording or a base signal is called.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.
    name : str
        Of a numbered result (``spikes_2``).

    Returns
    -------
    str
        The name itself where it has no label.
    """
    stem, _, number = name.rpartition("_")
    labelled = f"units_{number}" if stem in RECORDING else name
    return str(results[labelled].attrs.get("label", labelled)) if labelled in results else name


def _of_file(number: str, path: Path) -> dict[str, xr.Dataset]:
    """One result under the name that it has in a folder: units by what is in the table, others by the file's name.

    With what else there is of the same recording, where the figure needs more than one result.
    """
    data = load(path)
    name = re.sub(r"_\d+$", "", path.stem)
    end = path.stem.removeprefix(name)
    several = name in RECORDING and any(
        len(entry.needs) > 1 and set(entry.needs) <= RECORDING for entry in entries(number)
    )
    files = {part: path.with_name(f"{part}{end}.nc") for part in RECORDING if several}
    beside = {part: load(file) for part, file in files.items() if file.is_file()}
    return {**beside, "units" if set(data.variables) >= UNITS else name: data}
