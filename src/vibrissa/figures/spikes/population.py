"""The page of a population: what the test and the fits give, unit by unit, in one picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Mask
from vibrissa.figures.canvas import (
    add_caption,
    bars,
    counted,
    house_style,
    new_figure,
    say_absent,
    shown_in,
    whole_numbers,
)
from vibrissa.figures.colours import DOUBTFUL, FOUND, TRUTH

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

OUTCOMES = ("threshold known", "threshold not known", "envelope and phase", "phase", "cannot tell", "not driven")


def compute(units: xr.Dataset) -> xr.Dataset:
    """Say of each unit what came of it, and write the caption.

    Parameters
    ----------
    units : Dataset
        From :func:`vibrissa.neural.coupling.analysis.analyse_units`.

    Returns
    -------
    Dataset
        The same with ``unit_outcome``; attributes ``title`` and ``caption``.
    """
    passed = units.significant.values.astype(bool)
    verdict = units.envelope_verdict.values.astype(str)
    outcome = np.where(verdict == "both", OUTCOMES[2], verdict)
    outcome = np.where(verdict == "envelope", OUTCOMES[1], outcome)
    outcome = np.where(_known(units), OUTCOMES[0], outcome)
    found = units.assign(unit_outcome=("unit", np.where(passed, outcome, OUTCOMES[-1])))
    return found.assign_attrs(title=_title(units), caption=_caption(units))


def _known(units: xr.Dataset) -> Mask:
    """Units whose threshold the trials determine."""
    return units.significant.values.astype(bool) & units.identified.values.astype(bool)


def _title(units: xr.Dataset) -> str:
    passed, count = int(units.significant.sum()), units.sizes["unit"]
    return f"{counted(count, 'unit')}, {passed} of which pass{'es' if passed == 1 else ''} the test"


def _caption(units: xr.Dataset) -> str:
    attrs = units.attrs
    adjusted = "adjusted over units" if attrs["null"] == "circular" else "not adjusted"
    fitted = counted(int(np.isfinite(units.threshold.values).sum()), "unit")
    return (
        f"{counted(attrs['n_trials'], 'presentation')}; a unit passes where p is at most {attrs['level']:g}, "
        f"{adjusted}. Blue, units that pass and whose threshold the trials determine; pale blue, the others that pass; "
        "grey, units that do not. A: largest correlation of rate and envelope. B: thresholds, in their order, with 95 "
        f"% intervals, of {fitted} that could be fitted. C: slope against threshold. D: latencies. E: share of the "
        "variance of the rate over bins that the fit explains, against the most that any function of the stimulus "
        "could. F: what came of the units."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw the page.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Six panels.
    """
    figure, axes = new_figure(10.5, 6.8, 2, 3)
    _draw_correlations(axes[0, 0], data)
    _draw_thresholds(axes[0, 1], data)
    _draw_slopes(axes[0, 2], data)
    _draw_latencies(axes[1, 0], data)
    _draw_explained(axes[1, 1], data)
    _draw_outcomes(axes[1, 2], data)
    figure.suptitle(data.attrs["title"], x=0.01, ha="left", fontsize=11, parse_math=False)
    return add_caption(figure, data)


def _groups(data: xr.Dataset, *names: str) -> dict[str, tuple[str, xr.Dataset]]:
    """Fitted units of which all these are known: colour and units, those determined first."""
    fitted = np.logical_and.reduce([np.isfinite(data[name].values) for name in ("threshold", *names)])
    known = _known(data)
    masks = {"known": (FOUND, fitted & known), "doubtful": (DOUBTFUL, fitted & ~known)}
    return {name: (colour, data.isel(unit=np.flatnonzero(mask))) for name, (colour, mask) in masks.items()}


def _draw_correlations(axis: Axes, data: xr.Dataset) -> None:
    axis.set_title("A  Correlation with the envelope")
    r, known = data.envelope_correlation.values, _known(data)
    passed = data.significant.values.astype(bool)
    if not np.isfinite(r).any():
        say_absent(axis, "no unit has a correlation: all rates are constant")
        return
    edges = np.linspace(min(0.0, float(np.nanmin(r))), max(0.2, float(np.nanmax(r))), 26).tolist()
    parts = [r[mask & np.isfinite(r)] for mask in (known, passed & ~known, ~passed)]
    axis.hist(parts, edges, stacked=True, color=[FOUND, DOUBTFUL, TRUTH])
    axis.set(xlabel="largest correlation over the lags tested", ylabel="units")
    whole_numbers(axis.yaxis)


def _draw_thresholds(axis: Axes, data: xr.Dataset) -> None:
    axis.set_title("B  Thresholds")
    factor, unit = shown_in(str(data.threshold.attrs["units"]))
    order = np.argsort(data.threshold.values, kind="stable")
    sorted_units = data.isel(unit=order[np.isfinite(data.threshold.values[order])])
    if not sorted_units.sizes["unit"]:
        say_absent(axis, "no unit is fitted")
        return
    many = sorted_units.sizes["unit"] > 60
    known = _known(sorted_units)
    for mask, colour in ((known, FOUND), (~known, DOUBTFUL)):
        some, rank = sorted_units.isel(unit=np.flatnonzero(mask)), np.flatnonzero(mask) + 1
        value, low, high = (factor * some[f"threshold{end}"].values for end in ("", "_low", "_high"))
        reach = np.nan_to_num(np.maximum(bars(value, low, high), 0))
        axis.errorbar(value, rank, xerr=reach, fmt="o", ms=2 if many else 4, lw=0.4 if many else 0.9, color=colour)
    axis.set(xlabel=f"threshold [{unit}]", ylabel="unit, in this order", xlim=_shown_range(factor, sorted_units))
    whole_numbers(axis.yaxis)


def _shown_range(factor: float, units: xr.Dataset) -> tuple[float, float]:
    """From the least to the largest threshold and half as far again on both sides: some intervals end far out."""
    low, high = factor * float(units.threshold.min()), factor * float(units.threshold.max())
    margin = max(0.5 * (high - low), 0.5 * abs(high), 1e-9)
    return low - margin, high + margin


def _draw_slopes(axis: Axes, data: xr.Dataset) -> None:
    axis.set_title("C  Slopes")
    factor, unit = shown_in(str(data.threshold.attrs["units"]))
    for colour, some in _groups(data, "slope").values():
        axis.plot(factor * some.threshold, some.slope / factor, "o", ms=3, color=colour)
    if not axis.lines or not any(line.get_xdata().size for line in axis.lines):  # type: ignore[union-attr]
        say_absent(axis, "no unit is fitted")
        return
    axis.set(xlabel=f"threshold [{unit}]", ylabel=f"slope [AP/s/{unit}]", ylim=(0, None))


def _draw_latencies(axis: Axes, data: xr.Dataset) -> None:
    axis.set_title("D  Latencies")
    groups = _groups(data, "latency")
    values: list[Any] = [1e3 * some.latency.values for _, some in groups.values()]
    if not sum(one.size for one in values):
        say_absent(axis, "no unit is fitted")
        return
    last = max(30.0, *(float(one.max(initial=0)) for one in values))
    first = min(0.0, *(float(one.min(initial=0)) for one in values))
    axis.hist(values, np.linspace(first, last, 31).tolist(), stacked=True, color=[FOUND, DOUBTFUL])
    axis.set(xlabel="latency [ms]", ylabel="units", xlim=(first, last))
    whole_numbers(axis.yaxis)


def _draw_explained(axis: Axes, data: xr.Dataset) -> None:
    axis.set_title("E  Variance explained")
    groups = _groups(data, "tuning_r_squared", "tuning_r_squared_ceiling")
    if not any(some.sizes["unit"] for _, some in groups.values()):
        say_absent(axis, "no fitted unit has a ceiling, which needs several trials")
        return
    axis.plot([0, 1], [0, 1], color=TRUTH, lw=0.8)
    for colour, some in groups.values():
        axis.plot(some.tuning_r_squared_ceiling, some.tuning_r_squared, "o", ms=3, color=colour)
    axis.set(xlabel="R² that could be explained", ylabel="R² of the fit", xlim=(0, 1.02), ylim=(0, 1.02))


def _draw_outcomes(axis: Axes, data: xr.Dataset) -> None:
    axis.set_title("F  What came of the units")
    colours = (FOUND, *[DOUBTFUL] * 4, TRUTH)
    counts = [int((data.unit_outcome.values == name).sum()) for name in OUTCOMES]
    axis.barh(
        [name.replace("threshold ", "threshold\n").replace(" and", "\nand") for name in OUTCOMES], counts, color=colours
    )
    for place, count in enumerate(counts):
        axis.text(count, place, f" {count}", va="center")
    axis.set(xlabel="units", xlim=(0, 1.2 * max(counts)), ylim=(len(OUTCOMES) - 0.5, -0.5))
    whole_numbers(axis.xaxis)
