"""Coding of units: surround maps, demodulation, drives, kernels, information."""

from __future__ import annotations

from vibrissa.quantities.quantity import Quantity, ranged


def _information(name: str, unit: str, long_name: str) -> dict[str, Quantity]:
    """An information, corrected with its interval, as counted, and by extrapolation."""
    return ranged(name, ("unit",), unit, long_name) | {
        f"{name}_plain": Quantity(("unit",), unit, f"{long_name}, as counted"),
        f"{name}_extrapolated": Quantity(("unit",), unit, f"{long_name}, extrapolated to many trials"),
    }


CODING: dict[str, Quantity] = {
    # surround maps
    **ranged("surround_weight", ("unit", "whisker"), "1/(s m)", "rise of the rate above the threshold of each whisker"),
    "surround_shift_p_value": Quantity(("unit", "whisker"), "1", "p-value against circular shifts of the whisker"),
    "surround_p_value": Quantity(("unit", "whisker"), "1", "p-value of a whisker, adjusted over those of the unit"),
    "surround_verdict": Quantity(("unit", "whisker"), "1", "whether a whisker drives, suppresses, does nothing"),
    "strongest_whisker": Quantity(("unit",), "1", "whisker of the largest weight"),
    "driving_whiskers": Quantity(("unit",), "1", "whiskers that drive, the strongest first"),
    "suppressing_whiskers": Quantity(("unit",), "1", "whiskers that suppress, the strongest first"),
    "condition_number": Quantity((), "1", "condition number of the whiskers' thresholded envelopes, scaled"),
    "weight_inflation": Quantity(("whisker",), "1", "variance of a weight over that beside uncorrelated copies"),
    "copy_likeness": Quantity(("whisker",), "1", "largest |r| with another copy at lags up to the latest latency"),
    "likest_whisker": Quantity(("whisker",), "1", "whisker whose copy is most alike"),
    # which drive
    "drive": Quantity(("drive",), "1", "what of the motion may drive a unit"),
    **ranged("drive_gain", ("unit", "drive"), "bit", "likelihood of unseen spikes over a steady rate's, per spike"),
    **ranged("drive_loss", ("unit", "drive"), "bit", "likelihood of unseen spikes under the best drive's, per spike"),
    "drive_latency": Quantity(("unit", "drive"), "s", "delay from drive to rate"),
    "drive_likeness": Quantity(("drive",), "1", "correlation of a drive with the envelope over the bins that count"),
    "best_drive": Quantity(("unit",), "1", "drive that predicts unseen spikes best, or cannot tell"),
    "carrier_frequency": Quantity(("stimulus",), "Hz", "mean frequency of a stimulus, weighted by power"),
    # envelope or phase
    **ranged("demodulation_index", ("unit",), "1", "modulation by the envelope less that by the phase, over their sum"),
    **ranged("envelope_modulation", ("unit",), "1", "rms of the rate's part that follows the envelope, over the mean"),
    **ranged("phase_modulation", ("unit",), "1", "rms of the rate's part that follows the phase, over the mean"),
    **ranged("vector_strength", ("unit",), "1", "vector strength of what is locked to the carrier"),
    "vector_strength_plain": Quantity(
        ("unit",), "1", "vector strength of all spikes, what noise and envelope feign too"
    ),
    "locking_phase": Quantity(("unit",), "rad", "phase of the carrier at which the locked part of the rate is highest"),
    "locking_latency": Quantity(("unit",), "s", "delay at which envelope and phase are taken"),
    "envelope_coherence": Quantity(("unit",), "1", "squared coherence of the mean rate with the envelope"),
    "carrier_coherence": Quantity(("unit",), "1", "squared coherence of the mean rate with the carrier"),
    "envelope_p_value": Quantity(("unit",), "1", "share of circular shifts at which the envelope explains as much"),
    "phase_p_value": Quantity(("unit",), "1", "share of circular shifts at which the phase explains as much"),
    "demodulated": Quantity(("unit",), "1", "whether a unit follows the envelope, the phase, or both"),
    "phase_likeness": Quantity((), "1", "largest correlation of what envelope and phase can explain"),
    # kernels of a Poisson model
    "kernel_lag": Quantity(("kernel_lag",), "s", "latency of a whisker's kernel"),
    "past_lag": Quantity(("past_lag",), "s", "time since a spike of the unit itself"),
    **ranged("whisker_kernel", ("unit", "whisker", "kernel_lag"), "1/m", "rise of ln(rate) with the envelope, per bin"),
    **ranged("whisker_effect", ("unit", "whisker"), "1/m", "rise of ln(rate) with a lasting envelope"),
    "whisker_trial_p_value": Quantity(
        ("unit", "whisker"), "1", "p-value of a kernel, trials or blocks as draws (Hotelling)"
    ),
    "whisker_shift_p_value": Quantity(("unit", "whisker"), "1", "p-value against circular shifts of the whisker"),
    "whisker_p_value": Quantity(("unit", "whisker"), "1", "p-value of a whisker's kernel, adjusted over whiskers"),
    "whisker_matters": Quantity(("unit", "whisker"), "1", "whether a whisker's kernel differs from 0"),
    "whiskers_that_matter": Quantity(("unit",), "1", "whiskers whose kernel differs from 0, the surest first"),
    **ranged("past_kernel", ("unit", "past_lag"), "1", "factor on the rate after a spike of the unit itself"),
    "kernel_condition": Quantity((), "1", "condition number of the whiskers' columns, scaled"),
    "deviance_explained": Quantity(("unit",), "1", "share of the deviance explained in draws not seen"),
    "kernel_gain": Quantity(("unit",), "bit", "likelihood of unseen spikes over a steady rate's, per spike"),
    "n_blocks": Quantity(("unit",), "1", "blocks of the stimulus that are the draws; 0 where trials are"),
    "penalty": Quantity(("unit",), "1", "penalty on the squared coefficients of the whiskers"),
    "kernel_rate": Quantity(("unit",), "Hz", "mean rate over the bins that count"),
    # information
    **_information("spike_information", "bit", "information of one spike about the time in the stimulus"),
    **_information("information_rate", "bit/s", "information of single spikes about the time in the stimulus"),
    **_information("count_information", "bit", "information of the count in a bin about the time in the stimulus"),
    "informative": Quantity(("unit",), "1", "whether spikes inform on the stimulus beyond their interval of error"),
    "count_informative": Quantity(
        ("unit",), "1", "whether counts inform on the stimulus beyond their interval of error"
    ),
    "spike_reason": Quantity(("unit",), "1", "why the information of a spike cannot be estimated; empty if it can"),
}
