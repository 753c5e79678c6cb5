"""Figure 6C–D over sweeps: envelopes predicted and measured, their correlations, and what jitter does to these."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.figures.canvas import FOUND, OTHER, TRUTH, house_style, new_figure, split
from vibrissa.mechanics.gain import STEP, by_distance, effects, whisker_of_animal
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Series = Callable[[int], "xr.Dataset"]

EXAMPLES = 3
LEVEL = 0.05
FEWEST = 19  # new gratings with which p can be as low
SHOWN = 60e-3  # [m] of the distance scanned
PAPER = {1: "0.25 ± 0.15, 161/165", 2: "0.24 ± 0.14, 186/192"}


def compute(study: Mapping[str, xr.Dataset], series: Series) -> xr.Dataset:
    """Correlations of all sweeps, what they depend on, and the envelopes of up to three sweeps.

    Parameters
    ----------
    study : mapping
        ``sweeps``, ``comparison`` (:func:`vibrissa.mechanics.comparison.compare_sweeps`), and ``jitter``
        (:func:`vibrissa.study.phase_jitter.jittered`) if there is one.
    series : callable
        Number of a sweep → its ``envelope`` and ``envelope_model``.

    Returns
    -------
    Dataset
        ``correlation``, ``pearson_p``, ``pseudo_p``, ``chance_mean`` (sweep, mode); ``effect_p`` … (term) of ε, θ_b and
        identity on the correlation of mode 1; ``example_envelope`` and ``example_predicted`` (example,
        distance_scanned): one whisker and texture, the least, middle and largest correlation; the jitter's curves.
        Attribute ``caption``.

    Raises
    ------
    InputError
        If no sweep has a prediction.
    """
    sweeps, told = study["sweeps"], study["comparison"]
    rho = told.correlation.values[:, 0]
    if not np.isfinite(rho).any():
        raise InputError("sweeps", "must have one with a prediction at least", remedy="give the texture")
    terms = {name: sweeps[name].values for name in ("contact", "base_angle", "whisker_name")}
    data = told.merge(effects(rho, terms, whisker_of_animal(sweeps)), combine_attrs="override")
    data = data.merge(_examples(sweeps, rho, series), combine_attrs="override")
    if "jitter" in study:
        data = data.merge(study["jitter"], combine_attrs="override")
    return data.assign_attrs(caption=_caption(data))


def alike(sweeps: xr.Dataset, usable: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Sweeps of the whisker and texture that have most of them, as places in the table."""
    key = np.char.add(whisker_of_animal(sweeps), np.char.add(" ", sweeps.texture.values.astype(str)))
    names, counts = np.unique(key[usable], return_counts=True)
    return np.flatnonzero(usable & (key == names[counts.argmax()]))


def _examples(sweeps: xr.Dataset, rho: Array, series: Series) -> xr.Dataset:
    """Sweeps of one whisker over one texture, by the distance scanned."""
    group = alike(sweeps, np.isfinite(rho))
    group = group[np.argsort(rho[group])]
    chosen = group[np.unique(np.linspace(0, len(group) - 1, EXAMPLES).round().astype(int))]
    each = [series(int(sweeps.sweep[i])) for i in chosen]
    speed = sweeps.scan_speed.values[chosen]
    start = max(v * float(one.time[0]) for v, one in zip(speed, each, strict=True))
    x = start + np.arange(0, SHOWN, STEP)
    lines: dict[str, list[Array]] = {"example_envelope": [], "example_predicted": []}
    for v, one in zip(speed, each, strict=True):
        found, predicted = one.envelope.values[0], one.envelope_model.values[0]
        lines["example_envelope"].append(by_distance(found, one.time.values, v, x))
        scaled = predicted * found.mean() / predicted.mean()
        lines["example_predicted"].append(by_distance(scaled, one.time.values, v, x))
    columns: dict[str, Any] = {name: np.array(values) for name, values in lines.items()}
    return dataset(
        example=sweeps.sweep.values[chosen],
        distance_scanned=x,
        example_speed=speed,
        example_contact=sweeps.contact.values[chosen],
        example_correlation=rho[chosen],
        **columns,
    )


def _caption(data: xr.Dataset) -> str:
    """Everything the paper prints for 6C–D, here and there."""
    parts = [_mode_words(data.sel(mode=mode)) for mode in data.mode.values]
    p, clustered = (dict(zip(data.term.values, data[name].values, strict=True)) for name in _P)
    words = (("contact", "ε", 0.95), ("base_angle", "θ_b", 0.96), ("whisker_name", "identity", 0.40))
    depends = "; ".join(
        f"{word} {p_words(p[name])} | {p_words(clustered[name])} ({paper})" for name, word, paper in words
    )
    text = (
        "C: envelopes of mode 1, one whisker, one texture; prediction to the mean of the measurement. D: correlation "
        f"at its best lag, ≤ {1e3 * data.attrs['largest_lag']:.0f} ms. {' '.join(parts)} Correlation of mode 1 against "
        f"(p, every sweep a draw | every whisker one; paper in brackets): {depends}."
    )
    return text + (_jitter_words(data) if "jittered_correlation" in data else "")


_P = ("effect_p", "effect_p_clustered")


def p_words(value: float) -> str:
    """A p-value as a caption tells it."""
    return "not told" if not np.isfinite(value) else f"{value:.2f}" if value >= 0.01 else f"{value:.0e}"


def _mode_words(one: xr.Dataset) -> str:
    """Mean, and how many are significant by either test."""
    made, able = np.isfinite(one.correlation.values), _able(one)
    rho, n = one.correlation.values[made], int(made.sum())
    pearson, pseudo = (int((one[name].values <= LEVEL).sum()) for name in ("pearson_p", "pseudo_p"))
    chance = (
        f", {pseudo}/{int(able.sum())} by {one.attrs['pseudo_textures']} new gratings ({FEWEST} at least that the "
        f"posture can cross), with which it is {np.nanmean(one.chance_mean.values):.2f} on average"
        if able.any()
        else ""
    )
    mode, mean = int(one.mode), f"{rho.mean():.2f} ± {rho.std():.2f}"
    return f"Mode {mode}: {mean} (paper {PAPER[mode]}); p ≤ {LEVEL} {pearson}/{n} by Pearson{chance}."


def _able(one: xr.Dataset) -> NDArray[np.bool_]:
    """Sweeps held against gratings enough to reach the level."""
    return np.isfinite(one.correlation.values) & (one.pseudo_count.values >= FEWEST)


def _jitter_words(data: xr.Dataset) -> str:
    """What jitter would have to be, and what repeated runs allow."""
    rho, repeat = data.jittered_correlation.values, data.jittered_repeat.values
    allowed = np.nanmin(np.where(repeat >= 0.95, rho, np.nan))
    return (
        f" E: jitter of the tip along the texture. Down to 0.25 (dashed) it brings the correlation "
        f"{'at' if np.nanmin(rho) <= 0.25 else 'nowhere within'} {1e3 * float(data.jitter.max()):.1f} mm; jitter that "
        f"lets runs repeat at 0.95 or more (the paper's 0.96 with the mean of five) leaves it above {allowed:.2f}."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """C on the left, D on the right, jitter beneath D if there is any; each column as full as the other."""
    n, modes, jitter = data.sizes["example"], data.mode.values[:2], int("jittered_correlation" in data)
    figure, axes = new_figure(11.5, 2.3 * max(n, len(modes) + jitter) + 0.7, 1, 2, width_ratios=(1.5, 1))
    examples = split(figure, axes[0, 0], heights=[1] * n)
    told = split(figure, axes[0, 1], heights=[1] * (len(modes) + jitter))
    for k, axis in enumerate(examples):
        _draw_example(axis, data.isel(example=k))
    examples[0].legend(ncols=2, loc="upper right")
    examples[-1].set_xlabel("distance scanned [mm]")
    for axis, mode in zip(told, modes, strict=False):
        _draw_distribution(axis, data.sel(mode=mode))
    told[len(modes) - 1].set_xlabel("correlation of the envelopes")
    if jitter:
        _draw_jitter(told[-1], data)
    figure.supxlabel(fill(data.attrs["caption"], 165), x=0.01, ha="left", fontsize=8)
    return figure


def _draw_example(axis: Axes, one: xr.Dataset) -> None:
    x = 1e3 * one.distance_scanned
    axis.plot(x, 1e3 * one.example_predicted, color=TRUTH, lw=2.5, label="predicted")
    axis.plot(x, 1e3 * one.example_envelope, color=FOUND, lw=0.9, label="measured")
    title = f"C  ρ = {float(one.example_correlation):.2f}: ε = {float(one.example_contact):.2f}, "
    axis.set(title=title + f"{float(one.example_speed):.2g} m/s", ylabel="envelope, mode 1 [10⁻³ L]")
    last = float(x[np.isfinite(one.example_envelope)].max())
    axis.set(xlim=(float(x[0]), last), ylim=(0, 1.25e3 * float(one.example_envelope.max())))


def _draw_distribution(axis: Axes, one: xr.Dataset) -> None:
    """Histogram; white where not significant by the new gratings, grey where these are too few; or by Pearson."""
    made, able, name = np.isfinite(one.correlation.values), _able(one), "new gratings"
    p = one.pseudo_p.values
    if not able.any():
        able, p, name = made, one.pearson_p.values, "Pearson"
    rho, told = one.correlation.values, able & (p <= LEVEL)
    parts = ((told, FOUND, f"p ≤ {LEVEL} by {name}"), (able & ~told, "white", "not"), (made & ~able, "0.8", "not told"))
    some = [(rho[group], colour, label) for group, colour, label in parts if group.any()]
    values, colours, labels = ([entry[k] for entry in some] for k in range(3))
    edges = np.arange(-0.1, 1.0501, 0.05).tolist()
    axis.hist(values, edges, stacked=True, color=colours, edgecolor="0.2", lw=0.6, label=labels)
    if np.isfinite(one.chance_mean.values).any():
        axis.axvline(np.nanmean(one.chance_mean), color=OTHER, ls=":", label="chance, mean")
    axis.set(title=f"D  mode {int(one.mode)}, {int(made.sum())} sweeps", ylabel="sweeps", xlim=(-0.1, 1.05))
    axis.set_ylim(0, 1.35 * axis.get_ylim()[1])  # room for the legend
    axis.legend(loc="upper left", fontsize=7, frameon=True, framealpha=1, edgecolor="none")


def _draw_jitter(axis: Axes, data: xr.Dataset) -> None:
    """Correlation, full, and repeat, dotted, against jitter."""
    for colour, one in zip((FOUND, OTHER, "#009E73"), data.transpose("jitter_time", ...).jitter_time, strict=False):
        line = data.sel(jitter_time=one)
        label = f"slower than {float(one):g} s"
        axis.plot(1e6 * line.jitter, line.jittered_correlation, "o-", ms=3, color=colour, label=label)
        axis.plot(1e6 * line.jitter, line.jittered_repeat, "s:", ms=2.5, color=colour)
    axis.axhline(0.25, color="0.3", ls="--", lw=0.8)
    axis.set(xlabel="jitter of the tip, SD [µm]", ylabel="correlation", ylim=(0, 1.02), title="E  jitter")
    title = "envelope — , motion of repeats ···"
    axis.legend(title=title, title_fontsize=7, loc="lower center", ncols=3, columnspacing=1, fontsize=7)
