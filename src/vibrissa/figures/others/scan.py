"""A surface drawn past a whisker, as the model has it: excursion of the contact, modes, moment, and spectra."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import add_caption, house_style, key_above, merged, new_figure
from vibrissa.figures.colours import KINDS, PREDICTED, ordered
from vibrissa.quantities import dataset, require
from vibrissa.signals.spectra import power_spectrum

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 0.3  # [s] of the whole
MODES = 2  # that are drawn in time
WIDTH = 5.0  # [Hz] that a point of the spectra averages
BEYOND = 1.5  # the spectra end at so many times the highest resonance
MOMENTS = (1e-9, "nN m"), (1e-6, "µN m"), (1e-3, "mN m")
_TOP = ("excursion", "base_moment_quasi_static")  # of a single contact
_WHOLE = ("first_contact", "last_contact", "contact_state")  # of a whole whisker
_BRIDGE, _DETACHED = 3, 0  # contact_state
_ABOVE: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1, 0.95), "ncols": 2}  # clear of the lines


def compute(scan: xr.Dataset, *, shown: float = SHOWN) -> xr.Dataset:
    """The stretch that is drawn, about the strongest envelope of mode 1, and the spectra of the whole.

    Parameters
    ----------
    scan : Dataset
        From :func:`vibrissa.mechanics.scan.sampled.scanned` or
        :func:`vibrissa.mechanics.scan.sampled.scanned_relief`.
    shown : float
        Length of the stretch [s].

    Returns
    -------
    Dataset
        ``base_moment`` (time), with ``excursion`` and ``base_moment_quasi_static`` of a single contact, or
        ``first_contact``, ``last_contact`` and ``contact_state`` of a whole whisker; ``mode_displacement`` about its
        mean, ``envelope`` [m] (mode, time); ``power`` (mode, frequency), in steps of about 5 Hz, up to 1.5 times the
        highest resonance; ``resonant_frequency``, ``mode_sd`` (mode). Attributes ``whisker_length`` [m], ``caption``.
    """
    require(scan, "mode_displacement", "base_moment", "envelope", "resonant_frequency", "mode_sd")
    time = scan.time.values
    start = float(np.clip(time[scan.envelope.values[0].argmax()] - shown / 2, 0, max(0.0, time[-1] - shown)))
    seen = (time >= start) & (time <= start + shown)
    moving = scan.mode_displacement.values - scan.mode_displacement.values.mean(axis=1, keepdims=True)
    frequency, power = _smoothed(*power_spectrum(moving, 1 / float(time[1] - time[0])))
    band = (frequency > 0) & (frequency < BEYOND * float(np.nanmax(scan.resonant_frequency.values)))
    data = dataset(
        {"whisker_length": scan.attrs["whisker_length"]},
        time=time[seen],
        mode=scan.mode.values,
        frequency=frequency[band],
        mode_displacement=moving[:, seen],
        envelope=scan.envelope.values[:, seen],
        base_moment=scan.base_moment.values[seen],
        **{name: scan[name].values[seen] for name in _TOP + _WHOLE if name in scan},
        power=power[:, band],
        resonant_frequency=scan.resonant_frequency.values,
        mode_sd=scan.mode_sd.values,
    )
    return data.assign_attrs(caption=_caption(scan))


def _smoothed(frequency: Array, power: Array) -> tuple[Array, Array]:
    """Means over runs of bins of some ``WIDTH``: one bin of a periodogram is as scattered as it is high."""
    run = max(1, round(WIDTH / frequency[1]))
    bins = (len(frequency) - 1) // run
    kept = slice(1, 1 + bins * run)  # without the mean
    every = (values[..., kept].reshape(*values.shape[:-1], bins, run) for values in (frequency, power))
    smooth, smoothed = (values.mean(axis=-1) for values in every)
    return smooth, smoothed


def _caption(scan: xr.Dataset) -> str:
    um = 1e6 * scan.attrs["whisker_length"]
    modes = "; ".join(
        f"mode {int(one.mode)}: {float(one.resonant_frequency):.1f} Hz, rms {um * float(one.mode_sd):.3g} µm"
        for one in (scan[["resonant_frequency", "mode_sd"]].sel(mode=mode) for mode in scan.mode.values)
    )
    verdict = f" Verdict: {scan.attrs['verdict']}." if "verdict" in scan.attrs else ""
    size, unit = moment_unit(scan.base_moment.values)
    moment = f"The moment at the base has an rms of {float(np.nanstd(scan.base_moment.values)) / size:.3g} {unit}"
    if "base_moment_quasi_static" in scan:
        moment += (
            f", its quasi-static part of {float(np.nanstd(scan.base_moment_quasi_static.values)) / size:.3g} {unit}"
        )
    return f"Predicted, nothing measured. {modes}. {moment}.{verdict}"


def moment_unit(moments: Array) -> tuple[float, str]:
    """Size of the unit in which moments [N m] have no more than four digits, and its name."""
    largest = float(np.nanmax(np.abs(moments), initial=0.0))
    return next((one for one in MOMENTS if largest < 1e4 * one[0]), MOMENTS[-1])


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Excursion, modes and moment in time on the left, spectra on the right.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    n = min(MODES, data.sizes["mode"])
    figure, axes = new_figure(10.5, 0.8 + 1.4 * (n + 2), n + 2, 2, width_ratios=(1.6, 1), sharex="col")
    um = 1e6 * data.attrs["whisker_length"]
    _draw_contact(axes[0, 0], data, um)
    for i, colour in enumerate(ordered(data.sizes["mode"])[:n]):
        axes[1 + i, 0].plot(data.time, um * data.mode_displacement[i], color=colour, lw=0.6)
        axes[1 + i, 0].plot(data.time, 1e6 * data.envelope[i], color=colour, lw=1.6, label="envelope")
        axes[1 + i, 0].set_ylabel(f"mode {i + 1} [µm]")
    axes[1, 0].legend(**_ABOVE)
    below = axes[n + 1, 0]
    size, unit = moment_unit(data.base_moment.values)
    below.plot(data.time, data.base_moment / size, color=PREDICTED, lw=0.7, label="moment at the base")
    if "base_moment_quasi_static" in data:
        below.plot(data.time, data.base_moment_quasi_static / size, color="0.2", lw=1.0, label="quasi-static part")
    below.set(xlabel="time [s]", ylabel=f"moment [{unit}]", xlim=(float(data.time[0]), float(data.time[-1])))
    below.legend(**_ABOVE)
    _draw_spectra(figure.add_subplot(merged(axes[:, 1])), data)
    return add_caption(figure, data)


def _draw_contact(axis: Axes, data: xr.Dataset, um: float) -> None:
    """How far the surface carries a single contact, or where a whole whisker touches the ground."""
    if "excursion" in data:
        axis.plot(data.time, um * data.excursion, color=PREDICTED, lw=0.9)
        axis.set(ylabel="excursion [µm]", title="how far the surface carries the contact, and what follows")
        return
    axis.plot(data.time, 1e3 * data.last_contact, color="0.2", lw=0.7, label="last")
    axis.plot(data.time, 1e3 * data.first_contact, color=PREDICTED, lw=0.9, label="first")
    for state, colour in ((_BRIDGE, KINDS[1]), (_DETACHED, "0.6")):
        there = data.contact_state.values == state
        axis.fill_between(
            data.time, 0, 1, where=there, color=colour, alpha=0.25, lw=0, transform=axis.get_xaxis_transform()
        )
    axis.set(ylabel="contact [mm]", title="contacts from the base; shaded: a gap is bridged")
    axis.legend(**_ABOVE)


def _draw_spectra(axis: Axes, data: xr.Dataset) -> None:
    scale = (1e6 * data.attrs["whisker_length"]) ** 2
    for i, colour in enumerate(ordered(data.sizes["mode"])):
        axis.semilogy(data.frequency, scale * data.power[i], color=colour, lw=0.8, label=f"mode {i + 1}")
        axis.axvline(float(data.resonant_frequency[i]), color=colour, ls=":", lw=1)
    top = scale * float(np.nanmax(data.power.values))
    axis.set(xlabel="frequency [Hz]", ylabel="power [µm²/Hz]", ylim=(1e-9 * top, 3 * top), xlim=(0, None))
    axis.set_title("Spectra of the modes; dotted: resonances")
    key_above(axis)
