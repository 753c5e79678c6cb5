"""Envelope or carrier's phase: which drives a unit where the envelope of a lopsided motion carries its phase."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import MissingError
from vibrissa.neural.coupling.lack_of_fit import structure_p_value
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.neural.coupling.stimulus_blocks import block_starts
from vibrissa.neural.coupling.threshold_linear import BinnedDrive
from vibrissa.signals.envelope import analytic_envelope

ALIKE = 0.1  # correlation of binned envelope and binned phase, above which a unit locked to the phase may pass
LEVEL = 1e-3  # largest p-value at which envelope or phase adds to the other; the latency was chosen for each
DOMINANT = 0.1  # share of what both add, below which the smaller one is put down to the shape of the larger
AVERAGED = 0.02  # standard deviation of the binned phase below which the bins average it away
MOST_BINS = 50_000  # fine bins: of more the columns would fill the memory
CYCLE = 6  # fine bins in a period of the carrier, at least
STEP = 0.001  # [s] between the latencies tried
KNOTS = (0.0, 0.25, 0.5, 0.75)  # shares of the time at which the rate may bend with the envelope

ELSEWHERE = "the correlation is largest at"  # begins a remark that leaves a unit identified
VERDICTS = ("envelope", "phase", "both", "cannot tell")
REASONS = {
    "phase": "the rate follows the carrier's phase, which the envelope of this motion carries, not the envelope",
    "cannot tell": "cannot tell the envelope from the carrier's phase in this stimulus; a second stimulus may decide",
}


class CarrierVerdict(NamedTuple):
    """Which of envelope and phase drives a unit.

    Attributes
    ----------
    verdict : str
        envelope, phase, both or cannot tell.
    beyond_phase_p_value, beyond_envelope_p_value : float
        Of what the envelope explains beyond the phase, and the phase beyond the envelope; NaN where not tested.
    """

    verdict: str
    beyond_phase_p_value: float
    beyond_envelope_p_value: float


def phase_in_envelope(shown: Presentation) -> float:
    """Largest correlation of the binned envelope with anything locked to the carrier's phase in the same bins.

    Where it is near 0, as of a motion that is alike upwards and downwards and fast against the bins, a unit locked to
    the phase does not pass the test of the envelope.

    Parameters
    ----------
    shown : Presentation
        The stimulus.

    Returns
    -------
    float
        0 to 1, over latencies of up to 30 ms; 0 of a stimulus that is an envelope, which has no phase.
    """
    if not np.isfinite(shown.frequency):
        return 0.0
    drive, phase = shown.drive(), _phase(shown)
    latencies = np.arange(drive.latencies[0], drive.latencies[1] + 1e-9, 2 * STEP)
    envelope = _centred(drive.seen(drive.envelope, 0.0))
    waves = _centred(np.array([drive.seen(wave(phase), latencies) for wave in (np.cos, np.sin)]))  # (2, J, K')
    if waves.std() < AVERAGED:
        return 0.0
    bases = [np.linalg.qr(waves[:, j].T)[0] for j in range(latencies.size)]
    return float(max(np.linalg.norm(envelope @ one) for one in bases) / np.linalg.norm(envelope))


@dataclass(frozen=True, kw_only=True)
class PhaseTest:
    """Columns of envelope and phase in bins finer than the carrier's period: made once for a stimulus.

    Attributes
    ----------
    drive : BinnedDrive
        The envelope seen through the fine bins.
    envelope : (J, E, K) array
        Bent lines of the envelope at each latency, mean 0.
    phase : (J, P, K) array
        Cosine and sine of the phase, the same times the envelope, and of twice the phase; mean 0.
    finer : int
        Fine bins in one of the analysis.
    """

    drive: BinnedDrive
    envelope: Array
    phase: Array
    finer: int

    @classmethod
    def of(cls, shown: Presentation) -> PhaseTest | None:
        """Columns of a stimulus.

        Parameters
        ----------
        shown : Presentation
            The stimulus.

        Returns
        -------
        PhaseTest or None
            None where the stimulus is sampled too coarsely for its carrier, or too long for it.
        """
        width, step = float(shown.edges[1] - shown.edges[0]), float(shown.time[1] - shown.time[0])
        finer = int(np.ceil(width * CYCLE * shown.frequency - 1e-9))
        if width / finer < step or finer * len(shown.edges) > MOST_BINS:
            return None
        coarse = shown.drive()
        edges = shown.edges[0] + width / finer * np.arange(len(coarse.valid) * finer + 1, dtype=float)
        drive = replace(coarse, edges=edges, valid=np.repeat(coarse.valid, finer))
        latencies = np.arange(coarse.latencies[0], coarse.latencies[1] + 1e-9, STEP)
        a, phi = drive.envelope, _phase(shown)
        bent = [np.maximum(a - knot, 0) for knot in np.quantile(drive.counted(), KNOTS)]
        waves = [np.cos(phi), np.sin(phi), a * np.cos(phi), a * np.sin(phi), np.cos(2 * phi), np.sin(2 * phi)]
        envelope, phase = (_over(drive, columns, latencies) for columns in (bent, waves))
        return cls(drive=drive, envelope=envelope, phase=phase, finer=finer)

    def verdict_on(self, rate: Array) -> CarrierVerdict:
        """Which of envelope and phase explains what the other does not.

        Each is taken at the latency at which it explains most. What one adds to the other is tested by blocks of the
        stimulus; where both add, one that adds less than a tenth is put down to the other's shape.

        Parameters
        ----------
        rate : (K,) array
            Mean rate over trials in the fine bins that count.

        Returns
        -------
        CarrierVerdict
            The verdict.
        """
        rate = rate - rate.mean()
        envelope, phase = (_best(columns, rate) for columns in (self.envelope, self.phase))
        starts = block_starts(envelope[0], np.abs(phase[0]))
        p_values, added = [], []
        for new, old in ((envelope, phase), (phase, envelope)):
            residual, both = _residual(old, rate), _residual(np.vstack([old, new]), rate)
            fitted = np.vstack([np.ones(rate.size), old])
            p_values.append(structure_p_value(new, fitted, residual, np.ones(rate.size), starts))
            added.append(float(residual @ residual - both @ both))
        adds = [p <= LEVEL and one >= DOMINANT * sum(added) for p, one in zip(p_values, added, strict=True)]
        verdicts = {(True, False): "envelope", (False, True): "phase", (True, True): "both"}
        return CarrierVerdict(verdicts.get((adds[0], adds[1]), "cannot tell"), *p_values)


def share_remark(units: xr.Dataset) -> str:
    """Share of units that pass, with and without those that follow the phase or are undecided; empty without any.

    Parameters
    ----------
    units : Dataset
        With ``significant`` and ``envelope_verdict``.

    Returns
    -------
    str
        One sentence.
    """
    if "envelope_verdict" not in units:
        return ""
    verdict, passed, n = units.envelope_verdict.values, units.significant.values.astype(bool), units.sizes["unit"]
    phase, open_ = (int(np.sum(passed & (verdict == one))) for one in ("phase", "cannot tell"))
    if not phase + open_:
        return ""
    count = int(passed.sum())
    return (
        f"{count} of {n} units pass the test of the envelope ({100 * count / n:.1f} %); {phase} of them follow the "
        f"carrier's phase instead, and of {open_} it is undecided; without these {count - phase - open_} units pass "
        f"({100 * (count - phase - open_) / n:.1f} %)"
    )


def settled_by(first: xr.Dataset, second: xr.Dataset) -> xr.Dataset:
    """Verdicts on units of one stimulus, decided by a second stimulus where the first cannot.

    A unit that the first stimulus leaves open is driven by the envelope if it passes the test of a second one whose
    envelope does not carry its phase, or whose own test of the phase says so.

    Parameters
    ----------
    first, second : Dataset
        Of :func:`vibrissa.neural.coupling.analysis.analyse_units`, of the same units, found by their names.

    Returns
    -------
    Dataset
        The first, with ``envelope_verdict`` settled, and ``reason`` and ``identified`` of the units that it settles.

    Raises
    ------
    InputError
        If a unit of the first is missing in the second.
    """
    names = second.unit_name.values.tolist()
    absent = [str(name) for name in first.unit_name.values if name not in names]
    if absent:
        raise MissingError("second stimulus", "must have every unit of the first", ", ".join(absent))
    of = [names.index(name) for name in first.unit_name.values.tolist()]
    other = second.envelope_verdict.values[of]
    settled = (first.envelope_verdict.values == "cannot tell") & (other != "") & (other != "cannot tell")
    verdict = np.where(settled, other, first.envelope_verdict.values)
    found = first.copy()
    found["envelope_verdict"] = first.envelope_verdict.copy(data=verdict)
    if not {"reason", "identified"} <= set(first):
        return found
    rest = [str(one).removeprefix(REASONS["cannot tell"]).removeprefix("; ") for one in first.reason.values]
    reasons = ["; ".join(filter(None, [REASONS.get(v, ""), r])) for v, r in zip(verdict, rest, strict=True)]
    fitted = settled & (verdict != "phase") & [not one or _elsewhere_alone(one) for one in rest]
    found["reason"] = first.reason.copy(data=np.where(settled, reasons, first.reason.values))
    found["identified"] = first.identified.copy(data=fitted | first.identified.values.astype(bool))
    return found


def peak_elsewhere(units: xr.Dataset) -> Array:
    """Lag of the largest correlation of units for which it is none of the lags tested.

    Parameters
    ----------
    units : Dataset
        Of :func:`vibrissa.neural.coupling.analysis.analyse_units`.

    Returns
    -------
    (U,) array
        [s]; NaN where the correlation is largest at a lag that was tested, or is none beyond chance.
    """
    return np.where([ELSEWHERE in str(one) for one in units.reason.values], units.peak_lag.values, np.nan)


def _elsewhere_alone(reason: str) -> bool:
    """Whether the only remark on a unit is one that leaves it identified."""
    return reason.startswith(ELSEWHERE) and "; " not in reason


def _phase(shown: Presentation) -> Array:
    return np.asarray(np.unwrap(analytic_envelope(shown.carrier)[1]), float)


def _centred(columns: Array) -> Array:
    return np.asarray(columns - columns.mean(-1, keepdims=True))


def _over(drive: BinnedDrive, columns: list[Array], latencies: Array) -> Array:
    """Columns in the bins at each latency, of mean 0 and norm 1; (J, C, K)."""
    seen = _centred(np.array([drive.seen(one, latencies) for one in columns]).swapaxes(0, 1))
    return np.asarray(seen / np.maximum(np.linalg.norm(seen, axis=-1, keepdims=True), 1e-300))


def _best(columns: Array, rate: Array) -> Array:
    """Columns at the latency at which they explain most."""
    pull = columns @ rate
    gram = columns @ columns.swapaxes(1, 2) + 1e-9 * np.eye(columns.shape[1])
    explained = np.einsum("jc,jc->j", pull, np.linalg.solve(gram, pull[..., None])[..., 0])
    return np.asarray(columns[int(np.argmax(explained))])


def _residual(columns: Array, rate: Array) -> Array:
    return np.asarray(rate - np.linalg.lstsq(columns.T, rate, rcond=1e-8)[0] @ columns)
