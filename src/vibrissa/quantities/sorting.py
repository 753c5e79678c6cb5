"""Spike sorting: sorted units against the truth of a simulated recording."""

from __future__ import annotations

from vibrissa.quantities.quantity import Quantity

SORTING: dict[str, Quantity] = {
    "true_unit": Quantity(("true_unit",), "1", "unit of the truth"),
    "true_spikes": Quantity(("true_unit",), "1", "spikes of a unit of the truth"),
    "true_snr": Quantity(("true_unit",), "1", "peak-to-peak of the unit's true waveform over the noise's deviation"),
    "matched_unit": Quantity(("true_unit",), "1", "sorted unit matched to it; empty where none is"),
    "sorting_accuracy": Quantity(("true_unit",), "1", "spikes found over those found, missed or wrongly found"),
    "sorting_recall": Quantity(("true_unit",), "1", "share of the unit's spikes that are found"),
    "sorting_precision": Quantity(("true_unit",), "1", "share of the matched unit's spikes that are right"),
    "units_unmatched": Quantity((), "1", "sorted units that match no unit of the truth"),
}
