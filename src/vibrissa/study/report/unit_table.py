"""The table of units, as the report and the pages of units have it: a row for each unit, sorted by a click."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrissa.figures.canvas import p_words, shown_in

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
    """

    text: str
    order: str | None = None
    link: str = ""


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
    heads = {
        "unit": "unit",
        **({"quality": "quality"} if "unit_quality" in units else {}),
        "rate": "rate [Hz]",
        "p": "p" if units.attrs["null"] == "circular" else "p, not adjusted",
        "driven": "driven by",
        "r": "correlation",
        "threshold": f"threshold [{unit}]",
        "slope": f"slope [AP/s/{unit}]",
        "latency": "latency [ms]",
        "explained": "R²",
        "ceiling": "R² possible",
        "reason": "what is not known, and why",
    }
    rows = [_cells(units.isel(unit=k), factor, (links or {}).get(k, "")) for k in places]
    return {"heads": list(heads.values()), "rows": [[row[name] for name in heads] for row in rows]}


def _cells(unit: xr.Dataset, factor: float, link: str) -> dict[str, Cell]:
    p = "adjusted_p_value" if unit.attrs["null"] == "circular" else "p_value"
    quality = {"quality": Cell(str(unit.unit_quality.values))} if "unit_quality" in unit else {}
    return {
        "unit": Cell(str(unit.unit_name.values), None, link),
        **quality,
        "rate": _number(float(unit.unit_rate)),
        "p": _number(float(unit[p]), p_words),
        "driven": Cell(
            str(unit.envelope_verdict.values) or ("envelope" if bool(unit.significant) else "nothing found")
        ),
        "r": _number(float(unit.envelope_correlation)),
        "threshold": _with_interval(unit, "threshold", factor),
        "slope": _with_interval(unit, "slope", 1 / factor),
        "latency": _with_interval(unit, "latency", 1e3),
        "explained": _number(float(unit.tuning_r_squared)),
        "ceiling": _number(float(unit.tuning_r_squared_ceiling)),
        "reason": Cell(str(unit.reason.values)),
    }


def _number(value: float, words: Any = "{:.3g}".format) -> Cell:
    return Cell(words(value), f"{value:.9g}") if np.isfinite(value) else Cell("", "")


def _with_interval(unit: xr.Dataset, name: str, factor: float) -> Cell:
    """A fitted parameter with its interval, where the trials give one."""
    value, low, high = (factor * float(unit[name + end]) for end in ("", "_low", "_high"))
    cell = _number(value)
    return cell._replace(text=f"{cell.text} ({low:.3g} to {high:.3g})") if np.isfinite(low) else cell
