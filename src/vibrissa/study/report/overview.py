"""The first lines of a report: what was done, of which data, the main numbers, and how far to trust them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from vibrissa.figures.words import with_interval
from vibrissa.quantities.kinds import Results
from vibrissa.study.movie.verdict import VerdictRow
from vibrissa.study.report.headlines import done, headline_rows
from vibrissa.study.spec.inputs import input_files
from vibrissa.study.spec.settings import Study

MOST = 10  # lines
_HEADING = re.compile(r"<h2>(.*?)</h2>", re.DOTALL)


class Overview(NamedTuple):
    """The top of a report.

    Attributes
    ----------
    done : str
        What was analysed.
    data : str
        From when the data are.
    rows : list of dict
        Main numbers: ``quantity``, ``truth``, ``found``.
    remarks : list of str
        Validity, comparison with the paper, what failed.
    """

    done: str
    data: str
    rows: list[dict[str, str]]
    remarks: list[str]


def overview(
    study: Study, results: Results, validity: Sequence[str], counts: Mapping[str, int], failed: int
) -> Overview:
    """Gather the first lines, ten at most.

    Parameters
    ----------
    study : Study
        What was asked.
    results : mapping of Datasets
        Its results.
    validity : sequence of str
        From :func:`vibrissa.study.report.validity.validity`.
    counts : mapping
        Verdict → how many of the paper's numbers have it; empty without a comparison.
    failed : int
        How many parts could not be analysed.

    Returns
    -------
    Overview
        The lines.
    """
    remarks = list(validity[:1])
    if counts:
        each = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
        remarks.append(f"Of the paper's numbers: {each}.")
    if failed:
        remarks.append(f"{failed} part{'s' * (failed > 1)} of the study could not be analysed; see below.")
    rows = headline_rows(results)
    words = done(results)
    return Overview(f"{words[:1].upper()}{words[1:]}.", data_date(study), [_row(row) for row in rows], remarks)


def _row(row: VerdictRow) -> dict[str, str]:
    unit = "" if row.quantity_unit == "1" else f" [{row.quantity_unit}]"
    return {
        "quantity": f"{row.quantity}{unit}",
        "truth": f"{row.truth:.4g}" if np.isfinite(row.truth) else "",
        "found": _found(row),
    }


def _found(row: VerdictRow) -> str:
    """The value with the digits of its interval; without one six, since a correlation of 0.99999 is not 1."""
    if not np.isfinite(row.found):
        return "no fit"
    known = np.isfinite(row.found_low)
    return with_interval(row.found, row.found_low, row.found_high) if known else f"{row.found:.6g}"


def data_date(study: Study) -> str:
    """From when the data of a study are: the dates of the files that it reads.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    str
        A sentence.
    """
    files = [path for path in input_files(study).values() if path.is_file()]
    if not files:
        return "All data are simulated, from the seeds of the study; there is no recording with a date."
    dates = sorted({datetime.fromtimestamp(path.stat().st_mtime, UTC).date().isoformat() for path in files})
    when = dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"
    one = len(files) == 1
    return f"Data: {len(files)} file{'s' * (not one)}, last changed {when}."


def anchored(body: str) -> tuple[str, list[tuple[str, str]]]:
    """Give every section of a page a name, and list them.

    Parameters
    ----------
    body : str
        HTML, its sections headed by ``<h2>``.

    Returns
    -------
    body : str
        With names.
    contents : list of (str, str)
        Name and heading of each section.
    """
    contents: list[tuple[str, str]] = []

    def named(found: re.Match[str]) -> str:
        contents.append((f"section-{len(contents) + 1}", found[1]))
        return f'<h2 id="{contents[-1][0]}">{found[1]}</h2>'

    return _HEADING.sub(named, body), contents
