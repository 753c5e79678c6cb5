"""What was presented: a motion or the envelope of one, in any unit, as the analyses take it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, MissingError, RangeError, ShapeError
from vibrissa.quantities import QUANTITIES, dataset, require
from vibrissa.signals.envelope import analytic_envelope

NAMES = ("point_displacement", "stimulus_motion", "stimulus_envelope")
OTHERS = ("rad", "dB", "a.u.")  # units of a stimulus besides metres
NO_CARRIER = 0.5  # mean frequency of the envelope over that of the signal: below it in every ringing motion tried


class Presented(NamedTuple):
    """A stimulus.

    Attributes
    ----------
    time : (T,) array
        [s].
    values : (..., T) array
        In the unit; of an envelope NaN where it is not known.
    unit : str
        SI unit (``m``, ``rad``), or one that has none (``dB``, ``a.u.``).
    is_envelope : bool
        Whether the values are an envelope already.
    """

    time: Array
    values: Array
    unit: str
    is_envelope: bool


def labelled_stimulus(
    time: Array,
    values: Array,
    unit: str = "m",
    *,
    envelope: bool = False,
    lead: Mapping[str, Any] | None = None,
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Label a stimulus by what it is.

    Parameters
    ----------
    time : (T,) array
        [s].
    values : (..., T) array
        In the unit.
    unit : str
        As in :class:`Presented`.
    envelope : bool
        Whether it is an envelope already.
    lead : mapping, optional
        Dimensions before time: ``whisker`` with the names of the channels, ``trial`` without names.
    attrs : mapping, optional
        Attributes.

    Returns
    -------
    Dataset
        ``point_displacement`` [m], ``stimulus_motion`` (any other motion) or ``stimulus_envelope``, by ``time``.

    Raises
    ------
    InputError
        If an envelope, of a unit other than dB, is below 0 by more than a hundredth of its largest value.
    """
    low, high = np.nanmin(values, initial=0.0), np.nanmax(values, initial=0.0)
    if envelope and unit != "dB" and low < -0.01 * high:
        rule = "must not be negative where it is an envelope"
        raise RangeError("stimulus", rule, f"down to {low:g} {unit}", "leave `envelope` out if it is a motion")
    name = "stimulus_envelope" if envelope else "point_displacement" if unit == "m" else "stimulus_motion"
    lead = lead or {}
    named = {dim: np.array(cells, str) for dim, cells in lead.items() if cells is not None}
    data = dataset(attrs, lead=tuple(lead), time=time, **named, **{name: values})
    data[name].attrs["units"] = unit
    return data


def presented(stimulus: xr.Dataset) -> Presented:
    """The stimulus that a dataset holds.

    Parameters
    ----------
    stimulus : Dataset
        From :func:`labelled_stimulus`; or any that has ``time`` and ``point_displacement``.

    Returns
    -------
    Presented
        Its times, values and unit.

    Raises
    ------
    InputError
        If it holds none.
    """
    require(stimulus, "time")
    name = name_of(stimulus)
    unit = str(stimulus[name].attrs.get("units", QUANTITIES[name].unit))
    return Presented(stimulus.time.values, stimulus[name].values, unit, name == "stimulus_envelope")


def name_of(stimulus: xr.Dataset) -> str:
    """Name of the variable that holds the stimulus.

    Parameters
    ----------
    stimulus : Dataset
        As in :func:`presented`.

    Returns
    -------
    str
        One of ``NAMES``.

    Raises
    ------
    InputError
        If there is none.
    """
    for name in NAMES[1:]:
        if name in stimulus:
            return name
    require(stimulus, NAMES[0])
    return NAMES[0]


def require_motion(stimulus: xr.Dataset, what: str) -> None:
    """Refuse an envelope where the motion itself is needed.

    Parameters
    ----------
    stimulus : Dataset
        As in :func:`presented`.
    what : str
        What is taken from the motion: "phase", "speed".

    Raises
    ------
    InputError
        If it is an envelope.
    """
    if presented(stimulus).is_envelope:
        remedy = "give the motion as it was played"
        raise ConflictError("stimulus", f"must be a motion, which has a {what}", "an envelope", remedy)


def require_metres(stimulus: xr.Dataset, what: str) -> None:
    """Refuse a stimulus that is not in metres, where thresholds are.

    Parameters
    ----------
    stimulus : Dataset
        As in :func:`presented`.
    what : str
        What is in metres.

    Raises
    ------
    InputError
        If it is in another unit.
    """
    if (unit := presented(stimulus).unit) != "m":
        raise ConflictError("stimulus", f"must be in metres, as {what} is", unit)


def channels_of(stimulus: xr.Dataset) -> dict[str, xr.Dataset]:
    """Each channel of a stimulus of several, as a stimulus of one.

    Parameters
    ----------
    stimulus : Dataset
        With the dimension ``whisker``; or a command, with ``command`` (whisker, time).

    Returns
    -------
    dict of Datasets
        By the names of the channels, in their order.

    Raises
    ------
    InputError
        If it has one channel alone.
    """
    if "command" in stimulus:
        require(stimulus, "command", "time", "whisker")
        values = stimulus.command.transpose("whisker", "time").values
        time, names = stimulus.time.values, map(str, stimulus.whisker.values)
        return {name: labelled_stimulus(time, one) for name, one in zip(names, values, strict=True)}
    if "whisker" not in stimulus.dims:
        remedy = "a command of `vibrissa replay`, or a table with a column for each"
        raise ShapeError("stimulus", "must have a channel for each whisker", "one channel", remedy)
    name = name_of(stimulus)
    return {str(one): stimulus[[name]].sel(whisker=one, drop=True) for one in stimulus.whisker.values}


def with_channels(stimulus: xr.Dataset) -> xr.Dataset:
    """A stimulus of one channel as one of several; of several, or a command, as it is.

    Parameters
    ----------
    stimulus : Dataset
        As in :func:`channels_of`.

    Returns
    -------
    Dataset
        With the dimension ``whisker``; one channel is called ``stimulus``.
    """
    if "whisker" in stimulus.dims:
        return stimulus
    return stimulus.expand_dims(whisker=np.array(["stimulus"]))


def one_channel(stimulus: xr.Dataset, name: str | None, source: str) -> xr.Dataset:
    """One channel of a stimulus.

    Parameters
    ----------
    stimulus : Dataset
        Of one channel or of several.
    name : str or None
        The channel that is meant; needed where there are several.
    source : str
        The file, for messages.

    Returns
    -------
    Dataset
        Without the dimension ``whisker``.

    Raises
    ------
    InputError
        If several may be meant, or there is none of the name.
    """
    if "whisker" not in stimulus.dims:
        return stimulus
    names = [str(one) for one in stimulus.whisker.values]
    if name is None and len(names) > 1:
        there = ", ".join(names[:9]) + (" …" if names[9:] else "")
        raise MissingError("whisker", f"must be given: {source} has several channels", there)
    chosen = names[0] if name is None else name
    return stimulus.sel(whisker=chosen, drop=True).assign_attrs(whisker=chosen)


def has_no_carrier(values: Array, step: float) -> bool:
    """Whether a signal has no carrier: its envelope would vary about as fast as the signal itself.

    The envelope of a carrier varies more slowly than the carrier: the mean frequency of what the analytic signal gives
    (without its mean, weighted by power) was below 0.4 of that of the signal for ringing motions of textures, and above
    0.5 for envelopes and for noise without a carrier.

    Parameters
    ----------
    values : (T,) array
        The signal, in any unit.
    step : float
        Between its samples [s].

    Returns
    -------
    bool
        True where there is none.
    """
    envelope = analytic_envelope(values)[0]
    return mean_frequency(envelope, step) > NO_CARRIER * mean_frequency(values, step)


def mean_frequency(signal: Array, step: float) -> float:
    """Mean frequency of a signal without its mean, weighted by power [Hz].

    Parameters
    ----------
    signal : (T,) array
        Any unit.
    step : float
        Between its samples [s].

    Returns
    -------
    float
        0 of a constant.
    """
    power = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(signal.size))) ** 2
    return float(np.fft.rfftfreq(signal.size, step) @ power / power.sum()) if power.sum() > 0 else 0.0


def in_unit_of(found: xr.Dataset, stimulus: xr.Dataset) -> xr.Dataset:
    """Results in which the metre is replaced by the unit of the stimulus: thresholds in dB, slopes in 1/(s dB).

    Parameters
    ----------
    found : Dataset
        Results of an analysis, labelled as for a displacement.
    stimulus : Dataset
        As in :func:`presented`.

    Returns
    -------
    Dataset
        The same; unchanged where the stimulus is in metres.
    """
    unit = "m" if "command" in stimulus else presented(stimulus).unit
    if unit == "m":
        return found
    other = {"m": unit, "1/m": f"1/{unit}", "1/(s m)": f"1/(s {unit})", "m/s": f"{unit}/s"}
    for one in found.variables.values():
        if one.attrs.get("units") in other:
            one.attrs["units"] = other[one.attrs["units"]]
    return found.assign_attrs(stimulus_unit=unit)
