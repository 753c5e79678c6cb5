"""Surround map: how much each whisker drives a unit while all replay delayed copies of one texture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import stdtr, stdtrit

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import TooFewError, require_fraction
from vibrissa.neural.coupling.presentation import BinnedAnalysis
from vibrissa.neural.coupling.response import UnitCounts
from vibrissa.neural.coupling.stimulus_blocks import guard_bins, independent_blocks
from vibrissa.neural.glm.delayed_envelopes import ALIKE, INFLATED, Copies, condition_number, inflation
from vibrissa.neural.glm.shifted_whiskers import ShiftedWhiskers
from vibrissa.neural.glm.whisker_weights import SurroundGrid, whisker_weights
from vibrissa.neural.io.tables.inputs import refuse_misplaced
from vibrissa.neural.io.tables.stimuli import in_unit_of
from vibrissa.quantities import dataset, stacked
from vibrissa.quantities.quantity import estimate
from vibrissa.stats import adjusted_p_values

FEWEST_SPIKES, FEWEST_TRIALS = 100, 8  # with fewer trials, blocks of the stimulus are the draws
NEGLIGIBLE = 0.2  # of the largest weight: a whisker whose interval stays within this does nothing that matters


@dataclass(frozen=True, kw_only=True)
class SurroundAnalysis(BinnedAnalysis):
    """Settings of surround maps.

    Attributes
    ----------
    bin_width, skip, window, band
        As in :class:`vibrissa.neural.coupling.presentation.BinnedAnalysis`.
    level : float
        Largest p-value, adjusted over the whiskers of a unit, at which a whisker is said to drive or to suppress it.
    """

    level: float = 0.05

    def __post_init__(self) -> None:
        super().__post_init__()
        require_fraction("level", self.level)


def surround_map(
    spikes: xr.Dataset, command: xr.Dataset, n_trials: int, how: SurroundAnalysis | None = None
) -> xr.Dataset:
    """Weight of every whisker in the rate of every unit, from one stimulus that runs on all whiskers with delays.

    Trials are the draws for intervals; of fewer than 8 trials, blocks of the stimulus, as in
    :func:`vibrissa.neural.glm.poisson_model.whisker_kernels`.

    Parameters
    ----------
    spikes, command, n_trials
        As in :func:`vibrissa.neural.glm.poisson_model.whisker_kernels`.
    how : SurroundAnalysis, optional
        Bins and level.

    Returns
    -------
    Dataset
        ``surround_weight`` [1/(s m)] with its 95 % interval, ``surround_p_value`` (adjusted over the whiskers of a
        unit; the larger of that of the weight's error and ``surround_shift_p_value``, against circular shifts) and
        ``surround_verdict`` (unit, whisker): drives, suppresses, no (its interval stays within a fifth of the largest
        weight), cannot tell. ``strongest_whisker``, ``driving_whiskers`` and ``suppressing_whiskers`` (names, the
        strongest first), ``threshold``, ``latency``, ``n_blocks`` (0: trials are the draws), ``reason`` (unit).
        Of the design: ``condition_number``, ``weight_inflation``, ``copy_likeness``, ``likest_whisker`` (whisker).

    Raises
    ------
    InputError
        If spikes and stimulus do not fit together, or trials are few and the stimulus is short.
    """
    how = how or SurroundAnalysis()
    refuse_misplaced(spikes, command, n_trials, window=how.window, skip=how.skip)
    copies = Copies.of(command, how)
    grid = SurroundGrid(copies)
    if n_trials < FEWEST_TRIALS:
        independent_blocks(*grid.hinges[0, 0], width=how.bin_width, fewest_trials=FEWEST_TRIALS)
    design = _design(grid)
    shifts = ShiftedWhiskers(grid, how.bin_width)
    counts = UnitCounts.of(spikes, n_trials, copies.edges, how.bin_width)
    rows = [_row(grid, shifts, own[:, copies.valid].astype(float), design, how) for own in counts]
    attrs = {"n_trials": n_trials, "bin_width": how.bin_width, "skip": how.skip, "level": how.level}
    found = dataset(attrs, unit_name=spikes.unit_name.values, **stacked(rows), **design)
    return in_unit_of(found, command)


def _design(grid: SurroundGrid) -> dict[str, Any]:
    """Measures of the stimulus alone, at the threshold in the middle."""
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


def _row(
    grid: SurroundGrid, shifts: ShiftedWhiskers, counts: Array, design: dict[str, Any], how: SurroundAnalysis
) -> dict[str, Any]:
    names = np.array(grid.copies.whiskers)
    nothing = np.full(len(names), np.nan)
    row: dict[str, Any] = estimate("surround_weight", nothing, nothing, nothing)
    row |= {
        "surround_p_value": nothing,
        "surround_shift_p_value": nothing,
        "surround_verdict": np.full(len(names), "cannot tell", "<U11"),
    }
    row |= {**dict.fromkeys(("strongest_whisker", "driving_whiskers", "suppressing_whiskers"), "")}
    row |= {"threshold": np.nan, "latency": np.nan, "n_blocks": 0}
    if counts.sum() < FEWEST_SPIKES:
        return {**row, "reason": f"too few spikes: {counts.sum():.0f} in the bins that count, below {FEWEST_SPIKES}"}
    try:
        starts = _blocks(grid, counts, how)
    except TooFewError as error:
        return {**row, "reason": f"cannot tell: {error}"}
    row["n_blocks"] = 0 if starts is None else starts.size
    found = whisker_weights(grid, counts, how.bin_width, starts)
    blind = (design["copy_likeness"] > ALIKE) | (inflation(found.columns) > INFLATED)
    half = stdtrit(found.free, 0.975) * found.error
    weight, low, high = (
        np.where(blind, np.nan, one) for one in (found.weight, found.weight - half, found.weight + half)
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        by_error = 2 * stdtr(found.free, -np.abs(weight) / found.error)
    guard = guard_bins(how.bin_width, counts.shape[1], starts)
    shifted = np.where(blind, np.nan, shifts.p_values(counts.mean(0) / how.bin_width, guard))
    p = adjusted_p_values(np.maximum(by_error, shifted))
    verdict = _verdicts(weight, low, high, p, how.level)
    driven = verdict == "drives"
    row |= estimate("surround_weight", weight, low, high) | {"surround_p_value": p, "surround_verdict": verdict}
    row["surround_shift_p_value"] = shifted
    row["reason"] = _reason(blind, design, driven)
    if not (driven | (verdict == "suppresses")).any():
        return row
    return {**row, **_named(names, weight, verdict), "threshold": found.threshold, "latency": found.latency}


def _named(names: NDArray[np.str_], weight: Array, verdict: NDArray[np.str_]) -> dict[str, str]:
    """Names of the whiskers that drive and that suppress, the strongest first."""
    order = np.argsort(-np.abs(weight))
    driving, suppressing = (names[order][verdict[order] == said].tolist() for said in ("drives", "suppresses"))
    columns = {"driving_whiskers": ", ".join(driving), "suppressing_whiskers": ", ".join(suppressing)}
    return columns | {"strongest_whisker": next(iter(driving), "")}


def _blocks(grid: SurroundGrid, counts: Array, how: SurroundAnalysis) -> Integers | None:
    """First bin of each block of the stimulus, where trials are few; None where they are the draws."""
    if len(counts) >= FEWEST_TRIALS:
        return None
    series = *grid.hinges[0, 0], counts.sum(0)
    return independent_blocks(*series, width=how.bin_width, fewest_trials=FEWEST_TRIALS)


def _verdicts(weight: Array, low: Array, high: Array, p: Array, level: float) -> NDArray[np.str_]:
    significant = np.nan_to_num(p, nan=1.0) <= level
    largest = np.max(np.abs(weight[significant]), initial=0.0)
    verdict = np.full(len(weight), "cannot tell", "<U11")
    verdict[(np.maximum(-low, high) < NEGLIGIBLE * largest)] = "no"
    verdict[significant & (weight > 0)] = "drives"
    verdict[significant & (weight < 0)] = "suppresses"
    return verdict


def _reason(blind: Mask, design: dict[str, Any], driven: Mask) -> str:
    if blind.any():
        names, other = design["whisker"], design["likest_whisker"]
        k = int(np.argmax(blind))
        text = f"cannot tell {names[k]} from {other[k]}: their copies are alike (r = {design['copy_likeness'][k]:.2f})"
        more = f", and {blind.sum() - 1} more" if blind.sum() > 1 else ""
        return f"{text}{more}; condition number {design['condition_number']:.3g}; other delays would separate them"
    return "" if driven.any() else "no whisker drives it beyond chance"
