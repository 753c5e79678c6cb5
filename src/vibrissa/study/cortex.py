"""A virtual session at the stimulator: textures, a long whisker, 24 whiskers moved, simulated units, their analysis."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.mechanics.modes import resonances
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.superposition import Scan, predict
from vibrissa.neural.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.population import REST, THRESHOLD, Counts, draw_population, record_population
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.stimulus.array import replay_command
from vibrissa.stimulus.band import Band
from vibrissa.stimulus.waveform import Motion
from vibrissa.study.shown_unit import best_unit, shown_unit
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr

Datasets = dict[str, "xr.Dataset"]
Progress = Callable[[str, int, int], None]

LEAD = 0.05  # [s] left out at both ends of a texture, where the whisker meets and leaves it
BAND = Band(norm="mag")
NEAR = 10e-6  # [m] of the paper's mean threshold: the unit of Figure 8 is a usual one
TRUTH = ("unit_session", "unit_rat", "unit_whisker", "driven_by", "driving_whisker", "surround_gain",
         "true_threshold", "true_slope", "true_latency", "true_baseline")  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Cortex:
    """A simulated population that the 24-whisker stimulator drives with a whisker's motion on textures.

    As in the paper's Methods, textures are scanned, the motion near the base is read, filtered to the stimulator's
    band, joined into a loop of 10 s and given to 24 whiskers with delays. The whisker is a long one, whose first mode
    lies within the band. The units are drawn with the paper's counts, thresholds and slopes: what comes out of them
    tests the analysis, not the brain.

    Attributes
    ----------
    counts : {"results", "methods"}
        Which of the paper's two counts of units: 170 single and 344 multi-units, or 143 and 289.
    every : int
        Every n-th unit of these is recorded; 1 for all.
    n_trials : int
        Presentations; the paper's 40 to 100.
    n_textures : int
        Textures that are scanned one after the other.
    whisker : Whisker
        The whisker whose motion is replayed.
    posture : Posture
        How it touches the textures.
    scan : Scan
        How they are drawn past it.
    distance : float
        From the base to where the motion is read [m].
    grating_length : float
        Length of a texture [m].
    sampling_rate : float
        Of the command [Hz].
    mean_envelope : float
        Mean envelope to which the command is scaled [m]: chosen, since the paper prints no amplitude.
    bin_width : float
        Width of the bins [s].
    texture_seed : int
        Of the textures.
    population_seed : int
        Of who the units are.
    spike_seed : int
        Of their spikes.
    """

    counts: Counts = "results"
    every: int = 1
    n_trials: int = 100
    n_textures: int = 3
    whisker: Whisker = field(default_factory=lambda: Whisker(length=0.055, cone_angle=1.2e-3, tip=0.05))
    posture: Posture = field(default_factory=lambda: Posture(contact=0.29, base_angle=1.2))
    scan: Scan = field(default_factory=lambda: Scan(speed=0.1, damping=0.11))
    distance: float = 5e-3
    grating_length: float = 0.36
    sampling_rate: float = 4000.0
    mean_envelope: float = 55e-6
    bin_width: float = 0.01
    texture_seed: int = 1
    population_seed: int = 2
    spike_seed: int = 3

    def __post_init__(self) -> None:
        for name in ("every", "n_trials", "n_textures"):
            if not getattr(self, name) >= 1:
                raise InputError(f"Cortex.{name}", "must be at least 1", getattr(self, name))
        for name in ("mean_envelope", "sampling_rate", "bin_width"):
            if not 0 < getattr(self, name) < np.inf:
                raise InputError(f"Cortex.{name}", "must be positive", getattr(self, name))
        for name in ("texture_seed", "population_seed", "spike_seed"):
            if getattr(self, name) < 0:
                raise InputError(f"Cortex.{name}", "must be zero or positive", getattr(self, name))
        if not 0 < self.distance < self.whisker.length:
            raise InputError("Cortex.distance", "must lie on the whisker (m)", self.distance)
        if not self.grating_length > 2 * LEAD * self.scan.speed:
            rule = f"must be longer than what passes in {2 * LEAD:g} s"
            raise InputError("Cortex.grating_length", rule, self.grating_length)


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
    whiskers, tell = stimulated(cortex), progress or (lambda *_: None)
    blocks = []
    for done, whisker in enumerate(whiskers, 1):
        blocks.append(analyse_block(cortex, whisker))
        tell("simulated units, by whisker", done, len(whiskers))
    return gathered(cortex, blocks)


def stimulated(cortex: Cortex) -> list[int]:
    """Whiskers that are the principal one of some unit, by their place in the command: one block of work each."""
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
        As of :func:`vibrissa.neural.analysis.analyse_units`, chance values adjusted over the units of this whisker.
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
        ``units``: what was found of each unit, and its truth, as Figure 9 needs both. For Figure 8 ``spikes``,
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
    return {"units": units, **shown}


def told_of(cortex: Cortex) -> dict[str, str | int | float]:
    """Attributes that say how the population was made."""
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
    """How the stimulus was made, for the captions."""
    first = float(resonances(cortex.whisker, cortex.posture.contact, 1).resonant_frequency[0])
    return (
        f" Stimulus: predicted motion {1e3 * cortex.distance:.0f} mm from the base, first mode at {first:.0f} Hz, "
        f"filtered to 0.1–83 Hz forwards and backwards, then scaled by {command_of(cortex).attrs['scale']:.1f} to a "
        f"mean envelope of {1e6 * cortex.mean_envelope:.0f} µm, chosen because the paper prints none; "
        f"{cortex.n_trials} presentations."
    )


def texture_motion(cortex: Cortex, rng: np.random.Generator) -> Motion:
    """Displacement near the base while one texture passes."""
    whisker, scan = cortex.whisker, cortex.scan
    prediction = predict(whisker, cortex.posture, random_grating(cortex.grating_length, rng=rng), scan)
    time = np.arange(LEAD, cortex.grating_length / scan.speed - LEAD, 1 / cortex.sampling_rate)
    point = np.array([1 - cortex.distance / whisker.length])
    displacement = whisker.length * prediction.displacement(time, point)[:, 0]
    first = float(resonances(whisker, cortex.posture.contact, 1).resonant_frequency[0])
    return Motion(displacement=displacement, sampling_rate=cortex.sampling_rate, resonance=first)


@lru_cache(maxsize=1)  # the same for all whiskers of a session
def command_of(cortex: Cortex) -> xr.Dataset:
    """Command of 24 whiskers, scaled to the mean envelope; see :func:`vibrissa.stimulus.array.replay_command`."""
    rng, rate = np.random.default_rng(cortex.texture_seed), cortex.sampling_rate
    motions = [texture_motion(cortex, rng) for _ in range(cortex.n_textures)]
    plain = replay_command(motions, sampling_rate=rate, band=BAND)
    found = float(analytic_envelope(plain.command.values[0])[0].mean())
    return replay_command(motions, sampling_rate=rate, band=BAND, scale=cortex.mean_envelope / found)


def motion_of(cortex: Cortex, whisker: int) -> xr.Dataset:
    """Motion of one whisker of the command, as a stimulus."""
    command = command_of(cortex)
    return dataset(time=command.time.values, point_displacement=command.command.values[whisker])


@lru_cache(maxsize=1)
def population(cortex: Cortex) -> xr.Dataset:
    """Who the units are: every n-th of the paper's; see :func:`vibrissa.neural.population.draw_population`."""
    whole = draw_population(cortex.counts, rng=np.random.default_rng(cortex.population_seed))
    return whole.isel(unit=slice(None, None, cortex.every))


def recorded(cortex: Cortex, places: NDArray[np.int64]) -> xr.Dataset:
    """Spikes of the units at these places, as they fire among all."""
    command, rng = command_of(cortex), np.random.default_rng(cortex.spike_seed)
    time, moved = command.time.values, command.command.values
    return record_population(population(cortex), time, moved, cortex.n_trials, rng=rng, only=places)


def analysis(cortex: Cortex) -> EnvelopeAnalysis:
    """How units are analysed: the delays of the other whiskers are left out of chance."""
    delays = np.unique(command_of(cortex).delay.values)[1:]
    return EnvelopeAnalysis(delays=tuple(delays.tolist()), bin_width=cortex.bin_width)


def _places(cortex: Cortex, whisker: int) -> NDArray[np.int64]:
    return np.flatnonzero(population(cortex).unit_whisker.values == whisker)
