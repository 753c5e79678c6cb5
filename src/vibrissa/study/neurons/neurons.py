"""A user's recorded spikes and their stimulus: from the files to whether the envelope drives each unit."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.signal import periodogram

from vibrissa.errors import InputError
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.coupling.carrier import share_remark
from vibrissa.neural.coupling.presentation import JOINED
from vibrissa.neural.coupling.spontaneous import spontaneous_rates
from vibrissa.neural.io.tables.inputs import refuse_misplaced
from vibrissa.neural.io.tables.spikes import observed_trials
from vibrissa.neural.io.tables.stimuli import presented
from vibrissa.quantities.kinds import Progress
from vibrissa.study.neurons.inputs import read_recording
from vibrissa.study.neurons.rest import refuse_driven, remarks_on_rest
from vibrissa.study.neurons.shown_unit import EXAMPLES, best_unit, example_units, shown_unit, unit_examples
from vibrissa.study.neurons.trial_stimuli import end_to_end
from vibrissa.study.spec.neurons import Neurons

if TYPE_CHECKING:
    import xarray as xr

SAMPLES_PER_CYCLE = 6  # of the stimulus: with fewer its envelope may be wrong


class Analysed(NamedTuple):
    """Units as analysed, what they were analysed of, and what a reader should know of it."""

    units: xr.Dataset
    spikes: xr.Dataset
    stimulus: xr.Dataset
    n_trials: int
    how: EnvelopeAnalysis
    remarks: list[str]


def analyse_neurons(neurons: Neurons, folder: Path = Path(), progress: Progress | None = None) -> Analysed:
    """Read spikes and stimulus, and analyse the units.

    Parameters
    ----------
    neurons : Neurons
        The files, and how they are read and analysed.
    folder : Path
        Where relative paths start.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    Analysed
        Units and remarks.

    Raises
    ------
    InputError
        If a file is bad, or spikes and stimulus do not fit together; options go by the names of the verb ``neural``.
    """
    how = neurons.analysis()
    asked: dict[str, Any] = {"bin_width": neurons.bin_width, "around": neurons.spontaneous}
    asked |= {"window": neurons.window, "band": neurons.band}
    spikes, stimulus, n_trials, remarks = read_recording(neurons, neurons, folder, **asked, progress=progress)
    if progress is not None:
        progress("units", 0, 0)
    found = analyse_recording(spikes, stimulus, n_trials, how)
    return found._replace(remarks=[*remarks, *found.remarks])


def analyse_recording(spikes: xr.Dataset, stimulus: xr.Dataset, n_trials: int, how: EnvelopeAnalysis) -> Analysed:
    """Analyse the units of a recording that has been read.

    Parameters
    ----------
    spikes : Dataset
        In trials.
    stimulus : Dataset
        See :func:`vibrissa.neural.io.tables.stimuli.labelled_stimulus`; with the dimension ``trial`` where each trial
        had its own: these are joined, and their spontaneous rate is that of the trials before.
    n_trials : int
        Presentations.
    how : EnvelopeAnalysis
        Tests and fits.

    Returns
    -------
    Analysed
        Units and remarks; spikes and stimulus of joined trials as one presentation.

    Raises
    ------
    InputError
        If spikes and stimulus do not fit together.
    """
    refuse_driven(spikes, stimulus, how.spontaneous)
    remarks = remarks_on_rest(spikes, stimulus, how.spontaneous)
    if "trial" in stimulus.dims:
        found = _analyse_joined(spikes, stimulus, n_trials, how)
        return found._replace(remarks=[*remarks, *found.remarks])
    units = analyse_units(spikes, stimulus, n_trials, how)
    remarks += [*_coarse(stimulus), *_early(units), *filter(None, [share_remark(units)])]
    return Analysed(units, spikes, stimulus, n_trials, how, [*remarks, *_presented_once(units, n_trials)])


def _analyse_joined(spikes: xr.Dataset, stimulus: xr.Dataset, n_trials: int, how: EnvelopeAnalysis) -> Analysed:
    """Analyse trials, each with its own stimulus, as one presentation; before their onsets as they were."""
    refuse_misplaced(spikes, stimulus, n_trials, spontaneous=how.spontaneous, skip=how.skip)
    rates = spontaneous_rates(spikes, observed_trials(spikes, n_trials), how.spontaneous)
    joined, envelope, remarks = end_to_end(spikes, stimulus, how)
    found = analyse_recording(joined, envelope, 1, replace(how, spontaneous=None, band=None))
    about = {JOINED: n_trials, **how.as_attributes()}
    units = found.units.assign(spontaneous_rate=found.units.spontaneous_rate.copy(data=rates)).assign_attrs(about)
    return found._replace(units=units, remarks=[*remarks, *found.remarks])


def neuron_results(neurons: Neurons, folder: Path = Path(), progress: Progress | None = None) -> dict[str, xr.Dataset]:
    """Datasets of one recording.

    Parameters
    ----------
    neurons, folder, progress
        As in :func:`analyse_neurons`.

    Returns
    -------
    dict of Datasets
        ``units``, with the attributes ``label``, ``source``, ``remarks`` (JSON); for Figure 8 ``unit_examples``,
        ``spikes``, ``response``, ``motion`` and, if it is driven, ``unit`` of the unit whose fit explains most.

    Raises
    ------
    InputError
        As :func:`analyse_neurons`; names the recording.
    """
    try:
        found = analyse_neurons(neurons, folder, progress)
    except InputError as error:
        raise error.renamed(f"[[neural]] {neurons.label}: {error.quantity}") from error
    attrs = {"label": neurons.label, "source": Path(neurons.spikes).name, "remarks": json.dumps(found.remarks)}
    place = best_unit(found.units)
    unit = found.units.isel(unit=place)
    shown = shown_unit(found.spikes, unit, found.stimulus, found.n_trials, found.how)
    shown["spikes"].attrs.setdefault("source", Path(neurons.spikes).name)
    if found.units.sizes["unit"] > 1:
        shown["response"].attrs["note"] = f" Of {found.units.sizes['unit']} units, {_chosen(unit)}."
    how: tuple[int, EnvelopeAnalysis] = (found.n_trials, found.how)
    places = example_units(found.units)
    shown[EXAMPLES] = unit_examples(found.spikes, found.units, places, lambda _: found.stimulus, *how)
    return {"units": found.units.assign_attrs(attrs), **shown}


def _chosen(unit: xr.Dataset) -> str:
    """Why this unit is shown."""
    name = str(unit.unit_name.values)
    if not bool(unit.significant):
        return f"none of which passes the test, {name}, whose rate is most like the envelope"
    return f"{name}, whose fit explains most" if bool(unit.identified) else f"{name}, the most like the envelope"


def _presented_once(units: xr.Dataset, n_trials: int) -> list[str]:
    """Say why a recording of one presentation gives no interval."""
    if n_trials > 1 or not units.significant.any():
        return []
    why = "intervals come from resampled trials, and how a unit varies from one to the next is not known"
    return [f"one presentation: no interval of threshold, slope or latency; {why}"]


def _coarse(stimulus: xr.Dataset) -> list[str]:
    """Say that a carrier is near half the sampling rate."""
    time, values, _, is_envelope = presented(stimulus)
    if is_envelope:
        return []
    rate = (len(time) - 1) / (time[-1] - time[0])
    frequency, power = periodogram(values, rate)
    carrier = float(np.sum(frequency * power) / np.sum(power))
    if rate >= SAMPLES_PER_CYCLE * carrier:
        return []
    return [f"the stimulus, about {carrier:.0f} Hz, is sampled at {rate:.0f} Hz: its envelope may be wrong"]


def _early(units: xr.Dataset) -> list[str]:
    """Say how many units pass the test at a negative lag, which the paper's form tries."""
    passed = units.significant.values
    early = int((passed & (units.envelope_lag.values < 0)).sum())
    if not early:
        return []
    why = "their rate leads the envelope, and no response comes before its stimulus"
    return [f"{early} of {passed.sum()} units that pass the test do so at a negative lag: {why}; see reason"]
