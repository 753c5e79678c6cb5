"""Drive that a unit follows: likelihood of unseen spikes, on stimuli of different carrier frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers, Window
from vibrissa.errors import (
    ConflictError,
    RangeError,
    ShapeError,
    require_fraction,
    require_not_negative,
    require_positive,
)
from vibrissa.neural.coding.drives import DRIVES, LATEST, Stimuli
from vibrissa.neural.coupling.response import UnitCounts
from vibrissa.neural.coupling.threshold_linear import HingeGrid
from vibrissa.neural.io.tables.inputs import refuse_misplaced
from vibrissa.neural.io.tables.spikes import NOT_OBSERVED
from vibrissa.quantities import dataset, stacked
from vibrissa.quantities.quantity import SUFFIXES, estimate
from vibrissa.stats import jackknife_half_width

FEWEST_SPIKES = 100
PIECES = 12  # at least so many pieces of the stimuli are left out in turn; their scatter gives the intervals
APART = 1.15  # ratio of the highest to the lowest carrier, below which envelope and speed are one but for a factor
FEWEST_LATENCIES = 13  # tried, evenly
LEAST_RATE = 0.02  # of the mean rate: what a hinge at rest may predict, so that one odd spike does not decide


@dataclass(frozen=True, kw_only=True)
class DriveAnalysis:
    """Settings of the comparison of drives.

    Attributes
    ----------
    bin_width, skip, band
        As in :class:`vibrissa.neural.coupling.analysis.EnvelopeAnalysis`; the skip [s] is left out of every stimulus.
    smoothing : float
        Time constant of the smoothed envelope [s].
    level : float
        Chance that a wrong drive is named, over all rivals together.
    latest : float
        Longest latency searched [s], up to 30 ms.
    """

    bin_width: float = 0.01
    skip: float = 0.5
    smoothing: float = 0.03
    band: Window | None = None
    level: float = 0.05
    latest: float = LATEST

    def __post_init__(self) -> None:
        for name in ("bin_width", "smoothing"):
            require_positive(name.replace("_", " "), getattr(self, name), "s")
        require_not_negative("skip", self.skip, "s")
        require_fraction("level", self.level)
        if not 0 < self.latest <= LATEST:
            raise RangeError("latest", f"must be positive, up to {LATEST:g} s", self.latest)


def compare_drives(
    spikes: Sequence[xr.Dataset],
    stimuli: Sequence[xr.Dataset],
    n_trials: Sequence[int],
    how: DriveAnalysis | None = None,
) -> xr.Dataset:
    """Fit each drive to all stimuli but a piece, and report how well it predicts the spikes of that piece.

    One threshold, slope, latency and baseline must do for all stimuli. Envelope and speed differ by the carrier's
    frequency alone ([Arabzadeh2003]_): stimuli of one carrier cannot separate them.

    Parameters
    ----------
    spikes : sequence of Dataset
        Tables of :func:`vibrissa.neural.io.tables.spikes.spike_table`, one for each stimulus, with the same units.
    stimuli : sequence of Dataset
        ``time`` and ``point_displacement`` of one presentation each.
    n_trials : sequence of int
        Presentations of each stimulus.
    how : DriveAnalysis, optional
        Bins, smoothing and level.

    Returns
    -------
    Dataset
        ``drive_gain`` (unit, drive) [bit]: for each spike, beyond a steady rate; ``drive_loss`` (unit, drive) [bit]:
        behind the best drive. Their intervals are over pieces of the stimuli, the level shared among drives or rivals;
        ``drive_latency`` [s]. ``best_drive`` (unit), or cannot tell; ``reason``. ``carrier_frequency`` (stimulus) and
        ``drive_likeness`` (drive): correlation of each with the envelope.

    Raises
    ------
    InputError
        If the sequences differ in length, units differ between stimuli, or spikes and stimulus do not fit together.
    """
    how = how or DriveAnalysis()
    _refuse(spikes, stimuli, n_trials, how.skip)
    cut = {"bin_width": how.bin_width, "skip": how.skip, "smoothing": how.smoothing, "latest": how.latest}
    shown = Stimuli.of(stimuli, band=how.band, **cut)
    # latencies a bin apart at most: coarser ones miss what changes within a bin, and favour what changes more slowly
    n_latencies = max(FEWEST_LATENCIES, 1 + int(np.ceil(how.latest / how.bin_width)))
    grids = {
        name: HingeGrid.of(drive, n_thresholds=13, n_latencies=n_latencies) for name, drive in shown.drives.items()
    }
    names, each = spikes[0].unit_name.values, zip(spikes, n_trials, strict=True)
    counts, observed = zip(*[_totals(table, names, n, shown, j) for j, (table, n) in enumerate(each)], strict=True)
    trials = np.stack(observed, axis=1)[:, shown.stimulus].astype(float)
    each_unit = zip(np.hstack(counts), trials, strict=True)
    rows = [_row(grids, own[shown.valid], seen[shown.valid], shown, how) for own, seen in each_unit]
    return dataset(
        cut | {"level": how.level, "pieces": int(_pieces(shown.stimulus[shown.valid]).max()) + 1},
        unit_name=names,
        drive=np.array(DRIVES),
        drive_likeness=[shown.likeness("envelope", name) for name in DRIVES],
        carrier_frequency=shown.carrier,
        **stacked(rows),
    )


def _refuse(spikes: Sequence[xr.Dataset], stimuli: Sequence[xr.Dataset], n_trials: Sequence[int], skip: float) -> None:
    if not len(spikes) == len(stimuli) == len(n_trials) or not spikes:
        found = f"{len(spikes)}, {len(stimuli)}, {len(n_trials)}"
        raise ShapeError("spikes, stimuli and trials", "must be equal in number", found)
    for table, stimulus, n in zip(spikes, stimuli, n_trials, strict=True):
        refuse_misplaced(table, stimulus, n, skip=skip)
    names = [sorted(map(str, table.unit_name.values)) for table in spikes]
    for k, some in enumerate(names):
        if some != names[0]:
            odd = f"{min(set(some) ^ set(names[0]))} in one of them alone"
            raise ConflictError(f"units of stimulus {k + 1}", "must be those of the first", odd)


def _totals(table: xr.Dataset, names: Array, n_trials: int, shown: Stimuli, stimulus: int) -> tuple[Array, Integers]:
    """Counts of the units of these names in the bins of one stimulus, and trials in which each was observed."""
    edges = shown.starts[stimulus] + shown.bin_width * np.arange(np.sum(shown.stimulus == stimulus) + 1)
    counts = UnitCounts.of(table, n_trials, edges, shown.bin_width, partial=True)
    place = {name: k for k, name in enumerate(table.unit_name.values)}
    order = [place[name] for name in names]
    return counts.totals[order].astype(float), counts.observed.sum(1)[order]


def _pieces(stimulus: Integers) -> Integers:
    """Piece of each bin, whose stimulus is given: whole stimuli, or equal parts of them where they are few."""
    kinds = np.unique(stimulus)
    ways = -(-PIECES // kinds.size)
    piece = np.empty(len(stimulus), int)
    for j, kind in enumerate(kinds):
        own = np.flatnonzero(stimulus == kind)
        piece[own] = j * ways + np.arange(own.size) * ways // own.size
    return np.unique(piece, return_inverse=True)[1]


def _foreseen(grid: HingeGrid, counts: Array, trials: Array, pieces: Integers, width: float) -> tuple[Array, float]:
    """Log-likelihood [nat] of each bin under the fit to all pieces but its own, and the latency fitted to all.

    Terms that do not depend on the drive are left out. Bins of no trial belong to no piece, and have no weight.
    """
    floor = LEAST_RATE * counts.sum() / (trials.sum() * width)
    rates = counts / (np.maximum(trials, 1) * width)
    rate, _ = _fitted(grid, rates, trials / max(rates[trials > 0].mean(), 1e-12))
    weights = trials / np.maximum(rate, 0.05 * rate.mean())  # inverse of the variance of a bin's mean rate
    found = np.zeros(counts.size)
    for piece in range(int(pieces.max()) + 1):
        left = pieces == piece
        rate = np.maximum(_fitted(grid, rates, np.where(left, 0.0, weights))[0], floor)[left]
        found[left] = counts[left] * np.log(rate) - trials[left] * width * rate
    return found, _fitted(grid, rates, weights)[1]


def _fitted(grid: HingeGrid, rates: Array, weights: Array) -> tuple[Array, float]:
    """Rate [Hz] in every bin of the threshold-linear fit by weighted least squares, and its latency [s]."""
    threshold, slope, latency, baseline = grid.best(rates[None], weights)[:, 0].tolist()
    return baseline + slope * grid.drive.hinged(threshold, latency), latency


def _steady(counts: Array, trials: Array, pieces: Integers, width: float) -> Array:
    """Log-likelihood of each bin under the mean rate of the other pieces."""
    of_piece = np.array([np.bincount(pieces, one) for one in (counts, trials * width)])
    rate = (counts.sum() - of_piece[0]) / ((trials * width).sum() - of_piece[1])
    rate = np.maximum(rate, LEAST_RATE * rate.mean())[pieces]
    return counts * np.log(rate) - trials * width * rate


def _row(
    grids: dict[str, HingeGrid],
    counts: Array,
    trials: Array,
    shown: Stimuli,
    how: DriveAnalysis,
) -> dict[str, Any]:
    nothing = np.full(len(DRIVES), np.nan)
    row: dict[str, Any] = {"drive_latency": nothing, "best_drive": "cannot tell"}
    row |= {f"drive_{name}{end}": nothing for name in ("gain", "loss") for end in SUFFIXES}
    if not trials.any():
        return {**row, "reason": NOT_OBSERVED}
    if counts.sum() < FEWEST_SPIKES:
        return {**row, "reason": f"too few spikes: {counts.sum():.0f} in the bins that count, below {FEWEST_SPIKES}"}
    seen, stimulus = trials > 0, shown.stimulus[shown.valid]
    of_all = np.full(seen.size, -1)
    of_all[seen] = pieces = _pieces(stimulus[seen])
    foreseen = [_foreseen(grids[name], counts, trials, of_all, how.bin_width) for name in DRIVES]
    counts, trials = counts[seen], trials[seen]
    gains = np.array([one[seen] for one, _ in foreseen]) - _steady(counts, trials, pieces, how.bin_width)
    of_piece = np.array([np.bincount(pieces, one) for one in gains]) / np.log(2)
    spikes = np.bincount(pieces, counts).astype(float)
    best = int(of_piece.sum(1).argmax())
    row["drive_latency"] = np.array([latency for _, latency in foreseen])
    row |= _ends("drive_gain", of_piece, spikes, how.level / len(DRIVES))
    row |= _ends("drive_loss", of_piece[best] - of_piece, spikes, how.level / (len(DRIVES) - 1))
    verdict, reason = _verdict(row, best, shown.carrier[np.unique(stimulus[seen])])
    return {**row, "best_drive": verdict, "reason": reason}


def _ends(name: str, of_piece: Array, spikes: Array, level: float) -> dict[str, Array]:
    """Bits for each spike, and their interval from leaving out one piece at a time."""
    whole = of_piece.sum(1) / spikes.sum()
    parts = (of_piece.sum(1, keepdims=True) - of_piece) / (spikes.sum() - spikes)
    half = jackknife_half_width(parts, whole, upper=1 - level / 2)
    return estimate(name, whole, whole - half, whole + half)


def _verdict(row: dict[str, Any], best: int, carrier: Array) -> tuple[str, str]:
    if not row["drive_gain_low"][best] > 0:
        return "cannot tell", "no drive predicts its spikes better than a steady rate"
    left = [name for k, name in enumerate(DRIVES) if k != best and not row["drive_loss_low"][k] > 0]
    low, high = carrier.min(), carrier.max()
    pair = {"envelope", "speed"}
    if DRIVES[best] in pair and high < APART * low:
        left = sorted({*left, *(pair - {DRIVES[best]})})
        text = f"carriers of {low:.0f} to {high:.0f} Hz cannot tell envelope from speed: present others"
        return "cannot tell", f"{text}; left are {', '.join([DRIVES[best], *left])}"
    if left:
        return "cannot tell", f"{', '.join([DRIVES[best], *left])} predict equally well: more trials or textures"
    return DRIVES[best], ""
