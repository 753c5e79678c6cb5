"""Where every number comes from: ``provenance.json`` beside the report."""

from __future__ import annotations

import json
import platform
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, is_dataclass
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa import __version__
from vibrissa.errors import ConflictError
from vibrissa.files import digest
from vibrissa.quantities.kinds import Results
from vibrissa.study.paper.paper_measures import MEASURES
from vibrissa.study.paper.paper_numbers import compare
from vibrissa.study.paper.sweep_measures import MeasuredNumber
from vibrissa.study.spec.inputs import input_files
from vibrissa.study.stages.stages import STAGES, outputs_of
from vibrissa.study.store.result_store import path_of
from vibrissa.study.store.source import source_digest
from vibrissa.study.sweeps.sweeps import FOLDER

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.spec.settings import Study

COMPARISONS = "comparison"

REPORT = ("vibrissa.study.report.report.write_report", ["every result"])


def write_provenance(study: Study, results: Results, work: Path, out: Path) -> None:
    """Write ``provenance.json`` for the files in ``work``, which are then moved to ``out``.

    It holds the study in full, each input's SHA-256, the versions, and of each file of results its SHA-256, the
    function that made it and what it was made of; of sweeps and comparisons, their files: each carries as ``made_of``
    all that it depends on, and is named by it. ``numbers`` lists every number of the report's tables with the results
    that it was computed from. There is no clock in it: equal runs give equal files.

    Parameters
    ----------
    study : Study
        What was run.
    results : mapping of Datasets
        Of a study.
    work : Path
        Folder of the files of this run.
    out : Path
        Folder of the results.
    """
    made = {path.name: digest(path) for path in sorted(work.iterdir())}
    made_of = {
        "vibrissa_version": __version__,
        "source_sha256": source_digest(),
        "python": platform.python_version(),
        "machine": platform.machine(),
        "libraries": libraries(),
        "study": _plain(asdict(study) | {"folder": ""}),
        "inputs": {name: digest(path) for name, path in input_files(study).items()},
        "results": results_made(study, made),
        "stored": stored(results, out),
        "numbers": list(numbers(results)),
    }
    text = json.dumps(made_of, indent=1, ensure_ascii=False, sort_keys=True)
    (work / "provenance.json").write_text(text + "\n", encoding="utf-8")


def earlier_results(study: Study, out: Path) -> set[str]:
    """Files that the run before this one made in a folder, by its ``provenance.json``; empty without one.

    Parameters
    ----------
    study : Study
        What is to be run.
    out : Path
        Folder of the results.

    Returns
    -------
    set of str
        Names of files.

    Raises
    ------
    InputError
        If it was a run of another study, by its name: its results may have taken hours.
    """
    try:
        earlier = json.loads((out / "provenance.json").read_text(encoding="utf-8"))
        name, made = str(earlier["study"]["name"]), {Path(name).name for name in earlier["results"]}
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    if name != study.name:
        remedy = "choose another folder, or remove this one"
        raise ConflictError("out", "must hold no results of another study", f"{out} with those of {name!r}", remedy)
    return made


def libraries() -> dict[str, str]:
    """Versions of the libraries that this package needs, and of extras that are there."""
    found = {}
    for line in metadata.requires("vibrissa") or ():
        name = re.split(r"[;\[<>=\s]", line, maxsplit=1)[0]
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # an extra that is not installed
            continue
    return found


def results_made(study: Study, digests: Mapping[str, str]) -> dict[str, dict[str, Any]]:
    """SHA-256 of every file of results, the function that made it and of what, by the table of stages.

    Parameters
    ----------
    study : Study
        What was run.
    digests : mapping
        Name of a file → its SHA-256.

    Returns
    -------
    dict
        By file: ``sha256``, ``made_by`` and ``from``.
    """
    known = {name: (_name(output.made_by), list(output.made_from)) for name, output in outputs_of(study)}
    known["report.html"] = REPORT
    how = {name: known.get(name.removesuffix(".nc"), ("", [])) for name in digests}
    return {name: {"sha256": digests[name], "made_by": by, "from": of} for name, (by, of) in how.items()}


def stored(results: Results, out: Path) -> dict[str, Any]:
    """Files of sweeps and comparisons: number of the sweep → name and SHA-256.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.
    out : Path
        Folder of the results.

    Returns
    -------
    dict
        Folder → number of the sweep → ``file`` and ``sha256``.
    """
    if "sweeps" not in results:
        return {}
    table = results["sweeps"]
    addresses = {FOLDER: table.address.values}
    if "comparison" in results and "address" in results["comparison"]:
        addresses[COMPARISONS] = results["comparison"].address.values
    return {
        folder: {
            str(number): {"file": f"{folder}/{address}.nc", "sha256": digest(path_of(out / folder, str(address)))}
            for number, address in zip(table.sweep.values.tolist(), names, strict=True)
        }
        for folder, names in addresses.items()
    }


class _Traced(dict[str, "xr.Dataset"]):
    """Results that remember which of them were read."""

    def __init__(self, results: Results) -> None:
        super().__init__(results)
        self.read = set[str]()

    def __getitem__(self, name: str) -> xr.Dataset:
        self.read.add(name)
        return super().__getitem__(name)


def numbers(results: Results) -> Iterator[dict[str, Any]]:
    """Every number of the report's tables: its words, value, place and sources.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Yields
    ------
    dict
        One number.
    """
    outputs = {output.name: output for stage in STAGES for output in stage.outputs}
    for table, value in (("verdict", "found"), ("sweep_verdict", "error_median")):
        made_from = outputs[table].made_from
        if table in results:
            for i, words in enumerate(results[table].quantity.values.tolist()):
                number = float(results[table][value][i])
                known = number if np.isfinite(number) else None
                yield {"number": words, "value": known, "in": f"{table}.nc: {value}[{i}]", "from": list(made_from)}
    yield from _paper(results)


def _paper(results: Results) -> Iterator[dict[str, Any]]:
    for row in compare(results):
        measure, traced = MEASURES.get(row.paper.id), _Traced(results)
        if measure is None or row.paper.why:
            continue
        here = measure(traced)
        number: dict[str, Any] = {"number": row.paper.text, "id": row.paper.id, **_valued(here)}
        if here.informed is not None:
            number["with_texture_forcing"] = _valued(here.informed)
        number |= {"made_by": _name(measure), "from": sorted(traced.read)}
        yield number | {"origin": row.origin, "same": row.verdict}


def _valued(found: MeasuredNumber) -> dict[str, Any]:
    value, low, high = (float(one) if np.isfinite(one) else None for one in found[:3])
    return {"value": value, "interval": [low, high]}


def _name(measure: Any) -> str:
    """The function at the bottom of a measure, with what it was given."""
    if isinstance(measure, partial):
        given = ", ".join(repr(one) for one in measure.args if isinstance(one, str | int | float))
        return f"{_name(measure.func)}({given})"
    held = [cell.cell_contents for cell in measure.__closure__ or ()]
    inner = [one for one in held if callable(one)]
    if inner:
        return _name(inner[0])
    given = ", ".join(repr(one) for one in held if isinstance(one, str | int | tuple) and one != "")
    return f"{measure.__module__}.{measure.__qualname__.partition('.<locals>')[0]}({given})".removesuffix("()")


def _plain(value: Any) -> Any:
    """As JSON has it."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, Mapping):
        return {str(name): _plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    return str(value) if isinstance(value, Path) else value
