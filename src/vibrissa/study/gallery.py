"""The paper's figures, each from the results of any study: what a figure needs, and how it is made of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.figures import base_signal as base_figure
from vibrissa.figures import fig1, fig2, fig3, fig4, fig5, fig6, fig6_envelopes, fig6_model, fig7, fig7e, fig8, fig9
from vibrissa.figures import scan as scan_figure
from vibrissa.files import load
from vibrissa.study.sweeps import read_series
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

Results = Mapping[str, "xr.Dataset"]
Series = Callable[[int], "xr.Dataset"]


class Entry(NamedTuple):
    """A figure: its number in the paper, heading, the results it needs, and how it is made of them."""

    number: str
    heading: str
    needs: tuple[str, ...]
    make: Callable[[Results, Series], Figure]


def _first(results: Results, _: Series) -> Figure:
    told = results["posture"].attrs
    whisker = Whisker(length=told["whisker_length"], cone_angle=told["cone_angle"], tip=told["tip"])
    profile, still = results["profile"].isel(whisker=0), results.get("still")
    data = fig1.compute(profile, results["posture"], whisker, still=still, contact_true=told["contact_true"])
    return fig1.draw(data)


def _ninth(results: Results, _: Series) -> Figure:
    units = results["units"]  # of simulated ones the truth stands beside what was found
    truth = units if "driven_by" in units else None
    return fig9.draw(fig9.compute(units, rng=np.random.default_rng(0), truth=truth))


GALLERY = (
    Entry("1", "Figure 1: whisker and profile at rest", ("profile", "posture"), _first),
    Entry("2", "Figure 2: one gap crossed (model)", ("gap",), lambda results, _: fig2.draw(results["gap"])),
    Entry("3", "Figure 3: tracking", ("still", "profile"), lambda results, _: fig3.draw(fig3.compute(results))),
    Entry("4", "Figure 4: decomposition", ("modal",), lambda results, _: fig4.draw(fig4.compute(results))),
    Entry(
        "5",
        "Figure 5: spectra",
        ("spectra_white", "resonance_white"),
        lambda results, series: fig5.draw(fig5.compute(results, series)),
    ),
    Entry("6ab", "Figure 6A–B: gaps of several widths (model)", ("gaps",), lambda r, _: fig6_model.draw(r["gaps"])),
    Entry(
        "6",
        "Figure 6C–D: envelopes predicted and measured",
        ("sweeps", "comparison"),
        lambda results, series: fig6_envelopes.draw(fig6_envelopes.compute(results, series)),
    ),
    Entry(
        "6",
        "Figure 6: envelopes of one sweep",
        ("modal", "prediction"),
        lambda results, _: fig6.draw(fig6.compute(results)),
    ),
    Entry(
        "7",
        "Figure 7A–D: what sets the gain",
        ("sweeps", "gain"),
        lambda results, series: fig7.draw(fig7.compute(results, series)),
    ),
    Entry("7e", "Figure 7E: gain over posture (model)", ("gain_map",), lambda r, _: fig7e.draw(r["gain_map"])),
    Entry("8", "Figure 8: one neuron", ("spikes", "response"), lambda results, _: fig8.draw(fig8.compute(results))),
    Entry("9", "Figure 9: the population", ("units",), _ninth),
)

SURFACE = "From the surface to the follicle (model)"
UNITS = {"significant", "threshold", "slope"}  # what a table of units holds, whatever the file's name
RECORDING = ("units", "spikes", "response", "motion", "unit")  # names of the results of a recording
OF_RECORDINGS = {"8": "spikes", "9": "units"}  # figures of which a folder may hold several, one for each of these files
ONLY_WHERE_MADE = ("2", "6ab", "7e", "9")  # of the model alone, or of a verb of its own: no part of every study

REASONS = {
    "profile": "no movie and no tracks",
    "still": "the sweep shown was given as tracks, without a movie",
    "posture": "no whisker was given, or Eq. 1 could not be laid on its mean profile",
    "modal": "no whisker, no posture, or frames were lost",
    "spectra_white": "no modes",
    "resonance_white": "no modes",
    "prediction": "no texture is known",
    "gap": "made of [laboratory], sweeps or a surface alone, where the posture can cross the gap",
    "gaps": "made of [laboratory], sweeps or a surface alone, where the posture can cross the gaps",
    "gain_map": "made of [laboratory], sweeps or a surface alone",
    "sweeps": "no [laboratory] and no sweeps",
    "comparison": "no texture of a sweep is known: nothing to hold against the measurement",
    "gain": "no sweep was analysed to the end",
    "spikes": "no [recording], no [cortex] and no [[neural]]",
    "response": "no [recording], no [cortex] and no [[neural]]",
    "units": "no table of units: no [cortex] and no [[neural]], or see the verb neural",
}


def numbers() -> list[str]:
    """Numbers of the figures."""
    return list(dict.fromkeys(entry.number for entry in GALLERY))


def missing(entry: Entry, results: Results) -> str:
    """Why a figure cannot be made of these results; nothing if it can."""
    return "; ".join(dict.fromkeys(REASONS[name] for name in entry.needs if name not in results))


def best_entry(number: str, results: Results) -> Entry:
    """The entry of this number that these results serve, else the last that they do not."""
    entries = [entry for entry in GALLERY if entry.number == number]
    if not entries:
        raise InputError("figure", f"must be one of {', '.join(numbers())}", number)
    return next((entry for entry in entries if not missing(entry, results)), entries[0])


def made(entry: Entry, results: Results, series: Series) -> Figure | str:
    """The figure, or why it cannot be made."""
    if reason := missing(entry, results):
        return reason
    try:
        return entry.make(results, series)
    except (InputError, ConvergenceError) as error:
        return str(error)


def figure_of(number: str, folder: str | Path) -> Figure:
    """One figure of the paper, from a folder of results or a single dataset.

    Parameters
    ----------
    number : str
        As in the paper: 1 … 9, 6ab, 7e.
    folder : path
        Folder that ``vibrissa run`` or ``vibrissa sweeps`` wrote; or one dataset that is named as a result is
        (``gap.nc``). One of several recordings is told by its table of units (``units_2.nc``), for Figure 8 too, whose
        spikes are looked for beside it. A table of units may have any name.

    Raises
    ------
    InputError
        If the results do not serve the figure, and says what is missing; or serve it several times, and says of whom.
    """
    given = Path(folder)
    whole = given.is_dir()
    results = _of_folder(number, given) if whole else _of_file(number, given)
    figure = made(best_entry(number, results), results, partial(read_series, given if whole else given.parent))
    if isinstance(figure, str):
        raise InputError(f"figure {number}", f"cannot be made of {given} ({figure})")
    return figure


def _of_folder(number: str, folder: Path) -> dict[str, xr.Dataset]:
    """Results under their names; those of the only recording that has this figure under the names without a number."""
    results = {path.stem: load(path) for path in sorted(folder.glob("*.nc"))}
    name = OF_RECORDINGS.get(number)
    if name is None or name in results:
        return results
    ends = sorted((one.removeprefix(name) for one in results if re.fullmatch(rf"{name}_\d+", one)), key=_place)
    if len(ends) > 1:
        labels = [results[one].attrs.get("label", "") if (one := f"units{end}") in results else "" for end in ends]
        several = ", ".join(f"units{end}.nc ({label})" for end, label in zip(ends, labels, strict=True))
        rule = f"must be of one recording, and {folder} holds {len(ends)}: {several}"
        raise InputError(f"figure {number}", rule, remedy=f"give {folder / f'units{ends[-1]}.nc'}, say")
    return results | {part: results[part + end] for end in ends for part in RECORDING if part + end in results}


def _place(end: str) -> int:
    return int(end.removeprefix("_"))


def _of_file(number: str, path: Path) -> dict[str, xr.Dataset]:
    """One result under the name that it has in a folder: units by what is in the table, others by the file's name.

    For Figure 8 with what else there is of the same recording.
    """
    data = load(path)
    name = re.sub(r"_\d+$", "", path.stem)
    end = path.stem.removeprefix(name)
    files = {part: path.with_name(f"{part}{end}.nc") for part in RECORDING if number == "8" and name in RECORDING}
    beside = {part: load(file) for part, file in files.items() if file.is_file()}
    return {**beside, "units" if set(data.variables) >= UNITS else name: data}


def surface_figures(results: Results) -> list[tuple[str, Figure]]:
    """Heading and figure of a surface that was given without a movie, if one was."""
    some = [results["scan"]] if "scan" in results else []
    return [(SURFACE, scan_figure.draw(scan_figure.compute(one))) for one in some]


def base_figures(results: Results) -> list[tuple[str, Figure]]:
    """Heading and figure of each base signal."""
    some = [data for name, data in results.items() if name.startswith("base_signal_")]
    return [(f"Base signal: {one.attrs['label']}", base_figure.draw(base_figure.compute(one))) for one in some]
