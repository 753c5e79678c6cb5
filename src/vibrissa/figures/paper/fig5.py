"""Figure 5: spectra of the modes, the lines fitted to them, one node's spectrum, and the collapse of the resonances."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import add_caption, house_style, key_above, new_figure, split
from vibrissa.figures.colours import FITTED, MEASURED, TRUTH
from vibrissa.figures.paper.parts.fig5_collapse import collapse_words, collapsed, draw_collapse, draw_modulus, each
from vibrissa.figures.sources import of_movie, of_sweeps
from vibrissa.mechanics.inverse.resonance import line_r2
from vibrissa.quantities import dataset
from vibrissa.signals.spectra import power_spectrum

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SMOOTH = 5.0  # [Hz] half width of the running mean that shows a periodogram
PEAK, FLANKS = 0.1, (0.65, 1.4)  # of the resonance: half width of its peak; where the power on either side is read
RAISED = 10  # times, the line of the known texture: it would hide the measured one
PAPER_R2 = (0.55, 0.73, 0.73)


def compute(study: Mapping[str, xr.Dataset], series: Callable[[int], xr.Dataset] | None = None) -> xr.Dataset:
    """Smoothed spectra of the modes and of one node, the fitted lines smoothed alike; over sweeps, the collapse.

    Parameters
    ----------
    study : mapping
        ``spectra_white``, ``resonance_white``; where the texture is known ``spectra``, ``resonance``, ``spectra_true``;
        ``modal`` for B; ``sweeps`` for C and D.
    series : callable, optional
        Number of a sweep → its series: the texture's line where ``spectra`` are missing and ``posture`` names which of
        the ``sweeps`` is shown.

    Returns
    -------
    Dataset
        ``frequency``; ``power``, ``power_white_fit`` and, where known, ``power_fit``, ``power_true`` (mode, frequency)
        [1/Hz, over L²]; ``resonant_frequency``, ``damping`` of the best fit (mode); ``fit_r2_white`` and ``fit_r2``
        (mode), of the periodograms themselves; ``node_power`` (frequency) [m²/Hz] and ``peak_contrast`` (source, mode)
        [dB] of modes and node; what :func:`vibrissa.figures.paper.parts.fig5_collapse.collapsed` gives. Attributes
        ``forcing``, ``node_s``, ``caption``.
    """
    white = study["spectra_white"]
    step = float(white.frequency[1] - white.frequency[0])
    half = max(1, round(SMOOTH / step))
    columns: dict[str, Any] = {"power": white.power.values, "power_white_fit": white.power_fit.values}
    attrs: dict[str, Any] = {}
    known, best = _texture(study, series)
    if known is not None:
        columns["power_fit"] = known.power_fit.values
    if "spectra_true" in study:
        columns["power_true"] = study["spectra_true"].power.values
    facts: dict[str, Any] = {"fit_r2_white": line_r2(white)} | ({} if known is None else {"fit_r2": line_r2(known)})
    if "modal" in study:
        node, attrs["node_s"] = _node(study["modal"])
        columns["node_power"] = node
        facts |= _contrasts(white.frequency.values, white.power.values, node, best.resonant_frequency.values)
    smoothed: dict[str, Any] = {name: _running_mean(values, half) for name, values in columns.items()}
    data = dataset(
        {"forcing": best.attrs["forcing"], "of_movie": of_movie(study), **attrs},
        mode=white.mode.values,
        frequency=white.frequency.values,
        resonant_frequency=best.resonant_frequency.values,
        damping=best.damping.values,
        **facts,
        **smoothed,
    )
    if "sweeps" in study:
        data = data.merge(collapsed(study["sweeps"]).reindex(mode=data.mode), combine_attrs="override")
        data = data.assign_attrs(of_sweeps=of_sweeps(study["sweeps"]))
    return data.assign_attrs(caption=_caption(data))


def _texture(
    study: Mapping[str, xr.Dataset], series: Callable[[int], xr.Dataset] | None
) -> tuple[xr.Dataset | None, xr.Dataset]:
    """Spectra with the line of the texture's forcing, if it is known; and the best fit there is."""
    if "spectra" in study:
        return study["spectra"], study["resonance"]
    number = study["posture"].attrs.get("sweep") if "posture" in study else None
    if series is None or number is None or "sweeps" not in study or "power_fit" not in (one := series(int(number))):
        return None, study["resonance_white"]
    row = study["sweeps"].sel(sweep=int(number))
    found: dict[str, Any] = {name: row[name].values for name in ("mode", "resonant_frequency", "damping")}
    return one, dataset({"forcing": "texture"}, **found)


def _node(modal: xr.Dataset) -> tuple[Array, float]:
    """Periodogram [m²/Hz] of the node that moves most of those followed throughout, and its s."""
    u = modal.displacement.values
    s = 1 - modal.arc_length.values / modal.attrs["whisker_length"]
    usable = np.isfinite(u).all(axis=0) & (s >= float(modal.contact))
    most = int(np.where(usable, np.where(usable, u, 0).std(axis=0), -1.0).argmax())
    time = modal.time.values
    return power_spectrum(u[:, most], (len(time) - 1) / float(time[-1] - time[0]))[1], float(s[most])


def _contrasts(frequency: Array, power: Array, node: Array, resonance: Array) -> dict[str, Any]:
    """Height of each resonance above its flanks, in its mode's spectrum and at the node [dB]."""
    pairs = zip(power, resonance, strict=True)
    found = [[_contrast(frequency, one, f), _contrast(frequency, node, f)] for one, f in pairs]
    return {"source": ["mode", "node"], "peak_contrast": np.array(found).T}


def _contrast(frequency: Array, power: Array, resonance: float) -> float:
    def level(centre: float) -> float:
        here = np.abs(frequency / (centre * resonance) - 1) < PEAK
        return float(power[here].mean())

    if not np.isfinite(resonance) or FLANKS[1] * resonance > frequency[-1]:
        return np.nan
    return float(10 * (np.log10(level(1.0)) - np.mean(np.log10([level(one) for one in FLANKS]))))


def _running_mean(power: Array, half: int) -> Array:
    """Mean over 2·half + 1 bins where all of them are known, else NaN."""
    kernel = np.ones(2 * half + 1) / (2 * half + 1)
    out = np.full(power.shape, np.nan)
    for values, row in zip(np.atleast_2d(out), np.atleast_2d(power), strict=True):
        values[half:-half] = np.convolve(row, kernel, mode="valid")
    return out


def _caption(data: xr.Dataset) -> str:
    """R² of the lines, the peaks at a node, and the collapse."""
    white, paper = each(data.fit_r2_white.values, ".2f"), ", ".join(map(str, PAPER_R2[: data.sizes["mode"]]))
    true = " grey, the true signal;" if "power_true" in data else ""
    known = f" black, the line of the known texture, raised × {RAISED};" if "fit_r2" in data else ""
    forcing = "the known texture" if "fit_r2" in data else "Eq. 5"
    source = f"A, B: {data.attrs['of_movie']}"
    source += f"; C, D: {data.attrs['of_sweeps']}" if "of_sweeps" in data.attrs else ""
    parts = [
        f"Figure 5. {source}. A, power spectra of the amplitudes of the modes, smoothed over ± {SMOOTH:g} Hz: blue, "
        f"measured;{true}{known} orange, the paper's Lorentzian (Eq. 5); grey vertical, the resonance found with "
        f"{forcing}. R² of Eq. 5 {white} (paper {paper})"
    ]
    if "fit_r2" in data:
        parts.append(f"of the line of the known texture {each(data.fit_r2.values, '.3f')}")
    text = "; ".join(parts) + "."
    if _close_up(data):
        mode, node = (each(data.peak_contrast.sel(source=source).values, "+.0f") for source in ("mode", "node"))
        text += (
            f" B, the whole spectrum of one node, s = {data.attrs['node_s']:.2f}, and close-ups about each resonance, "
            f"beside the mode's own spectrum, each over its maximum there. Peaks over their flanks: {mode} dB in the "
            f"modes, {node} dB at the node."
        )
    return (text + (collapse_words(data) if "variant" in data.dims else "")).replace(" -", " −").replace("[-", "[−")


def _near_resonances(data: xr.Dataset) -> list[int]:
    """Modes about whose resonance there is a close-up."""
    return np.flatnonzero(np.isfinite(data.resonant_frequency.values)).tolist()


def _close_up(data: xr.Dataset) -> bool:
    """Whether there is a resonance about which one node can be looked at."""
    return "node_power" in data and bool(np.isfinite(data.resonant_frequency).any())


@house_style
def draw(data: xr.Dataset) -> Figure:
    """A: modes; B: one node, where a resonance is known; C: collapse, D: E.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    n, parts = data.sizes["mode"], 1 + _close_up(data) + ("variant" in data.dims)
    heights = [1.0, *([0.9] * _close_up(data)), *([1.25] * ("variant" in data.dims))]
    figure, axes = new_figure(9.0, 2.7 * sum(heights), parts, 1, height_ratios=heights)
    places = list(axes[:, 0])
    spectra = split(figure, places[0], widths=[1] * n)
    for i, axis in enumerate(spectra):
        _draw_mode(axis, data, i)
    spectra[0].set_ylabel("power density [L²/Hz]")
    key_above(spectra[0], columns=2)
    if _close_up(data):
        near = _near_resonances(data)
        whole, *others = split(figure, places[1], widths=[1.5, *([1] * len(near))])
        _draw_whole(whole, data)
        for axis, i in zip(others, near, strict=True):
            _draw_node(axis, data, i)
        key_above(others[0])
    if "variant" in data.dims:
        left, right = split(figure, places[-1], widths=[1.5, 1])
        draw_collapse(left, data)
        draw_modulus(right, data)
    return add_caption(figure, data)


def _draw_mode(axis: Axes, data: xr.Dataset, i: int) -> None:
    if "power_true" in data:
        axis.loglog(data.frequency, data.power_true[i], color=TRUTH, lw=3, label="truth")
    axis.loglog(data.frequency, data.power[i], color=MEASURED, lw=0.9, label="measured")
    if "power_fit" in data:
        axis.loglog(data.frequency, RAISED * data.power_fit[i], "k", lw=0.8, label=f"texture known, × {RAISED}")
    axis.loglog(data.frequency, data.power_white_fit[i], color=FITTED, lw=1.2, label="Eq. 5")
    f, zeta = float(data.resonant_frequency[i]), float(data.damping[i])
    found = f"{f:.1f} Hz, ζ = {zeta:.3f}" if np.isfinite(f) else "resonance not determined"
    axis.axvline(f if np.isfinite(f) else 0, color="0.7", lw=0.7, zorder=0)
    axis.set(xlabel="frequency [Hz]", xlim=(10, None), title=f"{'A  ' if i == 0 else ''}Mode {i + 1}: {found}")


def _draw_whole(axis: Axes, data: xr.Dataset) -> None:
    """The whole spectrum of the node, and where the resonances are."""
    axis.loglog(data.frequency, 1e12 * data.node_power, color=MEASURED, lw=0.9)
    for f in data.resonant_frequency.values:
        axis.axvline(f, color="0.7", lw=0.7, zorder=0)
    axis.set(xlabel="frequency [Hz]", ylabel="power density [µm²/Hz]", xlim=(10, None))
    axis.set_title(f"B  Node at s = {data.attrs['node_s']:.2f}")


def _draw_node(axis: Axes, data: xr.Dataset, i: int) -> None:
    """Close-up about one resonance, every line over its maximum there."""
    f = float(data.resonant_frequency[i])
    near = data.sel(frequency=slice(0.5 * f, 1.6 * f))
    for values, style, label in ((near.power[i], ":", "mode"), (near.node_power, "-", "node")):
        axis.plot(near.frequency, values / values.max(), style, lw=1.1, color=MEASURED, label=label)
    axis.axvline(f, color="0.7", lw=0.7, zorder=0)
    axis.set(xlabel="frequency [Hz]", xlim=(0.5 * f, 1.6 * f), ylim=(0, 1.05), title=f"About mode {i + 1}")
    axis.set_yticks([0, 1])
    if i == 0:
        axis.set_ylabel("over the maximum", labelpad=0)
