"""Where every number comes from: ``provenance.json`` beside the report."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterator, Mapping
from dataclasses import asdict, is_dataclass
from functools import cache, partial
from importlib import metadata, resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa import __version__
from vibrissa.errors import InputError
from vibrissa.files import digest
from vibrissa.study.inputs import input_files
from vibrissa.study.paper_measures import MEASURES
from vibrissa.study.paper_numbers import compare
from vibrissa.study.store import path_of
from vibrissa.study.sweeps import FOLDER

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.settings import Study

Results = Mapping[str, "xr.Dataset"]
COMPARISONS = "comparison"

# What makes a result, and of what: other results, the "study", its "inputs", files of "sweeps/" or "comparison/"
MADE = {
    "apparatus": ("vibrissa.study.apparatus.apparatus", ("study",)),
    "comparison": ("vibrissa.mechanics.comparison.compare_sweeps", ("comparison/",)),
    "gain": ("vibrissa.mechanics.gain.gain_table", ("sweeps",)),
    "gain_map": ("vibrissa.figures.fig7e.compute", ("study", "sweeps")),
    "gap": ("vibrissa.figures.fig2.compute", ("study", "sweeps")),
    "gaps": ("vibrissa.figures.fig6_model.compute", ("study", "sweeps")),
    "jitter": ("vibrissa.study.phase_jitter.jittered", ("sweeps",)),
    "modal": ("vibrissa.mechanics.decomposition.decompose", ("profile",)),
    "mode_shares": ("vibrissa.study.sweep_verdict.mode_shares", ("sweeps",)),
    "motion": ("vibrissa.study.cortex.run_cortex", ("study",)),
    "posture": ("vibrissa.mechanics.stationary.fit_profile", ("profile",)),
    "prediction": ("vibrissa.study.virtual.exposed_signals", ("study",)),
    "profile": ("vibrissa.video.tracking.track", ("movie.mkv", "inputs")),
    "repeats": ("vibrissa.study.repeats.film_repeats", ("study",)),
    "resonance": ("vibrissa.mechanics.resonance.fit_modes", ("modal", "prediction")),
    "resonance_true": ("vibrissa.mechanics.resonance.fit_modes", ("prediction",)),
    "resonance_white": ("vibrissa.mechanics.resonance.fit_modes", ("modal",)),
    "response": ("vibrissa.neural.response.spike_counts", ("spikes", "modal", "prediction")),
    "scan": ("vibrissa.study.surface.scan_surface", ("study", "inputs")),
    "spectra": ("vibrissa.mechanics.resonance.fit_modes", ("modal", "prediction")),
    "spectra_true": ("vibrissa.mechanics.resonance.fit_modes", ("prediction",)),
    "spectra_white": ("vibrissa.mechanics.resonance.fit_modes", ("modal",)),
    "spikes": ("vibrissa.study.virtual.record_unit", ("study", "prediction")),
    "still": ("vibrissa.study.backward.still_of", ("movie.mkv", "inputs")),
    "sweep_verdict": ("vibrissa.study.sweep_verdict.sweep_verdict", ("sweeps",)),
    "sweeps": ("vibrissa.study.sweep_table.sweep_table", ("sweeps/",)),
    "true_profile": ("vibrissa.study.apparatus.true_profile", ("study",)),
    "unit": ("vibrissa.study.shown_unit.shown_unit", ("units", "spikes")),
    "units": ("vibrissa.neural.analysis.analyse_units", ("study", "inputs")),
    "verdict": ("vibrissa.study.verdict.hold_against", ("resonance", "modal", "prediction", "response")),
    "movie.mkv": ("vibrissa.study.virtual.film_motion", ("study",)),
    "report.html": ("vibrissa.study.report.write_report", ("every result",)),
}  # fmt: skip
BY_PREFIX = {
    "base_signal_": ("vibrissa.study.base_signals.analyse_signal", ("inputs", "study")),
    "units_": ("vibrissa.neural.analysis.analyse_units", ("inputs", "study")),
    "spikes_": ("vibrissa.study.neurons", ("inputs",)),
    "response_": ("vibrissa.study.shown_unit.shown_unit", ("spikes", "inputs")),
    "motion_": ("vibrissa.study.neurons", ("inputs",)),
    "unit_": ("vibrissa.study.shown_unit.shown_unit", ("units", "spikes")),
}


def write_provenance(study: Study, results: Results, work: Path, out: Path) -> None:
    """Write ``provenance.json`` for what stands in ``work``, about to be moved to ``out``.

    It tells the study in full, each input's SHA-256, the versions, and of each file of results its SHA-256, the
    function that made it and what it was made of; of sweeps and comparisons, their files: each carries as ``made_of``
    all that it depends on, and is named by it. ``numbers`` lists every number of the report's tables with the results
    that it was computed from. There is no clock in it: equal runs give equal files.
    """
    made = {path.name: digest(path) for path in sorted(work.iterdir())}
    told = {
        "vibrissa_version": __version__,
        "source_sha256": source_digest(),
        "python": platform.python_version(),
        "machine": platform.machine(),
        "libraries": libraries(),
        "study": _plain(asdict(study) | {"folder": ""}),
        "inputs": {name: digest(path) for name, path in input_files(study).items()},
        "results": {name: _made(name, content) for name, content in made.items()},
        "stored": stored(results, out),
        "numbers": list(numbers(results)),
    }
    text = json.dumps(told, indent=1, ensure_ascii=False, sort_keys=True)
    (work / "provenance.json").write_text(text + "\n", encoding="utf-8")


def earlier_results(study: Study, out: Path) -> set[str]:
    """Files that the run before this one made in a folder, as its ``provenance.json`` tells; none if there is none.

    Raises
    ------
    InputError
        If it was a run of another study, by its name: its results may have taken hours.
    """
    try:
        told = json.loads((out / "provenance.json").read_text(encoding="utf-8"))
        name, made = str(told["study"]["name"]), {Path(name).name for name in told["results"]}
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    if name != study.name:
        remedy = "choose another folder, or remove this one"
        raise InputError("--out", "must hold no results of another study", f"{out} with those of {name!r}", remedy)
    return made


@cache
def source_digest() -> str:
    """SHA-256 of this package's modules and data, names included."""
    root = Path(str(resources.files("vibrissa")))
    parts = sorted(path for path in root.rglob("*") if path.suffix in (".py", ".toml", ".csv"))
    told = "\n".join(f"{path.relative_to(root).as_posix()} {digest(path)}" for path in parts)
    return hashlib.sha256(told.encode()).hexdigest()


def libraries() -> dict[str, str]:
    """Versions of the libraries that this package needs, and of extras that are there."""
    found = {}
    for line in metadata.requires("vibrissa") or ():
        name = line.partition(";")[0].strip().split("[")[0].split(">")[0].split("=")[0].split("<")[0].strip()
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # an extra that is not installed
            continue
    return found


def _made(name: str, content: str) -> dict[str, Any]:
    """SHA-256 of a file of results, what made it and of what."""
    stem = name.removesuffix(".nc")
    by, of = MADE.get(stem) or next((how for start, how in BY_PREFIX.items() if stem.startswith(start)), ("", ()))
    return {"sha256": content, "made_by": by, "from": list(of)}


def stored(results: Results, out: Path) -> dict[str, Any]:
    """Files of sweeps and comparisons: number of the sweep → name and SHA-256."""
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


class _Traced(Mapping[str, "xr.Dataset"]):
    """Results that remember which of them were read."""

    def __init__(self, results: Results) -> None:
        self._results, self.read = results, set[str]()

    def __getitem__(self, name: str) -> xr.Dataset:
        self.read.add(name)
        return self._results[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._results)

    def __len__(self) -> int:
        return len(self._results)


def numbers(results: Results) -> Iterator[dict[str, Any]]:
    """Every number of the report's tables: what it is, its value, where it stands and what it was computed from."""
    for table, value in (("verdict", "found"), ("sweep_verdict", "error_median")):
        if table in results:
            for i, words in enumerate(results[table].quantity.values.tolist()):
                number = float(results[table][value][i])
                where = f"{table}.nc: {value}[{i}]"
                yield {"number": words, "value": _finite(number), "in": where, "from": list(MADE[table][1])}
    yield from _paper(results)


def _paper(results: Results) -> Iterator[dict[str, Any]]:
    for row in compare(results):
        measure, traced = MEASURES.get(row.paper.id), _Traced(results)
        if measure is None or row.paper.why:
            continue
        here = measure(traced)
        ends = [_finite(here.low), _finite(here.high)]
        told = {"number": row.paper.text, "id": row.paper.id, "value": _finite(here.value), "interval": ends}
        yield told | {"made_by": _name(measure), "from": sorted(traced.read), "origin": row.origin, "same": row.verdict}


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


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


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
