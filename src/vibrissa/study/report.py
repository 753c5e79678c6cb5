"""The report: one self-contained HTML page with figures, tables and what was assumed."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrissa import __version__
from vibrissa.mechanics.shift import resonance_shift, shift_remark
from vibrissa.quantities import measured_sd
from vibrissa.study.backward import followed
from vibrissa.study.gallery import (
    ONLY_WHERE_MADE,
    Entry,
    Series,
    base_figures,
    best_entry,
    made,
    missing,
    numbers,
    surface_figures,
)
from vibrissa.study.outcome import not_fitted
from vibrissa.study.paper_numbers import compare, page_of
from vibrissa.study.report_neurons import neuron_figures, neurons_of, tables_of
from vibrissa.study.report_sweeps import base_rows, sweeps_of
from vibrissa.study.settings import Study
from vibrissa.study.surface import surface_rows

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

Results = Mapping[str, "xr.Dataset"]

WHITE = "forcing taken for white"


class Picture(NamedTuple):
    """A figure of the report: its heading, its PNG in base64 or why it is left out."""

    heading: str
    png: str
    left_out: str


def write_report(study: Study, results: Results, path: Path, series: Series, not_analysed: Sequence[str] = ()) -> None:
    """Write the report of a study.

    Parameters
    ----------
    study : Study
        What was asked.
    results : mapping of Datasets
        What came out.
    path : Path
        HTML file to write.
    series : callable
        Number of a sweep → its time series, where there are many.
    not_analysed : sequence of str
        What could not be analysed, and why: a line each.
    """
    from jinja2 import Environment, PackageLoader, select_autoescape

    rows = _verdict(results)
    environment = Environment(loader=PackageLoader("vibrissa.study"), autoescape=select_autoescape())
    page = environment.get_template("report.html").render(
        study=study,
        version=__version__,
        not_analysed=not_analysed,
        verdict=[row for row in rows if WHITE not in row["quantity"]],
        white=[row for row in rows if WHITE in row["quantity"]],
        tracks=_tracks(results["profile"]) if "profile" in results else [],
        contacts=_contacts(results["profile"]) if "profile" in results else [],
        remarks=_remarks(study, results),
        sweeps=sweeps_of(results),
        shown_sweep=results["posture"].attrs.get("sweep") if "posture" in results else None,
        base_signals=base_rows(results),
        surface=surface_rows(results["scan"]) if "scan" in results else [],
        neurons=neurons_of(results),
        pictures=[
            *_drawn(surface_figures(results)),
            *_pictures(study, results, series),
            *_neuron_pictures(results),
            *_drawn(base_figures(results)),
        ],
        **(page_of(compare(results)) if "sweeps" in results or tables_of(results) else {}),
    )
    path.write_text(page, encoding="utf-8")


def _pictures(study: Study, results: Results, series: Series) -> Iterator[Picture]:
    """Every figure, or why it is left out; of several of one number the one that the results serve."""
    for number in numbers():
        entry = best_entry(number, results)
        asked = number not in ONLY_WHERE_MADE and ("sweeps" in results or "gain" not in entry.needs)
        if missing(entry, results) and not asked:
            continue
        figure = made(entry, results, series)
        if isinstance(figure, str):
            yield Picture(entry.heading, "", _why(study, results, entry, figure))
        else:
            yield Picture(entry.heading, png_of(figure), "")


def _neuron_pictures(results: Results) -> Iterator[Picture]:
    for heading, figure in neuron_figures(results):
        if isinstance(figure, str):
            yield Picture(heading, "", f"Left out: {figure}.")
        else:
            yield Picture(heading, png_of(figure), "")


def _drawn(figures: list[tuple[str, Figure]]) -> Iterator[Picture]:
    for heading, figure in figures:
        yield Picture(heading, png_of(figure), "")


def png_of(figure: Figure) -> str:
    """PNG of a figure in base64."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return base64.b64encode(buffer.getvalue()).decode()


def _why(study: Study, results: Results, entry: Entry, reason: str) -> str:
    """Say why a figure is left out: what one movie's modes lack is told as before."""
    one_movie = study.movie is not None or study.film is not None
    if one_movie and "sweeps" not in entry.needs and entry.number in ("4", "5", "6", "8"):
        return why_left_out(study, results)
    return f"Left out: {reason}."


def _remarks(study: Study, results: Results) -> list[str]:
    told = json.loads(results["profile"].attrs.get("remarks", "[]")) if "profile" in results else []
    told += not_fitted(results)
    if "scan" in results:  # its remarks hold that of the curvature
        return [*told, *map(_sentence, json.loads(results["scan"].attrs["remarks"])), *_surface(study)]
    return [*told, *_curvature(study), *_surface(study)]


def _sentence(line: str) -> str:
    return line[:1].upper() + line[1:].rstrip(".") + "."


def why_left_out(study: Study, results: Results) -> str:
    """Say why the modal sections, or the unit, are not in the report."""
    if study.whisker is None or study.posture is None:
        parts = [name for name, part in (("[whisker]", study.whisker), ("[posture]", study.posture)) if part is None]
        return (
            f"Left out: the study file has no {' and no '.join(parts)}. "
            "Modes need the whisker's length and cone angle, and where it touches a surface."
        )
    if "modal" in results and "left_out" in results["modal"].attrs:
        return f"Left out: {results['modal'].attrs['left_out']}."
    return "Left out: the study file has no [recording]."


def _verdict(results: Results) -> list[dict[str, Any]]:
    """Rows of truth, found and relative error; ``inside`` says whether the interval holds the truth."""
    if "verdict" not in results:
        return []
    table = results["verdict"]
    rows = []
    for i in range(table.sizes["entry"]):
        truth, found, low, high = (float(table[name][i]) for name in ("truth", "found", "found_low", "found_high"))
        rows.append(
            {
                "quantity": str(table.quantity.values[i]),
                "unit": "" if str(table.quantity_unit.values[i]) == "1" else str(table.quantity_unit.values[i]),
                "truth": f"{truth:.5g}",
                "found": f"{found:.5g}" if np.isfinite(found) else "no fit",
                "error": f"{100 * (found / truth - 1):+.2f} %" if np.isfinite(found) else "",
                "interval": f"{low:.5g} – {high:.5g}" if np.isfinite(low) else "",
                "inside": "" if not np.isfinite(low) else "yes" if low <= truth <= high else "no",
            }
        )
    return rows


def _tracks(profile: xr.Dataset) -> list[dict[str, Any]]:
    """How far each whisker was followed, and which frames were lost and why."""
    table = followed(profile)
    count = table.sizes["whisker"]
    names = _names(profile)
    lost = json.loads(profile.attrs["lost"])
    frames = int(table.frames[0])
    rows = []
    for i in range(count):
        why = [f"{first}–{last}: {reason}" if last > first else f"{first}: {reason}" for first, last, reason in lost[i]]
        rows.append(
            {
                "name": names[i],
                "followed": f"{int(table.frames_followed[i])} of {frames}",
                "length": f"{1e3 * float(table.median_length[i]):.2f}",
                "sd": _node_sd(profile, i),
                "lost": why,
            }
        )
    return rows


def _node_sd(profile: xr.Dataset, whisker: int) -> str:
    """Median standard deviation of a node [µm]; nothing where the tracks tell none, as those of other programs."""
    if not {"x_sd", "y_sd"} & set(profile.data_vars):
        return "not told"
    return f"{1e6 * float(np.nanmedian(measured_sd(profile).values[whisker])):.1f}"


def _names(profile: xr.Dataset) -> list[str]:
    return json.loads(profile.attrs.get("names", "[]")) or [str(i) for i in range(profile.sizes["whisker"])]


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
