"""Paper | here | same?: every number that the paper prints for its figures, beside what sweeps and units give."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np
from scipy.special import stdtrit

from vibrissa import __version__
from vibrissa.errors import InputError
from vibrissa.files import written_whole
from vibrissa.stats import wilson_interval
from vibrissa.study import paper_measures, paper_neurons
from vibrissa.study.paper_neurons import NO_UNITS, is_simulated, populations
from vibrissa.study.sweep_measures import Here, is_virtual

if TYPE_CHECKING:
    import xarray as xr

Kind = Literal["setting", "mean", "share", "value", "range", "bound", "p"]
Origin = Literal["put in", "recovered", "came out"]
Verdict = Literal["same", "differs", "put in", "not comparable", "not measured"]

WHISKERS = 13  # the paper's: where it counts sweeps, these are its independent draws
SESSIONS = 15  # the same, where it counts units
NEURAL = ("8", "9")  # figures of neurons
MEASURES = paper_measures.MEASURES | paper_neurons.MEASURES
NO_SWEEPS = "no sweeps: the study has no [laboratory] and no sweeps"
LEVEL = 0.05

RULE = (
    "Same: the 95 % intervals of the two overlap. The paper's is that of a mean over its 13 whiskers, of units over "
    "its 15 sessions, their spread taken for the printed one of all sweeps or units, which is too wide rather than "
    "too narrow and so favours “same”; Wilson's for a share; half a unit of the last digit where no spread is "
    "printed. Here whole whiskers, or sessions, are left out in turn. Of p-values: the paper's own test, which takes "
    "sweeps and units for independent draws, comes out on the same side of 0.05, with the effect in the direction "
    "told. A bound is kept by the value here, or not. Put in: chosen, not found. Recovered: the truth of virtual "
    "sweeps and simulated units was put in, the value came out of their analysis, so that agreement tests the "
    "analysis and not the rat."
)


class PaperNumber(NamedTuple):
    """A number as the paper prints it, in SI units.

    ``low`` and ``high`` are the ends of a range, or of what rounds to the printed value; NaN where there are none.
    ``direction`` is 1 where an effect is said to rise, −1 where it falls, else NaN.
    ``origin`` tells how it stands in virtual sweeps; ``reading`` what else the paper says of it; ``why`` that it can
    not be compared, and the reason.
    """

    id: str
    figure: str
    text: str
    kind: Kind
    value: float
    sd: float
    n: float
    low: float
    high: float
    unit: str
    origin: Origin
    reading: str
    why: str
    direction: float

    @property
    def is_neural(self) -> bool:
        """Whether it is one of neurons and the stimulator, not of sweeps."""
        return self.figure in NEURAL

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the number; NaN where none can be stated."""
        if self.kind == "mean":
            draws = min(self.n, SESSIONS if self.is_neural else WHISKERS)
            half = float(stdtrit(draws - 1, 0.975)) * self.sd / np.sqrt(draws)
            return self.value - half, self.value + half
        if self.kind == "share":
            return wilson_interval(round(self.value * self.n), round(self.n))
        return self.low, self.high


class Row(NamedTuple):
    """One line of the table: the paper's number, what is found here, the verdict and its reason."""

    paper: PaperNumber
    here: Here
    origin: Origin
    verdict: Verdict
    why: str


@cache
def paper_numbers() -> tuple[PaperNumber, ...]:
    """Every number that the paper prints for its figures, with each reading where it disagrees with itself."""
    text = (files("vibrissa") / "data" / "paper_numbers.csv").read_text(encoding="utf-8")
    return tuple(_number(line) for line in csv.DictReader(text.splitlines()))


def _number(line: dict[str, str]) -> PaperNumber:
    for key, known in (("kind", Kind), ("origin", Origin)):
        if line[key] not in get_args(known):
            raise InputError(f"paper_numbers.csv, {line['id']}", f"must have a {key} of {get_args(known)}", line[key])
    numbers = {key: float(line[key] or "nan") for key in ("value", "sd", "n", "low", "high", "direction")}
    return PaperNumber(**{**line, **numbers})  # type: ignore[arg-type]


def compare(results: Mapping[str, xr.Dataset]) -> list[Row]:
    """Hold every number of the paper against the results of a study.

    Parameters
    ----------
    results : mapping of Datasets
        ``sweeps``; ``repeats``, ``comparison``, ``profile`` and ``gap`` where they are; ``units``, ``units_1``, …: what
        is absent is said.

    Returns
    -------
    list of Row
        One for each of :func:`paper_numbers`, in their order, none without a verdict; the rule is ``RULE``.
    """
    sweeps = "sweeps" in results and is_virtual(results["sweeps"])
    units = any(is_simulated(one) for one in populations(results).values())
    return [_row(number, results, units if number.is_neural else sweeps) for number in paper_numbers()]


def _row(number: PaperNumber, results: Mapping[str, xr.Dataset], virtual: bool) -> Row:
    origin: Origin = "came out" if number.origin == "recovered" and not virtual else number.origin
    if number.why:
        return Row(number, Here(), origin, "not comparable", number.why)
    here = MEASURES[number.id](results) if number.id in MEASURES else Here(note="not in the table of sweeps")
    if not np.isfinite(here.value) and (absent := _absent(number, results)):
        return Row(number, Here(), origin, "not measured", absent)
    if origin == "put in":
        return Row(number, here, origin, "put in", "; ".join(filter(None, (here.note, _set_otherwise(number, here)))))
    if not np.isfinite(here.value):
        return Row(number, here, origin, "not measured", here.note)
    return Row(number, here, origin, *_verdict(number, here))


def _absent(number: PaperNumber, results: Mapping[str, xr.Dataset]) -> str:
    """That the whole half of the study is absent to which a number belongs; nothing if it is there."""
    if number.is_neural:
        return "" if populations(results) else NO_UNITS
    return "" if "sweeps" in results else NO_SWEEPS


def _set_otherwise(number: PaperNumber, here: Here) -> str:
    """Say where a setting is none of the paper's."""
    theirs = np.array(number.interval if np.isfinite(number.interval).any() else (number.value, number.value))
    low, high = np.where(np.isfinite(theirs), theirs, (-np.inf, np.inf)) * (1 - 1e-6, 1 + 1e-6)
    least, most = (here.low, here.high) if np.isfinite(here.low) else (here.value, here.value)
    return "other than the paper's" if least > high or most < low else ""


def _verdict(number: PaperNumber, here: Here) -> tuple[Verdict, str]:
    low, high = number.interval
    if number.kind == "p":
        same = (number.value < LEVEL) == (here.value < LEVEL) and not number.direction * here.slope < 0
    elif number.kind == "bound":
        same = not (here.value > high or here.value < low)
    elif not np.isfinite(here.low):
        draws = "sessions" if number.is_neural else "whiskers"
        return "not comparable", "; ".join(filter(None, (f"no interval: fewer than two {draws}", here.note)))
    else:
        same = here.low <= high and low <= here.high
    return ("same" if same else "differs"), here.note


HEADER = ("figure", "paper", "paper low", "paper high", "here", "here low", "here high", "here n", "unit", "origin",
          "same?", "why", "reading", "id")  # fmt: skip


def write_table(rows: list[Row], path: str | Path) -> None:
    """Write the table as CSV, numbers in SI units, whole or not at all."""
    with written_whole(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADER)
        for row in rows:
            numbers = (*row.paper.interval, row.here.value, row.here.low, row.here.high, row.here.n)
            cells = [f"{number:.6g}" if np.isfinite(number) else "" for number in numbers]
            told = (row.paper.unit, row.origin, row.verdict, row.why, row.paper.reading, row.paper.id)
            writer.writerow([row.paper.figure, row.paper.text, *cells, *told])


def page_of(rows: list[Row]) -> dict[str, Any]:
    """What the template ``paper_table.html`` shows: the table, its rule, and how many rows have each verdict."""
    counts = [(verdict, sum(row.verdict == verdict for row in rows)) for verdict in get_args(Verdict)]
    return {"paper": html_rows(rows), "paper_rule": RULE, "paper_counts": counts}


def write_page(rows: list[Row], path: str | Path) -> None:
    """Write the table as a page of its own, whole or not at all."""
    from jinja2 import Environment, PackageLoader, select_autoescape

    environment = Environment(loader=PackageLoader("vibrissa.study"), autoescape=select_autoescape())
    page = environment.get_template("paper.html").render(version=__version__, **page_of(rows))
    with written_whole(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def html_rows(rows: list[Row]) -> list[dict[str, str]]:
    """Cells of the report's table as text."""
    return [
        {
            "figure": row.paper.figure,
            "paper": row.paper.text,
            "here": _shown(row.here, row.paper.unit),
            "origin": row.origin,
            "verdict": row.verdict,
            "why": "; ".join(part for part in (row.why, row.paper.reading) if part),
        }
        for row in rows
    ]


SCALED = {
    "m": (1e3, "mm"),
    "Pa": (1e-9, "GPa"),
    "m/s": (1e3, "mm/s"),
    "s": (1e3, "ms"),
    "1/(s m)": (1e-6, "AP/s/µm"),
}
_SMALL = 1e-4  # [m] lengths below it are told in µm


def _shown(here: Here, unit: str) -> str:
    if not np.isfinite(here.value):
        return ""
    factor, name = SCALED.get(unit, (1.0, "" if unit == "1" else unit))
    if unit == "m" and abs(here.value) < _SMALL:
        factor, name = 1e6, "µm"
    if unit == "s" and abs(here.value) >= 1:
        factor, name = 1.0, "s"
    ends = f" ({factor * here.low:.4g} to {factor * here.high:.4g})" if np.isfinite(here.low) else ""
    n = f", N = {here.n:.0f}" if np.isfinite(here.n) else ""
    return f"{factor * here.value:.4g}{ends} {name}".strip() + n
