"""Paper | here | same?: every number that the paper prints for its figures, beside what sweeps and units give."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import as_file, files
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple, get_args

import numpy as np

from vibrissa.errors import MissingError
from vibrissa.quantities.kinds import Datasets
from vibrissa.stats import Scale
from vibrissa.study.paper import paper_measures, paper_neurons
from vibrissa.study.paper.paper_columns import columns_of, main_column
from vibrissa.study.paper.paper_neurons import NO_UNITS, is_simulated, populations
from vibrissa.study.paper.paper_rule import Kind, Origin, PaperNumber, Verdict, verdict
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
    """Say where a setting is not the paper's: not within its range, or two standard deviations."""
    around = number.value + 2 * np.nan_to_num(number.sd) * np.array([-1, 1])
    theirs = np.array(number.interval) if np.isfinite(number.interval).any() else around
    low, high = np.where(np.isfinite(theirs), theirs, (-np.inf, np.inf)) + 1e-6 * np.abs(theirs) * (-1, 1)
    least, most = (here.low, here.high) if np.isfinite(here.low) else (here.value, here.value)
    return "other than the paper's" if least < low or most > high else ""


INFORMED = "with the texture's forcing"
