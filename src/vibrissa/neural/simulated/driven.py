"""Units that the envelope of one whisker drives: drawn as the paper found them, or read from a table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.neural.simulated.population import COUNTS, drawn_units, record_population
from vibrissa.neural.simulated.wandering import SlowState
from vibrissa.quantities import dataset, require
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.tables.reader import read_table
from vibrissa.tables.table import Table
from vibrissa.tables.units import TEXT
from vibrissa.tables.writer import write_table

MOST_UNITS = 100_000
MOST_SECONDS = 5e6  # [s] of all units and trials together: some 5e7 spikes, a gigabyte
STEADY = SlowState(depth=0.0, trial_sd=0.0)
# columns of a table of units, each with its SI unit, its largest value, and why
COLUMNS = {
    "threshold": ("m", 0.01, "in metres; a column threshold_um takes µm"),
    "slope": ("1/(s m)", 1e9, "in spikes per second and metre; a column slope_per_um takes them per µm"),
    "baseline": ("Hz", 1000.0, "in Hz"),
    "latency": ("s", 1.0, "in seconds; a column latency_ms takes ms"),
}
LEAST_SLOPE = 100.0  # [1/(s m)] 0.1 spikes/s for each millimetre: who writes less means per µm


def draw_driven(n_units: int, *, rng: np.random.Generator) -> xr.Dataset:
    """Draw units of one whisker that its envelope drives, single and multi-units in the paper's ratio, 45 to 157.

    Thresholds, slopes, latencies and baselines are drawn as in
    :func:`vibrissa.neural.simulated.population.draw_population`.

    Parameters
    ----------
    n_units : int
        Units, at most 100,000.
    rng : Generator
        Source of randomness.

    Returns
    -------
    Dataset
        A population of one whisker, as :func:`~vibrissa.neural.simulated.population.record_population` takes it.

    Raises
    ------
    InputError
        If there is no unit, or there are too many.
    """
    if not 1 <= n_units <= MOST_UNITS:
        raise RangeError("number of units", f"must be from 1 to {MOST_UNITS}", n_units)
    driven = {quality: count[1] for quality, count in COUNTS["results"].items()}
    single = round(n_units * driven["SU"] / sum(driven.values()))
    parts = [drawn_units(quality, n, n, rng) for quality, n in (("SU", single), ("MU", n_units - single)) if n]
    units: dict[str, Any] = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return _of_one_whisker(units | {"surround_gain": np.zeros(n_units)})


def _of_one_whisker(units: dict[str, Any]) -> xr.Dataset:
    """Label the units of one session, all of one whisker."""
    nowhere = np.zeros(len(units["unit_name"]), int)
    places: dict[str, Any] = dict.fromkeys(("unit_session", "unit_rat", "unit_whisker", "driving_whisker"), nowhere)
    return dataset({"n_whiskers": 1}, **units, **places)


def read_driven(path: str | Path) -> xr.Dataset:
    """Units from a table, one line for each.

    Parameters
    ----------
    path : path
        CSV with the columns ``unit`` (any name, each once), ``threshold`` [m] or ``threshold_um``, ``slope`` [1/(s m)]
        or ``slope_per_um``, ``baseline`` [Hz], ``latency`` [s] or ``latency_ms`` and, if known, ``quality``: SU for a
        single unit, which rests after each spike, MU for several neurons together. MU where there is no such column.

    Returns
    -------
    Dataset
        As :func:`draw_driven` gives it.

    Raises
    ------
    InputError
        Names file and line: a cell that is no number, negative, or too large or small for the unit stated.
    """
    table = read_table(path, {"unit": TEXT, **{name: si for name, (si, *_) in COLUMNS.items()}}, {"quality": TEXT})
    table.refuse_empty("must have a line for each unit below its header")
    names = table.names("unit")
    repeated = np.ones(len(names), bool)
    repeated[np.unique(names, return_index=True)[1]] = False
    table.refuse_first(repeated, "unit", "must name each unit once")
    quality = table.text("quality") if "quality" in table else ["MU"] * len(names)
    table.refuse_first(~np.isin(quality, ["SU", "MU"]), "quality", "must be SU or MU")
    return _of_one_whisker(
        {
            "unit_name": np.array(names, str),
            "unit_quality": np.array(quality, str),
            "driven_by": np.repeat("envelope", len(names)),
            **{f"true_{name}": _column(table, name) for name in COLUMNS},
            "surround_gain": np.zeros(len(names)),
        }
    )


def _column(table: Table, name: str) -> Array:
    """Values of a column in SI, refused where they cannot be meant."""
    _, largest, unit = COLUMNS[name]
    value = table.numbers(name)
    table.refuse_first(value < 0, name, "must be zero or positive")
    table.refuse_first(value > largest, name, f"must be at most {largest:g} {unit}")
    if name == "slope":
        table.refuse_first((value > 0) & (value < LEAST_SLOPE), name, f"must be 0 or at least {LEAST_SLOPE:g} {unit}")
    return value


def write_driven(units: xr.Dataset, path: str | Path) -> None:
    """Write units so that :func:`read_driven` gives them back to the last bit; whole or not at all.

    Parameters
    ----------
    units : Dataset
        From :func:`draw_driven` or :func:`read_driven`.
    path : path
        The CSV.
    """
    columns = {"unit": "unit_name", "quality": "unit_quality", **{name: f"true_{name}" for name in COLUMNS}}
    require(units, *columns.values())
    write_table(path, {column: units[name].values.tolist() for column, name in columns.items()})


def fire(
    units: xr.Dataset, time: Array, displacement: Array, n_trials: int, *, seed: int = 0, state: SlowState = STEADY
) -> xr.Dataset:
    """Spikes of units driven by the envelope of one whisker's motion, again and again.

    Parameters
    ----------
    units : Dataset
        From :func:`draw_driven` or :func:`read_driven`.
    time, displacement : (T,) arrays
        Even grid of one presentation [s], and the motion of a point of the shaft [m].
    n_trials : int
        Presentations.
    seed : int
        Equal seeds give equal spikes.
    state : SlowState, optional
        Excitability that the units share; by default it does not wander, and multi-units are Poisson.

    Returns
    -------
    Dataset
        ``time``, ``point_displacement``, ``point_envelope`` [m]; the units with their truth, ``unit_rate`` [Hz], over
        all trials, and ``time_above_threshold``; ``spike_time`` [s], ``spike_trial``, ``spike_unit``. The rate is
        baseline + slope · max(A(t − latency) − threshold, 0), A the envelope.

    Raises
    ------
    InputError
        If units and trials together last longer than 5,000,000 s; as
        :func:`~vibrissa.neural.simulated.population.record_population` does.
    """
    seconds = units.sizes["unit"] * n_trials * float(time[-1] - time[0])
    if seconds > MOST_SECONDS:
        raise RangeError("units and trials", f"must last at most {MOST_SECONDS:g} s in all", f"{seconds:.3g} s")
    rng = np.random.default_rng(seed)
    spikes = record_population(units, time, displacement[None], n_trials, rng=rng, state=state)
    envelope, count = analytic_envelope(displacement)[0], np.bincount(spikes.spike_unit, minlength=units.sizes["unit"])
    shown = dataset(
        {**spikes.attrs, "seed": seed},
        time=time,
        point_displacement=displacement,
        point_envelope=envelope,
        unit_rate=count / (n_trials * spikes.attrs["duration"]),
        time_above_threshold=_share_above(envelope, units.true_threshold.values),
    )
    true = [f"true_{name}" for name in COLUMNS]
    return shown.merge(spikes.drop_vars("unit_whisker").merge(units[true], compat="override"), combine_attrs="override")


def _share_above(values: Array, levels: Array) -> Array:
    """Share of the values above each level."""
    return 1 - np.searchsorted(np.sort(values), levels, side="right") / values.size
