"""Figure 10: resonance and damping of every sweep with their intervals, against the truth where it is known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import TooFewError
from vibrissa.exact import cone_kappa
from vibrissa.figures.canvas import add_caption, house_style, key_above, new_figure
from vibrissa.figures.colours import FITTED, MEASURED, TRUTH
from vibrissa.figures.sources import of_sweeps
from vibrissa.quantities import dataset, require
from vibrissa.stats import wilson_interval

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MODES = (1, 2)
FORCINGS = {"texture known": "", "white, Eq. 5": "_white"}  # end of the table's columns
COLOURS = dict(zip(FORCINGS, (MEASURED, FITTED), strict=True))
ENDS = ("", "_low", "_high")
HALF = 1.959964  # standard errors of half a 95 % interval
TICKS = 5  # contacts that are written below the sweeps
WIDEST = 4.0  # standard errors that the distributions show


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Resonance and damping of every accepted sweep, by rising contact ε, over what they should be.

    Parameters
    ----------
    study : mapping
        ``sweeps``, from :func:`vibrissa.study.sweeps.sweep_table.sweep_table`.

    Returns
    -------
    Dataset
        ``frequency_ratio`` (forcing, mode, sweep) with ``_low`` and ``_high``, over the truth, or over κ_i(ε)/2πk with
        the nominal E where no truth is known; ``damping_found`` likewise, ζ; ``damping_reference`` (mode, sweep), the
        true ζ, or NaN; ``frequency_z``, ``damping_z``, errors over their standard errors; ``frequency_held``,
        ``damping_held`` (forcing, mode), the share of 95 % intervals that hold the truth. Attributes ``virtual``,
        ``caption``.

    Raises
    ------
    InputError
        If no sweep was accepted.
    """
    sweeps = study["sweeps"]
    require(sweeps, "contact", "timescale", "resonant_frequency", "resonant_frequency_white", "damping", "accepted")
    usable = np.flatnonzero(sweeps.accepted.values.astype(bool))
    if not usable.size:
        raise TooFewError("sweeps", "must have one that was accepted")
    table = sweeps.isel(sweep=usable[np.argsort(sweeps.contact.values[usable], kind="stable")]).sel(mode=list(MODES))
    virtual = "resonant_frequency_true" in table
    frequency = table.resonant_frequency_true.values if virtual else _model(table)
    damping = table.damping_true.values if virtual else np.full(frequency.shape, np.nan)
    ratio, zeta = _columns(table, "resonant_frequency") / frequency, _columns(table, "damping")
    parts = {"frequency": (ratio, np.ones(frequency.shape)), "damping": (zeta, damping)}
    errors: dict[str, Any] = {
        f"{name}_{end}": values for name, part in parts.items() for end, values in _errors(*part, virtual).items()
    }
    columns: dict[str, Any] = {
        f"{name}{end}": values[k].transpose(0, 2, 1)
        for name, values in (("frequency_ratio", ratio), ("damping_found", zeta))
        for k, end in enumerate(ENDS)
    }
    data = dataset(
        {"virtual": int(virtual)},
        forcing=list(FORCINGS),
        mode=list(MODES),
        sweep=table.sweep.values,
        damping_reference=damping.T,
        **columns,
        **errors,
    ).assign_coords(contact=table.contact)
    return data.assign_attrs(caption=_caption(data, of_sweeps(sweeps)))


def _columns(table: xr.Dataset, name: str) -> Array:
    """Value, lower and upper end by both forcings, (3, forcing, sweep, mode)."""
    return np.array([[table[f"{name}{forcing}{end}"].values for forcing in FORCINGS.values()] for end in ENDS])


def _model(table: xr.Dataset) -> Array:
    """Resonant frequencies κ_i(ε)/2πk of the straight pinned cone with the nominal E, (sweep, mode) [Hz]."""
    pairs = zip(table.contact.values.tolist(), table.timescale.values.tolist(), strict=True)
    return np.array([cone_kappa(contact, len(MODES)) / (2 * np.pi * timescale) for contact, timescale in pairs])


def _errors(found: Array, truth: Array, virtual: bool) -> dict[str, Array]:
    """Standardised errors (forcing, mode, sweep), and the share of intervals that hold the truth (forcing, mode)."""
    value, low, high = found
    side = np.where(truth > value, high - value, value - low)  # the half of the interval on the side of the truth
    z = (value - truth) / (np.where(side > 0, side, np.nan) / HALF)
    made = np.isfinite(z)
    with np.errstate(invalid="ignore"):
        held = (made & (low <= truth) & (truth <= high)).sum(axis=1) / made.sum(axis=1)
    unknown = 1.0 if virtual else np.nan
    return {"z": unknown * z.transpose(0, 2, 1), "held": unknown * held}


def _caption(data: xr.Dataset, source: str) -> str:
    text = f"Figure 10, not in the paper. {source.capitalize()}, N = {data.sizes['sweep']}, one beside the other by "
    text += (
        f"rising contact ε, {float(data.contact[0]):.2f} to {float(data.contact[-1]):.2f}; bars, 95 % intervals, cut "
    )
    text += "at the edges. "
    if not data.attrs["virtual"]:
        return text + (
            "Frequencies over κ_i(ε)/2πk with the nominal Young's modulus: a common factor is that of √E. No truth is "
            "known, so no errors are shown."
        )
    text += "Frequencies over the true ones; grey, the true damping ratio; right, errors over their standard errors "
    text += "beside the standard normal distribution, which they follow where intervals are right; "
    text += f"those beyond ± {WIDEST:g} are drawn at the edge. "
    return text + " ".join(_words(data, forcing) for forcing in FORCINGS if _known(data, forcing))


def _known(data: xr.Dataset, forcing: str) -> bool:
    return bool(np.isfinite(data.frequency_ratio.sel(forcing=forcing)).any())


def _words(data: xr.Dataset, forcing: str) -> str:
    """Median error and coverage of both modes by one forcing."""
    lines = []
    for mode in MODES:
        one = data.sel(forcing=forcing, mode=mode)
        if not np.isfinite(one.frequency_ratio).any():
            lines.append(f"mode {mode} was not found")
            continue
        frequency = 100 * float(np.nanmedian(one.frequency_ratio - 1))
        damping = 100 * float(np.nanmedian(one.damping_found / one.damping_reference - 1))
        lines.append(
            f"mode {mode}: median error {frequency:+.2f} % of the frequency ({_held(one, 'frequency')}), "
            f"{damping:+.1f} % of the damping ({_held(one, 'damping')})".replace("-", "−")
        )
    return f"{forcing[:1].upper()}{forcing[1:]}: {'; '.join(lines)}."


def _held(one: xr.Dataset, name: str) -> str:
    """How many intervals hold the truth, with Wilson's interval of the share."""
    made = int(np.isfinite(one[f"{name}_z"]).sum())
    if not made:
        return "no intervals"
    held = round(float(one[f"{name}_held"]) * made)
    low, high = wilson_interval(held, made)
    return f"{held} of {made} intervals hold it, {100 * low:.0f} to {100 * high:.0f} %"


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Modes 1 and 2 in rows: frequency, damping and, where the truth is known, the distribution of the errors.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    columns = 3 if data.attrs["virtual"] else 2
    figure, axes = new_figure(9.0, 5.0, 2, columns, width_ratios=(1.3, 1.3, 1)[:columns], sharex="col")
    for row, mode in enumerate(MODES):
        one, letters = data.sel(mode=mode), "ABCDEF"[row * columns :]
        _draw_frequency(axes[row, 0], one, f"{letters[0]}  Resonance, mode {mode}")
        _draw_damping(axes[row, 1], one, f"{letters[1]}  Damping, mode {mode}")
        if columns == 3:
            _draw_errors(axes[row, 2], one, f"{letters[2]}  Errors, mode {mode}")
    places = np.unique(np.linspace(0, data.sizes["sweep"] - 1, TICKS).round().astype(int))
    for axis in axes[1, :2]:
        axis.set_xticks(places, [f"{float(data.contact[i]):.2f}" for i in places])
        axis.set_xlabel("sweeps by rising contact ε")
    key_above(axes[0, 0])
    if columns == 3:
        key_above(axes[0, 2])
        axes[1, 2].set_xlabel("error over its standard error")
        ticks = np.linspace(-WIDEST, WIDEST, 5)
        axes[1, 2].set_xticks(
            ticks, [f"≤ −{WIDEST:g}", *(f"{one:g}".replace("-", "−") for one in ticks[1:-1]), f"≥ {WIDEST:g}"]
        )
    return add_caption(figure, data)


def _bars(axis: Axes, one: xr.Dataset, name: str, scale: float, shift: float) -> None:
    """Value and interval of every sweep by both forcings, side by side; ends beyond the axis are cut."""
    for k, (forcing, colour) in enumerate(COLOURS.items()):
        value, low, high = (scale * (one[name + end].sel(forcing=forcing).values - shift) for end in ENDS)
        place = np.arange(len(value)) + 0.3 * (2 * k - 1) / 2
        axis.vlines(place, low, high, color=colour, lw=0.7, alpha=0.6)
        axis.plot(place, value, "o", ms=2.5, color=colour, label=forcing)


def _limits(values: Array) -> tuple[float, float]:
    """Limits that show all values, however long their intervals are."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    margin = 0.35 * max(high - low, 1e-3 * abs(high), 1e-6)
    return low - margin, high + margin


def _draw_frequency(axis: Axes, one: xr.Dataset, title: str) -> None:
    axis.axhline(0, color=TRUTH, lw=2.5, zorder=0)
    _bars(axis, one, "frequency_ratio", 100, 1)
    words = "error of the frequency" if one.attrs["virtual"] else "frequency over κ(ε)/2πk − 1"
    axis.set(ylabel=f"{words} [%]", title=title)
    axis.set_ylim(*_limits(100 * (np.append(one.frequency_ratio.values, 1.0) - 1)))


def _draw_damping(axis: Axes, one: xr.Dataset, title: str) -> None:
    look: dict[str, Any] = {"color": TRUTH, "lw": 2.5, "drawstyle": "steps-mid", "zorder": 0}
    axis.plot(np.arange(one.sizes["sweep"]), one.damping_reference, **look)
    _bars(axis, one, "damping_found", 1, 0)
    axis.set(ylabel="damping ratio ζ", title=title)
    low, high = _limits(np.append(one.damping_found.values, one.damping_reference.values))
    axis.set_ylim(max(low, 0.0), high)


def _draw_errors(axis: Axes, one: xr.Dataset, title: str) -> None:
    """Cumulative distributions of the standardised errors, frequencies full, damping dashed."""
    from scipy.special import ndtr

    grid = np.linspace(-WIDEST, WIDEST, 161)
    axis.plot(grid, ndtr(grid), color=TRUTH, lw=2.5, zorder=0)
    for forcing, colour in COLOURS.items():
        for name, style in (("frequency_z", "-"), ("damping_z", "--")):
            z = one[name].sel(forcing=forcing).values
            z = np.sort(z[np.isfinite(z)])
            if z.size:
                ends = np.pad(np.clip(z, -WIDEST, WIDEST), 1, constant_values=(-WIDEST, WIDEST))
                share = np.pad(np.arange(1, z.size + 1) / z.size, 1, constant_values=(0, 1))
                axis.step(ends, share, style, where="post", color=colour, lw=1)
    axis.plot([], [], "k-", label="frequency")
    axis.plot([], [], "k--", label="damping")
    axis.set(xlim=(-WIDEST, WIDEST), ylim=(0, 1), ylabel="share of the sweeps", title=title)
