"""Which drive a unit follows: likelihood of spikes not seen, on stimuli of different carrier frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from vibrissa.errors import InputError
from vibrissa.neural.drives import DRIVES, LATEST, Stimuli
from vibrissa.neural.hinge import HingeGrid
from vibrissa.neural.inputs import refuse_misplaced
from vibrissa.neural.response import spike_counts
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

Array = NDArray[np.float64]
Window = tuple[float, float]

FEWEST_SPIKES = 100
PIECES = 12  # at least so many pieces of the stimuli are left out in turn; their scatter gives the intervals
APART = 1.15  # ratio of the highest to the lowest carrier, below which envelope and speed are one but for a factor
FEWEST_LATENCIES = 13  # tried, evenly
LEAST_RATE = 0.02  # of the mean rate: what a hinge at rest may predict, so that one odd spike does not decide


@dataclass(frozen=True, kw_only=True)
class DriveAnalysis:
    """How drives are compared.

    Attributes
    ----------
    bin_width, skip, band
        As in :class:`vibrissa.neural.analysis.EnvelopeAnalysis`; the skip [s] is left out of every stimulus.
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
            if not 0 < getattr(self, name) < np.inf:
                raise InputError(name.replace("_", " "), "must be positive (s)", getattr(self, name))
        if not 0 <= self.skip < np.inf:
            raise InputError("skip", "must be zero or positive (s)", self.skip)
        if not 0 < self.level < 1:
            raise InputError("level", "must lie between 0 and 1", self.level)
        if not 0 < self.latest <= LATEST:
            raise InputError("latest", f"must be positive, up to {LATEST:g} s", self.latest)


def compare_drives(
    spikes: Sequence[xr.Dataset],
    stimuli: Sequence[xr.Dataset],
    n_trials: Sequence[int],
    how: DriveAnalysis | None = None,
) -> xr.Dataset:
    """Fit a hinge of each drive to all stimuli but a piece, and tell how well it foresees the spikes of that piece.

    One threshold, slope, latency and baseline must do for all stimuli. Envelope and speed differ by the carrier's
    frequency alone ([Arabzadeh2003]_): stimuli of one carrier cannot tell them apart.

    Parameters
    ----------
    spikes : sequence of Dataset
        Tables of :func:`vibrissa.neural.spikes.spike_table`, one for each stimulus, with the same units.
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
    _refuse(spikes, stimuli, n_trials)
    cut = {"bin_width": how.bin_width, "skip": how.skip, "smoothing": how.smoothing, "latest": how.latest}
    shown = Stimuli.of(stimuli, band=how.band, **cut)
    pieces = _pieces(shown)
    # latencies a bin apart at most: coarser ones miss what changes within a bin, and favour what changes more slowly
    n_latencies = max(FEWEST_LATENCIES, 1 + int(np.ceil(how.latest / how.bin_width)))
    grids = {
        name: HingeGrid.of(drive, n_thresholds=13, n_latencies=n_latencies) for name, drive in shown.drives.items()
    }
    trials = np.array(n_trials)[shown.stimulus][shown.valid]
    rows = []
    for name in spikes[0].unit_name.values:
        own = [_counts(table, name, shown, j, n) for j, (table, n) in enumerate(zip(spikes, n_trials, strict=True))]
        counts = np.concatenate(own)
        rows.append(_row(grids, counts[shown.valid], trials, pieces, shown, how))
    columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return dataset(
        cut | {"level": how.level, "pieces": int(pieces.max()) + 1},
        unit_name=spikes[0].unit_name.values,
        drive=np.array(DRIVES),
        drive_likeness=[shown.likeness("envelope", name) for name in DRIVES],
        carrier_frequency=shown.carrier,
        **columns,
    )


def _refuse(spikes: Sequence[xr.Dataset], stimuli: Sequence[xr.Dataset], n_trials: Sequence[int]) -> None:
    if not len(spikes) == len(stimuli) == len(n_trials) or not spikes:
        found = f"{len(spikes)}, {len(stimuli)}, {len(n_trials)}"
        raise InputError("spikes, stimuli and trials", "must be as many as each other", found)
    for table, stimulus, n in zip(spikes, stimuli, n_trials, strict=True):
        refuse_misplaced(table, stimulus, n)
    names = [sorted(map(str, table.unit_name.values)) for table in spikes]
    for k, some in enumerate(names):
        if some != names[0]:
            odd = sorted(set(some) ^ set(names[0]))[0]
            raise InputError(f"units of stimulus {k + 1}", "must be those of the first", f"{odd} in one of them alone")


def _counts(table: xr.Dataset, name: object, shown: Stimuli, stimulus: int, n_trials: int) -> Array:
    """Counts of a unit, summed over trials, in the bins of one stimulus."""
    unit = int(np.flatnonzero(table.unit_name.values == name)[0])
    own = table.isel(spike=np.flatnonzero(table.spike_unit.values == unit))
    n_bins = int(np.sum(shown.stimulus == stimulus))
    start = float(shown.starts[stimulus])
    counts = spike_counts(own, n_trials=n_trials, start=start, n_bins=n_bins, bin_width=shown.bin_width)
    return counts.sum(0).astype(float)


def _pieces(shown: Stimuli) -> NDArray[np.int64]:
    """Piece of each bin that counts: whole stimuli, or equal parts of them where they are few."""
    stimulus = shown.stimulus[shown.valid]
    ways = -(-PIECES // (int(stimulus.max()) + 1))
    piece = np.empty(len(stimulus), int)
    for j in range(int(stimulus.max()) + 1):
        own = np.flatnonzero(stimulus == j)
        piece[own] = j * ways + np.arange(own.size) * ways // max(own.size, 1)
    return np.unique(piece, return_inverse=True)[1]


def foreseen(
    grid: HingeGrid, counts: Array, trials: Array, pieces: NDArray[np.int64], width: float
) -> tuple[Array, float]:
    """Log-likelihood of each bin under the hinge fitted to all pieces but its own, and the latency fitted to all.

    Parameters
    ----------
    grid : HingeGrid
        One drive.
    counts, trials : (K',) arrays
        Counts summed over trials, and their number, in the bins that count.
    pieces : (K',) array of int
        Piece of each bin.
    width : float
        Width of a bin [s].

    Returns
    -------
    log_likelihood : (K',) array
        Without what does not depend on the drive [nat].
    latency : float
        [s].
    """
    rates, floor = counts / (trials * width), LEAST_RATE * counts.sum() / (trials.sum() * width)
    rate, _ = _fitted(grid, rates, trials / max(rates.mean(), 1e-12))
    weights = trials / np.maximum(rate, 0.05 * rate.mean())  # inverse of the variance of a bin's mean rate
    found = np.empty(counts.size)
    for piece in range(int(pieces.max()) + 1):
        left = pieces == piece
        rate = np.maximum(_fitted(grid, rates, np.where(left, 0.0, weights))[0], floor)[left]
        found[left] = counts[left] * np.log(rate) - trials[left] * width * rate
    return found, _fitted(grid, rates, weights)[1]


def _fitted(grid: HingeGrid, rates: Array, weights: Array) -> tuple[Array, float]:
    """Rate [Hz] in every bin of the hinge of weighted least squares, and its latency [s]."""
    threshold, slope, latency, baseline = grid.best(rates[None], weights)[:, 0].tolist()
    return baseline + slope * grid.drive.hinged(threshold, latency), latency


def _steady(counts: Array, trials: Array, pieces: NDArray[np.int64], width: float) -> Array:
    """Log-likelihood of each bin under the mean rate of the other pieces."""
    of_piece = np.array([np.bincount(pieces, one) for one in (counts, trials * width)])
    rate = (counts.sum() - of_piece[0]) / ((trials * width).sum() - of_piece[1])
    rate = np.maximum(rate, LEAST_RATE * rate.mean())[pieces]
    return counts * np.log(rate) - trials * width * rate


def _row(
    grids: dict[str, HingeGrid],
    counts: Array,
    trials: Array,
    pieces: NDArray[np.int64],
    shown: Stimuli,
    how: DriveAnalysis,
) -> dict[str, Any]:
    nothing = np.full(len(DRIVES), np.nan)
    row: dict[str, Any] = {"drive_latency": nothing, "best_drive": "cannot tell"}
    row |= {f"drive_{name}{end}": nothing for name in ("gain", "loss") for end in ("", "_low", "_high")}
    if counts.sum() < FEWEST_SPIKES:
        return {**row, "reason": f"too few spikes: {counts.sum():.0f} in the bins that count, below {FEWEST_SPIKES}"}
    told = [foreseen(grids[name], counts, trials, pieces, how.bin_width) for name in DRIVES]
    gains = np.array([one for one, _ in told]) - _steady(counts, trials, pieces, how.bin_width)
    of_piece = np.array([np.bincount(pieces, one) for one in gains]) / np.log(2)
    spikes = np.bincount(pieces, counts).astype(float)
    best = int(of_piece.sum(1).argmax())
    row["drive_latency"] = np.array([latency for _, latency in told])
    row |= _ends("drive_gain", of_piece, spikes, how.level / len(DRIVES))
    row |= _ends("drive_loss", of_piece[best] - of_piece, spikes, how.level / (len(DRIVES) - 1))
    verdict, reason = _verdict(row, best, shown)
    return {**row, "best_drive": verdict, "reason": reason}


def _ends(name: str, of_piece: Array, spikes: Array, level: float) -> dict[str, Array]:
    """Bits for each spike, and their interval from leaving out one piece at a time."""
    whole = of_piece.sum(1) / spikes.sum()
    parts = (of_piece.sum(1, keepdims=True) - of_piece) / (spikes.sum() - spikes)
    free = len(spikes) - 1
    error = np.sqrt(free / len(spikes) * np.sum((parts - whole[:, None]) ** 2, axis=1))
    half = stdtrit(free, 1 - level / 2) * error
    return {name: whole, f"{name}_low": whole - half, f"{name}_high": whole + half}


def _verdict(row: dict[str, Any], best: int, shown: Stimuli) -> tuple[str, str]:
    if not row["drive_gain_low"][best] > 0:
        return "cannot tell", "no drive foresees its spikes better than a steady rate"
    left = [name for k, name in enumerate(DRIVES) if k != best and not row["drive_loss_low"][k] > 0]
    low, high = shown.carrier.min(), shown.carrier.max()
    pair = {"envelope", "speed"}
    if DRIVES[best] in pair and high < APART * low:
        left = sorted({*left, *(pair - {DRIVES[best]})})
        text = f"carriers of {low:.0f} to {high:.0f} Hz cannot tell envelope from speed: present others"
        return "cannot tell", f"{text}; left are {', '.join([DRIVES[best], *left])}"
    if left:
        return "cannot tell", f"{', '.join([DRIVES[best], *left])} do as well as each other: more trials or textures"
    return DRIVES[best], ""
