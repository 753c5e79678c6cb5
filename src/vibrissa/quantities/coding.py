"""What units code: surround maps, demodulation, drives, kernels, information."""

from __future__ import annotations

from vibrissa.quantities.quantity import Quantity


def _ends(name: str, dims: tuple[str, ...], unit: str, long_name: str) -> dict[str, Quantity]:
    """A number and the ends of its 95 % interval."""
    return {
        name: Quantity(dims, unit, long_name),
        f"{name}_low": Quantity(dims, unit, f"{long_name}, lower end of the 95 % interval"),
        f"{name}_high": Quantity(dims, unit, f"{long_name}, upper end of the 95 % interval"),
    }


def _information(name: str, unit: str, long_name: str) -> dict[str, Quantity]:
    """An information, corrected with its interval, as counted, and by extrapolation."""
    return _ends(name, ("unit",), unit, long_name) | {
        f"{name}_plain": Quantity(("unit",), unit, f"{long_name}, as counted"),
        f"{name}_extrapolated": Quantity(("unit",), unit, f"{long_name}, extrapolated to many trials"),
    }


CODING: dict[str, Quantity] = {
    # surround maps
    **_ends("surround_weight", ("unit", "whisker"), "1/(s m)", "rise of the rate above the threshold of each whisker"),
    "surround_p_value": Quantity(("unit", "whisker"), "1", "p-value of a whisker, adjusted over those of the unit"),
    "surround_verdict": Quantity(("unit", "whisker"), "1", "whether a whisker drives, suppresses, does nothing"),
    "strongest_whisker": Quantity(("unit",), "1", "whisker of the largest weight"),
    "condition_number": Quantity((), "1", "condition number of the whiskers' hinged envelopes, scaled"),
    "weight_inflation": Quantity(("whisker",), "1", "variance of a weight over that beside uncorrelated copies"),
    "copy_likeness": Quantity(("whisker",), "1", "largest |r| with another copy at lags up to the latest latency"),
    "likest_whisker": Quantity(("whisker",), "1", "whisker whose copy is most alike"),
    # which drive
    "drive": Quantity(("drive",), "1", "what of the motion may drive a unit"),
    **_ends("drive_gain", ("unit", "drive"), "bit", "likelihood of unseen spikes over a steady rate's, per spike"),
    **_ends("drive_loss", ("unit", "drive"), "bit", "likelihood of unseen spikes under the best drive's, per spike"),
    "drive_latency": Quantity(("unit", "drive"), "s", "delay from drive to rate"),
    "drive_likeness": Quantity(("drive",), "1", "correlation of a drive with the envelope over the bins that count"),
    "best_drive": Quantity(("unit",), "1", "drive that foresees unseen spikes best, or cannot tell"),
    "carrier_frequency": Quantity(("stimulus",), "Hz", "mean frequency of a stimulus, weighted by power"),
    # envelope or phase
    **_ends("demodulation_index", ("unit",), "1", "modulation by the envelope less that by the phase, over their sum"),
    **_ends("envelope_modulation", ("unit",), "1", "rms of the rate's part that follows the envelope, over the mean"),
    **_ends("phase_modulation", ("unit",), "1", "rms of the rate's part that follows the phase, over the mean"),
    **_ends("vector_strength", ("unit",), "1", "vector strength of what is locked to the carrier"),
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
    **_ends("whisker_kernel", ("unit", "whisker", "kernel_lag"), "1/m", "rise of ln(rate) with the envelope, per bin"),
    **_ends("whisker_effect", ("unit", "whisker"), "1/m", "rise of ln(rate) with a lasting envelope"),
    "whisker_p_value": Quantity(("unit", "whisker"), "1", "p-value of a whisker's kernel, adjusted over whiskers"),
    "whisker_matters": Quantity(("unit", "whisker"), "1", "whether a whisker's kernel differs from 0"),
    **_ends("past_kernel", ("unit", "past_lag"), "1", "factor on the rate after a spike of the unit itself"),
    "kernel_condition": Quantity((), "1", "condition number of the whiskers' columns, scaled"),
    "deviance_explained": Quantity(("unit",), "1", "share of the deviance explained in trials not seen"),
    "penalty": Quantity(("unit",), "1", "penalty on the squared coefficients of the whiskers"),
    "kernel_rate": Quantity(("unit",), "Hz", "mean rate over the bins that count"),
    # information
    **_information("spike_information", "bit", "information of one spike about the time in the stimulus"),
    **_information("information_rate", "bit/s", "information of single spikes about the time in the stimulus"),
    **_information("count_information", "bit", "information of the count in a bin about the time in the stimulus"),
    "informative": Quantity(("unit",), "1", "whether spikes tell of the stimulus beyond their interval of error"),
}
