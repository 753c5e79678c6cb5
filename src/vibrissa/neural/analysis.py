"""From a table of spikes and one stimulus to what the envelope does to each unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.neural.coupling import Coupling, Null, envelope_coupling
from vibrissa.neural.hinge import Hinge, HingeGrid
from vibrissa.neural.inputs import refuse_misplaced
from vibrissa.neural.nulls import Circular, Paper2014, Record
from vibrissa.neural.presentation import Presentation
from vibrissa.neural.response import spike_counts
from vibrissa.neural.segments import First, two_segments
from vibrissa.neural.tuning import ENDS, bootstrap_fits, cross_validated, forward_fit, predicted, r_squared, weakness
from vibrissa.quantities import dataset
from vibrissa.stats import adjusted_p_values

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
Window = tuple[float, float]

FEWEST_SPIKES = 50  # in the bins that count; fewer tell neither threshold nor slope
FEWEST_TRIALS = 8  # fewer are resampled in too few ways: intervals come out too narrow
FITTED = ("threshold", "slope", "latency", "baseline")


@dataclass(frozen=True, kw_only=True)
class EnvelopeAnalysis:
    """How units are tested and fitted.

    Attributes
    ----------
    null : str
        ``circular`` (all shifts, adjusted over units) or ``paper2014`` (300 shuffles, not adjusted).
    fit : str
        ``forward`` (a hinge seen through the bins) or ``paper2014`` (two segments through the bins).
    first_segment : str
        Of the paper's fit: ``flat-first`` or ``free-first``.
    level : float
        Largest p-value, adjusted for ``circular``, that counts as significant.
    bin_width : float
        Width of the bins [s].
    skip : float
        Time left out at the start of the window, while units adapt [s].
    window : (float, float), optional
        Part of the stimulus analysed [s]; the whole of it by default.
    band : (float, float), optional
        Band of the carrier [Hz]; the displacement as it is by default.
    delays : tuple of float
        Delays at which other whiskers had the same stimulus [s].
    spontaneous : (float, float), optional
        Window without stimulus [s], negative before the onset.
    n_resamples : int
        Draws of trials for the intervals.
    seed : int
        Seed of all draws.
    """

    null: Literal["circular", "paper2014"] = "circular"
    fit: Literal["forward", "paper2014"] = "forward"
    first_segment: First = "flat-first"
    level: float = 0.01
    bin_width: float = 0.01
    skip: float = 1.0
    window: Window | None = None
    band: Window | None = None
    delays: tuple[float, ...] = ()
    spontaneous: Window | None = None
    n_resamples: int = 400
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 < self.bin_width < np.inf:
            raise InputError("bin width", "must be positive (s)", self.bin_width)
        if not 0 <= self.skip < np.inf:
            raise InputError("skip", "must be zero or positive (s)", self.skip)
        if not 0 < self.level < 1:
            raise InputError("level", "must lie between 0 and 1", self.level)
        for name in ("window", "band", "spontaneous"):
            ends = getattr(self, name)
            if ends is not None and not -np.inf < ends[0] < ends[1] < np.inf:
                raise InputError(name, "must start before it stops", ends)
        if self.n_resamples < 40 or self.seed < 0:
            raise InputError("resamples and seed", "must be at least 40 and 0", f"{self.n_resamples}, {self.seed}")

    @property
    def lags(self) -> tuple[int, int]:
        """Lags tried [bins]: the paper's ±1, or those of a response up to 30 ms late."""
        return (-1, 1) if self.null == "paper2014" else (0, max(1, round(0.03 / self.bin_width)))

    def chance(self) -> Null:
        """Give the null by its name."""
        if self.null == "paper2014":
            return Paper2014(seed=self.seed)
        guard = max(1, round(0.06 / self.bin_width))
        return Circular(guard=guard, delays=tuple(round(delay / self.bin_width) for delay in self.delays))


def analyse_units(
    spikes: xr.Dataset, stimulus: xr.Dataset, n_trials: int, how: EnvelopeAnalysis | None = None
) -> xr.Dataset:
    """Test whether the envelope drives each unit, and fit threshold, slope and latency where it does.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.spikes.spike_table`, times from the stimulus' onset.
    stimulus : Dataset
        ``time`` and ``point_displacement`` of one presentation, already filtered.
    n_trials : int
        Trials presented, silent ones included.
    how : EnvelopeAnalysis, optional
        Tests and fits.

    Returns
    -------
    Dataset
        One entry for each unit. NaN where something was not measured; ``reason`` says why. Only units that are
        significant are fitted. ``unit_quality`` and ``unit_session`` go along where the spikes have them.

    Raises
    ------
    InputError
        If spikes and stimulus do not fit together.
    """
    how = how or EnvelopeAnalysis()
    refuse_misplaced(spikes, stimulus, n_trials, window=how.window, spontaneous=how.spontaneous)
    shown = Presentation.of(stimulus, bin_width=how.bin_width, skip=how.skip, window=how.window, band=how.band)
    counts = _counts(spikes, n_trials, shown, how)
    record = Record(
        rates=counts.mean(1) / how.bin_width,
        envelope=shown.binned(),
        rate_valid=shown.rate_valid,
        envelope_valid=shown.envelope_valid,
    )
    coupling = envelope_coupling(record, how.chance(), lags=how.lags)
    adjusted = adjusted_p_values(coupling.tail_p_value)
    significant = (adjusted if how.null == "circular" else coupling.p_value) <= how.level
    rows = _fits(record, counts, shown, coupling, significant, how)
    columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    columns |= {name: spikes[name].values for name in ("unit_quality", "unit_session") if name in spikes}
    return dataset(
        {"n_trials": n_trials, "edge": shown.edge, "lag_low": how.lags[0], "lag_high": how.lags[1], **_told(how)},
        unit_name=spikes.unit_name.values,
        envelope_correlation=coupling.correlation,
        envelope_lag=np.where(np.isnan(coupling.correlation), np.nan, coupling.lag * how.bin_width),
        p_value=coupling.p_value,
        adjusted_p_value=adjusted,
        significant=significant,
        unit_rate=record.rates[:, shown.rate_valid].mean(1),
        spontaneous_rate=_spontaneous(spikes, n_trials, how),
        **columns,
    )


def _told(how: EnvelopeAnalysis) -> dict[str, Any]:
    """Attributes that made the data."""
    names = ("null", "fit", "first_segment", "level", "bin_width", "skip", "n_resamples", "seed")
    told: dict[str, Any] = {name: getattr(how, name) for name in names}
    for name in ("window", "band", "spontaneous", "delays"):
        if getattr(how, name):
            told[name] = np.array(getattr(how, name), float)
    return told


def _counts(spikes: xr.Dataset, n_trials: int, shown: Presentation, how: EnvelopeAnalysis) -> Counts:
    """Counts of each unit, trial and bin; (U, N, K)."""
    n_bins, start = len(shown.edges) - 1, float(shown.edges[0])
    return np.array(
        [
            spike_counts(
                spikes.isel(spike=np.flatnonzero(spikes.spike_unit.values == unit)),
                n_trials=n_trials,
                start=start,
                n_bins=n_bins,
                bin_width=how.bin_width,
            )
            for unit in range(spikes.sizes["unit"])
        ]
    )


def _spontaneous(spikes: xr.Dataset, n_trials: int, how: EnvelopeAnalysis) -> Array:
    n_units = spikes.sizes["unit"]
    if how.spontaneous is None:
        return np.full(n_units, np.nan)
    start, stop = how.spontaneous
    inside = (spikes.spike_time.values >= start) & (spikes.spike_time.values < stop)
    return np.bincount(spikes.spike_unit.values[inside], minlength=n_units) / (n_trials * (stop - start))


Row = dict[str, Any]
NOT_MEASURED: Row = {
    **{name + end: np.nan for name in FITTED for end in ("", "_low", "_high")},
    **dict.fromkeys(("tuning_r_squared", "tuning_r_squared_unseen", "noise_ceiling", "sub_threshold_rate"), np.nan),
    "identified": False,
}


def _fits(
    record: Record,
    counts: Counts,
    shown: Presentation,
    coupling: Coupling,
    significant: NDArray[np.bool_],
    how: EnvelopeAnalysis,
) -> list[Row]:
    """Fit each unit that is driven by the envelope; say of the others why not."""
    drive = shown.drive()
    grid = HingeGrid.of(drive) if how.fit == "forward" and significant.any() else None
    rows = []
    for unit, own in enumerate(counts):
        n_spikes = int(own[:, drive.valid].sum())
        if n_spikes < FEWEST_SPIKES:
            why = f"too few spikes: {n_spikes} in the bins that count, fewer than {FEWEST_SPIKES}"
            rows.append({**NOT_MEASURED, "reason": why})
        elif not significant[unit]:
            rows.append({**NOT_MEASURED, "reason": "no significant coupling to the envelope"})
        elif grid is not None:
            rng = np.random.default_rng([how.seed, unit])
            rows.append({**NOT_MEASURED, **_forward(grid, own[:, drive.valid].astype(float), how, rng)})
        else:
            rows.append({**NOT_MEASURED, **_paper(record, unit, int(coupling.lag[unit]), how)})
    return rows


def _forward(grid: HingeGrid, trial_counts: Array, how: EnvelopeAnalysis, rng: np.random.Generator) -> Row:
    """Hinge, its intervals, and how far to trust them."""
    n, width = len(trial_counts), how.bin_width
    fit = forward_fit(grid, trial_counts.sum(0), n * width)
    rate = trial_counts.mean(0) / width
    row: Row = {**fit._asdict(), "tuning_r_squared": r_squared(rate, predicted(grid.drive, fit))}
    row["sub_threshold_rate"] = _below(grid, rate, fit)
    if n == 1:
        return {**row, "reason": "one trial: no interval by resampling trials, so nothing tells how sure the fit is"}
    samples = bootstrap_fits(grid, trial_counts, width, fit, n_resamples=how.n_resamples, rng=rng)
    low, high = np.quantile(samples, ENDS, axis=1)
    for k, name in enumerate(Hinge._fields):
        row |= {f"{name}_low": low[k], f"{name}_high": high[k]}
    row["tuning_r_squared_unseen"], row["noise_ceiling"] = cross_validated(grid, trial_counts, width)
    why = weakness(grid, samples)
    if not why and n < FEWEST_TRIALS:
        why = f"{n} trials: intervals by resampling fewer than {FEWEST_TRIALS} come out too narrow"
    return {**row, "identified": not why, "reason": why}


def _below(grid: HingeGrid, rate: Array, fit: Hinge) -> float:
    """Mean rate in bins whose envelope stays below the threshold [Hz]; NaN where there is none."""
    below = grid.drive.hinged(fit.threshold, fit.latency) <= 1e-9 * max(fit.threshold, 1e-9)
    return float(rate[below].mean()) if below.any() else np.nan


def _paper(record: Record, unit: int, lag: int, how: EnvelopeAnalysis) -> Row:
    """Two segments at the best whole shift."""
    shifted, valid = np.roll(record.envelope, lag), record.rate_valid & np.roll(record.envelope_valid, lag)
    envelope, rate = shifted[valid], record.rates[unit][valid]
    found = two_segments(envelope, rate, first=how.first_segment)
    row: Row = {"threshold": found.threshold, "slope": found.slope, "baseline": found.baseline}
    row |= {"latency": lag * how.bin_width, "tuning_r_squared": found.r_squared}
    below = envelope < found.threshold
    row["sub_threshold_rate"] = float(rate[below].mean()) if below.any() else np.nan
    if not found.slope > 0:
        return {**row, "reason": "slope not above 0"}
    return {**row, "reason": "the paper's fit gives no interval"}
