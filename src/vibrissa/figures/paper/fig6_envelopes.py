"""Figure 6C–D over sweeps: envelopes predicted and measured, their correlations, and what jitter does to these."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import TooFewError
from vibrissa.figures.canvas import (
    FOUND,
    OTHER,
    P_VALUES,
    TRUTH,
    add_caption,
    house_style,
    new_figure,
    p_words,
    split,
    spread,
)
from vibrissa.mechanics.across.gain import STEP, by_distance, effects, whisker_of_animal
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Series
from vibrissa.stats import LEVEL, fewest_draws, least_p, reaches, significant

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EXAMPLES = 3
SHOWN = 60e-3  # [m] of the distance scanned
PAPER = {1: "0.25 ± 0.15, 161/165", 2: "0.24 ± 0.14, 186/192"}


def compute(study: Mapping[str, xr.Dataset], series: Series) -> xr.Dataset:
    """Correlations of all sweeps, what they depend on, and the envelopes of up to three sweeps.

    Parameters
    ----------
    study : mapping
        ``sweeps``, ``comparison`` (:func:`vibrissa.mechanics.across.comparison.compare_sweeps`), and ``jitter``
        (:func:`vibrissa.study.sweeps.phase_jitter.jittered`) if there is one.
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
    sweeps, held = study["sweeps"], study["comparison"]
    rho = held.correlation.values[:, 0]
    if not np.isfinite(rho).any():
        raise TooFewError("sweeps", "must have one with a prediction at least", remedy="give the texture")
    terms = {name: sweeps[name].values for name in ("contact", "base_angle", "whisker_name")}
    data = held.merge(effects(rho, terms, whisker_of_animal(sweeps)), combine_attrs="override")
    data = data.merge(_examples(sweeps, rho, series), combine_attrs="override")
    if "jitter" in study:
        data = data.merge(study["jitter"], combine_attrs="override")
    return data.assign_attrs(caption=_caption(data))


def alike(sweeps: xr.Dataset, usable: Mask) -> Integers:
    """Sweeps of the whisker and texture that have most of them, as places in the table.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.
    usable : (S,) array of bool
        Sweeps that count.

    Returns
    -------
    (N,) array of int
        Rising.
    """
    key = np.char.add(whisker_of_animal(sweeps), np.char.add(" ", sweeps.texture.values.astype(str)))
    names, counts = np.unique(key[usable], return_counts=True)
    return np.flatnonzero(usable & (key == names[counts.argmax()]))


def _examples(sweeps: xr.Dataset, rho: Array, series: Series) -> xr.Dataset:
    """Sweeps of one whisker over one texture, by the distance scanned."""
    group = alike(sweeps, np.isfinite(rho))
    chosen = spread(group[np.argsort(rho[group])], EXAMPLES)
    length = float(sweeps.length.values[chosen[0]])  # of the one whisker

    def measured(one: xr.Dataset) -> Array:
        return np.asarray(one.envelope.values[0] / length)

    def predicted(one: xr.Dataset) -> Array:
        model = one.envelope_model.values[0]
        return np.asarray(model * measured(one).mean() / model.mean())

    lines = {"example_envelope": measured, "example_predicted": predicted}
    return drawn_by_distance(sweeps, chosen, series, SHOWN, lines, {"example_correlation": rho[chosen]})


def drawn_by_distance(
    sweeps: xr.Dataset,
    chosen: Integers,
    series: Series,
    shown: float,
    lines: Mapping[str, Callable[[xr.Dataset], Array]],
    more: Mapping[str, Any],
) -> xr.Dataset:
    """Courses of some sweeps in time, over the distance scanned.

    Parameters
    ----------
    sweeps : Dataset
        The table.
    chosen : (K,) array of int
        Places in it.
    series : callable
        Number of a sweep → its time series.
    shown : float
        Distance [m], from where all have begun.
    lines : mapping
        Name of a variable → its course (T,) of one sweep's series.
    more : mapping
        Further columns (K,).

    Returns
    -------
    Dataset
        ``lines`` (example, distance_scanned), ``example_speed`` [m/s], ``example_contact`` and ``more`` (example).
    """
    each = [series(int(sweeps.sweep[i])) for i in chosen]
    speed = sweeps.scan_speed.values[chosen]
    pairs = list(zip(speed, each, strict=True))
    x = max(v * float(one.time[0]) for v, one in pairs) + np.arange(0, shown, STEP)
    courses: dict[str, Any] = {
        name: np.array([by_distance(course(one), one.time.values, v, x) for v, one in pairs])
        for name, course in lines.items()
    }
    return dataset(
        example=sweeps.sweep.values[chosen],
        distance_scanned=x,
        example_speed=speed,
        example_contact=sweeps.contact.values[chosen],
        **more,
        **courses,
    )


def _caption(data: xr.Dataset) -> str:
    """Everything the paper prints for 6C–D, here and there."""
    parts = [_mode_words(data.sel(mode=mode)) for mode in data.mode.values]
    p, clustered = (dict(zip(data.term.values, data[name].values, strict=True)) for name in P_VALUES)
    words = (("contact", "ε", 0.95), ("base_angle", "θ_b", 0.96), ("whisker_name", "identity", 0.40))
    each = (f"{word} {p_words(p[name])} | {p_words(clustered[name])} ({paper})" for name, word, paper in words)
    text = (
        "C: envelopes of mode 1, one whisker, one texture; prediction to the mean of the measurement. D: correlation "
        f"at its best lag, ≤ {1e3 * data.attrs['largest_lag']:.0f} ms. {' '.join(parts)} Correlation of mode 1 against "
        f"(p, every sweep a draw | every whisker one; paper in brackets): {'; '.join(each)}."
    )
    return text + (_jitter_words(data) if "jittered_correlation" in data else "")


def _mode_words(one: xr.Dataset) -> str:
    """Mean, and how many are significant by either test."""
    made, able = np.isfinite(one.correlation.values), _able(one)
    rho, n = one.correlation.values[made], int(made.sum())
    pearson = int(significant(one.pearson_p.values).sum())
    mode, mean = int(one.mode), f"{rho.mean():.2f} ± {rho.std():.2f}"
    return f"Mode {mode}: {mean} (paper {PAPER[mode]}); p < {LEVEL} {pearson}/{n} by Pearson{_by_gratings(one, able)}."


def _by_gratings(one: xr.Dataset, able: Mask) -> str:
    """How many are significant by new gratings, with the least p that these can give; nothing without any."""
    count = int(one.pseudo_count.values.max(initial=0))
    if not count:
        return ""
    least = f"the least p of {count} new gratings is {float(least_p(count)):.3g}"
    if not able.any():
        return f"; by new gratings it cannot reach that: {least}"
    passed = int(significant(one.pseudo_p.values[able]).sum())
    chance = np.nanmean(one.chance_mean.values)
    return (
        f", {passed}/{int(able.sum())} by new gratings ({least}; {fewest_draws()} at least that the posture can "
        f"cross), with which it is {chance:.2f} on average"
    )


def _able(one: xr.Dataset) -> Mask:
    """Sweeps held against gratings enough to reach the level."""
    return np.isfinite(one.correlation.values) & reaches(one.pseudo_count.values)


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
    """C on the left, D on the right, jitter beneath D if there is any; each column as full as the other.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    n, modes, jitter = data.sizes["example"], data.mode.values[:2], int("jittered_correlation" in data)
    figure, axes = new_figure(11.5, 2.3 * max(n, len(modes) + jitter) + 0.7, 1, 2, width_ratios=(1.5, 1))
    examples = split(figure, axes[0, 0], heights=[1] * n)
    right = split(figure, axes[0, 1], heights=[1] * (len(modes) + jitter))
    for k, axis in enumerate(examples):
        _draw_example(axis, data.isel(example=k))
    examples[0].legend(ncols=2, loc="upper right")
    examples[-1].set_xlabel("distance scanned [mm]")
    for axis, mode in zip(right, modes, strict=False):
        _draw_distribution(axis, data.sel(mode=mode))
    right[len(modes) - 1].set_xlabel("correlation of the envelopes")
    if jitter:
        _draw_jitter(right[-1], data)
    return add_caption(figure, data)


def _draw_example(axis: Axes, one: xr.Dataset) -> None:
    x = 1e3 * one.distance_scanned
    axis.plot(x, 1e3 * one.example_predicted, color=TRUTH, lw=2.5, label="predicted")
    axis.plot(x, 1e3 * one.example_envelope, color=FOUND, lw=0.9, label="measured")
    title = f"C  ρ = {float(one.example_correlation):.2f}: ε = {float(one.example_contact):.2f}, "
    axis.set(title=title + f"{float(one.example_speed):.2g} m/s", ylabel="envelope, mode 1 [10⁻³ L]")
    last = float(x[np.isfinite(one.example_envelope)].max())
    axis.set(xlim=(float(x[0]), last), ylim=(0, 1.25e3 * float(np.nanmax(one.example_envelope.values))))


def _draw_distribution(axis: Axes, one: xr.Dataset) -> None:
    """Histogram; white where not significant by the new gratings, grey where these are too few; or by Pearson."""
    made, able, name = np.isfinite(one.correlation.values), _able(one), "new gratings"
    p = one.pseudo_p.values
    if not able.any():
        able, p, name = made, one.pearson_p.values, "Pearson"
    rho, passed = one.correlation.values, able & significant(p)
    parts = (
        (passed, FOUND, f"p < {LEVEL} by {name}"),
        (able & ~passed, "white", "not"),
        (made & ~able, "0.8", "not determined"),
    )
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
