"""Paper | here | same?: every number that the paper prints for its figures, beside what sweeps and units give."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import as_file, files
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

import numpy as np

from vibrissa.errors import MissingError
from vibrissa.figures.words import decimals
from vibrissa.quantities.kinds import Datasets
from vibrissa.stats import Scale
from vibrissa.study.paper import paper_measures, paper_neurons
from vibrissa.study.paper.paper_columns import HERE, MODEL, OWN, ROD, columns_of, main_column
from vibrissa.study.paper.paper_neurons import NO_UNITS, is_simulated, populations
from vibrissa.study.paper.paper_rule import RULE, Kind, Origin, PaperNumber, Verdict, verdict
from vibrissa.study.paper.sweep_measures import MeasuredNumber, is_virtual
from vibrissa.tables.reader import read_table

if TYPE_CHECKING:
    import xarray as xr

MEASURES = paper_measures.MEASURES | paper_neurons.MEASURES
NO_SWEEPS = "no sweeps: the study has no [laboratory] and no sweeps"


class FoundNumber(NamedTuple):
    """A number found here, and its verdict, in one column of the table."""

    here: MeasuredNumber
    verdict: Verdict


class ComparedNumber(NamedTuple):
    """One line of the table: the paper's number, what is found here, the verdict and what must be known of it.

    ``beside`` holds the other columns by their headings, of sweeps whose truth is the rod; none of numbers that do not
    depend on it.
    """

    paper: PaperNumber
    here: MeasuredNumber
    origin: Origin
    verdict: Verdict
    why: str
    beside: Mapping[str, FoundNumber] = MappingProxyType({})


@cache
def paper_numbers() -> tuple[PaperNumber, ...]:
    """Every number that the paper prints for its figures, with each reading where it disagrees with itself."""
    with as_file(files("vibrissa") / "data" / "paper_numbers.csv") as path:
        return tuple(_number(line) for _, line in read_table(path, {}).rows())


def paper_number(name: str) -> PaperNumber:
    """One of :func:`paper_numbers` by its ``id``.

    Parameters
    ----------
    name : str
        Its ``id``.

    Returns
    -------
    PaperNumber
        That number.
    """
    return next(number for number in paper_numbers() if number.id == name)


def _number(line: dict[str, str]) -> PaperNumber:
    line["scale"] = line["scale"] or "plain"
    for key, known in (("kind", Kind), ("origin", Origin), ("scale", Scale)):
        if line[key] not in get_args(known):
            raise MissingError(f"paper_numbers.csv, {line['id']}", f"must have a {key} of {get_args(known)}", line[key])
    numbers = {key: float(line[key] or "nan") for key in ("value", "sd", "n", "low", "high", "direction")}
    return PaperNumber(**{**line, **numbers})  # type: ignore[arg-type]


def compare(results: Mapping[str, xr.Dataset]) -> list[ComparedNumber]:
    """Hold every number of the paper against the results of a study.

    Parameters
    ----------
    results : mapping of Datasets
        ``sweeps``; ``repeats``, ``comparison``, ``profile`` and ``gap`` where they are; ``units``, ``units_1``, …: what
        is absent is said. Of sweeps of the rod each also with ``_modes`` and ``_own``.

    Returns
    -------
    list of ComparedNumber
        One for each of :func:`paper_numbers`, in their order, none without a verdict; the rule is
        ``vibrissa.study.paper.paper_rule.RULE``.
    """
    sweeps = "sweeps" in results and is_virtual(results["sweeps"])
    units = any(is_simulated(one) for one in populations(results).values())
    columns = columns_of(results)
    main = columns.pop(main_column(columns))
    return [_with_columns(_row(number, main, units if number.is_neural else sweeps), columns)
            for number in paper_numbers()]  # fmt: skip


_OF_NO_SWEEP = ("kappa_air_1", "kappa_air_2")  # exact, whatever the sweeps show


def _with_columns(row: ComparedNumber, columns: Mapping[str, Datasets]) -> ComparedNumber:
    """The line with what the other columns hold, where they can differ."""
    if row.paper.is_neural or row.verdict in ("put in", "not comparable") or row.paper.id in _OF_NO_SWEEP:
        return row
    others = {heading: _row(row.paper, results, virtual=True) for heading, results in columns.items()}
    return row._replace(beside={heading: FoundNumber(one.here, one.verdict) for heading, one in others.items()})


def _row(number: PaperNumber, results: Mapping[str, xr.Dataset], virtual: bool) -> ComparedNumber:
    origin: Origin = "result" if number.origin == "recovered" and not virtual else number.origin
    if number.why:
        return ComparedNumber(number, MeasuredNumber(), origin, "not comparable", number.why)
    here = MEASURES[number.id](results) if number.id in MEASURES else MeasuredNumber(note="not in the table of sweeps")
    if not np.isfinite(here.value) and (absent := _absent(number, results)):
        return ComparedNumber(number, MeasuredNumber(), origin, "not measured", absent)
    if origin == "put in":
        why = "; ".join(filter(None, (here.note, _set_otherwise(number, here))))
        return ComparedNumber(number, here, origin, "put in", why)
    if not np.isfinite(here.value):
        return ComparedNumber(number, here, origin, "not measured", here.note)
    found, why = verdict(number, here)
    return ComparedNumber(number, here, origin, found, "; ".join(filter(None, (why, _informed(number, here)))))


def _informed(number: PaperNumber, here: MeasuredNumber) -> str:
    """Verdict of the number with the texture's forcing, where that of Eq. 5 is the row's."""
    if here.informed is None or not np.isfinite(here.informed.value):
        return ""
    found, why = verdict(number, here.informed)
    return f"{INFORMED}: {found}" + (f" ({why})" if why else "")


def _absent(number: PaperNumber, results: Mapping[str, xr.Dataset]) -> str:
    """That the whole half of the study is absent to which a number belongs; nothing if it is there."""
    if number.is_neural:
        return "" if populations(results) else NO_UNITS
    return "" if "sweeps" in results else NO_SWEEPS


def _set_otherwise(number: PaperNumber, here: MeasuredNumber) -> str:
    """Say where a setting is not the paper's."""
    theirs = np.array(number.interval if np.isfinite(number.interval).any() else (number.value, number.value))
    low, high = np.where(np.isfinite(theirs), theirs, (-np.inf, np.inf)) * (1 - 1e-6, 1 + 1e-6)
    least, most = (here.low, here.high) if np.isfinite(here.low) else (here.value, here.value)
    return "other than the paper's" if least > high or most < low else ""


INFORMED = "with the texture's forcing"


def page_of(rows: list[ComparedNumber]) -> dict[str, Any]:
    """What the template ``paper_table.html`` shows: the table, its rule, and how many rows have each verdict.

    Parameters
    ----------
    rows : list of ComparedNumber
        From :func:`compare`.

    Returns
    -------
    dict
        By the names of the template.
    """
    counts = [(verdict, sum(row.verdict == verdict for row in rows)) for verdict in get_args(Verdict)]
    return {"paper": html_rows(rows), "paper_columns": headings(rows), "paper_rule": RULE, "paper_counts": counts}


def headings(rows: list[ComparedNumber]) -> list[str]:
    """Headings of the columns of ours, from left to right; the verdicts counted are those of the middle one of three.

    Parameters
    ----------
    rows : list of ComparedNumber
        From :func:`compare`.

    Returns
    -------
    list of str
        One without the rod, else two or three.
    """
    others = {heading for row in rows for heading in row.beside}
    return [heading for heading in (MODEL, ROD, OWN) if heading in others | {ROD}] if others else [HERE]


def html_rows(rows: list[ComparedNumber]) -> list[dict[str, Any]]:
    """Cells of the report's table as text.

    Parameters
    ----------
    rows : list of ComparedNumber
        From :func:`compare`.

    Returns
    -------
    list of dict
        One for each row.
    """
    return [
        {
            "figure": row.paper.figure,
            "paper": row.paper.text,
            "here": _both(row.here, _unit(row.paper)),
            "origin": row.origin,
            "verdict": row.verdict,
            "class": _CLASSES.get(row.verdict, ""),
            "columns": [_column(row, heading) for heading in headings(rows)],
            "why": "; ".join(part for part in (row.why, row.paper.reading) if part),
        }
        for row in rows
    ]


_CLASSES = {"differs": "no", "cannot tell": "unknown"}


def _column(row: ComparedNumber, heading: str) -> dict[str, str]:
    """Number, verdict and its class in one column; empty where the number does not depend on it."""
    one = FoundNumber(row.here, row.verdict) if heading in (HERE, ROD) else row.beside.get(heading)
    if one is None:
        return {"here": "", "verdict": "", "class": ""}
    return {"here": _both(one.here, _unit(row.paper)), "verdict": one.verdict, "class": _CLASSES.get(one.verdict, "")}


SCALED = {"m": (1e3, "mm"), "Pa": (1e-9, "GPa"), "m/s": (1e3, "mm/s"), "s": (1e3, "ms"), "1/(s m)": (1e-6, "AP/s/µm"),
          "%": (100.0, "%")}  # fmt: skip
_SMALL = 5e-4  # [m] lengths below it are shown in µm


def _unit(paper: PaperNumber) -> str:
    """Unit in which the paper prints a number: shares of which it prints the percentage are percentages here too."""
    return "%" if paper.unit == "1" and " %" in paper.text else paper.unit


_LEAST = 1e-9  # of a number: below it an interval is one of rounding


def _both(here: MeasuredNumber, unit: str) -> str:
    """A number, and the same with the texture's forcing where this one is by Eq. 5."""
    if here.informed is None or not np.isfinite(here.value) or here.informed.value == here.value:
        return _shown(here, unit)
    informed = f"{_shown(here.informed, unit)} {INFORMED}" if np.isfinite(here.informed.value) else "not measured"
    return f"{_shown(here, unit)} by Eq. 5; {informed}"


def _shown(here: MeasuredNumber, unit: str) -> str:
    if not np.isfinite(here.value):
        return ""
    factor, name = SCALED.get(unit, (1.0, "" if unit == "1" else unit))
    if unit == "m" and abs(here.value) < _SMALL:
        factor, name = 1e6, "µm"
    if unit == "s" and abs(here.value) >= 1:
        factor, name = 1.0, "s"
    value, low, high = factor * here.value, factor * here.low, factor * here.high
    n = f", N = {here.n:.0f}" if np.isfinite(here.n) else ""
    if not high - low > _LEAST * abs(value):
        return f"{value:.4g} {name}".strip() + n
    form = f".{decimals((high - low) / 2)}f"
    return f"{value:{form}} ({low:{form}} to {high:{form}}) {name}".strip() + n
