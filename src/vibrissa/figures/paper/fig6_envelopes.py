"""Figure 6C–D over sweeps: envelopes predicted and measured, their correlations, and what jitter does to these."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import TooFewError
from vibrissa.figures.canvas import P_VALUES, add_caption, house_style, key_above, new_figure, p_words, split, spread
from vibrissa.figures.colours import MEASURED, PREDICTED, ordered
from vibrissa.figures.colours import PAPER as PAPER_COLOUR
from vibrissa.figures.paper.parts.examples import EXAMPLES, alike, drawn_by_distance
from vibrissa.figures.paper.parts.texture_strip import draw_scanned
from vibrissa.figures.sources import of_sweeps, printed_name
from vibrissa.mechanics.across.gain import effects, whisker_of_animal
from vibrissa.quantities.kinds import Series
from vibrissa.stats import LEVEL, fewest_draws, least_p, reaches, significant

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 60e-3  # [m] of the distance scanned
PAPER_MEAN = {1: 0.25, 2: 0.24}
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
    owner = whisker_of_animal(sweeps)
    terms = {name: sweeps[name].values for name in ("contact", "base_angle")} | {"whisker": owner}
    data = held.merge(effects(rho, terms, owner), combine_attrs="override")
    data = data.merge(_examples(sweeps, rho, series), combine_attrs="no_conflicts")
    if "jitter" in study:
        data = data.merge(study["jitter"], combine_attrs="override")
    return data.assign_attrs(caption=_caption(data, of_sweeps(sweeps)))


def _examples(sweeps: xr.Dataset, rho: Array, series: Series) -> xr.Dataset:
    """Sweeps over one texture, by the distance scanned."""
    group, shared = alike(sweeps, np.isfinite(rho))
    chosen = spread(group[np.argsort(rho[group])], EXAMPLES)

    def measured(one: xr.Dataset, length: float) -> Array:
        return np.asarray(one.envelope.values[0] / length)

    def predicted(one: xr.Dataset, length: float) -> Array:
        return np.asarray(one.envelope_model.values[0] / length * _scale(one))

    lines = {"example_envelope": measured, "example_predicted": predicted}
    scales = [_scale(series(int(sweeps.sweep[i]))) for i in chosen]
    more = {"example_correlation": rho[chosen], "example_scale": scales}
    found = drawn_by_distance(sweeps, chosen, series, SHOWN, lines, more)
    return found.assign_attrs(examples=shared)


def _scale(one: xr.Dataset) -> float:
    """Factor that gives the predicted envelope the mean of the measured one."""
    return float(one.envelope.values[0].mean() / one.envelope_model.values[0].mean())


def _caption(data: xr.Dataset, source: str) -> str:
    """Everything the paper prints for 6C–D, here and there."""
    parts = [_mode_words(data.sel(mode=mode)) for mode in data.mode.values]
    p, clustered = (dict(zip(data.term.values, data[name].values, strict=True)) for name in P_VALUES)
    words = (("contact", "ε", 0.95), ("base_angle", "θ_b", 0.96), ("whisker", "whisker", 0.40))
    each = (f"{word} {p_words(p[name])} | {p_words(clustered[name])} ({paper:.2f})" for name, word, paper in words)
    text = (
        f"Figure 6C–D. Measured: {source}; predicted: by the one-contact model. C, envelopes of mode 1, measured and "
        f"predicted from the texture (below; pale: gaps), over the distance scanned; {data.attrs['examples']}: "
        f"{_examples_words(data)}. The prediction is scaled to the mean of the measurement by the factor in the title. "
        "D, correlation of the two envelopes at its best lag, ≤ "
        f"{1e3 * data.attrs['largest_lag']:.0f} ms. {' '.join(parts)} Effect on the correlation of mode 1, p with "
        f"every sweep a draw | with every whisker of every animal one (paper): {'; '.join(each)}."
    )
    return text + (_jitter_words(data) if "jittered_correlation" in data else "")


def _examples_words(data: xr.Dataset) -> str:
    """Whisker, speed and contact of each example."""
    some = zip(data.example_whisker.values, data.example_speed.values, data.example_contact.values, strict=True)
    return "; ".join(
        f"{printed_name(owner)}, {1e3 * speed:.0f} mm/s, ε = {contact:.2f}" for owner, speed, contact in some
    )


def _mode_words(one: xr.Dataset) -> str:
    """Mean, and how many are significant by either test."""
    made, able = np.isfinite(one.correlation.values), _able(one)
    rho, n = one.correlation.values[made], int(made.sum())
    pearson = int(significant(one.pearson_p.values).sum())
    mean = f"{rho.mean():.2f}" + (f" ± {rho.std(ddof=1):.2f}" if n > 1 else "")
    text = (
        f"Mode {int(one.mode)}: {mean} (mean ± SD; paper {PAPER[int(one.mode)]}); p < {LEVEL} {pearson}/{n} by Pearson"
    )
    return f"{text}{_by_gratings(one, able)}."


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
        f", {passed}/{int(able.sum())} by new gratings ({least}; at least {fewest_draws()} are needed), with which the "
        f"correlation is {chance:.2f} on average"
    )


def _able(one: xr.Dataset) -> Mask:
    """Sweeps compared with gratings enough to reach the level."""
    return np.isfinite(one.correlation.values) & reaches(one.pseudo_count.values)


def _jitter_words(data: xr.Dataset) -> str:
    """What jitter would have to be, and what repeated runs allow."""
    rho, repeat = data.jittered_correlation.values, data.jittered_repeat.values
    allowed = np.nanmin(np.where(repeat >= 0.95, rho, np.nan))
    return (
        f" Not in the paper: E, jitter of the tip along the texture. Down to 0.25 (dashed) it brings the correlation "
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
    textured = "trough_start" in data
    figure, axes = new_figure(9.0, 2.1 * max(n, len(modes) + jitter), 1, 2, width_ratios=(1.5, 1))
    examples = split(figure, axes[0, 0], heights=[*([1] * n), *([0.18] * textured)])
    right = split(figure, axes[0, 1], heights=[1] * (len(modes) + jitter))
    for k, axis in enumerate(examples[:n]):
        _draw_example(axis, data.isel(example=k), "C  " if k == 0 else "")
    key_above(examples[0])
    if textured:
        draw_scanned(examples[-1], data)
    else:
        examples[-1].set_xlabel("distance scanned [mm]")
    for axis, mode in zip(right, modes, strict=False):
        _draw_distribution(axis, data.sel(mode=mode), "D  " if mode == modes[0] else "")
    right[len(modes) - 1].set_xlabel("correlation of the envelopes")
    if jitter:
        _draw_jitter(right[-1], data)
    return add_caption(figure, data)


def _draw_example(axis: Axes, one: xr.Dataset, letter: str) -> None:
    x = 1e3 * one.distance_scanned
    axis.plot(x, 1e3 * one.example_predicted, color=PREDICTED, lw=1.2, label="predicted")
    axis.plot(x, 1e3 * one.example_envelope, color=MEASURED, lw=0.9, label="measured")
    title = f"{letter}ρ = {float(one.example_correlation):.2f}: {printed_name(str(one.example_whisker.values))}, "
    title += f"{1e3 * float(one.example_speed):.0f} mm/s, ε = {float(one.example_contact):.2f}"
    axis.set_title(f"{title}; prediction × {float(one.example_scale):.2g}")
    axis.set_ylabel("envelope [10⁻³ L]")
    axis.set(xlim=(float(x[0]), float(x[-1])), ylim=(0, None))


def _draw_distribution(axis: Axes, one: xr.Dataset, letter: str) -> None:
    """Histogram; white where not significant by the new gratings, hatched where these are too few; or by Pearson."""
    made, able, name = np.isfinite(one.correlation.values), _able(one), "new gratings"
    p = one.pseudo_p.values
    if not able.any():
        able, p, name = made, one.pearson_p.values, "Pearson"
    rho, passed = one.correlation.values, able & significant(p)
    parts = (
        (passed, MEASURED, f"p < {LEVEL} by {name}"),
        (able & ~passed, "white", "not"),
        (made & ~able, "0.8", "not determined"),
    )
    some = [(rho[group], colour, label) for group, colour, label in parts if group.any()]
    values, colours, labels = ([entry[k] for entry in some] for k in range(3))
    edges = np.arange(-0.1, 1.0501, 0.05).tolist()
    axis.hist(values, edges, stacked=True, color=colours, edgecolor="0.2", lw=0.6, label=labels)
    if np.isfinite(one.chance_mean.values).any():
        axis.axvline(np.nanmean(one.chance_mean), color="0.3", ls=":", label="chance, mean")
    axis.axvline(PAPER_MEAN[int(one.mode)], color=PAPER_COLOUR, ls="--", label="paper, mean")
    axis.set(title=f"{letter}Mode {int(one.mode)}, {int(made.sum())} sweeps", ylabel="sweeps", xlim=(-0.1, 1.05))
    key_above(axis, columns=2)


def _draw_jitter(axis: Axes, data: xr.Dataset) -> None:
    """Correlation, full, and repeat, dotted, against jitter."""
    lines = data.transpose("jitter_time", ...).jitter_time
    for colour, one in zip(ordered(lines.size), lines, strict=True):
        line = data.sel(jitter_time=one)
        label = f"{float(one):g} s"
        axis.plot(1e6 * line.jitter, line.jittered_correlation, "o-", ms=3, color=colour, label=label)
        axis.plot(1e6 * line.jitter, line.jittered_repeat, "s:", ms=2.5, color=colour)
    axis.axhline(PAPER_MEAN[1], color=PAPER_COLOUR, ls="--", lw=0.8)
    axis.set(xlabel="jitter of the tip, SD [µm]", ylabel="correlation", ylim=(0, 1.02))
    axis.plot([], [], "k-o", ms=3, label="envelopes")
    axis.plot([], [], "k:s", ms=2.5, label="repeated runs")
    axis.set_title("E  Jitter of the tip, with periods above …")
    key_above(axis, columns=3)
