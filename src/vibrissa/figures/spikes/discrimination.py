"""Which texture it was: accuracy of each code, what is confounded with what, ROC curves, how many units it takes."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.figures.canvas import add_caption, bars, house_style, key_above, new_figure
from vibrissa.figures.colours import KINDS, TRUTH
from vibrissa.neural.coding.sensitivity import roc_curve
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FALSE = np.linspace(0, 1, 101)
COLOURS = KINDS[:4]  # of the codes


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """ROC curves beside what was found.

    Parameters
    ----------
    study : mapping
        ``discrimination``, of :func:`vibrissa.neural.coding.discrimination.discriminate`, with or without the accuracy
        by units.

    Returns
    -------
    Dataset
        The same with ``roc_true`` of each code: mean over all pairs of textures. Attributes ``best`` (the code of
        highest accuracy) and ``caption``.
    """
    data = study["discrimination"]
    texture = data.trial_texture.values
    pairs = list(combinations(range(data.sizes["presented"]), 2))
    names = data.presented.values
    every = data.held_out_score.values
    curves = [np.mean([_curve(scores, texture, names, *pair) for pair in pairs], axis=0) for scores in every]
    best = str(data.code.values[int(np.argmax(data.accuracy.values))])
    added = dataset(code=data.code.values, roc_false=FALSE, roc_true=np.array(curves))
    drawn = data.merge(added, combine_attrs="override").assign_attrs(best=best)
    return drawn.assign_attrs(caption=_caption(drawn))


def _curve(scores: Array, texture: NDArray[np.str_], names: NDArray[np.str_], a: int, b: int) -> Array:
    ratio = scores[:, a] - scores[:, b]
    return roc_curve(ratio[texture == names[a]], ratio[texture == names[b]], FALSE)


def _caption(data: xr.Dataset) -> str:
    attrs, rows = data.attrs, zip(data.code.values, data.code_verdict.values, data.code_adjusted_p_value, strict=True)
    verdicts = [f"{code}: {verdict} (adjusted p = {float(p):.2g})" for code, verdict, p in rows]
    units = (
        " D: accuracy from so many units, drawn at random; mean, first and last decile over draws."
        if "units_used" in data.coords
        else " D: d′ of each pair, with 95 % intervals; where no trial is confounded it has no upper end."
    )
    return (
        f"{attrs['n_units']} units, {attrs['n_trials']} trials, bins of {1e3 * attrs['bin_width']:g} ms; every trial "
        f"is read by decoders taught on the other {attrs['n_folds'] - 1} of {attrs['n_folds']} folds. A: share of "
        "trials answered rightly, every texture counted alike, and 95 % interval; grey: what 5 % of all permutations "
        f"of the textures exceed; {'; '.join(verdicts)}. B: answers, best code. C: share of hits over false alarms, "
        f"mean over all pairs.{units}"
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw the four panels.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(9.6, 6.6, 2, 2)
    _draw_accuracy(axes[0, 0], data)
    _draw_confusion(axes[0, 1], data)
    for code, colour in zip(data.code.values, COLOURS, strict=False):
        axes[1, 0].plot(data.roc_false, data.roc_true.sel(code=code), color=colour, label=str(code))
    axes[1, 0].plot([0, 1], [0, 1], color=TRUTH, zorder=0)
    axes[1, 0].set(xlabel="false alarms", ylabel="hits", xlim=(0, 1), ylim=(0, 1.01))
    axes[1, 0].set_title("C  Two textures distinguished")
    key_above(axes[1, 0])
    _draw_units(axes[1, 1], data) if "units_used" in data.coords else _draw_d_prime(axes[1, 1], data)
    return add_caption(figure, data)


def _draw_accuracy(axis: Axes, data: xr.Dataset) -> None:
    at = np.arange(data.sizes["code"])
    for k, code in enumerate(data.code.values):
        one = data.sel(code=code)
        axis.fill_between([k - 0.35, k + 0.35], 0, one.chance_accuracy_high, color=TRUTH, alpha=0.6, lw=0)
        ends = bars(one.accuracy, one.accuracy_low, one.accuracy_high)[:, None]
        axis.errorbar(k, one.accuracy, ends, fmt="o", capsize=3, color=COLOURS[k])
    axis.axhline(data.attrs["chance"], color="0.4", lw=0.8, ls="--")
    axis.set_xticks(at, [str(code) for code in data.code.values])
    axis.set(ylabel="accuracy", ylim=(0, 1.02), title="A  Trials answered rightly")


def _draw_confusion(axis: Axes, data: xr.Dataset) -> None:
    shares = data.confusion.sel(code=data.attrs["best"]).values
    names = [str(name) for name in data.presented.values]
    axis.imshow(shares, vmin=0, vmax=1, cmap="Blues")
    if len(names) <= 10:
        for (i, j), share in np.ndenumerate(shares):
            axis.text(j, i, f"{share:.2f}", ha="center", va="center", color="w" if share > 0.6 else "k", fontsize=7)
    axis.set_xticks(range(len(names)), names, rotation=45 if max(map(len, names)) > 4 else 0)
    axis.set_yticks(range(len(names)), names)
    axis.set(xlabel="answered", ylabel="presented", title=f"B  Answers by the {data.attrs['best']}")


def _draw_units(axis: Axes, data: xr.Dataset) -> None:
    for k, code in enumerate(data.code.values):
        one = data.sel(code=code)
        ends = one.accuracy_by_units_low, one.accuracy_by_units_high
        axis.plot(data.units_used, one.accuracy_by_units, "o-", ms=3, color=COLOURS[k])
        axis.fill_between(data.units_used, *ends, color=COLOURS[k], alpha=0.15, lw=0)
    axis.axhline(data.attrs["chance"], color="0.4", lw=0.8, ls="--")
    axis.set(xlabel="units", ylabel="accuracy", ylim=(0, 1.02), title="D  How many units it takes")
    if data.units_used.max() > 8 * data.units_used.min():
        axis.set_xscale("log", base=2)
    if data.sizes["units_used"] <= 8:
        axis.set_xticks(data.units_used.values, [str(number) for number in data.units_used.values])


def _draw_d_prime(axis: Axes, data: xr.Dataset) -> None:
    """Draw d′ of each pair; one without an upper end is drawn at its lower end, pointing up."""
    for k, code in enumerate(data.code.values):
        one = data.sel(code=code)
        at = np.arange(data.sizes["contrast"]) + 0.16 * (k - (data.sizes["code"] - 1) / 2)
        finite = np.isfinite(one.d_prime_high.values) & np.isfinite(one.d_prime_low.values)
        shown = one.isel(contrast=finite)
        ends = bars(shown.d_prime, shown.d_prime_low, shown.d_prime_high)
        axis.errorbar(at[finite], shown.d_prime, ends, fmt="o", ms=3, capsize=2, color=COLOURS[k])
        axis.plot(at[~finite], one.d_prime_low[~finite], "^", ms=5, color=COLOURS[k])
    axis.axhline(0, color=TRUTH, lw=0.8)
    pairs = [str(pair) for pair in data.contrast.values]
    axis.set_xticks(range(len(pairs)), pairs, rotation=30, ha="right")
    axis.set(ylabel="d′", title="D  Sensitivity, pair by pair")
