"""Figure 9: thresholds and slopes of a whole population, beside the numbers of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import mannwhitneyu

from vibrissa.arrays import Array, Mask
from vibrissa.errors import MissingError, UnknownError
from vibrissa.figures.canvas import add_caption, house_style, merged, new_figure
from vibrissa.figures.paper.parts import fig9_panels as panels
from vibrissa.figures.paper.parts.fig9_panels import QUALITIES, SOURCES
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
PAPER_R2 = {"SU": "0.71 ± 0.03", "MU": "0.72 ± 0.01"}
PAPER_P = {"threshold": "0.73", "slope": "0.06"}
SHARED = (  # (source, quality)
    *("units_kept", "units_driven", "share_driven", "share_driven_low", "share_driven_high"),
    *("threshold_mean", "threshold_sem", "slope_mean", "slope_sem"),
)
NEEDED = ("unit_quality", "significant", "identified", "threshold", "slope", "latency", "baseline")
RESAMPLES = 2000


def compute(units: xr.Dataset, *, rng: np.random.Generator, truth: xr.Dataset | None = None) -> xr.Dataset:
    """Distributions over the units that the envelope drives, their share, and the paper's numbers.

    Parameters
    ----------
    units : Dataset
        One row for each unit: ``unit_quality``, ``significant``, ``identified``, ``threshold`` [m], ``slope``
        [1/(s m)], ``latency`` [s], ``baseline`` [Hz]; where they are known ``envelope_correlation``,
        ``tuning_r_squared`` and ``unit_session``. Threshold and slope count where the unit is significant and they are
        identified, or were found by the paper's fit, which has no intervals. An attribute ``note`` ends the caption.
    rng : Generator
        Resamples the sessions.
    truth : Dataset, optional
        Of a simulated population, in the same order; see :func:`vibrissa.neural.simulated.population.draw_population`.

    Returns
    -------
    Dataset
        ``unit_driven``, ``unit_fitted``, ``fitted_threshold``, ``fitted_slope``, ``fitted_latency``,
        ``fitted_baseline``, ``unit_correlation`` (unit); ``share_driven`` with its Wilson interval, ``units_driven``,
        ``units_kept``, mean and standard error of threshold and slope (source, quality); ``table_text``. Attribute
        ``caption``.

    Raises
    ------
    InputError
        If a column is missing, or a quality is neither SU nor MU.
    """
    columns = _columns(units)
    if truth is not None and not np.array_equal(truth.unit_quality.values, columns["unit_quality"]):
        raise UnknownError("truth", "must hold the same units in the same order")
    statistics = [_statistics(columns, quality, rng) for quality in QUALITIES]
    known: dict[str, Any] = (
        {} if truth is None else {"true_threshold": _true(truth, "threshold"), "true_slope": _true(truth, "slope")}
    )
    several: dict[str, Any] = {name: np.array([one[name] for one in statistics]).T for name in SHARED}
    data = dataset(
        unit_quality=columns["unit_quality"],
        unit_driven=columns["significant"],
        unit_fitted=columns["fitted"],
        fitted_threshold=columns["threshold"],
        fitted_slope=columns["slope"],
        fitted_latency=columns["latency"],
        fitted_baseline=columns["baseline"],
        unit_correlation=columns["envelope_correlation"],
        source=list(SOURCES),
        quality=list(QUALITIES),
        **known,
        **several,
        table_text=_table(statistics, columns),
    )
    return data.assign_attrs(caption=_caption(columns, truth) + str(units.attrs.get("note", "")))


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
    for name in ("envelope_correlation", "tuning_r_squared"):
        columns[name] = units[name].values if name in units else np.full(n, np.nan)
    columns["unit_session"] = units.unit_session.values if "unit_session" in units else np.arange(n)
    columns["envelope_verdict"] = units.envelope_verdict.values if "envelope_verdict" in units else np.full(n, "")
    columns["significant"] = columns["significant"].astype(bool)
    finite = np.isfinite(columns["threshold"]) & np.isfinite(columns["slope"])
    known = columns["identified"].astype(bool) | (units.attrs.get("fit") == "paper2014")
    columns["fitted"] = columns["significant"] & known & finite & (columns["slope"] > 0)
    return columns


def _true(truth: xr.Dataset, name: str) -> Array:
    """Truth of the units that the envelope of their own whisker drives, NaN for the others."""
    return np.where(truth.driven_by.values == "envelope", truth[f"true_{name}"].values, np.nan)


def _statistics(columns: Columns, quality: str, rng: np.random.Generator) -> dict[str, Any]:
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
    by_session = _by_session(columns["significant"][those], columns["unit_session"][those], rng)
    return found | {"text": (by_session, _mean(columns["tuning_r_squared"][fitted]))}


def _mean(values: Array) -> tuple[float, float]:
    """Mean and standard error of the values that there are."""
    values = values[np.isfinite(values)]
    if values.size < 2:
        return (float(values[0]) if values.size else np.nan), np.nan
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(values.size))


def _by_session(driven: Mask, session: NDArray[Any], rng: np.random.Generator) -> tuple[float, float]:
    """95 % interval of the share driven when whole sessions are resampled: their units are not independent.

    NaN where it is not defined: one session, or all units alike.
    """
    _, index = np.unique(session, return_inverse=True)
    n = np.bincount(index).astype(float)
    if n.size < 2 or driven.all() or not driven.any():
        return np.nan, np.nan
    k = np.bincount(index, driven)
    drawn = rng.multinomial(n.size, np.full(n.size, 1 / n.size), RESAMPLES)
    low, high = np.quantile((drawn @ k) / (drawn @ n), (0.025, 0.975))
    return float(low), float(high)


def _table(statistics: list[dict[str, Any]], columns: Columns) -> list[list[str]]:
    """Rows of text: what, SU in the paper, SU here, MU in the paper, MU here."""

    def share(one: dict[str, Any], k: int) -> str:
        if np.isnan(one["share_driven"][k]):  # no units of this quality
            return "–"
        low, high = (100 * one[f"share_driven_{end}"][k] for end in ("low", "high"))
        return f"{100 * one['share_driven'][k]:.1f} % [{low:.1f}–{high:.1f}]"

    def pair(one: dict[str, Any], name: str, scale: float, digits: int) -> tuple[str, str]:
        mean, error = (scale * np.array(one[f"{name}_{part}"]) for part in ("mean", "sem"))
        paper, here = (_with_error(mean[k], error[k], digits) for k in (0, 2))
        return paper, here

    per_quality = []
    for quality, one in zip(QUALITIES, statistics, strict=True):
        n, k, paper = one["units_kept"], one["units_driven"], PAPER[quality]
        (low, high), (r2, r2_error) = one["text"]
        per_quality.append(
            [
                (f"{n[0]} (Results), {n[1]} (Methods)", f"{n[2]}"),
                (f"{k[0]}", f"{k[2]}"),
                (f"{share(one, 0)}; printed {paper['printed']}", share(one, 2)),
                (share(one, 1), "as above"),
                ("not given", "–" if np.isnan(low) else f"[{100 * low:.1f}–{100 * high:.1f}]"),
                pair(one, "threshold", 1e6, 1),
                pair(one, "slope", 1e-6, 3),
                (PAPER_R2[quality], _with_error(r2, r2_error, 2)),
            ]
        )
    names = (
        "units kept, N",
        "driven by the envelope",
        "share of N, Results [95 % Wilson]",
        "share of N, Methods [95 % Wilson]",
        "share, 95 % by sessions",
        "threshold [µm], mean ± SEM",
        "slope [AP/s/µm], mean ± SEM",
        "R², mean ± SEM",
    )
    rows = [[name, *su, *mu] for name, su, mu in zip(names, *per_quality, strict=True)]
    differences = [["SU against MU: " + name, f"p = {PAPER_P[name]}", _p(columns, name), "", ""] for name in PAPER_P]
    return rows + differences


def _with_error(mean: float, error: float, digits: int) -> str:
    """Mean ± standard error as text; of one value no error, of none a dash."""
    if np.isnan(mean):
        return "–"
    return f"{mean:.{digits}f}" if np.isnan(error) else f"{mean:.{digits}f} ± {error:.{digits}f}"


def _p(columns: Columns, name: str) -> str:
    """Rank test between the qualities, as text."""
    su, mu = (columns[name][columns["fitted"] & (columns["unit_quality"] == quality)] for quality in QUALITIES)
    if min(su.size, mu.size) < 2:
        return "–"
    return f"p = {mannwhitneyu(su, mu).pvalue:.2f} (ranks)"


def _truth_words(columns: Columns, truth: xr.Dataset) -> str:
    """That the units are simulated, and which of those the envelope does not drive pass its test."""
    role, passed = truth.driven_by.values, columns["significant"]
    driven = role == "envelope"
    others = [f"{np.sum(passed & (role == one))} of {np.sum(role == one)} {one}" for one in np.unique(role[~driven])]
    locked = role == "carrier"
    decided = ~np.isin(columns["envelope_verdict"], ["phase", "cannot tell"])
    surprise = (
        "Units locked to the carrier pass where the motion is lopsided: its phase then goes with its broad-band "
        f"envelope; finer bins leave {np.sum(passed & locked & decided)} of them. "
        if np.sum(passed & locked) > 0.2 * np.sum(locked)
        else ""
    )
    return (
        "Simulated units: thresholds and slopes were put in with the paper's means and spreads, so that agreement with "
        "the paper tests the analysis, not the brain; grey, the truth put in. Driven units that pass the test: "
        f"{np.sum(passed & driven)} of {driven.sum()}. Driven by something else, and passing: {', '.join(others)}. "
        f"{surprise}"
    )


def _caption(columns: Columns, truth: xr.Dataset | None) -> str:
    """What the figure shows, which units count, and what disagrees in the paper."""
    driven, fitted = columns["significant"].sum(), columns["fitted"].sum()
    return (
        ("" if truth is None else _truth_words(columns, truth))
        + f"Of {driven} units that pass the test, {fitted} have an identified threshold and slope; A–C and F "
        f"show these. A: their hinges above the baseline. B, C, F: distributions; black, the paper's mean ± SEM. D: "
        f"largest correlation of rate and envelope, all units; filled, those that pass. E: share that passes, 95 % "
        f"Wilson. The paper counts its units as 170 SU and 344 MU (Results) or 143 and 289 (Methods), both 1.19 times "
        f"apart; its 44 % of 344 MU are 157, which is 45.6 %. With equal means, its p = 0.06 for slopes must compare "
        f"shapes."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """A hinges, B thresholds, C slopes; D correlations, E shares, F latencies; below, the table.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(11.5, 9.4, 3, 3, height_ratios=[1, 1, 1.05])
    hinges, thresholds, slopes, correlations, shares, latencies = axes[:2].flat
    panels.hinges(hinges, data)
    panels.spread(thresholds, data, "threshold", 1e6, np.arange(0, 121, 7.5))
    panels.spread(slopes, data, "slope", 1e-6, np.geomspace(0.01, 4, 20))
    thresholds.set(xlabel="threshold [µm]", title="B  Thresholds")
    slopes.set(xlabel="slope [AP s⁻¹ µm⁻¹]", title="C  Slopes", xscale="log")
    panels.correlations(correlations, data)
    panels.shares(shares, data)
    panels.latencies(latencies, data)
    thresholds.legend(loc="upper right")
    panels.table(figure.add_subplot(merged(axes[2])), data)
    return add_caption(figure, data)
