"""Demodulation index: whether a unit follows the envelope or the carrier's phase."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, TooFewError
from vibrissa.neural.coding.phase_parts import DrawnParts, Estimate, Explained, by_chance
from vibrissa.neural.coupling.presentation import BinnedAnalysis, Presentation
from vibrissa.neural.coupling.response import UnitCounts
from vibrissa.neural.coupling.stimulus_blocks import guard_bins, independent_blocks
from vibrissa.neural.io.tables.inputs import refuse_misplaced
from vibrissa.neural.io.tables.stimuli import require_motion
from vibrissa.quantities import dataset, stacked
from vibrissa.quantities.quantity import SUFFIXES, estimate
from vibrissa.signals.coherence import band_coherence
from vibrissa.signals.envelope import analytic_envelope

FEWEST_SPIKES, FEWEST_TRIALS = 100, 8  # with fewer trials, blocks of the stimulus are the draws
LATENCIES = np.arange(0.0, 0.0305, 0.001)  # [s]
CYCLE = 6.0  # bins in a period of the carrier, at least: fewer would flatten what locks to it
ALIKE = 0.6  # correlation of what envelope and phase can explain: above it, slow motion spoils both of them
LEVEL = 0.01  # largest p at which a unit is said to follow
SEGMENT = 0.5  # [s] of the coherences


@dataclass(frozen=True, kw_only=True)
class DemodulationAnalysis(BinnedAnalysis):
    """Settings of the demodulation index.

    Attributes
    ----------
    bin_width : float
        Width of the bins [s], a sixth of the carrier's period or less.
    skip, window, band
        As in :class:`vibrissa.neural.coupling.presentation.BinnedAnalysis`.
    """

    bin_width: float = 0.001


def demodulation(
    spikes: xr.Dataset, stimulus: xr.Dataset, n_trials: int, how: DemodulationAnalysis | None = None
) -> xr.Dataset:
    """Shares of every unit's modulation that follow the envelope and the carrier's phase.

    In bins finer than the carrier's period, the rate is a bent line of the envelope plus a wave locked to the phase,
    or to twice the phase. The variances of both, V_E and V_C, are taken between different trials, so that noise adds
    nothing to them; of fewer than 8 trials, between different blocks of the stimulus. The index is
    (V_E − V_C)/(V_E + V_C): 1 for a unit that follows the envelope alone, −1 for one
    that follows the phase alone.

    Parameters
    ----------
    spikes, stimulus, n_trials
        As in :func:`vibrissa.neural.coupling.analysis.analyse_units`.
    how : DemodulationAnalysis, optional
        Bins and band.

    Returns
    -------
    Dataset
        ``demodulation_index``, ``envelope_modulation`` (√V_E over the mean rate), ``phase_modulation`` (√V_C over it)
        and ``vector_strength`` (of what is locked, without what envelope and noise feign), each with its 95 %
        interval; ``vector_strength_plain`` (of all spikes), ``locking_phase`` [rad], ``locking_latency`` [s];
        ``envelope_coherence`` below half the carrier's frequency and ``carrier_coherence`` from 0.75 to 1.25 of it,
        of the mean rate; ``envelope_p_value`` and ``phase_p_value`` against all circular shifts; ``demodulated``
        (envelope, phase, both, cannot tell), ``n_blocks`` (0: trials are the draws) and ``reason`` (unit).
        ``carrier_frequency`` [Hz] and ``phase_likeness``,
        how alike envelope and phase are in this stimulus.

    Raises
    ------
    InputError
        If bins are too wide for the carrier, trials are few and the stimulus is short, or spikes and stimulus do not
        fit together.
    """
    how = how or DemodulationAnalysis()
    require_motion(stimulus, "phase")
    refuse_misplaced(spikes, stimulus, n_trials, window=how.window, skip=how.skip)
    shown = how.presentation(stimulus)
    if CYCLE * shown.frequency * how.bin_width > 1:
        rule = f"must be at most {1 / (CYCLE * shown.frequency):.2g} s for a carrier of {shown.frequency:.0f} Hz"
        raise RangeError("bin width", rule, how.bin_width)
    valid = shown.drive().valid
    centre = shown.edges[:-1][valid] + how.bin_width / 2
    phase = np.unwrap(analytic_envelope(shown.carrier)[1])
    tried = [Explained.of(shown, phase, centre, float(latency)) for latency in LATENCIES]
    if n_trials < FEWEST_TRIALS:
        independent_blocks(tried[0].envelope[0], width=how.bin_width, fewest_trials=FEWEST_TRIALS)
    likeness = max(one.likeness() for one in tried[:: len(tried) // 3])
    counts = UnitCounts.of(spikes, n_trials, shown.edges, how.bin_width)
    rows = [_row(own[:, valid].astype(float), tried, likeness, shown, how) for own in counts]
    return dataset(
        {"n_trials": n_trials, "bin_width": how.bin_width, "skip": how.skip},
        unit_name=spikes.unit_name.values,
        carrier_frequency=np.array([shown.frequency]),
        phase_likeness=likeness,
        **stacked(rows),
    )


MEASURES = ("demodulation_index", "envelope_modulation", "phase_modulation", "vector_strength")
OTHERS = ("vector_strength_plain", "locking_phase", "locking_latency", "envelope_coherence", "carrier_coherence")
NOT_MEASURED = {f"{name}{end}": np.nan for name in MEASURES for end in SUFFIXES} | dict.fromkeys(
    (*OTHERS, "envelope_p_value", "phase_p_value"), np.nan
)


def _row(
    counts: Array, tried: list[Explained], likeness: float, shown: Presentation, how: DemodulationAnalysis
) -> dict[str, Any]:
    row: dict[str, Any] = {**NOT_MEASURED, "demodulated": "cannot tell", "n_blocks": 0}
    if counts.sum() < FEWEST_SPIKES:
        return {**row, "reason": f"too few spikes: {counts.sum():.0f} in the bins that count, below {FEWEST_SPIKES}"}
    rate = counts.mean(0)
    best = tried[int(np.argmax([one.variance_explained(rate) for one in tried]))]
    row |= _coherences(rate, best, shown, how)
    row["vector_strength_plain"] = float(np.abs(rate @ best.carrier) / rate.sum())
    if likeness > ALIKE:
        row["reason"] = f"envelope and phase correlate in this stimulus (r = {likeness:.2f}); give the carrier's band"
        return row
    try:
        starts = _blocks(best, counts, how)
    except TooFewError as error:
        return {**row, "reason": f"cannot tell: {error}"}
    parts = DrawnParts.of_trials(best, counts) if starts is None else DrawnParts.of_blocks(best, rate, starts)
    row["n_blocks"] = 0 if starts is None else starts.size
    found = parts.estimates()
    for name, one in found.items():
        row |= estimate(name, *one)
    row |= {"locking_phase": float(-np.angle(parts.locked.sum())), "locking_latency": best.latency}
    p_values = _p_values(tried[0], rate, guard_bins(how.bin_width, rate.size, starts), how.bin_width)
    row["demodulated"], row["reason"] = _verdict(found, p_values)
    return row | p_values


def _blocks(best: Explained, counts: Array, how: DemodulationAnalysis) -> Integers | None:
    """First bin of each block of the stimulus, where trials are few; None where they are the draws."""
    if len(counts) >= FEWEST_TRIALS:
        return None
    series = best.envelope[0], best.residual(counts.mean(0))
    return independent_blocks(*series, width=how.bin_width, fewest_trials=FEWEST_TRIALS)


def _p_values(unshifted: Explained, rate: Array, guard: int, width: float) -> dict[str, float]:
    reach = round(LATENCIES[-1] / width)
    columns = {"envelope": unshifted.envelope, "phase": unshifted.phase}
    return {f"{name}_p_value": by_chance(one, rate, reach, guard) for name, one in columns.items()}


def _verdict(found: dict[str, Estimate], p_values: dict[str, float]) -> tuple[str, str]:
    parts = ("envelope", "phase")
    modulation = {name: found[f"{name}_modulation"] for name in parts}
    follows = [p_values[f"{name}_p_value"] <= LEVEL and one.low > 0 for name, one in modulation.items()]
    seen = [name for name, one in modulation.items() if one.low > one.value / 2 > 0]  # plainly
    if not any(follows):
        shifts = "shifts of the stimulus explain as much: a steady carrier, or an envelope that repeats, is like itself"
        alike = f"its rate goes with the {' and the '.join(seen)} in all trials, but {shifts}"
        return "cannot tell", alike if seen else "neither envelope nor phase modulates it beyond chance"
    if found["demodulation_index"].high - found["demodulation_index"].low > 1:
        return "cannot tell", "interval of the index wider than 1: more trials"
    return {(True, False): "envelope", (False, True): "phase", (True, True): "both"}[follows[0], follows[1]], ""


def _coherences(rate: Array, best: Explained, shown: Presentation, how: DemodulationAnalysis) -> dict[str, float]:
    """Of the mean rate with envelope and carrier, at the latency; NaN where the record is short."""
    if rate.size * how.bin_width < 3 * SEGMENT:
        return {}
    envelope, carrier = best.envelope[0], shown.frequency
    moved = (envelope - envelope.min() + 1e-12) * best.carrier.real
    bands = {"envelope": (envelope, (1 / SEGMENT, carrier / 2)), "carrier": (moved, (0.75 * carrier, 1.25 * carrier))}
    return {
        f"{name}_coherence": band_coherence(rate, reference, 1 / how.bin_width, SEGMENT, band)
        for name, (reference, band) in bands.items()
    }
