"""Figure 9: the threshold-linear response of one unit, thresholds and slopes of a population, beside the paper's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import mannwhitneyu

from vibrissa.arrays import Array
from vibrissa.errors import MissingError, UnknownError
from vibrissa.figures.canvas import add_caption, house_style, key_above, new_figure, split
from vibrissa.figures.paper.parts import fig9_panels as panels
from vibrissa.figures.paper.parts.fig9_panels import QUALITIES, SOURCES
from vibrissa.figures.words import with_error
from vibrissa.quantities import dataset
from vibrissa.stats import wilson_interval

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

Columns = dict[str, NDArray[Any]]

# What the paper prints. It counts its units twice; its "44 %" of 344 is 157, which is 45.6 %.
PAPER: dict[str, dict[str, Any]] = {
    "SU": {"kept": (170, 143), "driven": 45, "printed": "26 %", "threshold": (42.3, 2.1), "slope": (0.25, 0.05)},
    "MU": {"kept": (344, 289), "driven": 157, "printed": "44 %", "threshold": (43.5, 0.9), "slope": (0.25, 0.02)},
}
PAPER_REST = {"SU": 0.66, "MU": 0.67}  # R² of the rate below the threshold against the spontaneous one
PAPER_P = {"threshold": "0.73", "slope": "0.06"}
MEANS = (("threshold", "µm", 1e6), ("slope", "AP/s/µm", 1e-6))
SHARED = (  # (source, quality)
    *("units_kept", "units_driven", "share_driven", "share_driven_low", "share_driven_high"),
    *("threshold_mean", "threshold_sem", "slope_mean", "slope_sem"),
)
NEEDED = ("unit_quality", "significant", "identified", "threshold", "slope", "latency", "baseline")


def compute(units: xr.Dataset, *, truth: xr.Dataset | None = None) -> xr.Dataset:
    """Distributions over the units that the envelope drives, their share, and the paper's numbers.

    Parameters
    ----------
    units : Dataset
        One row for each unit: ``unit_quality``, ``significant``, ``identified``, ``threshold`` [m], ``slope``
        [1/(s m)], ``latency`` [s], ``baseline`` [Hz]; where they are known ``envelope_correlation``,
        ``tuning_r_squared`` and ``unit_session``. Threshold and slope count where the unit is significant and they are
        identified, or were found by the paper's fit, which has no intervals. An attribute ``note`` ends the caption.
    truth : Dataset, optional
        Of a simulated population, in the same order; see :func:`vibrissa.neural.simulated.population.draw_population`.

    Returns
    -------
    Dataset
        ``unit_driven``, ``unit_fitted``, ``fitted_threshold``, ``fitted_slope``, ``fitted_latency``,
        ``unit_correlation`` (unit); ``share_driven`` with its Wilson interval, ``units_driven``, ``units_kept``, mean
        and standard error of threshold and slope (source, quality). Of the fitted single unit whose fit explains most
        ``class_envelope``, ``class_rate`` with its standard error (envelope_class), and its fit as attributes
        ``shown_…``, where the table has the classes. ``below_rate`` and ``rest_rate`` (unit) of fitted units, and their
        squared correlation ``rest_r2`` (quality). Attribute ``caption``.

    Raises
    ------
    InputError
        If a column is missing, or a quality is neither SU nor MU.
    """
    columns = _columns(units)
    if truth is not None and not np.array_equal(truth.unit_quality.values, columns["unit_quality"]):
        raise UnknownError("truth", "must hold the same units in the same order")
    statistics = [_statistics(columns, quality) for quality in QUALITIES]
    known: dict[str, Any] = (
        {} if truth is None else {"true_threshold": _true(truth, "threshold"), "true_slope": _true(truth, "slope")}
    )
    several: dict[str, Any] = {name: np.array([one[name] for one in statistics]).T for name in SHARED}
    one, facts = _one_unit(units, columns)
    data = dataset(
        facts,
        unit_quality=columns["unit_quality"],
        unit_driven=columns["significant"],
        unit_fitted=columns["fitted"],
        fitted_threshold=columns["threshold"],
        fitted_slope=columns["slope"],
        fitted_latency=columns["latency"],
        unit_correlation=columns["envelope_correlation"],
        source=list(SOURCES),
        quality=list(QUALITIES),
        **known,
        **several,
        **one,
        **_at_rest(columns),
    )
    return data.assign_attrs(caption=_caption(data, columns, truth) + str(units.attrs.get("note", "")))


def _columns(units: xr.Dataset) -> Columns:
    """Columns of the table of units; what may be absent is NaN."""
    missing = [name for name in NEEDED if name not in units]
    if missing:
        remedy = "give the table of spikes a column quality, SU or MU" if missing == ["unit_quality"] else ""
        raise MissingError("table of units", f"must have {', '.join(missing)}", remedy=remedy)
    columns: Columns = {name: units[name].values for name in NEEDED}
    strange = sorted(set(columns["unit_quality"].tolist()) - set(QUALITIES))
    if strange:
        raise UnknownError("unit_quality", "must be SU or MU", strange)
    n = len(columns["unit_quality"])
    for name in ("envelope_correlation", "tuning_r_squared", "sub_threshold_rate", "spontaneous_rate"):
        columns[name] = units[name].values if name in units else np.full(n, np.nan)
    columns["envelope_verdict"] = units.envelope_verdict.values if "envelope_verdict" in units else np.full(n, "")
    columns["significant"] = columns["significant"].astype(bool)
    finite = np.isfinite(columns["threshold"]) & np.isfinite(columns["slope"])
    known = columns["identified"].astype(bool) | (units.attrs.get("fit") == "paper2014")
    columns["fitted"] = columns["significant"] & known & finite & (columns["slope"] > 0)
    return columns


def _true(truth: xr.Dataset, name: str) -> Array:
    """Truth of the units that the envelope of their own whisker drives, NaN for the others."""
    return np.where(truth.driven_by.values == "envelope", truth[f"true_{name}"].values, np.nan)


def _statistics(columns: Columns, quality: str) -> dict[str, Any]:
    """Numbers of one quality; three sources each."""
    paper, those = PAPER[quality], columns["unit_quality"] == quality
    driven, fitted = columns["significant"] & those, columns["fitted"] & those
    kept, driven_units = np.array([*paper["kept"], those.sum()]), np.array([paper["driven"]] * 2 + [driven.sum()])
    pairs = zip(driven_units.tolist(), kept.tolist(), strict=True)
    shares = [(k / n, *wilson_interval(k, n)) if n else (np.nan,) * 3 for k, n in pairs]
    names = ("share_driven", "share_driven_low", "share_driven_high")
    found: dict[str, Any] = dict(zip(names, zip(*shares, strict=True), strict=True))
    found |= {"units_kept": kept, "units_driven": driven_units}
    for name, scale in (("threshold", 1e-6), ("slope", 1e6)):
        mean, error = _mean(columns[name][fitted])
        found[f"{name}_mean"] = [scale * paper[name][0]] * 2 + [mean]
        found[f"{name}_sem"] = [scale * paper[name][1]] * 2 + [error]
    return found


def _one_unit(units: xr.Dataset, columns: Columns) -> tuple[dict[str, Any], dict[str, Any]]:
    """Classes and fit of the fitted unit, single if there is one, whose fit explains most; nothing without classes."""
    explained = np.where(columns["fitted"], columns["tuning_r_squared"], np.nan)
    if "response_rate" not in units or not np.isfinite(explained).any():
        return {}, {}
    single = np.where(columns["unit_quality"] == "SU", explained, np.nan)
    place = int(np.nanargmax(single if np.isfinite(single).any() else explained))
    row = units.isel(unit=place)
    classes = {name: row[f"response_{name}"].values for name in ("envelope", "rate", "rate_se")}
    names = ("threshold", "slope", "baseline", "tuning_r_squared", "spontaneous_rate")
    facts: dict[str, Any] = {f"shown_{name}": float(columns[name][place]) for name in names}
    name = str(row.unit_name.values) if "unit_name" in row else f"number {place}"
    facts |= {"shown_quality": str(columns["unit_quality"][place]), "shown_unit": name}
    return {f"class_{name}": values for name, values in classes.items()}, facts


def _at_rest(columns: Columns) -> dict[str, Any]:
    """Rates below the threshold and spontaneous ones of fitted units, and how far the one explains the other."""
    fitted, below, rest = columns["fitted"], columns["sub_threshold_rate"], columns["spontaneous_rate"]
    both = fitted & np.isfinite(below) & np.isfinite(rest)
    r2 = [_squared(below[some], rest[some]) for some in (both & (columns["unit_quality"] == one) for one in QUALITIES)]
    return {"below_rate": np.where(both, below, np.nan), "rest_rate": np.where(both, rest, np.nan), "rest_r2": r2}


def _squared(a: Array, b: Array) -> float:
    """Squared correlation; NaN of fewer than three, or of values that are all alike."""
    return float(np.corrcoef(a, b)[0, 1] ** 2) if a.size > 2 and np.ptp(a) > 0 and np.ptp(b) > 0 else np.nan


def _mean(values: Array) -> tuple[float, float]:
    """Mean and standard error of the values that there are."""
    values = values[np.isfinite(values)]
    if values.size < 2:
        return (float(values[0]) if values.size else np.nan), np.nan
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(values.size))


def _p(columns: Columns, name: str) -> str:
    """Rank test between the qualities, as text."""
    su, mu = (columns[name][columns["fitted"] & (columns["unit_quality"] == quality)] for quality in QUALITIES)
    if min(su.size, mu.size) < 2:
        return "not determined"
    return f"{mannwhitneyu(su, mu).pvalue:.2f}"


def _truth_words(columns: Columns, truth: xr.Dataset) -> str:
    """That the units are simulated, and how many of those that pass the envelope drives."""
    driven, passed = truth.driven_by.values == "envelope", columns["significant"]
    return (
        "Simulated units: thresholds and slopes were put in with the paper's means and spreads, so that agreement "
        f"tests the analysis, not the brain; grey, the truth. The envelope drives {driven.sum()} units, of which "
        f"{np.sum(passed & driven)} pass the test; of the {np.sum(~driven)} others {np.sum(passed & ~driven)} pass. "
    )


def _caption(data: xr.Dataset, columns: Columns, truth: xr.Dataset | None) -> str:
    """What the figure shows, which units count, and the paper's means."""
    passed, fitted = columns["significant"].sum(), columns["fitted"].sum()
    means = "; ".join(_mean_words(data, columns, name, unit, scale) for name, unit, scale in MEANS)
    return (
        ("Figure 9. " if truth is None else f"Figure 9. {_truth_words(columns, truth)}")
        + f"{_one_words(data)} B, C, threshold and slope of each of the {fitted} units, of {passed} that pass, where "
        "both are identified (SU, single units; MU, multi-units); marks above: mean ± SEM, here and (black) in the "
        f"paper. {means}. Not in the paper: {_rest_words(data)}E, largest correlation of rate and envelope; filled, "
        "units that pass. F, share that passes, 95 % Wilson, beside both counts of the paper. G, latencies."
    )


def _one_words(data: xr.Dataset) -> str:
    """A: one unit and its fit."""
    attrs = data.attrs
    if "shown_unit" not in attrs:
        return "A, one unit: its classes of the envelope are not in the table of units."
    rest = (
        f"dotted: its spontaneous rate, {attrs['shown_spontaneous_rate']:.1f} Hz"
        if np.isfinite(attrs["shown_spontaneous_rate"])
        else "its spontaneous rate is not known: no window without stimulus"
    )
    return (
        f"A, rate of one unit ({attrs['shown_unit']}, {attrs['shown_quality']}) in classes of the envelope, mean ± SEM "
        f"over trials, and the fit of two segments: threshold {1e6 * attrs['shown_threshold']:.1f} µm, slope "
        f"{1e-6 * attrs['shown_slope']:.2f} AP/s/µm, R² {attrs['shown_tuning_r_squared']:.2f}; {rest}."
    )


def _mean_words(data: xr.Dataset, columns: Columns, name: str, unit: str, scale: float) -> str:
    """Means of SU and MU beside the paper's, and whether they differ."""

    def mean(quality: str) -> str:
        one = data.sel(source="here", quality=quality)
        return with_error(scale * float(one[f"{name}_mean"]), scale * float(one[f"{name}_sem"]))

    paper = {quality: "{:g} ± {:g}".format(*PAPER[quality][name]) for quality in QUALITIES}
    each = ", ".join(f"{quality} {mean(quality)} (paper {paper[quality]})" for quality in QUALITIES)
    p = f"p of SU against MU {_p(columns, name)} by ranks (paper {PAPER_P[name]})"
    return f"{name.capitalize()} [{unit}]: {each}, {p}"


def _rest_words(data: xr.Dataset) -> str:
    """D: whether the rate below the threshold is the spontaneous one; nothing where that is not known."""
    if not np.isfinite(data.rest_rate).any():
        return ""
    each = ", ".join(
        f"{quality} {float(r2):.2f} (paper {PAPER_REST[quality]})"
        for quality, r2 in zip(QUALITIES, data.rest_r2.values, strict=True)
    )
    return f"D, rate below the threshold against the spontaneous one; R²: {each}. "


@house_style
def draw(data: xr.Dataset) -> Figure:
    """A one unit, B thresholds, C slopes; D rates at rest if they are known, E correlations, F shares, G latencies.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    from matplotlib.ticker import LogLocator, NullFormatter

    figure, axes = new_figure(9.0, 5.8, 2, 1)
    one, thresholds, slopes = split(figure, axes[0, 0], widths=[1, 1, 1])
    known = bool(np.isfinite(data.rest_rate).any())
    *rest, correlations, shares, latencies = split(figure, axes[1, 0], widths=[1] * (3 + known))
    panels.one_unit(one, data)
    panels.spread(thresholds, data, "threshold", 1e6)
    panels.spread(slopes, data, "slope", 1e-6)
    thresholds.set(xlabel="threshold [µm]", title="B  Thresholds", xlim=(0, None))
    slopes.set(xlabel="slope [AP s⁻¹ µm⁻¹]", title="C  Slopes", xscale="log")
    slopes.xaxis.set_major_locator(LogLocator(subs=(1, 3)))
    slopes.xaxis.set_major_formatter("{x:g}")
    slopes.xaxis.set_minor_formatter(NullFormatter())
    key_above(thresholds)
    for axis in rest:
        panels.at_rest(axis, data)
    panels.correlations(correlations, data)
    panels.shares(shares, data)
    panels.latencies(latencies, data)
    return add_caption(figure, data)
