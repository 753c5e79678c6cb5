"""What was presented, from any file: a motion or an envelope, of one channel or several."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Window
from vibrissa.errors import ConflictError, MissingError, RangeError, UnknownError
from vibrissa.netcdf import load
from vibrissa.neural.coupling.presentation import banded
from vibrissa.neural.io.tables.stimuli import has_no_carrier, labelled_stimulus, name_of, one_channel, presented
from vibrissa.neural.io.tables.stimulus_csv import ASSUMED, checked_stimulus, in_stated_unit, read_stimulus_csv
from vibrissa.quantities import require
from vibrissa.stimulus.export import read_command
from vibrissa.study.spec.given import StimulusInput

if TYPE_CHECKING:
    import xarray as xr

SESSION = "session"
LEAST_SHARE = 1e-3  # of the variance of a motion that the band of its carrier holds


def read_stimulus(
    given: StimulusInput,
    folder: Path = Path(),
    *,
    channels: bool = False,
    band: Window | None = None,
    named: bool = True,
) -> tuple[xr.Dataset, list[str]]:
    """Read what was presented.

    Parameters
    ----------
    given : StimulusInput
        ``.csv``: see :func:`vibrissa.neural.io.tables.stimulus_csv.read_stimulus_csv`; with a sidecar, and ``.wav`` and
        ``.npy``, a command of ``vibrissa replay``. ``.nc``: a command, or what ``scan --simulate-units`` wrote.
        ``.nwb``: see :func:`vibrissa.neural.io.formats.nwb_series.read_nwb_stimulus`.
    folder : Path
        Where relative paths start.
    channels : bool
        Whether all channels are wanted; else one.
    band : (float, float), optional
        Band of the carrier whose envelope will be taken [Hz].
    named : bool
        Whether a motion must have a carrier, and what has none may be taken as an envelope.

    Returns
    -------
    stimulus : Dataset
        See :func:`vibrissa.neural.io.tables.stimuli.labelled_stimulus`.
    remarks : list of str
        That it is taken for an envelope, or in metres, where no one said so.

    Raises
    ------
    InputError
        If the file is bad, a unit or a channel is not known, or the motion has no carrier.
    """
    path = folder / given.stimulus
    if path.suffix.lower() in (".wav", ".npy") and path.is_file() and not _sidecar(path).is_file():
        remedy = "of another stimulus give a CSV with times and values, or a .nc"
        raise MissingError(str(path), "must have the sidecar of a command of `vibrissa replay`", remedy=remedy)
    if given.whisker is None and not channels and (path.suffix.lower() in (".wav", ".npy") or _sidecar(path).is_file()):
        raise ConflictError("whisker", "must be given with a command of vibrissa replay", str(path))
    stimulus = _read(path, given)
    remarks = [str(stimulus.attrs.pop(ASSUMED))] if ASSUMED in stimulus.attrs else []
    if channels:
        if given.whisker is not None and path.suffix.lower() != ".nwb":
            raise ConflictError("whisker", "must be left out where all channels are taken", given.whisker)
        return stimulus, remarks
    one = one_channel(stimulus, None if path.suffix.lower() == ".nwb" else given.whisker, str(path))
    known, more = named_stimulus(one, str(path), band) if named else (one, [])
    return known, [*remarks, *more]


def _read(path: Path, given: StimulusInput) -> xr.Dataset:
    """All channels of a file, or, of an NWB file, those of the series that is meant."""
    kind = path.suffix.lower()
    known: dict[str, Any] = {"unit": given.signal_unit, "envelope": given.envelope}
    if kind == ".nwb":
        from vibrissa.neural.io.formats.nwb_series import read_nwb_stimulus

        return read_nwb_stimulus(path, channel=given.whisker, **known)
    if kind in (".wav", ".npy") or _sidecar(path).is_file():
        return _of_command(read_command(path), given, path)
    if kind == ".nc":
        return _of_dataset(load(path), given, path)
    found = read_stimulus_csv(path, **known)
    names = [str(one) for one in found.whisker.values] if "whisker" in found.dims else []
    if given.whisker is not None and given.whisker not in names:
        remedy = "" if names else "the stimulus has one channel: leave it out"
        raise UnknownError(
            "whisker", f"must be one of {', '.join(names) or 'several channels'}", repr(given.whisker), remedy
        )
    return found


def is_command(path: Path) -> bool:
    """Whether a file is a command of the stimulator.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    bool
        True of sound, of arrays, of what has a sidecar, and of a dataset that holds a command.
    """
    if path.suffix.lower() in (".wav", ".npy") or _sidecar(path).is_file():
        return True
    return path.suffix.lower() == ".nc" and "command" in load(path)


def _sidecar(path: Path) -> Path:
    """File that says what a command holds."""
    return Path(f"{path}.json")


def _of_command(command: xr.Dataset, given: StimulusInput, path: Path) -> xr.Dataset:
    """A command of the stimulator, in metres."""
    if given.signal_unit is not None or given.envelope:
        raise ConflictError("signal_unit, envelope", "must not go with a command: it is a motion in metres", str(path))
    require(command, "command", "time", "whisker")
    values, names = command.command.transpose("whisker", "time").values, [str(one) for one in command.whisker.values]
    if given.whisker is not None and given.whisker not in names:
        raise UnknownError("whisker", f"must be one of {', '.join(names)}", repr(given.whisker))
    return labelled_stimulus(command.time.values, values, lead={"whisker": names}, attrs={"source": path.name})


def _of_dataset(data: xr.Dataset, given: StimulusInput, path: Path) -> xr.Dataset:
    """A command, or the stimulus of a scan, from a dataset."""
    if "command" in data:
        return _of_command(data, given, path)
    if "mode_displacement" in data and "point_displacement" not in data:
        raise MissingError(str(path), "must hold what was presented", "a scan", "give `simulate_units`")
    if given.whisker is not None:
        raise ConflictError("whisker", "must go with a stimulus of several channels", str(path), "leave it out")
    name = name_of(data)
    if not (given.envelope or given.signal_unit) or name == "stimulus_envelope":
        return data[[name]]
    require(data, "time")
    values, unit = data[name].values, presented(data).unit
    if given.signal_unit is not None and in_stated_unit(np.ones(1), given.signal_unit)[1] != unit:
        raise ConflictError("signal_unit", f"must be left out: {path} states its own, {unit}", given.signal_unit)
    return labelled_stimulus(data.time.values, values, unit, envelope=given.envelope, attrs={"source": path.name})


def named_stimulus(stimulus: xr.Dataset, source: str, band: Window | None) -> tuple[xr.Dataset, list[str]]:
    """A stimulus that is an envelope, though no one said so, as one; a motion without a carrier is refused.

    Parameters
    ----------
    stimulus : Dataset
        Of one channel.
    source : str
        Where it is from.
    band : (float, float), optional
        Band of the carrier [Hz].

    Returns
    -------
    stimulus : Dataset
        The same, or as an envelope.
    remarks : list of str
        That it is taken for an envelope.

    Raises
    ------
    InputError
        If it is negative at times and has no carrier, or has none in the band.
    """
    time, values, unit, is_envelope = presented(stimulus)
    if is_envelope or ("clock" in stimulus.attrs and stimulus.attrs["clock"] == SESSION):
        return stimulus, []
    checked_stimulus(stimulus, source)
    each = values.reshape(-1, time.size)
    each = each[np.ptp(each, axis=-1) > 0]
    step = float(time[-1] - time[0]) / (time.size - 1)
    if band is not None:
        share = max(float(banded(one, band, step).var() / one.var()) for one in each[:3])
        if share < LEAST_SHARE:
            rule = f"must hold a carrier: {source} has {100 * share:.2g} % of its variance there"
            raise RangeError("band", rule, band)
        return stimulus, []
    if not all(has_no_carrier(one, step) for one in each[:3]):
        return stimulus, []
    if each.min() < 0:
        rule = "must have a carrier, faster than the envelope of it varies"
        remedy = (
            "give `envelope` if it is one already, or the `band` of the carrier, such as 50 Hz 200 Hz; a carrier above "
            "half of these samples a second is lost"
        )
        raise RangeError(source, rule, f"none at {1 / step:.4g} samples a second", remedy)
    attrs, lead = stimulus.attrs, {str(dim): None for dim in stimulus[name_of(stimulus)].dims[:-1]}
    text = f"{Path(source).name} is never negative and has no carrier: it is taken as an envelope"
    return labelled_stimulus(time, values, unit, envelope=True, lead=lead, attrs=attrs), [text]
