"""The first lines of a report: what was done, of which data, the main numbers, and how far to trust them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any, NamedTuple

import numpy as np

from vibrissa.quantities.kinds import Results
from vibrissa.study.movie.verdict import VerdictRow
from vibrissa.study.paper.paper_columns import own_sweeps, truth_of
from vibrissa.study.paper.paper_modulus import modulus_here
from vibrissa.study.paper.printed import plain, printed
from vibrissa.study.paper.sweep_measures import accepted
from vibrissa.study.report.headlines import MODULUS, done, driven, headline_rows
from vibrissa.study.spec.inputs import input_files
from vibrissa.study.spec.settings import Study

MOST = 11  # lines
_COVERED = ("contact", "base_angle", "resonant_frequency_1", "damping_1")  # rows of the verdict on sweeps
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
        Main numbers: ``quantity``, ``truth``, ``found``, ``note``.
    remarks : list of str
        Validity, comparison with the paper, what failed.
    """

    done: str
    data: str
    rows: list[dict[str, str]]
    remarks: list[str]


def overview(study: Study, results: Results, validity: Sequence[str], tally: str, failed: int) -> Overview:
    """Gather the first lines, eleven at most, with the main reservation first among the remarks.

    Parameters
    ----------
    study : Study
        What was asked.
    results : mapping of Datasets
        Its results.
    validity : sequence of str
        From :func:`vibrissa.study.report.validity.validity`.
    tally : str
        How many of the paper's quantities have each verdict; empty without a comparison.
    failed : int
        How many parts could not be analysed.

    Returns
    -------
    Overview
        The lines.
    """
    missing = f"{failed} part{'s' * (failed > 1)} of the study could not be analysed; see below." if failed else ""
    remarks = filter(None, (*validity[:1], coverage(results), tally, missing))
    words, share = done(results), driven(results)
    rows = [_row(row, results) for row in headline_rows(results)]
    return Overview(
        f"{words[:1].upper()}{words[1:]}.{f' {share}.' * bool(share)}", data_date(study), rows, list(remarks)
    )


def _row(row: VerdictRow, results: Results) -> dict[str, str]:
    unit = "" if row.quantity_unit == "1" else f" [{row.quantity_unit}]"
    text = printed(*row[3:])
    note = _of_rods(results) if row.quantity.startswith(MODULUS) else ""
    return {"quantity": f"{row.quantity}{unit}", "truth": text.truth, "found": text.with_interval, "note": note}


def _of_rods(results: Results) -> str:
    """Young's modulus that the rods themselves give, where they are the truth: their motion without camera and fit."""
    if not (kept := accepted(results)) or truth_of(kept) != "rod":
        return ""
    own = modulus_here(own_sweeps(kept))
    text = printed(np.nan, *(1e-9 * one for one in (own.value, own.low, own.high)))
    return f"the rods themselves, neither filmed nor fitted, give {text.with_interval}"


def coverage(results: Results) -> str:
    """In how many sweeps the interval holds the truth: contact, base angle, resonance and damping of mode 1.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study; ``sweep_verdict`` is looked at.

    Returns
    -------
    str
        A sentence; empty where no truth is known.
    """
    if "sweep_verdict" not in results:
        return ""
    table = results["sweep_verdict"]
    parts = []
    for i in np.flatnonzero(np.isin(table.row_key.values, _COVERED) & np.isfinite(table.covered.values)):
        one = table.isel(entry=i)
        error = (
            f" (median error {plain(100 * float(one.error_median), '+.2g')} %)"
            if str(one.error_unit.values) == "1"
            else ""
        )
        count = int(one.entry_count)
        held = round(float(one.covered) * count)
        parts.append(f"{str(one.quantity.values).removesuffix(', texture known')} in {held} of {count}{error}")
    return f"Over the sweeps the 95 % interval holds the truth: {'; '.join(parts)}." if parts else ""


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
        return "All data are simulated, from the seeds of the study; there is no recording."
    dates = sorted({datetime.fromtimestamp(path.stat().st_mtime, UTC).date().isoformat() for path in files})
    when = dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"
    one = len(files) == 1
    return f"Data: {len(files)} file{'s' * (not one)}, last changed {when}."


def seeds_of(study: Study) -> str:
    """Seeds of a study, each with its place in the study file.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    str
        ``film.seed 1, cortex.texture_seed 1``; empty without any.
    """
    return ", ".join(f"{'.'.join(place)} {seed}" for place, seed in _seeds(asdict(study)))


def _seeds(part: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], int]]:
    for name, value in part.items():
        if isinstance(value, Mapping):
            yield from (((name, *place), seed) for place, seed in _seeds(value))
        elif name.endswith("seed") and isinstance(value, int):
            yield (name,), value


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
        return f'<h2 id="{contents[-1][0]}">{found[1]} <a class="up" href="#contents" title="contents">↑</a></h2>'

    return _HEADING.sub(named, body), contents
