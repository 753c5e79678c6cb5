"""Surround map: how much each whisker drives a unit while all replay delayed copies of one texture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr, stdtrit

from vibrissa.errors import InputError
from vibrissa.neural.copies import ALIKE, INFLATED, LATEST, Copies, condition_number, inflation
from vibrissa.neural.inputs import refuse_misplaced
from vibrissa.neural.response import spike_counts
from vibrissa.quantities import dataset
from vibrissa.stats import adjusted_p_values

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Window = tuple[float, float]

FEWEST_SPIKES, FEWEST_TRIALS = 100, 8
NEGLIGIBLE = 0.2  # of the largest weight: a whisker whose interval stays within this does nothing that matters
BLOCK = 0.2  # [s] pieces of the stimulus: longer than envelopes, and most of what else drives units, are alike
_STEPS = 8  # of Gauss and Newton from the best node; two mostly do


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


class Map(NamedTuple):
    """Weights of all whiskers for one unit, with the hinge they share.

    Attributes
    ----------
    weight, error : (W,) arrays
        Rise of the rate above the threshold and its standard error [1/(s m)]; negative where the whisker suppresses.
    threshold, latency : float
        θ [m] and τ [s].
    columns : (W, K') array
        Hinged envelopes at them [m].
    free : int
        Degrees of freedom of the errors.
    """

    weight: Array
    error: Array
    threshold: float
    latency: float
    columns: Array
    free: int


class SurroundGrid:
    """Hinged envelopes of all whiskers over thresholds and latencies: made once for a stimulus, used for every unit."""

    def __init__(self, copies: Copies, *, n_thresholds: int = 9, n_latencies: int = 13) -> None:
        self.copies = copies
        self.thresholds = np.linspace(*copies.thresholds(), n_thresholds)
        self.latencies = np.linspace(0.0, LATEST, n_latencies)
        # (I, J, W, K')
        self.hinges = np.array([copies.hinged(one, self.latencies).swapaxes(0, 1) for one in self.thresholds])
        centred = self.hinges - self.hinges.mean(-1, keepdims=True)
        gram = np.einsum("ijwk,ijvk->ijwv", centred, centred, optimize=True)
        self._centred, self._inverse = centred, np.linalg.pinv(gram, hermitian=True, rcond=1e-10)

    def start(self, rate: Array) -> tuple[float, float]:
        """Threshold and latency of the node whose columns explain most of the rate's variance."""
        product = self._centred @ rate
        told = np.einsum("ijw,ijwv,ijv->ij", product, self._inverse, product)
        i, j = divmod(int(np.argmax(told)), len(self.latencies))
        return float(self.thresholds[i]), float(self.latencies[j])


def _with_constant(columns: Array) -> Array:
    return np.vstack([np.ones(columns.shape[-1]), columns])


def _misfit(columns: Array, rate: Array, weights: Array) -> float:
    b = _solve(columns, weights) @ rate
    return float(weights @ (rate - b @ columns) ** 2)


def _solve(columns: Array, weights: Array) -> Array:
    """(W + 1, K') matrix that gives the coefficients of weighted least squares; columns that follow share a weight."""
    weighted = columns * weights
    scale = np.sqrt((weighted * columns).sum(1))
    scale = np.where(scale > 0, scale, 1.0)
    gram = weighted @ columns.T / np.outer(scale, scale)
    return (np.linalg.pinv(gram, hermitian=True, rcond=1e-10) @ (weighted / scale[:, None])) / scale[:, None]


def whisker_weights(grid: SurroundGrid, counts: Array, width: float) -> Map:
    """Weight of each whisker in the rate of one unit.

    The rate of bin k is b + Σ_w g_w · mean over the bin of max(A_w(t − τ) − θ, 0), with one threshold and one latency
    for all whiskers. Least squares weighted by the inverse of the fitted rate, the variance of counts; weights may be
    negative. The error is that of the mean over trials or, where it is larger, that from pieces of the stimulus: a unit
    that answers something else, in every trial alike, pulls at the weights by chance. θ's and τ's error is included.

    Parameters
    ----------
    grid : SurroundGrid
        The stimulus.
    counts : (N, K') array
        Counts of each trial in the bins that count; at least 2 trials.
    width : float
        Width of a bin [s].

    Returns
    -------
    Map
        Where whiskers move exactly alike, their weight is shared out evenly among them.
    """
    rates = counts / width
    rate = rates.mean(0)
    threshold, latency = grid.start(rate)
    fitted = _fitted_rate(grid.copies, threshold, latency, rate)
    weights = 1 / np.maximum(fitted, 0.1 * rate.mean())
    threshold, latency, b, columns, slopes = _refined(grid, threshold, latency, rate, weights)
    whole = _solve(np.vstack([columns, slopes]), weights)
    of_trials = rates @ whole.T  # every trial's own estimate: the estimate is linear in the counts
    noise = of_trials.std(0, ddof=1) / np.sqrt(len(rates))
    n_blocks = max(int(rate.size * width / BLOCK), 2)
    error = np.maximum(noise, _misfit_error(whole, rate - b @ columns, n_blocks))
    return Map(b[1:], error[1 : len(columns)], threshold, latency, columns[1:], min(len(rates), n_blocks) - 1)


def _misfit_error(whole: Array, residual: Array, n_blocks: int) -> Array:
    """Error of the coefficients from pieces of the stimulus: what else the unit answers to does not differ by trial."""
    block = np.arange(residual.size) * n_blocks // residual.size
    pulls = np.array([np.bincount(block, row * residual, n_blocks) for row in whole])
    free = residual.size - len(whole)
    return np.sqrt((pulls**2).sum(1) * residual.size / max(free, 1))


def _fitted_rate(copies: Copies, threshold: float, latency: float, rate: Array) -> Array:
    columns = _with_constant(copies.hinged(threshold, latency))
    return _solve(columns, np.ones(rate.size)) @ rate @ columns


def _refined(
    grid: SurroundGrid, threshold: float, latency: float, rate: Array, weights: Array
) -> tuple[float, float, Array, Array, Array]:
    """Gauss and Newton from a node; a step that does not gain is halved. Last, the change with θ and τ."""
    least = np.array([grid.thresholds[0], grid.latencies[0]])
    most = np.array([grid.thresholds[-1], grid.latencies[-1]])
    at = np.array([threshold, latency])
    columns = _with_constant(grid.copies.hinged(*at))
    b = _solve(columns, weights) @ rate
    lost = float(weights @ (rate - b @ columns) ** 2)
    slopes = _slopes(grid.copies, at, most - least, b)
    for _ in range(_STEPS):
        step = (_solve(np.vstack([columns, slopes]), weights) @ rate)[-2:]
        found = lost
        for share in (1.0, 0.5, 0.25, 0.1):
            there = np.clip(at + share * step, least, most)
            columns_there = _with_constant(grid.copies.hinged(*there))
            found = _misfit(columns_there, rate, weights)
            if found < lost:
                break
        if not found < lost * (1 - 1e-6):
            break
        at, lost, columns = there, found, columns_there
        b = _solve(columns, weights) @ rate
        slopes = _slopes(grid.copies, at, most - least, b)
    return float(at[0]), float(at[1]), b, columns, slopes


def _slopes(copies: Copies, at: Array, span: Array, b: Array) -> Array:
    """Change of the fitted rate with threshold and latency, by differences of 1 % of their ranges; (2, K')."""
    found = []
    for move in np.diag(0.01 * span):
        low, high = at - move, at + move
        low[1] = max(low[1], 0.0)
        change = copies.hinged(*high) - copies.hinged(*low)
        found.append(b[1:] @ change / (high - low).sum())
    return np.array(found)


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
