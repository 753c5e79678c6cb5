"""Figure 9: thresholds and slopes of a whole population, beside the numbers of the paper."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, mannwhitneyu

from vibrissa.errors import InputError
from vibrissa.figures.canvas import FOUND, OTHER, TRUTH, house_style, new_figure
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]

QUALITIES = ("SU", "MU")
SOURCES = ("paper, N of Results", "paper, N of Methods", "here")
COLOURS = dict(zip(QUALITIES, (FOUND, OTHER), strict=True))
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
        identified, or were found by the paper's fit, which cannot tell. An attribute ``note`` ends the caption.
    rng : Generator
        Resamples the sessions.
    truth : Dataset, optional
        Of a simulated population, in the same order; see :func:`vibrissa.neural.population.draw_population`.

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
        raise InputError("truth", "must hold the same units in the same order")
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
        raise InputError("table of units", f"must have {', '.join(missing)}", remedy=remedy)
    columns: Columns = {name: units[name].values for name in NEEDED}
    strange = sorted(set(columns["unit_quality"].tolist()) - set(QUALITIES))
    if strange:
        raise InputError("unit_quality", "must be SU or MU", strange)
    n = len(columns["unit_quality"])
    for name in ("envelope_correlation", "tuning_r_squared"):
        columns[name] = units[name].values if name in units else np.full(n, np.nan)
    columns["unit_session"] = units.unit_session.values if "unit_session" in units else np.arange(n)
    columns["significant"] = columns["significant"].astype(bool)
    finite = np.isfinite(columns["threshold"]) & np.isfinite(columns["slope"])
    told = columns["identified"].astype(bool) | (units.attrs.get("fit") == "paper2014")
    columns["fitted"] = columns["significant"] & told & finite & (columns["slope"] > 0)
    return columns


def _true(truth: xr.Dataset, name: str) -> Array:
    """Truth of the units that the envelope of their own whisker drives, NaN for the others."""
    return np.where(truth.driven_by.values == "envelope", truth[f"true_{name}"].values, np.nan)


def _statistics(columns: Columns, quality: str, rng: np.random.Generator) -> dict[str, Any]:
    """What is drawn and told of one quality; three sources each."""
    paper, those = PAPER[quality], columns["unit_quality"] == quality
    driven, fitted = columns["significant"] & those, columns["fitted"] & those
    kept, driven_units = np.array([*paper["kept"], those.sum()]), np.array([paper["driven"]] * 2 + [driven.sum()])
    shares = [wilson(int(k), int(n)) for k, n in zip(driven_units, kept, strict=True)]
    found = {
        "units_kept": kept,
        "units_driven": driven_units,
        "share_driven": [share[0] for share in shares],
        "share_driven_low": [share[1] for share in shares],
        "share_driven_high": [share[2] for share in shares],
    }
    for name, scale in (("threshold", 1e-6), ("slope", 1e6)):
        mean, error = _mean(columns[name][fitted])
        found[f"{name}_mean"] = [scale * paper[name][0]] * 2 + [mean]
        found[f"{name}_sem"] = [scale * paper[name][1]] * 2 + [error]
    by_session = _by_session(columns["significant"][those], columns["unit_session"][those], rng)
    return found | {"text": (by_session, _mean(columns["tuning_r_squared"][fitted]))}


def wilson(k: int, n: int) -> tuple[float, float, float]:
    """Share k/n and its 95 % interval by Wilson; NaN where there is none."""
    if n == 0:
        return np.nan, np.nan, np.nan
    low, high = binomtest(k, n).proportion_ci(method="wilson")
    return k / n, float(low), float(high)


def _mean(values: Array) -> tuple[float, float]:
    """Mean and standard error of the values that there are."""
    values = values[np.isfinite(values)]
    if values.size < 2:
        return (float(values[0]) if values.size else np.nan), np.nan
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(values.size))


def _by_session(driven: NDArray[np.bool_], session: NDArray[Any], rng: np.random.Generator) -> tuple[float, float]:
    """95 % interval of the share driven when whole sessions are resampled: their units are not independent."""
    _, index = np.unique(session, return_inverse=True)
    n = np.bincount(index).astype(float)
    if n.size < 2:
        return np.nan, np.nan
    k = np.bincount(index, driven)
    drawn = rng.multinomial(n.size, np.full(n.size, 1 / n.size), RESAMPLES)
    low, high = np.quantile((drawn @ k) / (drawn @ n), (0.025, 0.975))
    return float(low), float(high)


def _table(statistics: list[dict[str, Any]], columns: Columns) -> list[list[str]]:
    """Rows of text: what, SU in the paper, SU here, MU in the paper, MU here."""

    def share(one: dict[str, Any], k: int) -> str:
        low, high = (100 * one[f"share_driven_{end}"][k] for end in ("low", "high"))
        return f"{100 * one['share_driven'][k]:.1f} % [{low:.1f}–{high:.1f}]"

    def pair(one: dict[str, Any], name: str, scale: float, digits: int) -> tuple[str, str]:
        mean, error = (scale * np.array(one[f"{name}_{part}"]) for part in ("mean", "sem"))
        return tuple(f"{mean[k]:.{digits}f} ± {error[k]:.{digits}f}" for k in (0, 2))  # type: ignore[return-value]

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
                ("not told", f"[{100 * low:.1f}–{100 * high:.1f}]"),
                pair(one, "threshold", 1e6, 1),
                pair(one, "slope", 1e-6, 3),
                (PAPER_R2[quality], "–" if np.isnan(r2) else f"{r2:.2f} ± {r2_error:.2f}"),
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


def _p(columns: Columns, name: str) -> str:
    """Rank test between the qualities, as text."""
    su, mu = (columns[name][columns["fitted"] & (columns["unit_quality"] == quality)] for quality in QUALITIES)
    if min(su.size, mu.size) < 2:
        return "–"
    return f"p = {mannwhitneyu(su, mu).pvalue:.2f} (ranks)"


def _told_of_truth(columns: Columns, truth: xr.Dataset) -> str:
    """That the units are simulated, and which of those the envelope does not drive pass its test."""
    role, passed = truth.driven_by.values, columns["significant"]
    driven = role == "envelope"
    others = [f"{np.sum(passed & (role == one))} of {np.sum(role == one)} {one}" for one in np.unique(role[~driven])]
    locked = role == "carrier"
    surprise = (
        "Units locked to the carrier pass where the motion is lopsided: its phase then goes with its broad-band "
        "envelope, and bins of 10 ms cannot tell them from units that demodulate. "
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
        ("" if truth is None else _told_of_truth(columns, truth))
        + f"Of {driven} units that pass the test, {fitted} have an identified threshold and slope; A–C and F "
        f"show these. A: their hinges above the baseline. B, C, F: distributions; black, the paper's mean ± SEM. D: "
        f"largest correlation of rate and envelope, all units; filled, those that pass. E: share that passes, 95 % "
        f"Wilson. The paper counts its units as 170 SU and 344 MU (Results) or 143 and 289 (Methods), both 1.19 times "
        f"apart; its 44 % of 344 MU are 157, which is 45.6 %. With equal means, its p = 0.06 for slopes must compare "
        f"shapes."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """A hinges, B thresholds, C slopes; D correlations, E shares, F latencies; below, the table."""
    figure, axes = new_figure(11.5, 9.4, 3, 3, height_ratios=[1, 1, 1.05])
    hinges, thresholds, slopes, correlations, shares, latencies, *rest = axes.ravel()
    _draw_hinges(hinges, data)
    _draw_spread(thresholds, data, "threshold", 1e6, np.arange(0, 121, 7.5))
    _draw_spread(slopes, data, "slope", 1e-6, np.geomspace(0.01, 4, 20))
    thresholds.set(xlabel="threshold [µm]", title="B  Thresholds")
    slopes.set(xlabel="slope [AP s⁻¹ µm⁻¹]", title="C  Slopes", xscale="log")
    _draw_correlations(correlations, data)
    _draw_shares(shares, data)
    _draw_latencies(latencies, data)
    thresholds.legend(loc="upper right")
    grid = rest[0].get_gridspec()
    for axis in rest:
        axis.remove()
    _draw_table(figure.add_subplot(grid[2, :]), data)
    figure.supxlabel(fill(data.attrs["caption"], 190), x=0.01, ha="left", fontsize=8)
    return figure


def _of(data: xr.Dataset, quality: str, *, mask: str = "unit_fitted") -> xr.Dataset:
    return data.isel(unit=np.flatnonzero((data.unit_quality == quality) & data[mask]))


def _draw_hinges(axis: Axes, data: xr.Dataset) -> None:
    """Every fitted hinge above its baseline."""
    envelope = np.linspace(0, 150e-6, 151)
    for quality in QUALITIES[::-1]:
        units = _of(data, quality)
        above = np.maximum(envelope[:, None] - units.fitted_threshold.values, 0) * units.fitted_slope.values
        axis.plot(1e6 * envelope, above, color=COLOURS[quality], lw=0.5, alpha=0.35)
        axis.plot([], [], color=COLOURS[quality], label=f"{quality}, n = {units.sizes['unit']}")
    axis.set(xlabel="envelope [µm]", ylabel="rate above the baseline [Hz]", ylim=(0, 80), xlim=(0, 150))
    axis.set_title("A  Fitted hinges")
    axis.legend(loc="upper left")


def _draw_spread(axis: Axes, data: xr.Dataset, name: str, scale: float, edges: Array) -> None:
    """Share of the units in each bin, SU and MU, with the means here and in the paper above."""
    tallest = 0.0
    for row, quality in enumerate(QUALITIES):
        values = np.clip(scale * _of(data, quality)[f"fitted_{name}"].values, edges[0], edges[-1])
        weights = np.full(values.size, 1 / max(values.size, 1))
        if f"true_{name}" in data:
            true = scale * data[f"true_{name}"].values[(data.unit_quality == quality).values]
            true = np.clip(true[np.isfinite(true)], edges[0], edges[-1])
            style: dict[str, Any] = {"color": TRUTH, "lw": 2.5, "ls": ("-", ":")[row], "zorder": 0.5}
            label = f"truth, {quality}"
            axis.hist(
                true, edges.tolist(), weights=np.full(true.size, 1 / true.size), histtype="step", label=label, **style
            )
        height, *_ = axis.hist(
            values, edges.tolist(), weights=weights, histtype="step", color=COLOURS[quality], label=quality
        )
        tallest = max(tallest, float(np.max(height)))
    for row, quality in enumerate(QUALITIES):
        for source, colour, shift in (("here", COLOURS[quality], 0.0), (SOURCES[0], "black", 0.05)):
            mean, error = (scale * data[f"{name}_{x}"].sel(source=source, quality=quality) for x in ("mean", "sem"))
            height_here = tallest * (1.12 + 0.13 * row + shift)
            axis.errorbar(mean, height_here, xerr=error, fmt="os"[row], color=colour, ms=3.5, capsize=2)
    axis.set(ylabel="share of units", ylim=(0, 1.4 * tallest if tallest else 1))


def _draw_correlations(axis: Axes, data: xr.Dataset) -> None:
    """Correlations of all units, driven ones filled."""
    edges = np.linspace(-0.2, 1, 31).tolist()
    for quality in QUALITIES[::-1]:
        every = data.unit_correlation.values[(data.unit_quality == quality).values]
        driven = _of(data, quality, mask="unit_driven").unit_correlation.values
        axis.hist(every[np.isfinite(every)], edges, histtype="step", color=COLOURS[quality], label=f"{quality}, all")
        axis.hist(driven[np.isfinite(driven)], edges, color=COLOURS[quality], alpha=0.45, label=f"{quality}, driven")
    axis.set(xlabel="largest correlation with the envelope", ylabel="units", title="D  Correlations")
    if not np.isfinite(data.unit_correlation).any():
        axis.text(0.5, 0.5, "not in the table of units", ha="center", transform=axis.transAxes)
    axis.legend(loc="upper right")


def _draw_shares(axis: Axes, data: xr.Dataset) -> None:
    """Share of driven units, in both readings of the paper and here."""
    for row, quality in enumerate(QUALITIES):
        at = np.arange(len(SOURCES)) + 0.16 * (2 * row - 1)
        share, low, high = (100 * data[f"share_driven{end}"].sel(quality=quality) for end in ("", "_low", "_high"))
        error = [share - low, high - share]
        axis.errorbar(at, share, error, fmt="os"[row], color=COLOURS[quality], capsize=3, ms=5, label=quality)
    axis.set_xticks(range(len(SOURCES)), [name.replace(", ", ",\n") for name in SOURCES])
    axis.set(ylabel="driven by the envelope [%]", ylim=(0, 75), xlim=(-0.6, 2.6), title="E  Share of driven units")
    axis.legend(loc="upper right")


def _draw_latencies(axis: Axes, data: xr.Dataset) -> None:
    """Latencies; the paper gives none."""
    edges = np.linspace(0, 30, 16).tolist()
    for quality in QUALITIES:
        values = 1e3 * _of(data, quality).fitted_latency.values
        axis.hist(values[np.isfinite(values)], edges, histtype="step", color=COLOURS[quality], label=quality)
    axis.set(xlabel="latency [ms]", ylabel="units", title="F  Latencies (none in the paper)")
    axis.legend(loc="upper right")


def _draw_table(axis: Axes, data: xr.Dataset) -> None:
    from matplotlib.transforms import Bbox

    axis.axis("off")
    head = ["", "SU, paper", "SU, here", "MU, paper", "MU, here"]
    table = axis.table(
        data.table_text.values.tolist(),
        colLabels=head,
        colWidths=[0.2, 0.24, 0.16, 0.24, 0.16],
        cellLoc="left",
        bbox=Bbox.unit(),
        edges="horizontal",
    )
    table.auto_set_font_size(False)
    table.set_fontsize(8)
