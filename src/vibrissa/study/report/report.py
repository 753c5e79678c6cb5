"""The report: one self-contained HTML page with figures, tables and what was assumed."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa import __version__
from vibrissa.mechanics.modes.shift import resonance_shift, shift_remark
from vibrissa.quantities import measured_sd
from vibrissa.quantities.kinds import Progress, Results
from vibrissa.quantities.tracks import stored_names
from vibrissa.study.forward.surface import surface_rows
from vibrissa.study.movie.backward import followed
from vibrissa.study.movie.verdict import VerdictRow, rows_of
from vibrissa.study.paper.paper_numbers import compare
from vibrissa.study.paper.paper_table import page_of
from vibrissa.study.paper.printed import plain, printed
from vibrissa.study.report.drawing import Drawing, drawn
from vibrissa.study.report.gallery import label_of
from vibrissa.study.report.overview import anchored, overview, seeds_of
from vibrissa.study.report.report_neurons import neurons_of, tables_of
from vibrissa.study.report.report_sweeps import base_rows, sweeps_of
from vibrissa.study.report.validity import validity
from vibrissa.study.spec.settings import Study
from vibrissa.study.stages.figure_table import FIGURES, best_entry, left_out, served
from vibrissa.study.stages.stage import FigureEntry
from vibrissa.study.stages.stages import STAGES
from vibrissa.study.store.outcome import not_fitted
from vibrissa.study.store.source import source_digest
from vibrissa.sweep.engine import Engine

if TYPE_CHECKING:
    import xarray as xr

OF_MODES = {  # results of one movie that need its modes
    output.name
    for stage in STAGES
    if stage.part == "movie" and "modal" in {*stage.inputs, *(output.name for output in stage.outputs)}
    for output in stage.outputs
}
_BROKEN = re.compile(r"(\[[−\d.]+,) (?=[−\d.]+\])")  # an interval: lines break before it, not within it
_WHITE, _TRACKED = "_white", "_tracked"  # ends of the keys of rows: of Eq. 5; against the signal of a perfect tracker
_AMPLITUDE = "rms displacement over L"  # of the rows that are printed in 10⁻³ L


def write_report(
    study: Study,
    results: Results,
    folder: Path,
    sweeps: Path,
    not_analysed: Sequence[str] = (),
    *,
    engine: Engine | None = None,
    progress: Progress | None = None,
) -> None:
    """Write the report of a study, ``report.html``, into the folder of its results.

    Parameters
    ----------
    study : Study
        What was asked.
    results : mapping of Datasets
        Its results.
    folder : Path
        Holds the results as files.
    sweeps : Path
        Folder whose ``sweeps`` holds the time series of sweeps, where there are many.
    not_analysed : sequence of str
        What could not be analysed, and why: a line each.
    engine : Engine, optional
        Who draws the figures.
    progress : callable, optional
        Called with ("report", figures drawn, figures in all).
    """
    from jinja2 import Environment, PackageLoader, select_autoescape
    from markupsafe import Markup

    figures = list(_figures(study, results))
    drawings = [Drawing(FIGURES.index(entry), end) for _, entry, end in figures]
    pictures = drawn(drawings, folder, sweeps, engine, progress or (lambda *_: None))
    compared = page_of(compare(results)) if _comparable(results) else {}
    lines = validity(results)
    environment = Environment(loader=PackageLoader("vibrissa.study"), autoescape=select_autoescape())
    body, contents = anchored(
        environment.get_template("report_body.html").render(
            study=study,
            validity=lines,
            not_analysed=not_analysed,
            pictures=[
                {**one._asdict(), "heading": heading, "left_out": _left_out(study, results, entry, one.left_out)}
                for (heading, entry, _), one in zip(figures, pictures, strict=True)
            ],
            **_tables(study, results),
            **compared,
        )
    )
    page = environment.get_template("report.html").render(
        study=study,
        version=__version__,
        overview=overview(study, results, lines, compared.get("paper_tally", ""), len(not_analysed)),
        source=source_digest()[:12],
        seeds=seeds_of(study),
        contents=contents,
        body=Markup(body),
        sortable=bool(tables_of(results)),
    )
    (folder / "report.html").write_text(_BROKEN.sub("\\1\N{NO-BREAK SPACE}", page), encoding="utf-8")


def _comparable(results: Results) -> bool:
    """Whether the study has what the paper has numbers of: sweeps, or single and multi-units of a motion."""
    populations = (units for units in tables_of(results).values() if "unit_quality" in units)
    return "sweeps" in results or any("stimulus_unit" not in units.attrs for units in populations)


def _tables(study: Study, results: Results) -> dict[str, Any]:
    """Cells of the tables, by the names of the template."""
    return {
        **_verdict(results),
        "tracks": _tracks(results["profile"]) if "profile" in results else [],
        "contacts": _contacts(results["profile"]) if "profile" in results else [],
        "remarks": _remarks(study, results),
        "sweeps": sweeps_of(results),
        "shown_sweep": results["posture"].attrs.get("sweep") if "posture" in results else None,
        "base_signals": base_rows(results),
        "surface": surface_rows(results["scan"]) if "scan" in results else [],
        "neurons": neurons_of(results),
    }


def _figures(study: Study, results: Results) -> Iterator[tuple[str, FigureEntry, str]]:
    """Heading, entry and end of the names of every figure that the results serve, and of those asked for in vain."""
    for one in served(results, partial(label_of, results)):
        yield one.heading, one.entry, one.end
    for number, _ in left_out(study, results):
        entry = best_entry(number, results)
        yield entry.heading, entry, ""


def _left_out(study: Study, results: Results, entry: FigureEntry, reason: str) -> str:
    """Say why a figure is left out: of one movie without modes, what the modes lack; nothing of one that is drawn."""
    if not reason:
        return ""
    one_movie = study.movie is not None or study.film is not None
    lacks = "modal" not in results or "left_out" in results["modal"].attrs
    why = why_no_modes(study, results) if one_movie and lacks and set(entry.needs) & OF_MODES else reason
    return f"Left out: {why}."


def _remarks(study: Study, results: Results) -> list[str]:
    lines = json.loads(results["profile"].attrs.get("remarks", "[]")) if "profile" in results else []
    lines += not_fitted(results)
    if "scan" in results:  # its remarks hold that of the curvature
        remarks = json.loads(results["scan"].attrs["remarks"])
        lines += [f"{line[:1].upper()}{line[1:].rstrip('.')}." for line in remarks]
    else:
        lines += _curvature(study)
    return [*lines, *_surface(study)]


def why_no_modes(study: Study, results: Results) -> str:
    """Say why the modes, or their envelopes, of a movie are not in the report.

    Parameters
    ----------
    study : Study
        With a movie.
    results : mapping of Datasets
        Its results; of ``modal`` the attribute ``left_out`` is read.

    Returns
    -------
    str
        Without a full stop.
    """
    parts = [name for name, part in (("[whisker]", study.whisker), ("[posture]", study.posture)) if part is None]
    if parts:
        return (
            f"the study file has no {' and no '.join(parts)}. "
            "Modes need the whisker's length and cone angle, and where it touches a surface"
        )
    return str(results["modal"].attrs["left_out"]) if "modal" in results else "the movie could not be analysed"


def _verdict(results: Results) -> dict[str, Any]:
    """Rows of truth, found and error: of the fits, of those with white forcing, and the error of a perfect tracker."""
    if "verdict" not in results:
        return {"verdict": [], "white": [], "perfect": ""}
    rows = rows_of(results["verdict"])
    truths = {row.row_key: row.truth for row in rows}
    perfect = [abs(row.truth / truths[key] - 1) for row in rows if (key := row.row_key.removesuffix(_TRACKED)) in truths
               and key != row.row_key]  # fmt: skip
    return {
        "verdict": [_verdict_row(row) for row in rows if not row.row_key.endswith((_WHITE, _TRACKED))],
        "white": [_verdict_row(row) for row in rows if row.row_key.endswith(_WHITE)],
        "perfect": f"{max(0.01, 100 * max(perfect)):.2g} %" if perfect else "",
    }


def _verdict_row(row: VerdictRow) -> dict[str, Any]:
    """Cells of one row; truth, found and interval have the digits of the interval, amplitudes are all in 10⁻³ L."""
    _, quantity, unit, *numbers = row
    scale = 1e3 if quantity.startswith(_AMPLITUDE) else 1.0
    truth, found, low, high = (scale * one for one in numbers)
    text = printed(truth, found, low, high)
    unit, quantity = ("10⁻³ L", quantity.replace(_AMPLITUDE, "rms displacement")) if scale > 1 else (unit, quantity)
    return {
        "quantity": quantity if unit == "1" else f"{quantity} [{unit}]",
        "truth": text.truth,
        "found": text.with_interval,
        "error": plain(100 * (found / truth - 1), "+.2f") if np.isfinite(found) else "",
        "inside": "" if not text.low else "yes" if low <= truth <= high else "no",
    }


def _tracks(profile: xr.Dataset) -> list[dict[str, Any]]:
    """How far each whisker was followed, and which frames were lost and why."""
    table = followed(profile)
    lost = (
        json.loads(profile.attrs.get("lost", "[]")) or [[]] * profile.sizes["whisker"]
    )  # other programs give no reasons
    return [
        {
            "name": name,
            "followed": f"{int(table.frames_followed[i])} of {int(table.frames[0])}",
            "length": f"{1e3 * float(table.median_length[i]):.2f}",
            "sd": _node_sd(profile, i),
            "lost": [f"{first}–{last}: {why}" if last > first else f"{first}: {why}" for first, last, why in lost[i]],
        }
        for i, name in enumerate(_names(profile))
    ]


def _node_sd(profile: xr.Dataset, whisker: int) -> str:
    """Median standard deviation of a node [µm]; "not known" where the tracks have none, as those of other programs."""
    if not {"x_sd", "y_sd"} & set(profile.data_vars):
        return "not known"
    return f"{1e6 * float(np.nanmedian(measured_sd(profile).values[whisker])):.1f}"


def _names(profile: xr.Dataset) -> list[str]:
    return stored_names(profile) or [str(i) for i in range(profile.sizes["whisker"])]


def _curvature(study: Study) -> list[str]:
    """What the whisker's curvature would do to the resonances of the modes."""
    if study.posture is None:
        return []
    taken = study.scan.modes if study.scan is not None else "straight"
    line = shift_remark(resonance_shift(study.posture, 1, whisker=study.whisker))
    return [f"Modes, of prediction and decomposition, are {taken}; {line}."]


def _surface(study: Study) -> list[str]:
    """What was decided of the texture's file."""
    notes: list[str] = []
    if study.texture is not None:
        study.texture.made(study.folder, notes.append)
    return [f"Texture: {note}." for note in notes]


def _contacts(profile: xr.Dataset) -> list[dict[str, str]]:
    """Where each whisker touches the substrate, if its line was given, and whether that is consistent with it."""
    if "contact_accepted" not in profile:
        return []
    return [
        {
            "name": name,
            "arc": f"{1e3 * float(profile.contact_arc_length[i]):.2f}",
            "arc_sd": f"{1e3 * float(profile.contact_arc_length_sd[i]):.2f}",
            "height": f"{1e6 * float(profile.contact_height[i]):.0f}",
            "height_sd": f"{1e6 * float(profile.contact_height_sd[i]):.0f}",
            "verdict": f"no: {reason}" if reason else "yes",
        }
        for i, (name, reason) in enumerate(zip(_names(profile), json.loads(profile.attrs["rejected"]), strict=True))
    ]
