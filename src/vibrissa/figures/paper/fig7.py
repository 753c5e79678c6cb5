"""Figure 7A–D: what sets the gain, measured and of the model, and envelopes compared by the distance scanned."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import TooFewError
from vibrissa.figures.canvas import P_VALUES, add_caption, house_style, key_above, new_figure, p_words, split, spread
from vibrissa.figures.colours import ENVELOPE, MEASURED, PREDICTED
from vibrissa.figures.paper.parts.examples import EXAMPLES, Course, alike, drawn_by_distance
from vibrissa.figures.paper.parts.texture_strip import draw_scanned
from vibrissa.figures.sources import of_sweeps, printed_name, whisker_marks
from vibrissa.mechanics.across.gain import (
    SOURCES,
    STEP,
    distance_correlogram,
    gain_table,
    whisker_of_animal,
)
from vibrissa.quantities import dataset, require
from vibrissa.quantities.kinds import Series

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 40e-3  # [m] of the distance scanned
MOST_PAIRS = 40  # of each kind
OFFSETS = np.arange(-10e-3, 10.01e-3, 50e-6)  # [m]
PAPER = {"scan_speed": "p = 0.11", "contact": "p < 10⁻⁶", "base_angle": "p < 10⁻¹⁵"}
SYMBOLS = {"scan_speed": "v", "contact": "ε", "base_angle": "θ_b"}
PAPER_MEAN = 2.64e-3  # rms of mode 1 over L
APART = 2.5  # [mm/s] between the marks of two whiskers at one speed
AREA = 60  # of the circle of the mean rms [square points]


def compute(study: Mapping[str, xr.Dataset], series: Series) -> xr.Dataset:
    """Gain of every sweep, its effects, three sweeps by distance, and correlograms of pairs of sweeps.

    Parameters
    ----------
    study : mapping
        ``sweeps``.
    series : callable
        Number of a sweep → its ``mode_displacement`` and ``envelope``.

    Returns
    -------
    Dataset
        ``sweep_gain`` (source, sweep), the rms of mode 1 over L, measured and of the model, and
        ``relative_gain``, over the mean of its source; ``effect_p`` … (subset,
        source, term) of all whiskers and of β and C1; ``pair_correlogram`` (pair, offset): one whisker of one animal,
        two speeds, the same texture or two. Attribute ``caption``.

    Raises
    ------
    InputError
        If no sweep was accepted.
    """
    sweeps = study["sweeps"]
    require(sweeps, "mode_rms_model", "contact", "base_angle", "accepted")
    usable = sweeps.accepted.values.astype(bool)
    if not usable.any():
        raise TooFewError("sweeps", "must have one that was accepted")
    gain = np.array([np.where(usable, sweeps[name].values[:, 0], np.nan) for name in SOURCES])
    data = dataset(
        sweep=sweeps.sweep.values,
        source=["measured", "model"],
        sweep_gain=gain,
        relative_gain=gain / np.array([[_mean(one)] for one in gain]),
    ).assign_coords({name: sweeps[name] for name in ("scan_speed", "contact", "base_angle", "whisker_name", "animal")})
    parts = (gain_table(sweeps), _examples(sweeps, usable, series), _pairs(sweeps, usable, series))
    for part in parts:
        data = data.merge(part, combine_attrs="drop_conflicts")
    return data.assign_attrs(caption=_caption(data, of_sweeps(sweeps)))


def _mean(values: Array) -> float:
    """Mean of what is known; NaN where nothing is."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else np.nan


def _examples(sweeps: xr.Dataset, usable: Mask, series: Series) -> xr.Dataset:
    """Mode 1 and its envelope of up to three sweeps over one texture, by distance."""
    group, shared = alike(sweeps, usable)
    group = group[np.lexsort((sweeps.scan_speed.values[group], sweeps.contact.values[group]))]
    chosen = spread(group, EXAMPLES)
    lines: dict[str, Course] = {
        "example_mode": lambda one, _: one.mode_displacement.values[0],
        "example_envelope": lambda one, length: one.envelope.values[0] / length,
    }
    more = {"example_angle": sweeps.base_angle.values, "example_frequency": _first_resonance(sweeps)}
    some = {name: values[chosen] for name, values in more.items()}
    return drawn_by_distance(sweeps, chosen, series, SHOWN, lines, some).assign_attrs(examples=shared)


def _first_resonance(sweeps: xr.Dataset) -> Array:
    """Resonance of mode 1 [Hz] with the texture's forcing; where it is not known, with white forcing."""
    known, white = (sweeps[f"resonant_frequency{end}"].values[:, 0] for end in ("", "_white"))
    return np.where(np.isfinite(known), known, white)


def _pairs(sweeps: xr.Dataset, usable: Mask, series: Series) -> xr.Dataset:
    """Correlograms of sweeps of one whisker at two speeds: over the same texture, and over two."""
    owner, texture, speed = whisker_of_animal(sweeps), sweeps.texture.values, sweeps.scan_speed.values
    every = [
        (i, j)
        for i, j in combinations(np.flatnonzero(usable & (texture >= 0)).tolist(), 2)
        if owner[i] == owner[j] and speed[i] != speed[j]
    ]
    kinds = [[(i, j) for i, j in every if bool(texture[i] == texture[j]) is same] for same in (True, False)]
    chosen = [pair for kind in kinds for pair in kind[:: max(1, -(-len(kind) // MOST_PAIRS))]]
    curves = [_correlogram(series, sweeps, i, j) for i, j in chosen]
    return dataset(
        pair=np.arange(len(chosen)),
        offset=OFFSETS,
        pair_same_texture=np.array([texture[i] == texture[j] for i, j in chosen], bool),
        pair_correlogram=np.array(curves).reshape(len(chosen), len(OFFSETS)),
    )


def _correlogram(series: Series, sweeps: xr.Dataset, i: int, j: int) -> Array:
    def envelope(k: int) -> tuple[Array, Array, float]:
        one = series(int(sweeps.sweep[k]))
        return one.envelope.values[0], one.time.values, float(sweeps.scan_speed[k])

    offset, rho = distance_correlogram(envelope(i), envelope(j), float(OFFSETS[-1]) + STEP)
    return np.interp(OFFSETS, offset, rho)


def _caption(data: xr.Dataset, source: str) -> str:
    """The paper's tests, here and there."""
    below = " (texture below; pale: gaps)" if "trough_start" in data else ""
    owners = ", ".join(printed_name(one) for one in dict.fromkeys(data.example_whisker.values.tolist()))
    text = (
        f"Figure 7A–D. Measured: {source}; model: computed from their textures. A, amplitude of mode 1 and its "
        f"envelope (black) over the distance scanned{below}; {data.attrs['examples']}: {owners}. "
    )
    if not data.sizes["pair"]:
        text += "B, correlograms: no whisker met a known texture at two speeds. "
    else:
        middle = data.pair_correlogram.sel(offset=0, method="nearest").values
        same = data.pair_same_texture.values
        kinds = (same, ~same)
        means = (f"{np.mean(middle[kind]):.2f} ({kind.sum()} pairs)" if kind.any() else "none" for kind in kinds)
        text += "B, correlograms of envelopes by distance, of one whisker at two speeds, thick: means; without offset, "
        text += "same texture {}, two textures {}".format(*means)
        text += f"{_peak_words(data) if same.any() else ''}. "
    text += (
        "C, rms of mode 1, measured and of the model, against the scanning speed; a mark for each whisker. "
        f"{_mean_words(data)} D, the same against θ_b and ε: the radius is in proportion to the "
        f"rms over its mean. Not in the paper: F, of the model (mean {_model_words(data)}); G, H, the rms against θ_b "
        "and ε alone. "
    )
    if np.isfinite(data.effect_p.values).any():
        text += (
            "Slopes per SD over the mean [95 %, by whisker]; p with every sweep a draw, and with every whisker one. "
        )
    return (text + " ".join(_effect_words(data.sel(source=source)) for source in data.source.values)).replace(
        " -", " −"
    )


def _mean_words(data: xr.Dataset) -> str:
    """Mean measured gain beside the paper's."""
    mean = _mean(data.sweep_gain.values[0])
    paper = f"the paper's {1e3 * PAPER_MEAN:.2f} × 10⁻³ L"
    ratio = PAPER_MEAN / mean
    beside = f"{ratio:.0f} times below {paper}" if ratio > 2 else f"for comparison: {paper}"
    return f"Measured mean {1e3 * mean:.2f} × 10⁻³ L, {beside}."


def _model_words(data: xr.Dataset) -> str:
    mean = _mean(data.sweep_gain.values[1])
    return f"{1e3 * mean:.2f} × 10⁻³ L" if np.isfinite(mean) else "not known"


def _peak_words(data: xr.Dataset) -> str:
    """Where the mean correlogram of one texture peaks: the envelope lags the texture by a time, not by a distance."""
    mean = data.pair_correlogram.values[data.pair_same_texture.values].mean(axis=0)
    offset = round(1e3 * float(data.offset[mean.argmax()]), 2) + 0.0  # without a sign where it is 0
    return f"; of the same texture largest, {mean.max():.2f}, at {offset:.2f} mm"


def _effect_words(data: xr.Dataset) -> str:
    """Slope and p-values of every term, all whiskers and the two."""
    source = str(data.source.values)
    if not np.isfinite(data.sweep_gain).any():
        return f"{source.capitalize()}: no texture is known."
    if not np.isfinite(data.effect_p.values).any():
        return f"{source.capitalize()}: too few sweeps to find an effect."
    parts = []
    for term in data.term.values:
        one = data.sel(term=term)
        ends = (round(float(one[f"effect_{name}"][0]), 2) + 0.0 for name in ("slope", "low", "high"))
        slope = "{:+.2f} [{:+.2f}, {:+.2f}]".format(*ends).replace("-", "−")
        p = [" and ".join(p_words(float(one[name][k])) for name in P_VALUES) for k in range(2)]
        parts.append(f"{SYMBOLS[term]} {slope}, p = {p[0]}, of β and C1 alone {p[1]} (paper {PAPER[term]})")
    return f"{source.capitalize()}: {'; '.join(parts)}."


@house_style
def draw(data: xr.Dataset) -> Figure:
    """A on the left; B and C, D, F measured and model on one scale, G and H. What is not there takes no place.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    made, n, textured = _right(data), data.sizes["example"], "trough_start" in data
    places = [range(k, min(k + 2, len(made))) for k in range(len(made) % 2, len(made), 2)]
    places = [range(len(made) % 2), *places] if len(made) % 2 else places  # an odd one has a row of its own
    figure, axes = new_figure(9.0, 2.3 * max(n, len(places)), 1, 2, width_ratios=(1.3, 2))
    examples = split(figure, axes[0, 0], heights=[*([1] * n), *([0.18] * textured)])
    for k, axis in enumerate(examples[:n]):
        _draw_example(axis, data, k)
    if textured:
        draw_scanned(examples[-1], data)
    else:
        examples[-1].set_xlabel("distance scanned [mm]")
    for row, place in zip(split(figure, axes[0, 1], heights=[1] * len(places)), places, strict=True):
        for k, axis in zip(place, split(figure, row, widths=[1] * len(place)), strict=True):
            made[k](axis)
    return add_caption(figure, data)


def _right(data: xr.Dataset) -> list[Callable[[Axes], None]]:
    """What draws B to H: correlograms where there are pairs, the model where a texture is known."""
    sources = [one for one in data.source.values if np.isfinite(data.sweep_gain.sel(source=one)).any()]
    return [
        *([partial(_draw_pairs, data=data)] if data.sizes["pair"] else []),
        partial(_draw_relation, data=data, name="scan_speed", label="scanning speed [mm/s]", title="C  Scanning speed"),
        *(partial(_draw_plane, data=data.sel(source=one)) for one in sources),
        partial(_draw_relation, data=data, name="base_angle", label="base angle θ$_b$ [rad]", title="G  Base angle"),
        partial(_draw_relation, data=data, name="contact", label="contact ε", title="H  Contact"),
    ]


def _draw_example(axis: Axes, data: xr.Dataset, k: int) -> None:
    one, x = data.isel(example=k), 1e3 * data.distance_scanned
    axis.plot(x, 1e3 * one.example_mode, color=MEASURED, lw=0.6, label="mode 1")
    axis.plot(x, 1e3 * one.example_envelope, color=ENVELOPE, lw=1.2, label="envelope")
    resonance = f", {float(one.example_frequency):.0f} Hz" if np.isfinite(one.example_frequency) else ""
    axis.set_title(
        f"{'A  ' if k == 0 else ''}{1e3 * float(one.example_speed):.0f} mm/s, ε = {one.example_contact:.2f}{resonance}"
    )
    axis.set_ylabel("mode 1 [10⁻³ L]")
    top = 1.1e3 * float(np.nanmax(data.example_envelope.values))
    axis.set(xlim=(float(x[0]), float(x[-1])), ylim=(-top, top))
    if k == 0:
        key_above(axis)


def _draw_pairs(axis: Axes, data: xr.Dataset) -> None:
    """Each pair thin, their mean thick."""
    for same, colour, label in ((False, "0.5", "two textures"), (True, MEASURED, "same texture")):
        curves = data.pair_correlogram.values[data.pair_same_texture.values == same]
        if not len(curves):
            continue
        axis.plot(1e3 * data.offset, curves.T, color=colour, lw=0.4, alpha=0.5)
        axis.plot(1e3 * data.offset, curves.mean(axis=0), color=colour, lw=2, label=label)
    axis.set(xlabel="offset [mm]", ylabel="correlation", title="B  Envelopes at two speeds")
    key_above(axis)


def _draw_relation(axis: Axes, data: xr.Dataset, name: str, label: str, title: str) -> None:
    """Measured full, model hollow where there is one; a mark for each whisker."""
    names, speed = np.unique(data.whisker_name).tolist(), name == "scan_speed"
    marks = whisker_marks(names)
    for k, whisker in enumerate(names):
        some = data.sel(sweep=data.whisker_name == whisker)
        looks: tuple[dict[str, Any], ...] = ({"color": MEASURED}, {"facecolors": "none", "edgecolors": PREDICTED})
        place = 1e3 * some[name] + APART * (k - (len(names) - 1) / 2) if speed else some[name]
        for source, look in zip(data.source.values, looks, strict=True):
            gain = 1e3 * some.sweep_gain.sel(source=source)
            if np.isfinite(gain).any():
                words = f"{printed_name(whisker)}{', model' * (source != 'measured')}"
                axis.scatter(place, gain, s=16, lw=0.9, marker=marks[whisker], label=words, **look)
    axis.set(xlabel=label, ylabel="rms of mode 1 [10⁻³ L]", title=title, yscale="log")
    if speed:
        key_above(axis, columns=3, handletextpad=0.1)


def _draw_plane(axis: Axes, data: xr.Dataset) -> None:
    """Radius of each circle in proportion to the rms."""
    radius, measured = data.relative_gain.values, str(data.source.values) == "measured"
    edge = MEASURED if measured else PREDICTED
    look: dict[str, Any] = {"facecolors": "none", "edgecolors": edge, "lw": 0.9}
    axis.scatter(data.base_angle, data.contact, s=AREA * radius**2, **look)
    axis.scatter([], [], s=AREA, label="the mean", **look)
    title = "D  Measured" if measured else "F  Model"
    axis.set(xlabel="base angle θ$_b$ [rad]", ylabel="contact ε", title=title)
    axis.margins(0.1)
    key_above(axis)
