"""The table paper | here | same? as the report shows it: cells as text, and how many quantities have each verdict."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any, get_args

import numpy as np

from vibrissa.study.paper.paper_columns import HERE, MODEL, OWN, ROD
from vibrissa.study.paper.paper_numbers import ComparedNumber, FoundNumber
from vibrissa.study.paper.paper_rule import RULE, PaperNumber, Verdict
from vibrissa.study.paper.printed import plain, printed
from vibrissa.study.paper.sweep_measures import MeasuredNumber

SCALED = {"m": (1e3, "mm"), "Pa": (1e-9, "GPa"), "m/s": (1e3, "mm/s"), "s": (1e3, "ms"), "1/(s m)": (1e-6, "AP/s/µm"),
          "%": (100.0, "%")}  # fmt: skip
_SMALL = 5e-4  # [m] lengths below it are shown in µm
_LEAST = 1e-9  # of a number: below it an interval is one of rounding
_READINGS = re.compile(r"_(bracket|literature|caption|methods|printed|max)$")  # ends of ids: of one quantity
_CLASSES = {"differs": "no", "cannot tell": "unknown"}


def page_of(rows: list[ComparedNumber]) -> dict[str, Any]:
    """What the template ``paper_table.html`` shows: the table, its rule, and how many quantities have each verdict.

    Parameters
    ----------
    rows : list of ComparedNumber
        From :func:`vibrissa.study.paper.paper_numbers.compare`.

    Returns
    -------
    dict
        By the names of the template.
    """
    return {"paper": html_rows(rows), "paper_columns": headings(rows), "paper_rule": RULE, "paper_tally": tally(rows)}


def tally(rows: list[ComparedNumber]) -> str:
    """How many quantities have each verdict; one that the paper prints in several readings counts once, by the first.

    Parameters
    ----------
    rows : list of ComparedNumber
        As in :func:`page_of`.

    Returns
    -------
    str
        Two sentences.
    """
    first: dict[str, ComparedNumber] = {}
    for row in rows:
        first.setdefault(_READINGS.sub("", row.paper.id), row)
    found = Counter(row.verdict for row in first.values() if row.origin != "put in")
    each = ", ".join(
        f"{found[one]} {'differ' if one == 'differs' and found[one] > 1 else one}"
        for one in get_args(Verdict)
        if one in found
    )
    put_in = [row.verdict for row in rows if row.origin == "put in"]
    whose = f" beside those of “{ROD}”" if ROD in headings(rows) else ""
    return (
        f"Quantities of the paper{whose}, several readings of one counted once: {each}. {len(put_in)} conditions "
        f"were put in, {put_in.count('not comparable')} of them not comparable."
    )


def headings(rows: list[ComparedNumber]) -> list[str]:
    """Headings of the columns of ours, from left to right; the verdicts counted are those of the middle one of three.

    Parameters
    ----------
    rows : list of ComparedNumber
        As in :func:`page_of`.

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
        As in :func:`page_of`.

    Returns
    -------
    list of dict
        One for each row.
    """
    names = headings(rows)
    return [
        {
            "figure": row.paper.figure,
            "paper": row.paper.text,
            "paper_interval": _paper_interval(row.paper),
            "here": _cell(row.here, row)["here"],
            "origin": row.origin,
            "verdict": row.verdict,
            "class": _CLASSES.get(row.verdict, ""),
            "columns": [_column(row, heading) for heading in names],
            "why": "; ".join(filter(None, (_recovered(row), _spread(row), row.why, row.paper.reading))),
        }
        for row in rows
    ]


def _recovered(row: ComparedNumber) -> str:
    return "recovered" if row.origin == "recovered" else ""


def _column(row: ComparedNumber, heading: str) -> dict[str, Any]:
    """Number, verdict and its class in one column; empty where the number does not depend on it."""
    one = FoundNumber(row.here, row.verdict) if heading in (HERE, ROD) else row.beside.get(heading)
    if one is None:
        return {"lines": [], "count": "", "here": "", "verdict": "", "class": ""}
    return _cell(one.here, row) | {"verdict": one.verdict, "class": _CLASSES.get(one.verdict, "")}


def _scale(value: float, paper: PaperNumber) -> tuple[float, str]:
    """Factor and name of the unit in which the paper prints a number of this size: a share may be a percentage."""
    unit = "%" if paper.unit == "1" and " %" in paper.text else paper.unit
    size = abs(value)
    if unit == "m" and 0 < size < _SMALL:
        return 1e6, "µm"
    if unit == "s" and size >= 1:
        return 1.0, "s"
    if unit == "Hz" and size >= 1000:
        return 1e-3, "kHz"
    if unit == "1":
        return (1e3, "× 10⁻³") if 0 < size < 1e-3 else (1.0, "")
    return SCALED.get(unit, (1.0, unit))


def _paper_interval(paper: PaperNumber) -> str:
    """Interval of the paper by which the verdict is made, where it is computed."""
    if paper.kind not in ("mean", "share") or paper.why:
        return ""
    factor, unit = _scale(paper.value, paper)
    text = printed(np.nan, *(factor * one for one in (paper.value, *paper.interval)))
    return f"{text.interval} {unit}".rstrip()


def _spread(row: ComparedNumber) -> str:
    """Standard deviation of a mean, in the unit of the mean."""
    if not np.isfinite(row.here.sd):
        return ""
    factor, unit = _scale(row.here.value, row.paper)
    return f"SD {plain(factor * row.here.sd, '.2g')} {unit}".rstrip()


def _cell(here: MeasuredNumber, row: ComparedNumber) -> dict[str, Any]:
    """A number, as lines that break before brackets alone, and in one; by Eq. 5 also with the texture's forcing."""
    shown = _shown(here, row)
    lines, count = [shown] if shown else [], f"N = {here.n:.0f}" if shown and np.isfinite(here.n) else ""
    if shown and here.informed is not None and here.informed.value != here.value:
        lines = [f"Eq. 5: {shown}", f"texture: {_shown(here.informed, row) or 'not measured'}"]
    unbroken = [re.sub(r" (?!\[)", "\N{NO-BREAK SPACE}", line) for line in lines]
    return {"lines": unbroken, "count": count, "here": ", ".join(filter(None, ("; ".join(lines), count)))}


def _shown(here: MeasuredNumber, row: ComparedNumber) -> str:
    """A number with its interval; a setting with its range; a p-value."""
    if not np.isfinite(here.value):
        return ""
    factor, unit = _scale(here.value, row.paper)
    value, low, high = (factor * one for one in here[:3])
    if here.text or row.paper.kind == "p":
        return here.text or f"p = {plain(here.value, '#.2g')}"
    if not high - low > _LEAST * abs(value):
        text = plain(value, ".4g")
    elif row.origin == "put in":
        middle = "" if value in (low, high) else f"median {plain(value, '.3g')}, "
        text = f"{middle}{plain(low, '.3g')} to {plain(high, '.3g')}"
    else:
        text = printed(np.nan, value, low, high).with_interval
    return f"{text} {unit}".rstrip()
