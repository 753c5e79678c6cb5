"""Signal to noise of units: as their file states it, or from their waveforms."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from vibrissa.arrays import Array

# variables that a reader or a sorter gives, and where they are from; the smallest waveform is the paper's
GIVEN = {"unit_snr": "file", "snr_smallest": "smallest waveform", "snr_mean": "mean waveform"}


class UnitSnr(NamedTuple):
    """Signal to noise of units.

    Attributes
    ----------
    snr : (U,) array
        NaN where it is not measured.
    source : list of str
        Where each is from; empty where it is not measured.
    measured : dict of str to (U,) array
        ``snr_smallest`` and ``snr_mean``, each where it is known.
    """

    snr: Array
    source: list[str]
    measured: dict[str, Array]


def waveform_snr(mean: Array, sd: Array) -> Array:
    """Peak-to-peak of the mean waveform over the rms of what the waveforms have beside it.

    Twice the ratio of Kelly et al. (2007), who divide by two standard deviations: with one it lies on the scale of the
    paper, peak-to-peak over the rms of the noise. The paper takes the smallest waveform of a unit, not the mean one.

    Parameters
    ----------
    mean, sd : (U, samples) arrays
        Mean of the waveforms of each unit on one electrode, and their standard deviation at each sample; in one unit.

    Returns
    -------
    (U,) array
        NaN where the deviation is not known or is 0.
    """
    known = np.isfinite(mean) & np.isfinite(sd)
    height = np.max(np.where(known, mean, -np.inf), axis=1) - np.min(np.where(known, mean, np.inf), axis=1)
    power, count = np.where(known, sd, 0.0) ** 2, known.sum(axis=1)
    noise = np.sqrt(power.sum(axis=1) / np.maximum(count, 1))
    measured = (count > 0) & (noise > 0)
    return np.where(measured, height / np.where(measured, noise, 1.0), np.nan)


def unit_snr(spikes: xr.Dataset) -> UnitSnr:
    """Signal to noise of each unit: what its file states, else of its smallest waveform, else of its mean one.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`, with ``unit_snr``, ``snr_smallest`` or
        ``snr_mean``, or with ``unit_waveform`` and ``unit_waveform_sd``, where its reader has them.

    Returns
    -------
    UnitSnr
        Values and sources.
    """
    snr, source = np.full(spikes.sizes["unit"], np.nan), [""] * spikes.sizes["unit"]
    known = {name: spikes[name].values for name in GIVEN if name in spikes}
    words = {name: GIVEN[name] for name in known}
    if known and spikes.attrs.get("snr_source"):  # of a column or table of the file, which comes first
        words[next(iter(known))] = str(spikes.attrs["snr_source"])
    if "snr_mean" not in known and "unit_waveform" in spikes and "unit_waveform_sd" in spikes:
        known["snr_mean"] = waveform_snr(spikes.unit_waveform.values, spikes.unit_waveform_sd.values)
    for name, values in known.items():
        for k in np.flatnonzero(np.isnan(snr) & np.isfinite(values)):
            snr[k], source[k] = values[k], words.get(name, GIVEN[name])
    return UnitSnr(snr, source, {name: values for name, values in known.items() if name != "unit_snr"})
