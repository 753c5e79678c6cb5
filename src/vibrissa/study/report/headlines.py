"""What a run prints in the end: what was done, and at most five numbers, with their truth where it is known."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import InputError
from vibrissa.mechanics.across.collapse import collapse
from vibrissa.quantities.kinds import Results
from vibrissa.study.movie.verdict import VerdictRow, rows_of
from vibrissa.study.paper.paper_neurons import is_simulated
from vibrissa.study.paper.printed import printed
from vibrissa.study.report.report_neurons import UNITS, mean_of_fitted, tables_of
from vibrissa.study.report.summary import base_lines

if TYPE_CHECKING:
    import xarray as xr

MOST = 5  # numbers
_line = partial(VerdictRow, "")  # of no table: without a key
_RESONANCE, _DAMPING = "resonant frequency, mode 1", "damping ratio, mode 1"
_ZETA = ("damping", _DAMPING, "1")
MODULUS = "Young's modulus"
_OF_MOVIE = ("resonant_frequency_1", "damping_1", "envelope_correlation_1")


def headlines(results: Results) -> list[str]:
    """Say what was done, then give the headline numbers.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    list of str
        Lines of at most 80 characters. Of several parts, the first has most of the numbers and each other has one.
    """
    rows = headline_rows(results)
    return [done(results), *_verdict_of_model(results), *(_table(rows) if rows else [])]


def _verdict_of_model(results: Results) -> list[str]:
    """Whether the model holds on a surface, with its first reason."""
    if "scan" not in results or "verdict" not in results["scan"].attrs:
        return []
    return [f"{str(results['scan'].attrs['verdict']).partition(';')[0]}; see the report"]


def headline_rows(results: Results) -> list[VerdictRow]:
    """The headline numbers.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    list of VerdictRow
        Five at most: of several parts, the first has most of the numbers and each other has one.
    """
    makers = (_movie_rows, _sweep_rows, _unit_rows, _surface_rows, _base_rows)
    parts = [rows for rows in (make(results) for make in makers) if rows]
    if not parts:
        return []
    first, *others = parts
    return [*first[: MOST - len(others)], *(part[0] for part in others)]


def done(results: Results) -> str:
    """Say what the run has analysed.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    str
        Without a full stop.
    """
    words = []
    if _has_movie(results):
        size = results["profile"].sizes
        whiskers = f"{size['whisker']} whiskers tracked in " if size["whisker"] > 1 else ""
        words.append(f"{whiskers}{_counted(size['time'], 'frame')}{'' if whiskers else ' tracked'}")
    if "sweeps" in results:
        accepted = results["sweeps"].accepted.values
        words.append(f"{int(accepted.sum())} of {_counted(accepted.size, 'sweep')} analysed")
    if tables := tables_of(results).values():
        words.append(_passed(list(tables)))
    if "scan" in results:
        words.append("a surface scanned")
    if count := sum(name.startswith("base_signal_") for name in results):
        words.append(f"{_counted(count, 'base signal')} analysed")
    return ", ".join(words) or "nothing could be analysed"


def _passed(tables: Sequence[xr.Dataset]) -> str:
    """How many units pass the test of the envelope; a line of the screen has no room for more."""
    passed = sum(int(units.significant.values.sum()) for units in tables)
    return f"{passed} of {_counted(sum(units.sizes['unit'] for units in tables), 'unit')} pass"


def driven(results: Results) -> str:
    """Say how many of the simulated units that the envelope drives pass its test.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    str
        Without a full stop; empty where units are recorded, or there are none.
    """
    tables = tables_of(results).values()
    if not tables or not all(map(is_simulated, tables)):
        return ""
    passed = np.concatenate([units.significant.values for units in tables]).astype(bool)
    true = np.concatenate([units.driven_by.values for units in tables]) == "envelope"
    found, others = (passed & true).sum(), (passed & ~true).sum()
    return f"Of {true.sum()} units that the envelope drives, {found} pass its test; {others} others pass too"


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'s' if count != 1 else ''}"


def _has_movie(results: Results) -> bool:
    """Whether there is a single movie; the movie of a sweep that is shown does not count."""
    return "profile" in results and "sweep" not in results.get("posture", results["profile"]).attrs


def _movie_rows(results: Results) -> list[VerdictRow]:
    """Of one movie: compared with its truth, or as recorded."""
    if "verdict" in results:
        known = {row.row_key: row for row in rows_of(results["verdict"])}
        return [*(known[key] for key in _OF_MOVIE if key in known), *_contact(results)]
    if not _has_movie(results) or "sweeps" in results:
        return []
    if "resonance_white" not in results or "resonant_frequency" not in results["resonance_white"]:
        return _contact(results)
    fit, names = results["resonance_white"].isel(mode=0), (("resonant_frequency", _RESONANCE, "Hz"), _ZETA)
    rows = [_line(f"{words}, white forcing", unit, np.nan, *_found(fit, name)) for name, words, unit in names]
    return [*rows, *_contact(results)]


def _found(data: xr.Dataset, name: str) -> tuple[float, float, float]:
    found, low, high = (float(data[name + end]) for end in ("", "_low", "_high"))
    return found, low, high


def _contact(results: Results) -> list[VerdictRow]:
    if "posture" not in results:
        return []
    one = results["posture"]
    return [_line("contact over L, at rest", "1", float(one.attrs["contact_true"]), *_found(one, "contact"))]


def _sweep_rows(results: Results) -> list[VerdictRow]:
    """Of many sweeps: Young's modulus, medians over those analysed, agreement of the envelopes."""
    if "sweeps" not in results or not results["sweeps"].accepted.values.any():
        return []
    sweeps = results["sweeps"]
    some = sweeps.isel(sweep=np.flatnonzero(sweeps.accepted.values))
    rows = [*_modulus(some), _median(some, "resonant_frequency", _RESONANCE, "Hz"), _median(some, "damping", _DAMPING)]
    if "comparison" in results:
        agreed = _middle(results["comparison"].correlation.values[:, 0])
        rows.append(_line("correlation of envelope with the prediction, median", "1", np.nan, agreed))
    return [*rows, _median(some, "contact", "contact over L")]


def _modulus(sweeps: xr.Dataset) -> list[VerdictRow]:
    """Young's modulus [GPa] of all sweeps; nothing where no resonance is known."""
    try:
        found = collapse(sweeps)
    except InputError:
        return []
    true = float(np.median(sweeps.youngs_modulus_true)) if "youngs_modulus_true" in sweeps else np.nan
    values = (1e-9 * value for value in (true, *_found(found, "youngs_modulus")))
    return [_line(f"{MODULUS}, of {_counted(found.sizes['sweep'], 'sweep')}", "GPa", *values)]


def _median(sweeps: xr.Dataset, name: str, words: str, unit: str = "1") -> VerdictRow:
    """Median over sweeps of a number, of mode 1 if it has modes; of white forcing where no texture is known."""
    true = sweeps[f"{name}_true"] if f"{name}_true" in sweeps else np.nan * sweeps.contact
    found = sweeps[name]
    if not np.isfinite(found).any():
        found, words = sweeps[f"{name}_white"], f"{words}, white forcing"
    middle = (_middle(one.values.reshape(len(sweeps.sweep), -1)[:, 0]) for one in (true, found))
    return _line(f"{words}, median", unit, *middle)


def _middle(values: Array) -> float:
    """Median of what is known; NaN where nothing is."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else np.nan


def _unit_rows(results: Results) -> list[VerdictRow]:
    """Of units: means of threshold, slope and latency of those whose threshold the trials determine."""
    rows = []
    for name, unit in UNITS.items():
        for units in tables_of(results).values():
            count, *numbers = mean_of_fitted(units, name)
            noun = "driven unit" if is_simulated(units) else "unit"
            if count:
                rows.append(_line(f"{name}, mean of {_counted(count, noun)}", unit, *numbers))
    return rows or _test_rows(results)


def _test_rows(results: Results) -> list[VerdictRow]:
    """Of units that pass the test, but have no threshold in metres: how they follow the envelope."""
    tables = [units.isel(unit=np.flatnonzero(units.significant.values)) for units in tables_of(results).values()]
    rows = (
        ("correlation with the envelope", "1", 1.0, "envelope_correlation"),
        ("lag of it", "ms", 1e3, "envelope_lag"),
    )
    known = [np.concatenate([units[name].values for units in tables]) if tables else np.array([]) for *_, name in rows]
    return [
        _line(
            f"{words}, median of {_counted(values.size, 'unit')}", unit, np.nan, float(f"{scale * _middle(values):.3g}")
        )
        for (words, unit, scale, _), values in zip(rows, known, strict=True)
        if values.size
    ]


def _surface_rows(results: Results) -> list[VerdictRow]:
    """Of a surface alone: what the model says of mode 1."""
    if "scan" not in results:
        return []
    scan = results["scan"]
    one, um = scan.isel(mode=0), 1e6 * float(scan.attrs["whisker_length"])
    return [
        _line(_RESONANCE, "Hz", np.nan, float(one.resonant_frequency)),
        _line("rms displacement, mode 1", "µm", np.nan, um * float(one.mode_sd)),
        _line("exact over linear jump, mode 1", "1", np.nan, float(one.linearity)),
    ]


def _base_rows(results: Results) -> list[VerdictRow]:
    """Of base signals: first resonance and damping of each."""
    lines = base_lines(results)
    if not lines.sizes:
        return []
    columns = (lines[name].values.tolist() for name in ("signal_name", "first_resonance", "first_damping"))
    return [
        _line(f"{words} of {name}", unit, np.nan, value)
        for name, *values in zip(*columns, strict=True)
        for words, unit, value in zip(("resonant frequency", "damping ratio"), ("Hz", "1"), values, strict=True)
    ]


def _table(rows: Sequence[VerdictRow]) -> list[str]:
    """Lines of the table; without a column of truths where there are none."""
    cells = [["", "truth", "found", "95 % interval"], *map(_cells, rows)]
    kept = [k for k in range(4) if any(row[k] for row in cells[1:])]
    widths = [max(len(row[k]) for row in cells) for k in kept]
    lines = ["  ".join([row[0].ljust(widths[0]), *(row[k].rjust(w) for k, w in zip(kept[1:], widths[1:], strict=True))])
             for row in cells]  # fmt: skip
    return [line.rstrip() for line in lines]


def _cells(row: VerdictRow) -> list[str]:
    """Half the interval has two digits, as in the report."""
    label = row.quantity if row.quantity_unit == "1" else f"{row.quantity} [{row.quantity_unit}]"
    text = printed(*row[3:])
    return [label, text.truth, text.found, f"{text.low} to {text.high}" if text.low else ""]
