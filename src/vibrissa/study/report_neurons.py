"""What the report tells of units, recorded or simulated: as text, as figures, and as the lines of a run."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.figures import fig8, fig9
from vibrissa.quantities import dataset
from vibrissa.stats import jackknife_interval, wilson_interval
from vibrissa.study.paper_neurons import is_simulated

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Results = Mapping[str, "xr.Dataset"]

FITTED = {"threshold": 1e6, "slope": 1e-6, "latency": 1e3}  # shown in µm, AP/s/µm and ms
FORMS = {"threshold": ".1f", "slope": ".3f", "latency": ".1f", "baseline": ".1f"}


def tables_of(results: Results) -> dict[str, xr.Dataset]:
    """Every table of units among the results, by its name."""
    return {name: data for name, data in results.items() if name == "units" or name.startswith("units_")}


def neurons_of(results: Results) -> list[dict[str, Any]]:
    """Cells of the report's sections on units: one for each table, as the template ``neurons.html`` takes them."""
    return [
        {
            "heading": str(units.attrs.get("label", "Units")),
            "words": _words(units),
            "remarks": json.loads(units.attrs.get("remarks", "[]")),
            "absent": _absent(units),
            "qualities": _qualities(units),
            "truth": _truth(units) if is_simulated(units) else [],
            "units": [_unit(units.isel(unit=k)) for k in np.flatnonzero(_passed(units))],
            "others": Counter(str(why) for why in units.reason.values[~_passed(units)]).most_common(),
        }
        for units in tables_of(results).values()
    ]


def _passed(units: xr.Dataset) -> NDArray[np.bool_]:
    return units.significant.values.astype(bool)


def _told(units: xr.Dataset) -> NDArray[np.bool_]:
    """Units whose threshold and slope count, as in Figure 9."""
    finite = np.isfinite(units.threshold.values) & (units.slope.values > 0)
    return _passed(units) & finite & (units.identified.values.astype(bool) | (units.attrs.get("fit") == "paper2014"))


def _sessions(units: xr.Dataset) -> NDArray[Any]:
    return units.unit_session.values if "unit_session" in units else np.arange(units.sizes["unit"])


def _words(units: xr.Dataset) -> str:
    attrs, count = units.attrs, units.sizes["unit"]
    source = f" of {attrs['source']}" if "source" in attrs else ""
    text = (
        f"{count} unit{'s' if count != 1 else ''}{source}, {attrs['n_trials']} presentations, {_passed(units).sum()} "
    )
    text += f"driven by the envelope (p at most {attrs['level']:g}"
    text += ", adjusted). " if attrs["null"] == "circular" else ", not adjusted). "
    if is_simulated(units):
        text += (
            "The units are simulated: shares, thresholds, slopes and latencies were put in, so that what comes out "
            "tests the analysis and not the brain. "
        )
    return text + "Means with 95 % intervals, of the units whose threshold the trials tell; " + _draws(units)


def _draws(units: xr.Dataset) -> str:
    return (
        "sessions are the independent draws." if "unit_session" in units else "units are taken for independent draws."
    )


def _absent(units: xr.Dataset) -> list[str]:
    """What is not there, and what is not told for it."""
    lines = []
    if "unit_quality" not in units:
        lines.append(
            "Single units are not told from multi-units: no Figure 9, and nothing beside the paper's numbers. Give the "
            "table of spikes a column quality, SU or MU."
        )
    if not np.isfinite(units.spontaneous_rate.values).any():
        lines.append("No window without stimulus: rates below the threshold are not held against spontaneous ones.")
    if not _passed(units).any():
        lines.append("No unit is driven: no threshold, slope and latency.")
    elif not_told := int((_passed(units) & ~_told(units)).sum()):
        lines.append(
            f"The trials do not tell the threshold of {not_told} of the {_passed(units).sum()} driven units; the table "
            "says why."
        )
    if "unit_session" not in units and "source" not in units.attrs:
        lines.append("Sessions are not told apart.")
    return lines


def _qualities(units: xr.Dataset) -> list[list[str]]:
    """Rows: quality, units, driven, share with Wilson's interval, fitted, means with intervals."""
    quality = units.unit_quality.values if "unit_quality" in units else np.full(units.sizes["unit"], "all")
    rows = []
    for name in dict.fromkeys(quality.tolist()):
        some = units.isel(unit=np.flatnonzero(quality == name))
        driven, count = int(_passed(some).sum()), some.sizes["unit"]
        low, high = wilson_interval(driven, count)
        told = np.flatnonzero(_told(some))
        share = f"{100 * driven / count:.1f} ({100 * low:.1f} to {100 * high:.1f})"
        means = [_mean(some.isel(unit=told), name, scale) for name, scale in FITTED.items()]
        rows.append([str(name), str(count), str(driven), share, str(len(told)), *means])
    return rows


def _mean(units: xr.Dataset, name: str, scale: float) -> str:
    values = scale * units[name].values
    if not values.size:
        return ""
    low, high = jackknife_interval(values, clusters=_sessions(units))
    ends = f" ({low:{FORMS[name]}} to {high:{FORMS[name]}})" if np.isfinite(low) else ""
    return f"{values.mean():{FORMS[name]}}{ends}"


def _unit(unit: xr.Dataset) -> list[str]:
    """One driven unit: name, quality, p, threshold, slope, latency, R², what the trials do not tell."""
    quality = str(unit.unit_quality.values) if "unit_quality" in unit else ""
    cells = [str(unit.unit_name.values), quality, f"{float(unit.adjusted_p_value):.2g}"]
    for name, scale in FITTED.items():
        value, low, high = (scale * float(unit[name + end]) for end in ("", "_low", "_high"))
        ends = f" ({low:{FORMS[name]}} to {high:{FORMS[name]}})" if np.isfinite(low) else ""
        cells.append(f"{value:{FORMS[name]}}{ends}" if np.isfinite(value) else "")
    explained = float(unit.tuning_r_squared)
    return [*cells, f"{explained:.2f}" if np.isfinite(explained) else "", str(unit.reason.values)]


def _truth(units: xr.Dataset) -> list[list[str]]:
    """Rows: of what, put in, found, error and coverage of the intervals."""
    driven, passed = units.driven_by.values == "envelope", _passed(units)
    rows = [["driven units that pass", f"{driven.sum()}", f"{(passed & driven).sum()}", "", ""]]
    for role in sorted(set(units.driven_by.values[~driven].tolist())):
        of = units.driven_by.values == role
        rows.append([f"driven by {role}, and passing", f"{of.sum()}", f"{(passed & of).sum()}", "", ""])
    known = units.isel(unit=np.flatnonzero(_told(units) & driven))
    alone = known.isel(unit=np.flatnonzero(known.surround_gain.values == 0))  # others raise the rate of the rest
    for name, some, unit, of in (
        ("threshold", known, "µm", "those told"),
        ("slope", known, "AP/s/µm", "those told"),
        ("latency", known, "ms", "those told"),
        ("baseline", alone, "Hz", "those without a surround"),
    ):
        if some.sizes["unit"]:
            rows.append([f"mean {name} [{unit}], of {of}", *_error(some, name)])
    return rows


def _error(units: xr.Dataset, name: str) -> list[str]:
    """Truth, found, error and coverage of one parameter."""
    true, found, scale = units[f"true_{name}"].values, units[name].values, FITTED.get(name, 1.0)
    error = scale * (found - true)
    held = (units[f"{name}_low"].values <= true) & (true <= units[f"{name}_high"].values)
    low, high = wilson_interval(int(held.sum()), held.size)
    form = FORMS[name]
    spread = f" ± {error.std(ddof=1):{form}}" if error.size > 1 else ""
    return [
        f"{scale * true.mean():{form}}",
        f"{scale * found.mean():{form}}",
        f"{error.mean():+{form}}{spread}",
        f"{held.sum()} of {held.size}, {100 * held.mean():.0f} % ({100 * low:.0f} to {100 * high:.0f})",
    ]


def neuron_figures(results: Results) -> Iterator[tuple[str, Figure | str]]:
    """Figures 8 and 9 of each of several recordings, or why they cannot be made.

    Those of a study's only population go by the names that every figure knows, and are none of these.
    """
    for name, units in tables_of(results).items():
        end = name.removeprefix("units")
        label = str(units.attrs.get("label", name))
        parts = {
            part: results[part + end] for part in ("spikes", "response", "motion", "unit") if part + end in results
        }
        if end and "spikes" in parts:
            yield f"Figure 8: one unit of {label}", fig8.draw(fig8.compute(parts))
        if end:
            yield f"Figure 9: {label}", _figure_9(units)


def _figure_9(units: xr.Dataset) -> Figure | str:
    try:
        return fig9.draw(fig9.compute(units, rng=np.random.default_rng(0)))
    except InputError as error:
        return str(error)


def unit_lines(results: Results) -> xr.Dataset:
    """A line for each table of units.

    Returns
    -------
    Dataset
        By ``population_name``: ``units_counted``, ``units_passed``, ``units_fitted``, and of the last the medians
        ``median_threshold`` [m], ``median_slope`` [1/(s m)], ``median_latency`` [s].
    """
    rows: dict[str, list[Any]] = {}
    for name, units in tables_of(results).items():
        told = _told(units)
        row: dict[str, Any] = {
            "population_name": str(units.attrs.get("label", name)),
            "units_counted": units.sizes["unit"],
            "units_passed": int(_passed(units).sum()),
            "units_fitted": int(told.sum()),
        }
        row |= {f"median_{one}": float(np.median(units[one].values[told])) if told.any() else np.nan for one in FITTED}
        for key, value in row.items():
            rows.setdefault(key, []).append(value)
    columns: dict[str, Any] = {key: np.array(values) for key, values in rows.items()}
    return dataset(lead=("population_name",), **columns)
