"""Surround map: how much each whisker drives a unit while all replay delayed copies of one texture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr, stdtrit

from vibrissa.errors import InputError
from vibrissa.neural.copies import ALIKE, INFLATED, Copies, condition_number, inflation
from vibrissa.neural.inputs import refuse_misplaced
from vibrissa.neural.response import spike_counts
from vibrissa.neural.whisker_weights import SurroundGrid, whisker_weights
from vibrissa.quantities import dataset
from vibrissa.stats import adjusted_p_values

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Window = tuple[float, float]

FEWEST_SPIKES, FEWEST_TRIALS = 100, 8
NEGLIGIBLE = 0.2  # of the largest weight: a whisker whose interval stays within this does nothing that matters


@dataclass(frozen=True, kw_only=True)
class SurroundAnalysis:
    """How surround maps are made.

    Attributes
    ----------
    bin_width, skip, window, band
        As in :class:`vibrissa.neural.analysis.EnvelopeAnalysis`.
    level : float
        Largest p-value, adjusted over the whiskers of a unit, at which a whisker is said to drive or to suppress it.
    """

    bin_width: float = 0.01
    skip: float = 1.0
    window: Window | None = None
    band: Window | None = None
    level: float = 0.05

    def __post_init__(self) -> None:
        if not 0 < self.bin_width < np.inf:
            raise InputError("bin width", "must be positive (s)", self.bin_width)
        if not 0 <= self.skip < np.inf:
            raise InputError("skip", "must be zero or positive (s)", self.skip)
        if not 0 < self.level < 1:
            raise InputError("level", "must lie between 0 and 1", self.level)


def surround_map(
    spikes: xr.Dataset, command: xr.Dataset, n_trials: int, how: SurroundAnalysis | None = None
) -> xr.Dataset:
    """Weight of every whisker in the rate of every unit, from one stimulus that runs on all whiskers with delays.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.spikes.spike_table`, times from the stimulus' onset.
    command : Dataset
        ``command`` (whisker, time) [m], as :func:`vibrissa.stimulus.array.replay_command` gives it.
    n_trials : int
        Trials presented, silent ones included.
    how : SurroundAnalysis, optional
        Bins and level.

    Returns
    -------
    Dataset
        ``surround_weight`` [1/(s m)] with its 95 % interval, ``surround_p_value`` (adjusted over the whiskers of a
        unit) and ``surround_verdict`` (unit, whisker): drives, suppresses, no (its interval stays within a fifth of
        the largest weight), cannot tell. ``strongest_whisker``, ``threshold``, ``latency``, ``reason`` (unit).
        Of the design: ``condition_number``, ``weight_inflation``, ``copy_likeness``, ``likest_whisker`` (whisker).

    Raises
    ------
    InputError
        If spikes and stimulus do not fit together, or there are too few trials.
    """
    how = how or SurroundAnalysis()
    one = dataset(time=command.time.values, point_displacement=command.command.isel(whisker=0).values)
    refuse_misplaced(spikes, one, n_trials, window=how.window)
    if n_trials < FEWEST_TRIALS:
        raise InputError(
            "number of trials", f"must be at least {FEWEST_TRIALS}", n_trials, "intervals come from trials"
        )
    copies = Copies.of(command, bin_width=how.bin_width, skip=how.skip, window=how.window, band=how.band)
    grid = SurroundGrid(copies)
    design = _design(grid)
    rows = [
        _row(grid, _counts(spikes, unit, n_trials, copies, how), design, how) for unit in range(spikes.sizes["unit"])
    ]
    columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    attrs = {"n_trials": n_trials, "bin_width": how.bin_width, "skip": how.skip, "level": how.level}
    return dataset(attrs, unit_name=spikes.unit_name.values, **columns, **design)


def _design(grid: SurroundGrid) -> dict[str, Any]:
    """What the stimulus alone decides, at the threshold in the middle."""
    columns = grid.hinges[len(grid.thresholds) // 2, 0]
    likeness, other = grid.copies.likeness()
    names = np.array(grid.copies.whiskers)
    return {
        "whisker": names,
        "condition_number": condition_number(columns),
        "weight_inflation": inflation(columns),
        "copy_likeness": likeness,
        "likest_whisker": names[other],
    }


def _counts(spikes: xr.Dataset, unit: int, n_trials: int, copies: Copies, how: SurroundAnalysis) -> Array:
    own = spikes.isel(spike=np.flatnonzero(spikes.spike_unit.values == unit))
    start, n_bins = float(copies.edges[0]), len(copies.edges) - 1
    counts = spike_counts(own, n_trials=n_trials, start=start, n_bins=n_bins, bin_width=how.bin_width)
    return counts[:, copies.valid].astype(float)


def _row(grid: SurroundGrid, counts: Array, design: dict[str, Any], how: SurroundAnalysis) -> dict[str, Any]:
    names = np.array(grid.copies.whiskers)
    nothing = np.full(len(names), np.nan)
    row: dict[str, Any] = {f"surround_weight{end}": nothing for end in ("", "_low", "_high")}
    row |= {"surround_p_value": nothing, "surround_verdict": np.full(len(names), "cannot tell", "<U11")}
    row |= {"strongest_whisker": "", "threshold": np.nan, "latency": np.nan}
    if counts.sum() < FEWEST_SPIKES:
        return {**row, "reason": f"too few spikes: {counts.sum():.0f} in the bins that count, below {FEWEST_SPIKES}"}
    found = whisker_weights(grid, counts, how.bin_width)
    blind = (design["copy_likeness"] > ALIKE) | (inflation(found.columns) > INFLATED)
    half = stdtrit(found.free, 0.975) * found.error
    weight, low, high = (
        np.where(blind, np.nan, one) for one in (found.weight, found.weight - half, found.weight + half)
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        p = adjusted_p_values(2 * stdtr(found.free, -np.abs(weight) / found.error))
    verdict = _verdicts(weight, low, high, p, how.level)
    driven = verdict == "drives"
    row |= {"surround_weight": weight, "surround_weight_low": low, "surround_weight_high": high, "surround_p_value": p}
    row |= {"surround_verdict": verdict, "reason": _reason(blind, design, driven)}
    if not (driven | (verdict == "suppresses")).any():
        return row
    strongest = str(names[int(np.nanargmax(np.where(driven, weight, -np.inf)))]) if driven.any() else ""
    return {**row, "strongest_whisker": strongest, "threshold": found.threshold, "latency": found.latency}


def _verdicts(weight: Array, low: Array, high: Array, p: Array, level: float) -> NDArray[np.str_]:
    significant = np.nan_to_num(p, nan=1.0) <= level
    largest = np.max(np.abs(weight[significant]), initial=0.0)
    verdict = np.full(len(weight), "cannot tell", "<U11")
    verdict[(np.maximum(-low, high) < NEGLIGIBLE * largest)] = "no"
    verdict[significant & (weight > 0)] = "drives"
    verdict[significant & (weight < 0)] = "suppresses"
    return verdict


def _reason(blind: NDArray[np.bool_], design: dict[str, Any], driven: NDArray[np.bool_]) -> str:
    if blind.any():
        names, other = design["whisker"], design["likest_whisker"]
        k = int(np.argmax(blind))
        text = f"cannot tell {names[k]} from {other[k]}: their copies are alike (r = {design['copy_likeness'][k]:.2f})"
        more = f", and {blind.sum() - 1} more" if blind.sum() > 1 else ""
        return f"{text}{more}; condition number {design['condition_number']:.3g}; other delays would tell"
    return "" if driven.any() else "no whisker drives it beyond chance"
