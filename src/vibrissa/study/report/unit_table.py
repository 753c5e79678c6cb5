"""The table of units, as the report and the pages of units have it: a row for each unit, sorted by a click."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import shown_in, tail_words
from vibrissa.neural.coupling.carrier import peak_elsewhere

if TYPE_CHECKING:
    import xarray as xr


class Cell(NamedTuple):
    """A cell of the table.

    Attributes
    ----------
    text : str
        What is read.
    order : str, optional
        Number by which the column is sorted, empty where nothing was measured; None of a column of words.
    link : str
        Where it leads; empty for nowhere.
    interval : str
        Its interval, on a line below; empty for none.
    """

    text: str
    order: str | None = None
    link: str = ""
    interval: str = ""


def unit_table(units: xr.Dataset, places: Sequence[int], links: Mapping[int, str] | None = None) -> dict[str, Any]:
    """Headings and rows of some units.

    Parameters
    ----------
    units : Dataset
        From :func:`vibrissa.neural.coupling.analysis.analyse_units`.
    places : sequence of int
        The units, in this order.
    links : mapping, optional
        Place of a unit → address of its page.

    Returns
    -------
    dict
        ``heads``, texts, and ``rows`` of :class:`Cell`.
    """
    factor, unit = shown_in(str(units.threshold.attrs["units"]))
    some, circular = units.isel(unit=list(places)), units.attrs["null"] == "circular"
    elsewhere = peak_elsewhere(some)
    names = zip(places, some.unit_name.values, strict=True)
    columns = {
        "unit": [Cell(str(name), None, (links or {}).get(place, "")) for place, name in names],
        **({"quality": _words(some.unit_quality.values)} if "unit_quality" in some else {}),
        "rate [Hz]": _numbers(some.unit_rate.values),
        "p" if circular else "p, not adjusted": _numbers(
            some["adjusted_p_value" if circular else "p_value"].values, tail_words
        ),
        "follows": _words(_drives(some)),
        "correlation": _numbers(some.envelope_correlation.values),
        **({"lag of its peak [ms]": _numbers(1e3 * elsewhere)} if np.isfinite(elsewhere).any() else {}),
        f"threshold [{unit}]": _with_intervals(some, "threshold", factor),
        f"slope [AP/s/{unit}]": _with_intervals(some, "slope", 1 / factor),
        "latency [ms]": _with_intervals(some, "latency", 1e3),
        "R²": _numbers(some.tuning_r_squared.values),
        "R² possible": _numbers(some.tuning_r_squared_ceiling.values),
        "what is not known, and why": _words(some.reason.values),
    }
    return {"heads": list(columns), "rows": list(zip(*columns.values(), strict=True))}


def _drives(units: xr.Dataset) -> list[str]:
    """What drives each unit, in a word or two."""
    found = zip(units.envelope_verdict.values, units.significant.values, strict=True)
    return [str(verdict) or ("envelope" if passed else "nothing found") for verdict, passed in found]


def _words(values: Iterable[object]) -> list[Cell]:
    return [Cell(str(value)) for value in values]


def _numbers(values: Array, words: Callable[[float], str] = "{:.3g}".format) -> list[Cell]:
    return [Cell(words(one), f"{one:.9g}") if np.isfinite(one) else Cell("", "") for one in values.tolist()]


def _with_intervals(units: xr.Dataset, name: str, factor: float) -> list[Cell]:
    """A fitted parameter with its interval, where the trials give one."""
    low, high = (factor * units[f"{name}_{end}"].values for end in ("low", "high"))
    cells = zip(_numbers(factor * units[name].values), low.tolist(), high.tolist(), strict=True)
    return [
        cell._replace(interval=f"[{first:.3g}, {last:.3g}]") if np.isfinite(first) else cell
        for cell, first, last in cells
    ]
