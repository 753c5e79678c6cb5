"""Cells of the report's sections on units, recorded or simulated, and their lines at the end of a run."""

from __future__ import annotations

import json
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Mask
from vibrissa.figures.canvas import counted, shown_in
from vibrissa.neural.coupling.carrier import share_remark
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Results
from vibrissa.stats import jackknife_interval, wilson_interval
from vibrissa.study.paper.paper_neurons import is_simulated
from vibrissa.study.paper.printed import Printed, plain
from vibrissa.study.report.unit_table import unit_table

if TYPE_CHECKING:
    import xarray as xr

FITTED = {"threshold": 1e6, "slope": 1e-6, "latency": 1e3}  # as shown, in UNITS
UNITS = {"threshold": "µm", "slope": "AP/s/µm", "latency": "ms"}
FORMS = {"threshold": ".1f", "slope": ".3f", "latency": ".1f", "baseline": ".1f"}


def tables_of(results: Results) -> dict[str, xr.Dataset]:
    """Every table of units among the results, by its name.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    dict of Datasets
        By name.
    """
    return {name: data for name, data in results.items() if name == "units" or name.startswith("units_")}


def neurons_of(results: Results) -> list[dict[str, Any]]:
    """Cells of the report's sections on units: one for each table, as the template ``neurons.html`` takes them.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    list of dict
        One for each table of units.
    """
    return [
        {
            "heading": str(units.attrs.get("label", "Units")),
            "words": _words(units),
            "remarks": json.loads(units.attrs.get("remarks", "[]")),
            "absent": _absent(units),
            "heads": _heads(units),
            "qualities": _qualities(units),
            "truth": _truth(units) if is_simulated(units) else [],
            "units": unit_table(units, np.flatnonzero(_passed(units)).tolist()),
            "others": Counter(str(why) for why in units.reason.values[~_passed(units)]).most_common(),
        }
        for units in tables_of(results).values()
    ]


def _passed(units: xr.Dataset) -> Mask:
    return units.significant.values.astype(bool)


def _determined(units: xr.Dataset) -> Mask:
    """Units whose threshold and slope count, as in Figure 9."""
    finite = np.isfinite(units.threshold.values) & (units.slope.values > 0)
    return _passed(units) & finite & (units.identified.values.astype(bool) | (units.attrs.get("fit") == "paper2014"))


def _fitted(units: xr.Dataset) -> Mask:
    """The same; none of a stimulus that is not in metres, whose numbers cannot be pooled with others."""
    return _determined(units) & ("stimulus_unit" not in units.attrs)


def _sessions(units: xr.Dataset) -> NDArray[Any]:
    return units.unit_session.values if "unit_session" in units else np.arange(units.sizes["unit"])


def _words(units: xr.Dataset) -> str:
    attrs, count = units.attrs, units.sizes["unit"]
    source = f" of {attrs['source']}" if "source" in attrs else ""
    adjusted = "adjusted" if attrs["null"] == "circular" else "not adjusted"
    simulated = (
        "The units are simulated: shares, thresholds, slopes and latencies were put in, so that the results test the "
        "analysis and not the brain. "
    )
    draws = "sessions are the" if "unit_session" in units else "units are taken for"
    presentations = counted(int(attrs["n_trials"]), "presentation")
    return (
        f"{counted(count, 'unit')}{source}, {presentations}, {_passed(units).sum()} "
        f"pass the test of the envelope (p at most {attrs['level']:g}, {adjusted}). "
        f"{simulated if is_simulated(units) else ''}Means with 95 % intervals, of the units whose threshold the trials "
        f"determine; {draws} independent draws."
    )


def _absent(units: xr.Dataset) -> list[str]:
    """Say which inputs are absent, and what cannot be estimated without them."""
    lines = []
    if "unit_quality" not in units:
        lines.append(
            "Single units are not distinguished from multi-units: no Figure 9, and no comparison with the paper's "
            "numbers. Give the table of spikes a column quality, SU or MU."
        )
    if not np.isfinite(units.spontaneous_rate.values).any():
        lines.append("No window without stimulus: rates below the threshold are not compared with spontaneous ones.")
    if not _passed(units).any():
        lines.append("No unit passes the test: no threshold, slope and latency.")
    elif unknown := int((_passed(units) & ~_determined(units)).sum()):
        lines.append(
            f"The trials do not determine the threshold of {unknown} of the {_passed(units).sum()} units that pass; "
            "the table of units says why."
        )
    if remark := share_remark(units):
        lines.append(f"{remark[0].upper()}{remark[1:]}.")
    if "unit_session" not in units and "source" not in units.attrs:
        lines.append("Sessions are not distinguished.")
    return lines


def _shown(units: xr.Dataset) -> dict[str, tuple[float, str]]:
    """Factor and unit of each fitted parameter."""
    factor, unit = shown_in(str(units.threshold.attrs["units"]))
    return {"threshold": (factor, unit), "slope": (1 / factor, f"AP/s/{unit}"), "latency": (1e3, "ms")}


def _heads(units: xr.Dataset) -> list[str]:
    means = (f"{name} [{unit}]" for name, (_, unit) in _shown(units).items())
    return ["quality", "units", "pass", "share [%]", "fitted", *means]


def _qualities(units: xr.Dataset) -> list[list[str]]:
    """Rows: quality, units, passing, share with Wilson's interval, fitted, means with intervals."""
    quality = units.unit_quality.values if "unit_quality" in units else np.full(units.sizes["unit"], "all")
    rows = []
    for name in dict.fromkeys(quality.tolist()):
        some = units.isel(unit=np.flatnonzero(quality == name))
        passed, count = int(_passed(some).sum()), some.sizes["unit"]
        low, high = wilson_interval(passed, count)
        fitted = np.flatnonzero(_determined(some))
        share = f"{100 * passed / count:.0f} [{100 * low:.0f}, {100 * high:.0f}]"
        means = [_mean(some.isel(unit=fitted), name, scale) for name, (scale, _) in _shown(units).items()]
        rows.append([str(name), str(count), str(passed), share, str(len(fitted)), *means])
    return rows


def _mean(units: xr.Dataset, name: str, scale: float) -> str:
    values = scale * units[name].values
    if not values.size:
        return ""
    return _with_ends(name, float(values.mean()), *jackknife_interval(values, clusters=_sessions(units)))


def _with_ends(name: str, value: float, low: float, high: float) -> str:
    """A fitted parameter and its interval, in the units shown."""
    form = FORMS[name] if abs(value) >= 1 or name == "slope" else ".3g"  # a threshold of 0.08 in arbitrary units
    texts = [plain(one, form) for one in (value, low, high)]
    return Printed("", *texts).with_interval if np.isfinite(low) else texts[0]


def mean_of_fitted(units: xr.Dataset, name: str) -> tuple[int, float, float, float, float]:
    """Mean of a fitted parameter in the report's units: count, truth (NaN if not known), found, 95 % interval.

    Of the units whose threshold the trials determine; of simulated ones, of those that the envelope drives.

    Parameters
    ----------
    units : Dataset
        From :func:`vibrissa.neural.coupling.analysis.analyse_units`.
    name : str
        One of ``FITTED``.

    Returns
    -------
    count : int
    truth, found, low, high : float
        NaN where there are none.
    """
    simulated = is_simulated(units)
    kept = _fitted(units) & (units.driven_by.values == "envelope") if simulated else _fitted(units)
    some = units.isel(unit=np.flatnonzero(kept))
    if not some.sizes["unit"]:
        return 0, np.nan, np.nan, np.nan, np.nan
    scale, values = FITTED[name], FITTED[name] * some[name].values
    truth = scale * float(np.nanmean(some[f"true_{name}"].values)) if simulated else np.nan
    return some.sizes["unit"], truth, float(values.mean()), *jackknife_interval(values, clusters=_sessions(some))


def _truth(units: xr.Dataset) -> list[list[str]]:
    """Rows: of what, put in, found, error and coverage of the intervals."""
    driven, passed = units.driven_by.values == "envelope", _passed(units)
    rows = [["driven by the envelope, and passing", f"{driven.sum()}", f"{(passed & driven).sum()}", "", ""]]
    for role in sorted(set(units.driven_by.values[~driven].tolist())):
        of = units.driven_by.values == role
        rows.append([f"driven by {role}, and passing", f"{of.sum()}", f"{(passed & of).sum()}", "", ""])
    if "envelope_verdict" in units:
        decided = passed & ~np.isin(units.envelope_verdict.values, ["phase", "cannot tell"])
        counts = f"{driven.sum()}", f"{(decided & driven).sum()}"
        rows.append(["driven by the envelope, and passing as such, not as driven by the phase", *counts, "", ""])
        rows.append(["others, and passing as such", f"{(~driven).sum()}", f"{(decided & ~driven).sum()}", "", ""])
    known = units.isel(unit=np.flatnonzero(_fitted(units) & driven))
    alone = known.isel(unit=np.flatnonzero(known.surround_gain.values == 0))  # others raise the rate of the rest
    fitted = [(name, known, unit, "those determined") for name, unit in UNITS.items()]
    for name, some, unit, of in (*fitted, ("baseline", alone, "Hz", "those without a surround")):
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
    spread = f" ± {plain(error.std(ddof=1), form)}" if error.size > 1 else ""
    return [
        f"{scale * true.mean():{form}}",
        f"{scale * found.mean():{form}}",
        f"{plain(error.mean(), f'+{form}')}{spread}",
        f"{held.sum()} of {held.size}, {100 * held.mean():.0f} [{100 * low:.0f}, {100 * high:.0f}] %",
    ]


def unit_lines(results: Results) -> xr.Dataset:
    """A line for each table of units.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    Dataset
        By ``population_name``: ``units_counted``, ``units_passed``, ``units_fitted``, and of the last the medians
        ``median_threshold`` [m], ``median_slope`` [1/(s m)], ``median_latency`` [s].
    """
    tables = tables_of(results)
    fitted = {name: units.isel(unit=np.flatnonzero(_fitted(units))) for name, units in tables.items()}
    medians: dict[str, Any] = {
        f"median_{one}": [float(np.median(units[one])) if units.sizes["unit"] else np.nan for units in fitted.values()]
        for one in FITTED
    }
    return dataset(
        lead=("population_name",),
        population_name=[str(units.attrs.get("label", name)) for name, units in tables.items()],
        units_counted=[units.sizes["unit"] for units in tables.values()],
        units_passed=[int(_passed(units).sum()) for units in tables.values()],
        units_fitted=[units.sizes["unit"] for units in fitted.values()],
        **medians,
    )
