"""Envelope coupling of each unit, from a table of spikes and one stimulus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Mask, Window
from vibrissa.errors import RangeError, UnknownError, require_fraction, require_not_negative
from vibrissa.neural.coupling.carrier import ALIKE, REASONS, CarrierVerdict, PhaseTest, phase_in_envelope
from vibrissa.neural.coupling.envelope_coupling import Coupling, Null, envelope_coupling
from vibrissa.neural.coupling.lack_of_fit import CLASSES, describe, response_curve
from vibrissa.neural.coupling.nulls import BinnedRecord, Circular, Paper2014
from vibrissa.neural.coupling.presentation import BinnedAnalysis, Presentation
from vibrissa.neural.coupling.reasons import elsewhere, uncoupled
from vibrissa.neural.coupling.repeatability import r_squared_ceiling, variability
from vibrissa.neural.coupling.response import UnitCounts
from vibrissa.neural.coupling.segments import First, two_segments
from vibrissa.neural.coupling.spontaneous import spontaneous_rates
from vibrissa.neural.coupling.threshold_linear import Hinge, HingeGrid
from vibrissa.neural.coupling.tuning import (
    ENDS,
    bootstrap_fits,
    cross_validated,
    forward_fit,
    predicted,
    r_squared,
    weakness,
)
from vibrissa.neural.io.tables.inputs import refuse_misplaced
from vibrissa.neural.io.tables.spikes import NOT_OBSERVED
from vibrissa.neural.io.tables.stimuli import in_unit_of
from vibrissa.quantities import dataset, stacked
from vibrissa.quantities.quantity import SUFFIXES
from vibrissa.stats import adjusted_p_values

FEWEST_SPIKES = 50  # in the bins that count; fewer determine neither threshold nor slope
DESCRIBED = {
    "saturation": "a rate that saturates",
    "rectified square": "the square of the envelope above a threshold",
    "adaptation": "a rate that adapts to the envelope before",
    "smooth curve": "a smooth curve over the envelope",
}
FEWEST_TRIALS = 8  # fewer are resampled in too few ways: their intervals are too narrow


@dataclass(frozen=True, kw_only=True)
class EnvelopeAnalysis(BinnedAnalysis):
    """Settings of the tests and fits.

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
    bin_width, skip, window, band
        As in :class:`vibrissa.neural.coupling.presentation.BinnedAnalysis`.
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
    delays: tuple[float, ...] = ()
    spontaneous: Window | None = None
    n_resamples: int = 400
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_fraction("level", self.level)
        for name, known in (("null", ("circular", "paper2014")), ("fit", ("forward", "paper2014"))):
            if getattr(self, name) not in known:
                raise UnknownError(name, f"must be {' or '.join(known)}", repr(getattr(self, name)))
        for name in ("window", "band", "spontaneous"):
            ends = getattr(self, name)
            if ends is not None and not -np.inf < ends[0] < ends[1] < np.inf:
                raise RangeError(name, "must start before it stops", ends)
        for delay in self.delays:
            require_not_negative("delay", delay, "s")
        if self.n_resamples < 40 or self.seed < 0:
            raise RangeError("resamples and seed", "must be at least 40 and 0", f"{self.n_resamples}, {self.seed}")

    @property
    def lags(self) -> tuple[int, int]:
        """Lags tried [bins]: the paper's ±1, or those of a response up to 30 ms late."""
        return (-1, 1) if self.null == "paper2014" else (0, max(1, round(0.03 / self.bin_width)))

    @property
    def reach(self) -> int:
        """Largest lag at which the correlation is looked at, tested or not [bins]: 50 ms."""
        return max(1, round(0.05 / self.bin_width))

    def chance(self) -> Null:
        """Null distribution by its name."""
        if self.null == "paper2014":
            return Paper2014(seed=self.seed)
        guard = max(1, round(0.06 / self.bin_width))
        return Circular(guard=guard, delays=tuple(round(delay / self.bin_width) for delay in self.delays))

    def as_attributes(self) -> dict[str, Any]:
        """Settings as attributes of what they made."""
        given = {name: value for name, value in vars(self).items() if value not in (None, ())}
        return {name: np.array(value, float) if isinstance(value, tuple) else value for name, value in given.items()}


def analyse_units(
    spikes: xr.Dataset, stimulus: xr.Dataset, n_trials: int, how: EnvelopeAnalysis | None = None
) -> xr.Dataset:
    """Test whether the envelope drives each unit, and fit threshold, slope and latency where it does.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`, times from the stimulus' onset.
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
        significant are fitted; ``envelope_verdict`` of these is envelope, phase, both, or cannot tell.
        ``unit_quality`` and ``unit_session`` go along where the spikes have them.

    Raises
    ------
    InputError
        If spikes and stimulus do not fit together.
    """
    how = how or EnvelopeAnalysis()
    refuse_misplaced(spikes, stimulus, n_trials, window=how.window, spontaneous=how.spontaneous, skip=how.skip)
    shown = how.presentation(stimulus)
    counts = UnitCounts.of(spikes, n_trials, shown.edges, how.bin_width, partial=True)
    record = binned_record(counts, shown)
    coupling = envelope_coupling(record, how.chance(), lags=how.lags, reach=how.reach)
    adjusted = adjusted_p_values(coupling.tail_p_value)
    significant = (adjusted if how.null == "circular" else coupling.p_value) <= how.level
    likeness = phase_in_envelope(shown)
    verdicts = _verdicts(counts, shown, likeness, significant)
    fits = _fits(record, counts, shown, coupling, significant, how)
    rows = [_judged(fit, verdict) for fit, verdict in zip(fits, verdicts, strict=True)]
    known: dict[str, Any] = {name: spikes[name].values for name in ("unit_quality", "unit_session") if name in spikes}
    about = {"n_trials": n_trials, "edge": shown.edge, "lag_low": how.lags[0], "lag_high": how.lags[1]}
    found = dataset(
        {**about, "phase_in_envelope": likeness, **how.as_attributes()},
        unit_name=spikes.unit_name.values,
        envelope_correlation=coupling.correlation,
        envelope_lag=np.where(np.isnan(coupling.correlation), np.nan, coupling.lag * how.bin_width),
        peak_correlation=coupling.peak,
        peak_lag=np.where(np.isnan(coupling.peak), np.nan, coupling.peak_lag * how.bin_width),
        p_value=coupling.p_value,
        tail_p_value=coupling.tail_p_value,
        adjusted_p_value=adjusted,
        significant=significant,
        unit_rate=record.rates[:, shown.rate_valid].mean(1),
        spontaneous_rate=spontaneous_rates(spikes, counts.observed, how.spontaneous),
        **stacked(rows),
        **known,
    )
    return in_unit_of(found, stimulus)


def _judged(row: Row, of: CarrierVerdict) -> Row:
    """A unit's fit with the verdict on envelope and phase."""
    row |= {f"envelope_{name}" if name == "verdict" else name: value for name, value in of._asdict().items()}
    if of.verdict not in REASONS:
        return row
    return row | {"identified": False, "reason": "; ".join(filter(None, [REASONS[of.verdict], row["reason"]]))}


def binned_record(counts: UnitCounts, shown: Presentation) -> BinnedRecord:
    """Rates of units beside the envelope, with the bins that count.

    Parameters
    ----------
    counts : UnitCounts
        In the bins of the presentation.
    shown : Presentation
        The stimulus.

    Returns
    -------
    BinnedRecord
        What is tested.
    """
    valid = {"rate_valid": shown.rate_valid, "envelope_valid": shown.envelope_valid}
    return BinnedRecord(rates=counts.rates(), envelope=shown.binned(), **valid)


def _verdicts(counts: UnitCounts, shown: Presentation, likeness: float, significant: Mask) -> list[CarrierVerdict]:
    """Which of envelope and phase drives each unit that passes; where the envelope carries no phase, the envelope."""
    idle, plain, open_ = (CarrierVerdict(one, np.nan, np.nan) for one in ("", "envelope", "cannot tell"))
    if likeness <= ALIKE or not significant.any():
        return [plain if one else idle for one in significant]
    test = PhaseTest.of(shown)
    if test is None:
        return [open_ if one else idle for one in significant]
    valid = test.drive.valid
    return [
        test.verdict_on(counts.total_of(unit, test.finer)[valid].astype(float)) if one else idle
        for unit, one in enumerate(significant)
    ]


Row = dict[str, Any]
NOT_MEASURED: Row = {
    **{name + end: np.nan for name in Hinge._fields for end in SUFFIXES},
    **dict.fromkeys(("tuning_r_squared", "tuning_r_squared_unseen", "noise_ceiling", "sub_threshold_rate"), np.nan),
    **dict.fromkeys(("tuning_r_squared_ceiling", "structure_p_value", "response_model_r_squared"), np.nan),
    **dict.fromkeys(("saturation_envelope", "adaptation_time", "fano_factor", "trial_gain_sd"), np.nan),
    **{f"response_{name}": np.full(CLASSES, np.nan) for name in ("envelope", "rate", "rate_se", "rate_fitted")},
    "response_model": "",
    "identified": False,
}


def _fits(
    record: BinnedRecord,
    counts: UnitCounts,
    shown: Presentation,
    coupling: Coupling,
    significant: Mask,
    how: EnvelopeAnalysis,
) -> list[Row]:
    """Fit each unit that is driven by the envelope; say of the others why not."""
    drive = shown.drive()
    grid = HingeGrid.of(drive) if how.fit == "forward" and significant.any() else None
    tested: dict[str, Any] = {"significant": significant, "level": how.level}
    unfitted = uncoupled(record, coupling, how.chance(), how.lags, how.bin_width, **tested)
    rows = []
    for unit, total in enumerate(counts.totals):
        n_spikes = int(total[drive.valid].sum())
        if n_spikes < FEWEST_SPIKES:
            few = f"too few spikes: {n_spikes} in the bins that count, fewer than {FEWEST_SPIKES}"
            rows.append({**NOT_MEASURED, "reason": few if counts.observed[unit].any() else NOT_OBSERVED})
        elif not significant[unit]:
            rows.append({**NOT_MEASURED, "reason": unfitted[unit]})
        elif grid is not None:
            rng = np.random.default_rng(how.seed)
            own = counts.of_unit(unit)[:, drive.valid].astype(float)
            rows.append({**NOT_MEASURED, **_forward(grid, own, how, rng)})
        else:
            rows.append({**NOT_MEASURED, **_paper(record, unit, int(coupling.lag[unit]), how)})
        beyond = how.null == "circular" and (significant[unit] or coupling.peak_p_value[unit] <= how.level)
        remarks = [elsewhere(coupling, unit, how.lags, how.bin_width, beyond=bool(beyond)), rows[-1]["reason"]]
        if significant[unit] and coupling.lag[unit] < 0:
            lead = f"the rate leads the envelope by {-1e3 * coupling.lag[unit] * how.bin_width:g} ms"
            remarks.insert(0, f"{lead}, and no response comes before its stimulus")
        rows[-1]["reason"] = "; ".join(filter(None, remarks))
    return rows


def _forward(grid: HingeGrid, trial_counts: Array, how: EnvelopeAnalysis, rng: np.random.Generator) -> Row:
    """Threshold-linear fit, its intervals, and how far to trust them."""
    n, width = len(trial_counts), how.bin_width
    fit = forward_fit(grid, trial_counts.sum(0), n * width)
    rate = trial_counts.mean(0) / width
    row: Row = {**fit._asdict(), "tuning_r_squared": r_squared(rate, predicted(grid.drive, fit))}
    curve = response_curve(grid.drive, trial_counts / width, fit.latency, predicted(grid.drive, fit))
    row |= {"sub_threshold_rate": _below(grid, rate, fit), **curve}
    row["fano_factor"], row["trial_gain_sd"] = variability(trial_counts)
    if n == 1:
        return {**row, "reason": "one trial: no interval by resampling trials, so the error of the fit is unknown"}
    samples = bootstrap_fits(grid, trial_counts, width, fit, n_resamples=how.n_resamples, rng=rng)
    for name, low, high in zip(Hinge._fields, *np.quantile(samples, ENDS, axis=1), strict=True):
        row |= {f"{name}_low": low, f"{name}_high": high}
    row["tuning_r_squared_unseen"], row["noise_ceiling"] = cross_validated(grid, trial_counts, width)
    row |= _described(grid, rate, fit, r_squared_ceiling(trial_counts))
    why = _not_threshold_linear(row) or weakness(grid, samples)
    if not why and n < FEWEST_TRIALS:
        why = f"{n} trials: intervals by resampling fewer than {FEWEST_TRIALS} are too narrow"
    for name in Hinge._fields if why else ():  # resampled trials that all end at one limit tell no interval
        if row[f"{name}_low"] == row[f"{name}_high"]:
            row |= {f"{name}_low": np.nan, f"{name}_high": np.nan}
    return {**row, "identified": not why, "reason": why}


def _described(grid: HingeGrid, rate: Array, fit: Hinge, ceiling: float) -> Row:
    """Curve that describes the unit, beside the share that any could explain."""
    row: Row = {"tuning_r_squared_ceiling": ceiling}
    if not (fit.slope > 0 and np.isfinite(ceiling)):
        return row
    model, p_value, share, at = describe(grid.drive, rate, fit, ceiling)
    where = {"saturation": "saturation_envelope", "adaptation": "adaptation_time"}
    row |= {"response_model": model, "structure_p_value": p_value, "response_model_r_squared": share}
    return row | ({where[model]: at} if model in where else {})


def _not_threshold_linear(row: Row) -> str:
    """Reason of a unit that another curve describes better; empty for the others."""
    model = row.get("response_model", "threshold-linear")
    if model == "threshold-linear":
        return ""
    found, hinge, ceiling = (
        row[name] for name in ("response_model_r_squared", "tuning_r_squared", "tuning_r_squared_ceiling")
    )
    shares = f"R² {found:.2f} against {hinge:.2f} of at most {ceiling:.2f}"
    return f"threshold-linear does not describe this unit: {DESCRIBED[model]} does better ({shares})"


def _below(grid: HingeGrid, rate: Array, fit: Hinge) -> float:
    """Mean rate in bins whose envelope stays below the threshold [Hz]; NaN where there is none."""
    below = grid.drive.hinged(fit.threshold, fit.latency) <= 1e-9 * max(fit.threshold, 1e-9)
    return float(rate[below].mean()) if below.any() else np.nan


def _paper(record: BinnedRecord, unit: int, lag: int, how: EnvelopeAnalysis) -> Row:
    """Two segments at the best whole shift."""
    shifted, valid = np.roll(record.envelope, lag), record.rate_valid & np.roll(record.envelope_valid, lag)
    envelope, rate = shifted[valid], record.rates[unit][valid]
    found = two_segments(envelope, rate, first=how.first_segment)
    row: Row = {"threshold": found.threshold, "slope": found.slope, "baseline": found.baseline}
    row |= {"latency": lag * how.bin_width, "tuning_r_squared": found.r_squared}
    below = envelope < found.threshold
    row["sub_threshold_rate"] = float(rate[below].mean()) if below.any() else np.nan
    return {**row, "reason": "the paper's fit gives no interval" if found.slope > 0 else "slope not above 0"}
