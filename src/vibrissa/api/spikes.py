"""Spikes: read, tested against the envelope of a stimulus, and simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrissa.api.motion import Motion
from vibrissa.api.remarks import remark
from vibrissa.api.shared.arguments import names_arguments
from vibrissa.errors import ConflictError, FormatError, InputError, MissingError, ShapeError
from vibrissa.mechanics.whisking.slow_prediction import SlowPrediction
from vibrissa.mechanics.whisking.swing_prediction import SwingPrediction

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.forward.forward import TrialSettings

Seconds = tuple[float, float]


@names_arguments
def read_spikes(spikes: Any, *, trials: Any = None, **how: Any) -> xr.Dataset:
    """Spikes of a recording as one flat table of events.

    Parameters
    ----------
    spikes : path, DataFrame, TsGroup, neo object, BaseSorting or open NWB file
        Files: CSV, NWB, Plexon, NeuroExplorer, folders of phy and SpikeInterface. See
        :func:`vibrissa.api.objects.spikes.as_spikes`.
    trials : optional
        Onsets and ends of the trials, where the spikes are on the session's clock.
    **how
        As of that function.

    Returns
    -------
    Dataset
        ``spike_time`` [s], ``spike_unit`` and, with trials, ``spike_trial`` (spike); ``unit_name`` (unit). The
        coordinates ``unit`` and, of a table of trials, ``trial`` number them: select or sort by them as xarray does
        (``isel(unit=[1])``, ``sortby("unit_name")``), and the functions of this package leave out the spikes of others.
        Files that number trials, such as a stimulus of each, are taken by these numbers.

    Raises
    ------
    InputError
        If they cannot be read.

    Examples
    --------
    >>> import vibrissa as vb
    >>> vb.read_spikes(vb.sample_data("spikes.csv")).unit_name.values.tolist()
    ['MU001', 'MU002', 'SU001']
    """
    from vibrissa.api.objects.spikes import as_spikes
    from vibrissa.neural.io.tables.selection import labelled
    from vibrissa.study.neurons.inputs import remarks_on

    table = as_spikes(spikes, trials=trials, **how)
    remark(*remarks_on(table.drop_attrs().assign_attrs(spikes_shared=table.attrs.get("spikes_shared", 0))))
    return labelled(table)


@names_arguments
def envelope_coupling(
    spikes: Any,
    stimulus: Any,
    *,
    n_trials: int | None = None,
    unit: str | None = None,
    envelope: bool = False,
    null: Literal["circular", "paper2014"] = "circular",
    fit: Literal["forward", "paper2014"] = "forward",
    level: float = 0.01,
    bin_width: float = 0.01,
    skip: float = 1.0,
    window: Seconds | None = None,
    band: Seconds | None = None,
    delays: Sequence[float] = (),
    spontaneous: Seconds | None = None,
    seed: int = 0,
) -> xr.Dataset:
    """Whether the envelope of a stimulus drives each unit: threshold, slope and latency, with 95 % intervals.

    Parameters
    ----------
    spikes : Dataset or any object that ``read_spikes`` takes
        In trials, seconds from the stimulus' onset. The few that lie beyond the stimulus are left out with a remark.
    stimulus : Dataset, DataArray, Tsd, AnalogSignal or path
        As played: displacement [m], or an angle or any other motion in the unit it states. One presentation, or, of a
        file, one of each trial: with a column ``trial``, or on the session's clock, from which the trials are cut.
    n_trials : int, optional
        Presentations, silent ones included; where the spikes do not hold it.
    unit : str, optional
        Unit of a stimulus that states none: ``"um"``, ``"deg"``, ``"dB"``; metres by default.
    envelope : bool
        Whether the stimulus is an envelope already.
    null : {"circular", "paper2014"}
        Chance: all circular shifts, adjusted over units, or the paper's 300 shuffles.
    fit : {"forward", "paper2014"}
        A hinge seen through the bins, or the paper's two segments.
    level : float
        Largest p-value that counts as significant.
    bin_width, skip : float
        Width of the bins, and time left out at the start [s].
    window, band, spontaneous : (float, float), optional
        Part of the stimulus [s]; band of the carrier [Hz]; window without stimulus [s].
    delays : sequence of float
        Delays at which other whiskers had the same stimulus [s].
    seed : int
        Of the resampled trials.

    Returns
    -------
    Dataset
        On (unit): ``significant``, ``p_value``, ``threshold`` in the SI unit of the stimulus
        (its attribute ``units``: metres of a displacement), ``slope``, ``latency`` with ``_low`` and ``_high``,
        ``reason`` where they cannot be estimated. It holds spikes and stimulus too, which ``plot_unit`` draws.

    Raises
    ------
    InputError
        If spikes and stimulus do not fit together or are swapped, or the number of trials is not known.

    Examples
    --------
    >>> import vibrissa as vb
    >>> spikes, stimulus = vb.sample_data("spikes.csv"), vb.sample_data("spikes-stimulus.csv")
    >>> units = vb.envelope_coupling(spikes, stimulus)
    >>> units.significant.values.tolist()
    [True, True, True]
    """
    from vibrissa.neural.coupling.analysis import EnvelopeAnalysis
    from vibrissa.neural.io.tables.inputs import require_whole
    from vibrissa.neural.io.tables.selection import labelled
    from vibrissa.study.neurons.inputs import remarks_on, silent_end
    from vibrissa.study.neurons.neurons import analyse_recording
    from vibrissa.study.neurons.silent_trials import silent_trials
    from vibrissa.study.neurons.trial_stimuli import refuse_other_trials

    how = EnvelopeAnalysis(
        null=null,
        fit=fit,
        level=level,
        bin_width=bin_width,
        skip=skip,
        window=window,
        band=band,
        delays=tuple(delays),
        spontaneous=spontaneous,
        seed=seed,
    )
    named = str(getattr(stimulus, "name", "")) + str(getattr(stimulus, "attrs", {}).get("long_name", ""))
    if "envelope" in named and not envelope:
        raise ConflictError("stimulus", "must be a displacement", "an envelope", "say so: envelope=True")
    table, shown, remarks = _spikes_and_stimulus(spikes, stimulus, unit, envelope, band, spontaneous, window)
    known = table.attrs.get("n_trials")
    if None not in (known, n_trials) and known != n_trials:
        raise ConflictError("n_trials", f"must be left out: the spikes have {known} trials", n_trials)
    if (count := known if n_trials is None else n_trials) is None:
        raise MissingError("n_trials", "must be given", remedy="count silent presentations too")
    require_whole("n_trials", count)
    refuse_other_trials(shown, int(count), str(stimulus))
    found = analyse_recording(table, shown, int(count), how)
    analysed = window or (float(shown.time[0]), float(shown.time[-1]))
    silence = [*silent_trials(table, int(count)), *silent_end(table, *analysed)]
    remark(*remarks, *remarks_on(table), *silence, *found.remarks)
    known = {"spike_time", "spike_unit", "spike_trial", "unit_observed"} & set(found.spikes.data_vars)
    units = found.units.merge(found.spikes[sorted(known)], combine_attrs="override")
    return labelled(units.merge(found.stimulus, combine_attrs="override"))


def _spikes_and_stimulus(
    spikes: Any,
    stimulus: Any,
    unit: str | None,
    envelope: bool,
    band: Seconds | None,
    spontaneous: Seconds | None,
    window: Seconds | None,
) -> tuple[xr.Dataset, xr.Dataset, list[str]]:
    """Both as datasets, and remarks on both; refused in one line if they are swapped."""
    from vibrissa.api.objects.signals import as_signal
    from vibrissa.api.objects.spikes import as_spikes
    from vibrissa.study.neurons.session_stimuli import stimulus_in_trials
    from vibrissa.study.neurons.stimuli import SESSION
    from vibrissa.study.neurons.trial_stimuli import of_the_trials, spikes_within

    def reads(reader: Callable[[Any], object], thing: Any) -> bool:
        try:
            reader(thing)
        except InputError:
            return False
        return True

    try:
        table = as_spikes(spikes)
    except InputError as error:
        swapped = reads(as_spikes, stimulus) and (reads(as_signal, spikes) or not reads(as_signal, stimulus))
        if not swapped:
            raise
        remedy = "vb.envelope_coupling(spikes, stimulus)"
        raise ConflictError("spikes, stimulus", "must be in this order", "them swapped", remedy) from error
    shown, remarks = _shown(stimulus, unit, envelope, band)
    if shown.attrs.get("clock") == SESSION:
        if "trial_start" not in table:
            rule, found = "must have the times of their trials", "a stimulus on the session's clock"
            raise MissingError("spikes", rule, found, "vb.read_spikes(spikes, trials=onsets)")
        shown, more = stimulus_in_trials(shown, table, str(stimulus), band, spontaneous=spontaneous)
        remarks = [*remarks, *more]
    else:
        shown = of_the_trials(shown, table, str(stimulus))
    if "spike_trial" not in table:
        raise MissingError("spikes", "must be in trials", remedy="vb.read_spikes(spikes, trials=onsets)")
    within, beyond = spikes_within(table, shown, spontaneous, window)
    return within, shown, [*remarks, *beyond]


def _shown(stimulus: Any, unit: str | None, envelope: bool, band: Seconds | None) -> tuple[xr.Dataset, list[str]]:
    """The stimulus, by what it is, and remarks on it."""
    from vibrissa.api.objects.signals import as_signal
    from vibrissa.neural.io.tables.stimuli import OTHERS, labelled_stimulus
    from vibrissa.neural.io.tables.stimulus_csv import checked_stimulus
    from vibrissa.study.neurons.stimuli import named_stimulus, read_stimulus
    from vibrissa.study.spec.given import StimulusInput
    from vibrissa.tables.units import in_si

    if isinstance(stimulus, str | PathLike):
        return read_stimulus(StimulusInput(stimulus=str(stimulus), signal_unit=unit, envelope=envelope), band=band)
    stated = unit or str(getattr(stimulus, "attrs", {}).get("units", ""))
    if not envelope and in_si(1.0, stated)[1] not in OTHERS:
        signal, known = as_signal(stimulus, unit=unit), "m"
    else:
        signal = as_signal(stimulus, unit=unit, quantity=None)
        known = "m" if signal.attrs["units"] == "1" else signal.attrs["units"]
    if signal.ndim > 1:
        found = f"{signal.shape[0]} channels"
        raise ShapeError("stimulus", "must be one channel", found, "take one: stimulus[0]")
    source = signal.attrs["source"]
    shown = labelled_stimulus(signal.time.values, signal.values, known, envelope=envelope, attrs={"source": source})
    return named_stimulus(checked_stimulus(shown, source), source, band)


@names_arguments
def simulate_units(
    motion: Any,
    units: int | xr.Dataset = 20,
    *,
    n_trials: int = 40,
    rate: float | None = None,
    distance: float | None = None,
    mean_envelope: float | None = None,
    unit: str | None = None,
    seed: int = 0,
) -> xr.Dataset:
    """Spikes of units that are driven by the envelope of a whisker's motion near its base.

    Parameters
    ----------
    motion : Motion, or a signal
        A prediction, or the displacement of a point [m] (DataArray, Tsd, AnalogSignal, path).
    units : int or Dataset
        How many, drawn as the paper found them; or units of :func:`vibrissa.neural.simulated.driven.read_driven`.
    n_trials : int
        Presentations.
    rate : float, optional
        Samples per second of a predicted motion [Hz]; 20,000 by default.
    distance : float, optional
        From the base, of the point of a predicted motion whose envelope drives the units [m]; 5 mm by default.
    mean_envelope : float, optional
        Scale the motion so that its mean envelope is this [m], as a stimulator may.
    unit : str, optional
        Unit of a signal that states none: ``"um"``; metres by default.
    seed : int
        Of units and spikes.

    Returns
    -------
    Dataset
        Spikes in trials, the units' truth (``true_threshold`` …), and the stimulus, ``point_displacement`` (time) [m].

    Raises
    ------
    InputError
        If the point is not on the whisker, nothing moves, or an option does not go with the motion.

    Examples
    --------
    >>> import numpy as np
    >>> import vibrissa as vb
    >>> surface = vb.random_grating(0.3, rng=1)
    >>> motion = vb.scan(vb.atlas("C2"), vb.Posture(contact=0.29, base_angle=1.2), surface, speed=0.1)
    >>> spikes = vb.simulate_units(motion, 3, n_trials=10)
    >>> spikes.sizes["unit"]
    3
    """
    from vibrissa.mechanics.free_end.free_end_prediction import FreeEndPrediction
    from vibrissa.mechanics.rod.rod_prediction import RodPrediction
    from vibrissa.mechanics.scan.sampled import sampling_times
    from vibrissa.neural.io.tables.selection import labelled
    from vibrissa.neural.simulated.driven import draw_driven
    from vibrissa.study.forward.forward import TrialSettings, spikes_of

    if isinstance(units, int | np.integer):
        population = draw_driven(int(units), rng=np.random.default_rng(seed))
    elif hasattr(units, "data_vars"):
        population = units
    else:
        raise FormatError("units", "must be a whole number, or a dataset of units", repr(units)[:60], "20, for example")
    about = {} if distance is None else {"distance": distance}
    how = TrialSettings(n_trials=n_trials, seed=seed, mean_envelope=mean_envelope, **about)
    if not isinstance(motion, Motion):
        for name, value in (("rate", rate), ("distance", distance)):
            if value is not None:
                raise ConflictError(name, "must go with a Motion", value, "leave it out: a signal is of one point")
        return labelled(_of_signal(motion, unit, population, how))
    if unit is not None:
        raise ConflictError("unit", "must go with a signal", unit, "leave it out: a Motion is in metres")
    if isinstance(motion.prediction, SlowPrediction | SwingPrediction):
        raise ConflictError("motion", "must be of one posture", "one that changes")
    prediction, rate = motion.prediction, 20e3 if rate is None else rate
    if isinstance(prediction, RodPrediction | FreeEndPrediction):
        times = prediction.times(rate)
    else:
        times = sampling_times(prediction, rate)
    return labelled(spikes_of(prediction, times, population, how))


def _of_signal(signal: Any, unit: str | None, population: xr.Dataset, how: TrialSettings) -> xr.Dataset:
    """Spikes of units that a signal drives, scaled as asked."""
    from vibrissa.api.objects.signals import as_signal
    from vibrissa.neural.simulated.driven import fire

    shown = as_signal(signal, unit=unit)
    scale = how.scaling(shown.to_numpy())
    spikes = fire(population, shown.time.to_numpy(), scale * shown.to_numpy(), how.n_trials, seed=how.seed)
    return spikes.assign_attrs(motion_scale=scale)
