"""A virtual session at the stimulator: textures, a long whisker, 24 whiskers moved, simulated units, their analysis."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.mechanics.modes.straight import resonances
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.simulated.population import REST, THRESHOLD, draw_population, record_population
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Datasets, Progress
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.stimulus.array import replay_command
from vibrissa.stimulus.band import Band
from vibrissa.stimulus.waveform import PointMotion
from vibrissa.study.neurons.shown_unit import EXAMPLES, best_unit, example_units, shown_unit, unit_examples
from vibrissa.study.spec.cortex import LEAD, Cortex
from vibrissa.texture.surface import random_grating

if TYPE_CHECKING:
    import xarray as xr

BAND = Band(norm="mag")
NEAR = 10e-6  # [m] of the paper's mean threshold: the unit of Figure 8 is a usual one
TRUTH = ("unit_session", "unit_rat", "unit_whisker", "driven_by", "driving_whisker", "surround_gain",
         "true_threshold", "true_slope", "true_latency", "true_baseline")  # fmt: skip


def run_cortex(cortex: Cortex, progress: Progress | None = None) -> Datasets:
    """Simulate and analyse a population, whisker by whisker.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    dict of Datasets
        See :func:`gathered`.
    """
    whiskers, report = stimulated(cortex), progress or (lambda *_: None)
    blocks = []
    for done, whisker in enumerate(whiskers, 1):
        blocks.append(analyse_block(cortex, whisker))
        report("simulated units, by whisker", done, len(whiskers))
    return gathered(cortex, blocks)


def stimulated(cortex: Cortex) -> list[int]:
    """Whiskers that are the principal one of some unit, by their place in the command: one block of work each.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.

    Returns
    -------
    list of int
        Rising.
    """
    return [int(whisker) for whisker in np.unique(population(cortex).unit_whisker.values)]


def analyse_block(cortex: Cortex, whisker: int) -> xr.Dataset:
    """Record and analyse the units of one whisker. Nothing else is needed or changed: blocks may be done in any order.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.
    whisker : int
        One of :func:`stimulated`.

    Returns
    -------
    Dataset
        As of :func:`vibrissa.neural.coupling.analysis.analyse_units`, chance values adjusted over the units of this
        whisker.
    """
    spikes = recorded(cortex, _places(cortex, whisker))
    return analyse_units(spikes, motion_of(cortex, whisker), cortex.n_trials, analysis(cortex))


def gathered(cortex: Cortex, blocks: Sequence[xr.Dataset]) -> Datasets:
    """Put the blocks of all whiskers together, in the order of the units.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.
    blocks : sequence of Datasets
        One from :func:`analyse_block` for each of :func:`stimulated`, in that order.

    Returns
    -------
    dict of Datasets
        ``units``: what was found of each unit, and its truth, as Figure 9 needs both. For Figure 8 ``unit_examples``,
        rates of up to four units of one session, and ``spikes``,
        ``response``, ``motion`` and ``unit`` of the single unit whose fit explains most among those of a usual
        threshold.
    """
    import xarray as xr

    places = np.concatenate([_places(cortex, whisker) for whisker in stimulated(cortex)])
    joined = xr.concat(blocks, "unit", combine_attrs="override", join="exact").isel(unit=np.argsort(places))
    truth = population(cortex)
    units = joined.assign({name: truth[name] for name in TRUTH}).assign_attrs(told_of(cortex))
    usual = np.abs(units.threshold.values - THRESHOLD["SU"][0]) < NEAR
    place = best_unit(units, usual)
    spikes = recorded(cortex, np.array([place]))
    motion = motion_of(cortex, int(truth.unit_whisker[place]))
    shown = shown_unit(spikes, units.isel(unit=place), motion, cortex.n_trials, analysis(cortex))
    shown["response"].attrs["note"] = note(cortex)
    return {"units": units, EXAMPLES: _examples(cortex, units), **shown}


def _examples(cortex: Cortex, units: xr.Dataset) -> xr.Dataset:
    """The rates of a few units of one session."""
    places = example_units(units)
    spikes = recorded(cortex, np.array(places, int)) if places else units
    whisker = population(cortex).unit_whisker.values
    how: tuple[int, EnvelopeAnalysis] = (cortex.n_trials, analysis(cortex))
    return unit_examples(spikes, units, places, lambda place: motion_of(cortex, int(whisker[place])), *how)


def told_of(cortex: Cortex) -> dict[str, str | int | float]:
    """Attributes that say how the population was made.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.

    Returns
    -------
    dict
        Attributes of the table of units.
    """
    command = command_of(cortex)
    return {
        "label": "Simulated population",
        "cortex": json.dumps(asdict(cortex)),
        "n_whiskers": command.sizes["whisker"],
        "duration": command.sizes["time"] / cortex.sampling_rate,
        "band_low": BAND.low,
        "band_high": BAND.high,
        "refractory": REST.absolute,
        "note": note(cortex) + " Chance values are adjusted over the units of each whisker.",
    }


def note(cortex: Cortex) -> str:
    """How the stimulus was made, for the captions.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.

    Returns
    -------
    str
        Begins with a space.
    """
    first = float(resonances(cortex.whisker, cortex.posture.contact, 1).resonant_frequency[0])
    return (
        f" Stimulus: predicted motion {1e3 * cortex.distance:.0f} mm from the base, first mode at {first:.0f} Hz, "
        f"filtered ({command_of(cortex).attrs['filter']}), then scaled by {command_of(cortex).attrs['scale']:.1f} to a "
        f"mean envelope of {1e6 * cortex.mean_envelope:.0f} µm, chosen because the paper prints none; "
        f"{cortex.n_trials} presentations."
    )


def texture_motion(cortex: Cortex, rng: np.random.Generator) -> PointMotion:
    """Displacement near the base while one texture passes.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.
    rng : Generator
        Draws the texture.

    Returns
    -------
    PointMotion
        [m].
    """
    whisker, scan = cortex.whisker, cortex.scan
    prediction = predict(whisker, cortex.posture, random_grating(cortex.grating_length, rng=rng), scan)
    time = np.arange(LEAD, cortex.grating_length / scan.speed - LEAD, 1 / cortex.sampling_rate)
    point = np.array([1 - cortex.distance / whisker.length])
    displacement = whisker.length * prediction.displacement(time, point)[:, 0]
    first = float(resonances(whisker, cortex.posture.contact, 1).resonant_frequency[0])
    return PointMotion(displacement=displacement, sampling_rate=cortex.sampling_rate, resonance=first)


@lru_cache(maxsize=1)  # the same for all whiskers of a session
def command_of(cortex: Cortex) -> xr.Dataset:
    """Command of 24 whiskers, scaled to the mean envelope; see :func:`vibrissa.stimulus.array.replay_command`.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.

    Returns
    -------
    Dataset
        ``command`` (whisker, time) [m].
    """
    rng, rate = np.random.default_rng(cortex.texture_seed), cortex.sampling_rate
    motions = [texture_motion(cortex, rng) for _ in range(cortex.n_textures)]
    plain = replay_command(motions, sampling_rate=rate, band=BAND)
    found = float(analytic_envelope(plain.command.values[0])[0].mean())
    return replay_command(motions, sampling_rate=rate, band=BAND, scale=cortex.mean_envelope / found)


def motion_of(cortex: Cortex, whisker: int) -> xr.Dataset:
    """Motion of one whisker of the command, as a stimulus.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.
    whisker : int
        Its place in the command.

    Returns
    -------
    Dataset
        ``point_displacement`` (time) [m].
    """
    command = command_of(cortex)
    return dataset(time=command.time.values, point_displacement=command.command.values[whisker])


@lru_cache(maxsize=1)
def population(cortex: Cortex) -> xr.Dataset:
    """Units recorded: every n-th of :func:`vibrissa.neural.simulated.population.draw_population`.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.

    Returns
    -------
    Dataset
        Truth of each unit.
    """
    whole = draw_population(cortex.counts, rng=np.random.default_rng(cortex.population_seed))
    return whole.isel(unit=slice(None, None, cortex.every))


def recorded(cortex: Cortex, places: Integers) -> xr.Dataset:
    """Spikes of the units at these places, as they fire among all.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.
    places : (N,) array of int
        Places in :func:`population`.

    Returns
    -------
    Dataset
        Spikes in trials.
    """
    command, rng = command_of(cortex), np.random.default_rng(cortex.spike_seed)
    time, moved = command.time.values, command.command.values
    return record_population(population(cortex), time, moved, cortex.n_trials, rng=rng, only=places)


def analysis(cortex: Cortex) -> EnvelopeAnalysis:
    """How units are analysed: the delays of the other whiskers are left out of chance.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.

    Returns
    -------
    EnvelopeAnalysis
        Settings.
    """
    delays = np.unique(command_of(cortex).delay.values)[1:]
    return EnvelopeAnalysis(delays=tuple(delays.tolist()), bin_width=cortex.bin_width)


def _places(cortex: Cortex, whisker: int) -> Integers:
    return np.flatnonzero(population(cortex).unit_whisker.values == whisker)
