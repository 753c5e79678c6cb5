"""Clusters that hold the spikes of several neurons, by their waveforms: they fall into several groups."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Integers
from vibrissa.neural.io.formats.traces import part

COMPONENTS = 3  # of the waveforms, in which groups are sought
LEAST_SPIKES = 40  # below which no groups are sought
LEAST_SHARE = 0.1  # of the spikes that a group holds; smaller ones are overlapping spikes and drift
MOST_SPIKES = 2000  # of a unit that are looked at
DIP = 3.0  # isocut's threshold; SpikeInterface's own, 2, also splits what sorters align a sample apart
SHIFTS = (0, -2, -1, 1, 2)  # samples by which waveforms are moved onto their mean before groups are sought


def waveform_groups(waveforms: NDArray[Any], seed: int = 0) -> int:
    """Groups into which the waveforms of a unit fall, by ISO-SPLIT (Magland and Barnett 2015).

    Clusters are joined unless the density between them dips, so a single neuron whose amplitude varies has one group,
    whatever the shape of its distribution.

    Parameters
    ----------
    waveforms : (N, samples) array
        Of the spikes of one unit on one electrode.
    seed : int
        Of the clusters with which the search begins.

    Returns
    -------
    int
        Groups that hold a tenth of the spikes or more; 1 with fewer than 40 spikes, which show none.
    """
    if len(waveforms) < LEAST_SPIKES:
        return 1
    aligned = _aligned(np.asarray(waveforms, float))
    centred = aligned - aligned.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2][:COMPONENTS]
    isosplit = part("sortingcomponents.clustering.isosplit_isocut").isosplit
    starts = min(200, len(waveforms) // 20)  # the search asks for ten spikes in each, and a reserve
    label = isosplit(np.ascontiguousarray(centred @ axes.T), n_init=starts, isocut_threshold=DIP, seed=seed)
    sizes = np.unique(np.asarray(label), return_counts=True)[1]
    return max(int((sizes >= LEAST_SHARE * len(waveforms)).sum()), 1)


def _aligned(waveforms: NDArray[Any]) -> NDArray[Any]:
    """Waveforms moved by the samples that bring each nearest to their mean."""
    moved = np.array([np.roll(waveforms, shift, axis=1) for shift in SHIFTS])
    best = (moved @ waveforms.mean(axis=0)).argmax(axis=0)
    return np.asarray(moved[best, np.arange(len(waveforms))])


def groups_of_units(
    traces: Any, spikes: NDArray[Any], channels: Integers, span: tuple[int, int], seed: int
) -> Integers:
    """Groups of waveforms of each unit of a sorting.

    Parameters
    ----------
    traces : spikeinterface.BaseRecording
        Filtered.
    spikes : structured array
        SpikeInterface's vector of spikes.
    channels : (U,) array of int
        Channel on which each unit is largest.
    span : (int, int)
        Samples of a waveform before and after its spike.
    seed : int
        Of the spikes that are looked at, and of the search.

    Returns
    -------
    (U,) array of int
        1 for a unit of one neuron.
    """
    chosen = _some(spikes, channels.size, seed)
    sparse = np.zeros((channels.size, traces.get_num_channels()), bool)
    sparse[np.arange(channels.size), channels] = True
    extract = part("core.waveform_tools").extract_waveforms_to_single_buffer
    how = {"mode": "shared_memory", "return_in_uV": False, "copy": True, "n_jobs": 1, "progress_bar": False}
    shapes = extract(traces, spikes[chosen], *span, dtype="float32", sparsity_mask=sparse, **how)[..., 0]
    units = spikes["unit_index"][chosen]
    return np.array([waveform_groups(shapes[units == k], seed) for k in range(channels.size)], int)


def _some(spikes: NDArray[Any], units: int, seed: int) -> Integers:
    """Indices of at most this number of spikes of each unit, drawn at random, ascending."""
    rng = np.random.default_rng(seed)
    every = [np.flatnonzero(spikes["unit_index"] == k) for k in range(units)]
    some = [one if one.size <= MOST_SPIKES else rng.choice(one, MOST_SPIKES, replace=False) for one in every]
    return np.sort(np.concatenate(some))
