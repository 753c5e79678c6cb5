"""What these units give for each number that the paper prints of neurons and of the stimulator."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import mannwhitneyu

from vibrissa.arrays import Array
from vibrissa.errors import InputError
from vibrissa.figures.paper import fig9
from vibrissa.quantities.kinds import Results
from vibrissa.stats import jackknife_interval
from vibrissa.study.paper.sweep_measures import Measure, MeasuredNumber, mean, share

if TYPE_CHECKING:
    import xarray as xr

NO_QUALITY = "no table of units distinguishes single units from multi-units: give it a column quality, SU or MU"
NO_UNITS = "no units: the study has no [cortex] and no [[neural]]"
COLUMNS = ("unit_quality", "significant", "identified", "threshold", "slope", "latency", "baseline", "unit_rate",
           "tuning_r_squared", "sub_threshold_rate", "spontaneous_rate", "envelope_correlation")  # fmt: skip
_FEWEST = 3  # values of a correlation


def populations(results: Results) -> dict[str, xr.Dataset]:
    """Tables of units among the results: the recorded ones, or else the simulated.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    dict of Datasets
        By name.
    """
    some = {name: data for name, data in results.items() if name == "units" or name.startswith("units_")}
    own = {name: data for name, data in some.items() if not is_simulated(data)}
    return own or some


def is_simulated(units: xr.Dataset) -> bool:
    """Whether the truth of the units is known, so that it was put in.

    Parameters
    ----------
    units : Dataset
        A table of units.

    Returns
    -------
    bool
        By the column ``driven_by``.
    """
    return "driven_by" in units


def pooled(results: Results) -> xr.Dataset | None:
    """Units of all tables with a quality, sessions kept apart; None if there are none.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    Dataset or None
        ``COLUMNS`` (unit).
    """
    import xarray as xr

    parts = []
    for name, units in populations(results).items():
        if "unit_quality" not in units:
            continue
        session = units.unit_session.values if "unit_session" in units else np.zeros(units.sizes["unit"], int)
        columns: dict[str, Any] = {column: ("unit", units[column].values) for column in COLUMNS}
        if "envelope_verdict" in units:
            columns["envelope_verdict"] = ("unit", units["envelope_verdict"].values)
        if is_simulated(units):
            columns["driven_by"] = ("unit", units["driven_by"].values)
        columns["unit_session"] = ("unit", np.array([f"{name} {one}" for one in session.tolist()]))
        parts.append(xr.Dataset(columns, attrs=units.attrs))
    return xr.concat(parts, "unit", combine_attrs="override") if parts else None


def _of_units(measure: Callable[[xr.Dataset], MeasuredNumber]) -> Measure:
    """Measure of the units; a note where there are none, or none has a quality."""

    def on(results: Results) -> MeasuredNumber:
        if not populations(results):
            return MeasuredNumber(note=NO_UNITS)
        units = pooled(results)
        if units is None:
            return MeasuredNumber(note=NO_QUALITY)
        try:
            return measure(units)
        except InputError as error:
            return MeasuredNumber(note=str(error))

    return on


def _fitted(quality: str, name: str, units: xr.Dataset) -> MeasuredNumber:
    """Mean of the units that Figure 9 shows."""
    shown = fig9.compute(units)
    kept = shown.unit_fitted.values.astype(bool) & (units.unit_quality.values == quality)
    if not np.isfinite(values := np.where(kept, units[name].values, np.nan)).any():
        return MeasuredNumber(note=f"no {quality} of known threshold and slope")
    return mean(values, units.unit_session.values, scale="r2" if name == "tuning_r_squared" else "plain")


def _driven(quality: str, units: xr.Dataset) -> MeasuredNumber:
    """Share of units that pass the test."""
    those = units.isel(unit=np.flatnonzero(units.unit_quality.values == quality))
    if not those.sizes["unit"]:
        return MeasuredNumber(note=f"no {quality}")
    passed = those.significant.values.astype(float)
    note = f"{int(passed.sum())} of {passed.size} pass"
    if "envelope_verdict" in those:
        decided = (passed > 0) & ~np.isin(those.envelope_verdict.values, ["phase", "cannot tell"])
        note += f"; {int(decided.sum())} without those that follow the carrier's phase or are undecided"
    if is_simulated(units):
        driven = those.driven_by.values == "envelope"
        note += f"; driven, as put in: {driven.sum()}, of which {int(passed[driven].sum())} pass"
    return share(passed, those.unit_session.values, note)


def _kept(quality: str, units: xr.Dataset) -> MeasuredNumber:
    return MeasuredNumber(float(np.sum(units.unit_quality.values == quality)))


def _difference(name: str, units: xr.Dataset) -> MeasuredNumber:
    """p-value of single against multi-units, by ranks."""
    shown = fig9.compute(units)
    kept = shown.unit_fitted.values.astype(bool)
    su, mu = (units[name].values[kept & (units.unit_quality.values == one)] for one in ("SU", "MU"))
    if min(su.size, mu.size) < _FEWEST:
        return MeasuredNumber(note=f"fewer than {_FEWEST} units of known {name} on one side")
    return MeasuredNumber(
        float(mannwhitneyu(su, mu).pvalue), n=float(su.size + mu.size), note="Mann and Whitney's rank test"
    )


def _spontaneous(quality: str, units: xr.Dataset) -> MeasuredNumber:
    """Squared correlation of the rate below the threshold and the spontaneous rate."""
    below, rest = units.sub_threshold_rate.values, units.spontaneous_rate.values
    if not np.isfinite(rest).any():
        return MeasuredNumber(note="no window without stimulus")
    kept = np.flatnonzero(np.isfinite(below) & np.isfinite(rest) & (units.unit_quality.values == quality))
    if kept.size < _FEWEST:
        return MeasuredNumber(note=f"fewer than {_FEWEST} {quality} with both rates")

    def correlation(chosen: Array) -> float:
        k = chosen.astype(int)
        return float(np.corrcoef(below[k], rest[k])[0, 1]) if np.ptp(rest[k]) > 0 and np.ptp(below[k]) > 0 else 0.0

    index, sessions = kept.astype(float), units.unit_session.values[kept]
    low, high = jackknife_interval(index, correlation, clusters=sessions, scale="correlation")
    least = 0.0 if low < 0 < high else min(low**2, high**2)
    draws = float(len(np.unique(sessions)))
    ends = least, max(low**2, high**2)
    return MeasuredNumber(correlation(index) ** 2, *ends, float(kept.size), "Pearson's, squared", draws=draws)


def _least_rate(units: xr.Dataset) -> MeasuredNumber:
    least = float(units.unit_rate.values.min())
    return MeasuredNumber(least, n=float(units.sizes["unit"]), note="the least, during the stimulus")


def _sessions(units: xr.Dataset) -> MeasuredNumber:
    return MeasuredNumber(float(len(np.unique(units.unit_session.values))))


def _of_settings(measure: Callable[[xr.Dataset], MeasuredNumber]) -> Measure:
    """Measure of how the first table of units was made; a note where the table does not hold it."""

    def on(results: Results) -> MeasuredNumber:
        units = next(iter(populations(results).values()), None)
        if units is None:
            return MeasuredNumber(note=NO_UNITS)
        try:
            return measure(units)
        except KeyError:
            return MeasuredNumber(note="not in the table of units")

    return on


def _attribute(name: str, note: str = "") -> Measure:
    """An attribute of the table."""
    return _of_settings(lambda units: MeasuredNumber(float(units.attrs[name]), note=note))


def _chosen(*path: str) -> Measure:
    """A setting of the virtual session."""

    def of(units: xr.Dataset) -> MeasuredNumber:
        value: Any = json.loads(units.attrs["cortex"])
        for key in path:
            value = value[key]
        return MeasuredNumber(float(value))

    return _of_settings(of)


def _rats(units: xr.Dataset) -> MeasuredNumber:
    return MeasuredNumber(float(len(np.unique(units["unit_rat"].values))))


def _lags(units: xr.Dataset) -> MeasuredNumber:
    first, last = (int(units.attrs[name]) for name in ("lag_low", "lag_high"))
    low, high = (float(lag * units.attrs["bin_width"]) for lag in (first, last))
    note = "" if low < 0 else "only responses after their stimulus"
    return MeasuredNumber(high, low, high, note=note, text=f"{first} to {last} bins".replace("-", "−"))


def _percentile(units: xr.Dataset) -> MeasuredNumber:
    level = float(units.attrs["level"])
    note = "adjusted over the units of a whisker, or of the recording"
    return MeasuredNumber(level, note=note, text=f"{100 * (1 - level):g}th percentile")


def _band(units: xr.Dataset) -> MeasuredNumber:
    low, high = (float(units.attrs[name]) for name in ("band_low", "band_high"))
    return MeasuredNumber(high, low, high)


def _shuffles(units: xr.Dataset) -> MeasuredNumber:
    if units.attrs["null"] == "paper2014":
        return MeasuredNumber(300.0)
    shifts = round(units.attrs["duration"] / units.attrs["bin_width"])
    return MeasuredNumber(
        float(shifts), note="circular shifts, all but those near 0 or near the delay of another whisker"
    )


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
    "percentile": _of_settings(_percentile),
    "lags": _of_settings(_lags),
    **{name: _attribute("n_trials") for name in ("presentations", "presentations_caption")},
    **{f"{name}_difference": _of_units(partial(_difference, name)) for name in ("threshold", "slope")},
    **{f"{name}_{one.lower()}{reading}": _of_units(partial(measure, one)) for one in ("SU", "MU")
       for name, measure in (("units", _kept), ("driven", _driven)) for reading in ("", "_methods")},
    **{f"{name}_{one.lower()}": _of_units(partial(_fitted, one, column)) for one in ("SU", "MU") for name, column in
       (("envelope_r2", "tuning_r_squared"), ("threshold", "threshold"), ("slope", "slope"))},
    **{f"spontaneous_{one.lower()}": _of_units(partial(_spontaneous, one)) for one in ("SU", "MU")},
    "driven_mu_printed": _of_units(partial(_driven, "MU")),
}  # fmt: skip
