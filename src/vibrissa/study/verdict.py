"""Truth, what was found, and the error between them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.mechanics.motion import Motion
from vibrissa.neural.coupling import maximal_correlation
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.settings import Study

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]


class Row(NamedTuple):
    """One line of the table: a quantity, its truth, what was found and its 95 % interval (NaN: none)."""

    quantity: str
    unit: str
    truth: float
    found: float
    low: float = np.nan
    high: float = np.nan


def hold_against(study: Study, prediction: Motion, results: dict[str, xr.Dataset]) -> xr.Dataset:
    """Table of truth against found for a virtual experiment.

    The truth of a frequency or a damping is what was put in; ``true signal`` rows hold the fit on the tracked movie
    against the same fit on the signal a perfect tracker would have found.

    Returns
    -------
    Dataset
        ``quantity``, ``quantity_unit``, ``truth``, ``found``, ``found_low``, ``found_high`` (entry).
    """
    rows = [*_resonance_rows(study, prediction, results), *_agreement_rows(results)]
    if "response" in results:
        rows += _unit_rows(results["response"])
    quantity, unit, truth, found, low, high = map(np.array, zip(*rows, strict=True))
    return dataset(quantity=quantity, quantity_unit=unit, truth=truth, found=found, found_low=low, found_high=high)


def _resonance_rows(study: Study, prediction: Motion, results: dict[str, xr.Dataset]) -> list[Row]:
    found, true = results["resonance"], results["resonance_true"]
    white = results["resonance_white"]
    rows = []
    for i in range(study.n_modes):
        mode = f"mode {i + 1}"
        for name, unit, truth in (
            ("resonant_frequency", "Hz", prediction.omega[i] / (2 * np.pi)),
            ("damping", "1", prediction.scan.damping),
        ):
            label = "resonant frequency" if unit == "Hz" else "damping ratio"
            low, value, high = (float(found[name + end][i]) for end in ("_low", "", "_high"))
            rows.append(Row(f"{label}, {mode}", unit, truth, value, low, high))
            rows.append(Row(f"{label}, {mode}, against the true signal", unit, float(true[name][i]), value))
            low, value, high = (float(white[name + end][i]) for end in ("_low", "", "_high"))
            rows.append(Row(f"{label}, {mode}, forcing taken for white", unit, truth, value, low, high))
    return rows


def _agreement_rows(results: dict[str, xr.Dataset]) -> list[Row]:
    """Correlation and size of displacement and envelope, mode by mode; the truth of a correlation is 1."""
    found, true = results["modal"].mode_displacement.values, results["prediction"].mode_displacement.values
    rows = []
    for i in range(len(found)):
        a, b = found[i], true[i] - true[i].mean()
        envelope_a, envelope_b = analytic_envelope(a)[0], analytic_envelope(b)[0]
        rows.append(Row(f"rms displacement over L, mode {i + 1}", "1", float(b.std()), float(a.std())))
        rows.append(Row(f"correlation of displacement, mode {i + 1}", "1", 1.0, float(np.corrcoef(a, b)[0, 1])))
        r = float(np.corrcoef(envelope_a, envelope_b)[0, 1])
        rows.append(Row(f"correlation of envelope, mode {i + 1}", "1", 1.0, r))
    return rows


def _unit_rows(response: xr.Dataset) -> list[Row]:
    rate = response.firing_rate.values
    true, _ = maximal_correlation(rate, response.bin_envelope_true.values)
    found, _ = maximal_correlation(rate, response.bin_envelope.values)
    return [Row("correlation of firing rate with the true | tracked envelope", "1", true, found)]
