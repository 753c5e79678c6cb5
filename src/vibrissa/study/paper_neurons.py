"""What these units give for each number that the paper prints of neurons and of the stimulator."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import mannwhitneyu

from vibrissa.errors import InputError
from vibrissa.figures import fig9
from vibrissa.stats import jackknife_interval
from vibrissa.study.sweep_measures import Here, Measure, Results

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

NO_UNITS = "no units: the study has no [cortex] and no [[neural]]"
COLUMNS = ("unit_quality", "significant", "identified", "threshold", "slope", "latency", "baseline", "unit_rate",
           "tuning_r_squared", "sub_threshold_rate", "spontaneous_rate", "envelope_correlation")  # fmt: skip
_FEWEST = 3  # values of a correlation


def populations(results: Results) -> dict[str, xr.Dataset]:
    """Tables of units among the results: the recorded ones, or else the simulated."""
    some = {name: data for name, data in results.items() if name == "units" or name.startswith("units_")}
    own = {name: data for name, data in some.items() if not is_simulated(data)}
    return own or some


def is_simulated(units: xr.Dataset) -> bool:
    """Whether the truth of the units is known, so that it was put in."""
    return "driven_by" in units


def pooled(results: Results) -> xr.Dataset | None:
    """Units of all tables that tell single units from multi-units, sessions apart; None if there are none."""
    import xarray as xr

    parts = []
    for name, units in populations(results).items():
        if "unit_quality" not in units:
            continue
        session = units.unit_session.values if "unit_session" in units else np.zeros(units.sizes["unit"], int)
        columns: dict[str, Any] = {column: ("unit", units[column].values) for column in COLUMNS}
        if is_simulated(units):
            columns["driven_by"] = ("unit", units["driven_by"].values)
        columns["unit_session"] = ("unit", np.array([f"{name} {one}" for one in session.tolist()]))
        parts.append(xr.Dataset(columns, attrs=units.attrs))
    return xr.concat(parts, "unit", combine_attrs="override") if parts else None


def _of_units(measure: Callable[[xr.Dataset], Here]) -> Measure:
    """Measure of the units; says so where there are none, or single units are not told from multi-units."""

    def on(results: Results) -> Here:
        if not populations(results):
            return Here(note=NO_UNITS)
        units = pooled(results)
        if units is None:
            return Here(
                note="no table of units tells single units from multi-units: give it a column quality, SU or MU"
            )
        try:
            return measure(units)
        except InputError as error:
            return Here(note=str(error))

    return on


def _mean(values: Array, sessions: NDArray[Any], quality: str) -> Here:
    made = np.isfinite(values)
    if not made.any():
        return Here(note=f"no {quality} of known threshold and slope")
    low, high = jackknife_interval(values, clusters=sessions)
    spread = f"SD {values[made].std(ddof=1):.3g}" if made.sum() > 1 else ""
    return Here(float(values[made].mean()), low, high, float(made.sum()), spread)


def _fitted(quality: str, name: str, units: xr.Dataset) -> Here:
    """Mean of the units that Figure 9 shows."""
    shown = fig9.compute(units, rng=np.random.default_rng(0))
    kept = shown.unit_fitted.values.astype(bool) & (units.unit_quality.values == quality)
    return _mean(np.where(kept, units[name].values, np.nan), units.unit_session.values, quality)


def _driven(quality: str, units: xr.Dataset) -> Here:
    """Share of units that pass the test."""
    those = units.isel(unit=np.flatnonzero(units.unit_quality.values == quality))
    if not those.sizes["unit"]:
        return Here(note=f"no {quality}")
    passed = those.significant.values.astype(float)
    told = f"{int(passed.sum())} of {passed.size}"
    if is_simulated(units):
        driven = those.driven_by.values == "envelope"
        told += f"; put in: {driven.sum()}, of which {int(passed[driven].sum())} pass"
    return _mean(passed, those.unit_session.values, quality)._replace(note=told)


def _kept(quality: str, units: xr.Dataset) -> Here:
    return Here(float(np.sum(units.unit_quality.values == quality)))


def _difference(name: str, units: xr.Dataset) -> Here:
    """p-value of single against multi-units, by ranks."""
    shown = fig9.compute(units, rng=np.random.default_rng(0))
    kept = shown.unit_fitted.values.astype(bool)
    su, mu = (units[name].values[kept & (units.unit_quality.values == one)] for one in ("SU", "MU"))
    if min(su.size, mu.size) < _FEWEST:
        return Here(note=f"fewer than {_FEWEST} units of known {name} on one side")
    return Here(float(mannwhitneyu(su, mu).pvalue), n=float(su.size + mu.size), note="Mann and Whitney's rank test")


def _spontaneous(quality: str, units: xr.Dataset) -> Here:
    """Squared correlation of the rate below the threshold and the spontaneous rate."""
    below, rest = units.sub_threshold_rate.values, units.spontaneous_rate.values
    if not np.isfinite(rest).any():
        return Here(note="no window without stimulus")
    kept = np.flatnonzero(np.isfinite(below) & np.isfinite(rest) & (units.unit_quality.values == quality))
    if kept.size < _FEWEST:
        return Here(note=f"fewer than {_FEWEST} {quality} with both rates")

    def r2(chosen: Array) -> float:
        k = chosen.astype(int)
        return float(np.corrcoef(below[k], rest[k])[0, 1] ** 2) if np.ptp(rest[k]) > 0 and np.ptp(below[k]) > 0 else 0.0

    ends = jackknife_interval(kept.astype(float), r2, clusters=units.unit_session.values[kept])
    return Here(r2(kept.astype(float)), *ends, float(kept.size), "Pearson's, squared")


def _least_rate(units: xr.Dataset) -> Here:
    return Here(
        float(units.unit_rate.values.min()), n=float(units.sizes["unit"]), note="the least, during the stimulus"
    )


def _sessions(units: xr.Dataset) -> Here:
    return Here(float(len(np.unique(units.unit_session.values))))


def _of_settings(measure: Callable[[xr.Dataset], Here]) -> Measure:
    """Measure of how the first table of units was made; says so where it does not tell."""

    def on(results: Results) -> Here:
        units = next(iter(populations(results).values()), None)
        if units is None:
            return Here(note=NO_UNITS)
        try:
            return measure(units)
        except KeyError:
            return Here(note="not told by the table of units")

    return on


def _attribute(name: str, note: str = "") -> Measure:
    """An attribute of the table."""
    return _of_settings(lambda units: Here(float(units.attrs[name]), note=note))


def _chosen(*path: str) -> Measure:
    """A setting of the virtual session."""

    def of(units: xr.Dataset) -> Here:
        value: Any = json.loads(units.attrs["cortex"])
        for key in path:
            value = value[key]
        return Here(float(value))

    return _of_settings(of)


def _rats(units: xr.Dataset) -> Here:
    return Here(float(len(np.unique(units["unit_rat"].values))))


def _lags(units: xr.Dataset) -> Here:
    low, high = (float(units.attrs[name] * units.attrs["bin_width"]) for name in ("lag_low", "lag_high"))
    return Here(high, low, high, note="" if low < 0 else "only responses after their stimulus")


def _band(units: xr.Dataset) -> Here:
    low, high = (float(units.attrs[name]) for name in ("band_low", "band_high"))
    return Here(high, low, high)


def _shuffles(units: xr.Dataset) -> Here:
    if units.attrs["null"] == "paper2014":
        return Here(300.0)
    shifts = round(units.attrs["duration"] / units.attrs["bin_width"])
    return Here(float(shifts), note="circular shifts, all but those near 0 or near the delay of another whisker")


MEASURES: dict[str, Measure] = {
    "cortex_rats": _of_settings(_rats),
    "cortex_sessions": _of_units(_sessions),
    "refractory": _attribute("refractory"),
    "least_rate": _of_units(_least_rate),
    "stimulated": _attribute("n_whiskers"),
    "stimulus_distance": _chosen("distance"),
    "stimulus_duration": _attribute("duration"),
    "stimulus_textures": _chosen("n_textures"),
    "stimulus_contact": _chosen("posture", "contact"),
    "stimulus_speed": _chosen("scan", "speed"),
    "stimulus_band": _of_settings(_band),
    "response_bins": _attribute("bin_width"),
    "shuffles": _of_settings(_shuffles),
    "percentile": _attribute("level", "adjusted over the units of a whisker, or of the recording"),
    "lags": _of_settings(_lags),
    **{name: _attribute("n_trials") for name in ("presentations", "presentations_caption")},
    **{name: _of_units(partial(_difference, name.removesuffix("_difference"))) for name in
       ("threshold_difference", "slope_difference")},
}  # fmt: skip
for _quality in ("SU", "MU"):
    _end = _quality.lower()
    MEASURES |= {f"units_{_end}{reading}": _of_units(partial(_kept, _quality)) for reading in ("", "_methods")}
    MEASURES |= {f"driven_{_end}{one}": _of_units(partial(_driven, _quality)) for one in ("", "_methods")}
    MEASURES |= {
        f"envelope_r2_{_end}": _of_units(partial(_fitted, _quality, "tuning_r_squared")),
        f"threshold_{_end}": _of_units(partial(_fitted, _quality, "threshold")),
        f"slope_{_end}": _of_units(partial(_fitted, _quality, "slope")),
        f"spontaneous_{_end}": _of_units(partial(_spontaneous, _quality)),
    }
MEASURES["driven_mu_printed"] = MEASURES["driven_mu"]
