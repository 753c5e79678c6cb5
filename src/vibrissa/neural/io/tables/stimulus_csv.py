"""Stimuli in files of comma-separated values: one channel or several, one presentation or one for each trial."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers
from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError, ShapeError, TooFewError, UnknownError
from vibrissa.neural.io.tables.stimuli import labelled_stimulus, name_of, presented
from vibrissa.rounded_times import refuse_rounded
from vibrissa.tables.reader import read_table
from vibrissa.tables.table import Table
from vibrissa.tables.units import PURE, channel_and_unit, in_si, is_unit
from vibrissa.tables.writer import write_table

NAMED = {"displacement": "m", "angle": "rad", "envelope": None}  # columns that say what they are, and their SI unit
UNREAD = frozenset({"cm", "dm", "km", "in", "inch", "inches", "px", "pixel", "pixels"})  # ends of names, no units here
LEVEL = "dB"  # of a unit that envelopes alone have
FEWEST, SLOWEST = 100, 0.01  # samples; [s] of the longest step between two
ASSUMED = "unit_assumed"  # attribute: what to remark on a unit that no one stated
LARGEST_SD = 0.01  # [m] numbers that move more are no metres


def read_stimulus_csv(path: str | Path, *, unit: str | None = None, envelope: bool = False) -> xr.Dataset:
    """Stimulus of a table with the column ``time`` [s] and a column for each channel.

    Parameters
    ----------
    path : path
        UTF-8 text. A column is named ``displacement``, ``angle`` or ``envelope``, or as its channel (``contra``), and
        may end in its unit: ``displacement_um``, ``angle_deg``, ``envelope_dB``, ``contra_au``. Where one of the three
        is there, other columns are left alone. With a column ``trial`` (from 0) there is one presentation for each
        trial, all at the same times.
    unit : str, optional
        Unit of the columns whose names have none; m, or rad of an angle, by default.
    envelope : bool
        Whether the columns are envelopes already, as one named ``envelope``, or in dB, is.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.stimuli.labelled_stimulus`; with the dimension ``whisker`` where there are
        several channels, ``trial`` where there is one presentation for each. The attribute ``unit_assumed`` says of
        channels without a unit that they are taken as metres.

    Raises
    ------
    InputError
        If a column is missing, a cell is no number, times do not ascend evenly, or a unit is not known.
    """
    table = read_table(path, {"time": "s"}, {"trial": PURE})
    table.refuse_empty("must hold a line for each sample")
    columns = {name: channel_and_unit(name) for name in table.others}
    known = {name: one for name, one in columns.items() if one[0] in NAMED}
    columns = known or columns
    if not columns:
        raise MissingError(str(path), "must have a column beside time", ",".join(table.header), "such as displacement")
    assumed = [name for name, (_, end) in columns.items() if unit is None and end is None and name not in NAMED]
    _refuse_odd_units(str(path), assumed)
    time, order = _times(table, str(path))
    parts = [_channel(table, name, *columns[name], unit, envelope) for name in columns]
    kinds = {(found, is_envelope) for _, found, is_envelope in parts}
    if len(kinds) > 1:
        remedy = "keep those of one unit and kind in a file"
        raise ConflictError(str(path), "must have channels of one unit and kind", ", ".join(columns), remedy)
    values = np.array([one[order] for one, _, _ in parts]).reshape(len(parts), -1, time.size)
    (found, is_envelope), names = kinds.pop(), [name for name, _ in columns.values()]
    if len(set(names)) < len(parts):
        raise FormatError(str(path), "must name each channel once", ", ".join(columns))
    several, repeated = len(parts) > 1, "trial" in table
    values = values[(slice(None) if several else 0, slice(None) if repeated else 0)]
    lead = ({"whisker": names} if several else {}) | ({"trial": None} if repeated else {})
    attrs = {"source": Path(path).name}
    if assumed:
        attrs[ASSUMED] = f"{Path(path).name}: no known unit ends the name of {', '.join(assumed)}: taken as metres"
    how: dict[str, Any] = {"envelope": is_envelope, "lead": lead, "attrs": attrs}
    return checked_stimulus(labelled_stimulus(time, values, found, **how), str(path))


def _refuse_odd_units(path: str, columns: list[str]) -> None:
    """Refuse names that end in a unit which is not known, or not written as one."""
    ends = {name: re.split(r"[_\s(\[]+", name.rstrip(")] "))[-1] for name in columns}
    odd = next((name for name, end in ends.items() if end in UNREAD or (is_unit(end) and end != name)), None)
    if odd is not None:
        remedy = "displacement_um or angle_deg, for example; or state the unit of all numbers (`signal_unit`)"
        raise UnknownError(f"{path}: column {odd!r}", "must end in a unit that is known", remedy=remedy)


def _times(table: Table, path: str) -> tuple[Array, Integers]:
    """Times of one presentation [s], even to a twentieth of a step, and the rows in the order of trials and times."""
    time = table.numbers("time")
    n_trials, order = 1, np.arange(time.size)
    if "trial" in table:
        trial = table.whole_numbers("trial", "must be a whole number from 0")
        order = np.argsort(trial, kind="stable")
        n_trials = int(trial.max()) + 1
        sizes = np.bincount(trial)
        if (sizes != sizes[0]).any():
            found = f"{sizes.min()} to {sizes.max()} samples"
            raise ShapeError(path, f"must have as many samples of each of its {n_trials} trials", found)
    each = time[order].reshape(n_trials, -1)
    apart = np.abs(each - each[0]).max()
    if apart > 1e-6:
        rule, remedy = "must have the same times in all trials", "times count from the onset of each trial"
        raise FormatError(f"{path}, time", rule, f"up to {apart:.4g} s apart", remedy)
    first, step = each[0], np.diff(each[0])
    rows = np.flatnonzero(order < first.size) if n_trials == 1 else order[: first.size]
    wrong = np.zeros(time.size, bool)
    wrong[rows[1:]] = step <= 0
    refuse_rounded(first, f"{path}: time")
    table.refuse_first(wrong, "time", "must be later than the one before")
    usual = float(np.median(step)) if step.size else 0.0
    wrong[rows[1:]] = np.abs(step - usual) > 0.05 * usual
    remedy = "interpolate it first; where samples are missing, give the part before or after"
    table.refuse_first(wrong, "time", f"must follow the one before evenly, by {usual:.6g} s", remedy)
    return first, order


def _channel(
    table: Table, column: str, name: str, end: str | None, unit: str | None, envelope: bool
) -> tuple[Array, str, bool]:
    """Values in SI of one column, their unit, and whether they are an envelope."""
    if unit is not None and end is not None and in_si(1.0, unit) != in_si(1.0, end):
        raise ConflictError("signal_unit", f"must be left out: {table.path} states it, {column}", unit)
    stated = end or unit or NAMED.get(name) or "m"
    values, found = in_stated_unit(table.numbers(column), stated)
    return values, found, envelope or name == "envelope" or found == LEVEL


def in_stated_unit(values: Array, unit: str) -> tuple[Array, str]:
    """Values in SI, of a unit that must be known.

    Parameters
    ----------
    values : array
        In the unit.
    unit : str
        As it is stated.

    Returns
    -------
    values : array
        In SI.
    unit : str
        Its SI unit.

    Raises
    ------
    InputError
        If there is no such unit.
    """
    if not is_unit(unit):
        raise UnknownError("signal_unit", "must be a unit: m, mm, um, rad, deg, V, dB, a.u.", repr(unit))
    return in_si(values, unit)


def checked_stimulus(stimulus: xr.Dataset, source: str) -> xr.Dataset:
    """A stimulus that can be analysed: long, fine and moving enough, of finite numbers.

    Parameters
    ----------
    stimulus : Dataset
        From :func:`vibrissa.neural.io.tables.stimuli.labelled_stimulus`.
    source : str
        Where it is from, for messages.

    Returns
    -------
    Dataset
        The same.

    Raises
    ------
    InputError
        If it has fewer than 100 samples, or fewer than 100 for each second, or does not move, or moves by centimetres.
    """
    time, values, unit, _ = presented(stimulus)
    if time.size < FEWEST:
        raise TooFewError(source, f"must hold at least {FEWEST} samples", time.size)
    mean = (time[-1] - time[0]) / (time.size - 1)
    if mean > SLOWEST:
        raise RangeError(source, "must be sampled at 100 Hz or above", f"{1 / mean:.4g} Hz", "times are in seconds")
    if not np.isfinite(values).all():
        raise RangeError(source, "must have finite samples", f"{int((~np.isfinite(values)).sum())} that are not")
    each = values.reshape(-1, time.size)
    still = np.ptp(values, axis=-1) == 0
    if (still.all(-1) if "trial" in stimulus.dims else still).any():  # a trial may be one without stimulus
        what = f"constant {name_of(stimulus).removeprefix('point_').removeprefix('stimulus_')}"
        raise RangeError(source, "must move", f"a {what}" if len(each) == 1 else f"one channel with a {what}")
    largest = float(each.std(axis=-1).max())
    if unit == "m" and largest > LARGEST_SD:
        remedy = "say otherwise by `signal_unit`, or in the column's name: displacement_um, angle_deg, envelope_dB"
        raise RangeError(
            source, "must move by less than 1 cm: numbers are metres", f"standard deviation {largest:.3g}", remedy
        )
    return stimulus


def write_stimulus(stimulus: xr.Dataset, path: str | Path) -> None:
    """Write the stimulus of one channel so that :func:`read_stimulus_csv` gives it back; whole or not at all.

    Parameters
    ----------
    stimulus : Dataset
        As :func:`vibrissa.neural.io.tables.stimuli.presented` takes it.
    path : path
        Name of the file; one that is there is replaced.
    """
    time, values, unit, envelope = presented(stimulus)
    name = "envelope" if envelope else "displacement" if unit == "m" else "angle" if unit == "rad" else "motion"
    end = "" if unit in ("m", "rad") else f"_{unit}"
    write_table(path, {"time": time, f"{name}{end}": values})
