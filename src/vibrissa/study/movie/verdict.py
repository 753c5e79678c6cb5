"""Truth, what was found, and the error between them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrissa.mechanics.scan.motion import PredictedMotion
from vibrissa.quantities import dataset
from vibrissa.signals.correlation import best_correlation
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.spec.settings import Study

if TYPE_CHECKING:
    import xarray as xr


class VerdictRow(NamedTuple):
    """One line of the table: its key, a quantity, its truth, what was found and its 95 % interval (NaN: none)."""

    row_key: str
    quantity: str
    quantity_unit: str
    truth: float
    found: float
    found_low: float = np.nan
    found_high: float = np.nan


def hold_against(study: Study, prediction: PredictedMotion, results: dict[str, xr.Dataset]) -> xr.Dataset:
    """Table of truth against found for a virtual experiment.

    The truth of a frequency or a damping is what was put in; ``true signal`` rows hold the fit on the tracked movie
    against the same fit on the signal a perfect tracker would have found.

    Parameters
    ----------
    study : Study
        With a film.
    prediction : PredictedMotion
        The true motion.
    results : mapping of Datasets
        What was found in the film.

    Returns
    -------
    Dataset
        ``row_key``, by which a row is chosen; ``quantity``, in words; ``quantity_unit``, ``truth``, ``found``,
        ``found_low``, ``found_high`` (entry).
    """
    rows = [*_resonance_rows(study, prediction, results), *_agreement_rows(results)]
    if "response" in results:
        rows += _unit_rows(results["response"])
    columns: dict[str, Any] = dict(zip(VerdictRow._fields, map(np.array, zip(*rows, strict=True)), strict=True))
    return dataset(**columns)


def rows_of(table: xr.Dataset) -> list[VerdictRow]:
    """Rows of such a table.

    Parameters
    ----------
    table : Dataset
        From :func:`hold_against`.

    Returns
    -------
    list of VerdictRow
        In its order.
    """
    return [VerdictRow(*row) for row in zip(*(table[name].values.tolist() for name in VerdictRow._fields), strict=True)]


def _resonance_rows(study: Study, prediction: PredictedMotion, results: dict[str, xr.Dataset]) -> list[VerdictRow]:
    rows = []
    for i in range(study.n_modes):
        for name, label, unit, truth in (
            ("resonant_frequency", "resonant frequency", "Hz", prediction.omega[i] / (2 * np.pi)),
            ("damping", "damping ratio", "1", prediction.scan.damping),
        ):
            found, white = (
                [float(results[fit][name + end][i]) for end in ("", "_low", "_high")]
                for fit in ("resonance", "resonance_white")
            )
            exact, words, key = float(results["resonance_true"][name][i]), f"{label}, mode {i + 1}", f"{name}_{i + 1}"
            rows.append(VerdictRow(key, words, unit, truth, *found))
            rows.append(VerdictRow(f"{key}_tracked", f"{words}, against the true signal", unit, exact, found[0]))
            rows.append(VerdictRow(f"{key}_white", f"{words}, white forcing assumed", unit, truth, *white))
    return rows


def _agreement_rows(results: dict[str, xr.Dataset]) -> list[VerdictRow]:
    """Correlation and size of displacement and envelope, mode by mode; the truth of a correlation is 1."""
    found, true = results["modal"].mode_displacement.values, results["prediction"].mode_displacement.values
    rows = []
    for i in range(len(found)):
        a, b = found[i], true[i] - true[i].mean()
        r = float(np.corrcoef(a, b)[0, 1])
        of_envelopes = float(np.corrcoef(analytic_envelope(a)[0], analytic_envelope(b)[0])[0, 1])
        for key, words, truth, value in (
            ("displacement_rms", "rms displacement over L", float(b.std()), float(a.std())),
            ("displacement_correlation", "correlation of displacement", 1.0, r),
            ("envelope_correlation", "correlation of envelope", 1.0, of_envelopes),
        ):
            rows.append(VerdictRow(f"{key}_{i + 1}", f"{words}, mode {i + 1}", "1", truth, value))
    return rows


def _unit_rows(response: xr.Dataset) -> list[VerdictRow]:
    rate = response.firing_rate.values
    names = ("bin_envelope_true", "bin_envelope")
    true, found = (float(best_correlation(rate, response[name].values, 1)[1]) for name in names)
    words = "correlation of firing rate with the true | tracked envelope"
    return [VerdictRow("rate_correlation", words, "1", true, found)]
