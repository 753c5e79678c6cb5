"""Draw Figures 8 and 9 from a simulated population: textures, whisker, stimulator, spikes, analysis.

python docs/make_cortex_figures.py [FOLDER]

Three random gratings are scanned by a long whisker, whose first mode lies within the stimulator's band; its motion 5 mm
from the base is filtered, scaled to the envelope below, and replayed on 24 whiskers to 514 simulated units.
"""

import sys
from pathlib import Path

import numpy as np
import xarray as xr

from vibrissa.figures import fig8, fig9
from vibrissa.mechanics.modes import resonances
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.superposition import Scan, predict
from vibrissa.neural.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.population import draw_population, record_population
from vibrissa.neural.response import psth
from vibrissa.neural.spikes import of_unit, spike_table
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.stimulus.array import replay_command
from vibrissa.stimulus.band import Band
from vibrissa.stimulus.waveform import Motion
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.055, cone_angle=1.2e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)
SCAN = Scan(speed=0.1, damping=0.11)
DISTANCE, GRATING, RATE, TRIALS = 5e-3, 0.36, 4000.0, 100  # [m], [m], [Hz], [1]
MEAN_ENVELOPE = 55e-6  # [m] chosen: the paper prints no amplitude of its stimulus
BIN = 0.01  # [s]


def motion(rng: np.random.Generator) -> Motion:
    """Displacement near the base while one texture passes."""
    prediction = predict(WHISKER, POSTURE, random_grating(GRATING, rng=rng), SCAN)
    time = np.arange(0.05, GRATING / SCAN.speed - 0.05, 1 / RATE)
    point = np.array([1 - DISTANCE / WHISKER.length])
    displacement = WHISKER.length * prediction.displacement(time, point)[:, 0]
    first = float(resonances(WHISKER, POSTURE.contact, 1).resonant_frequency[0])
    return Motion(displacement=displacement, sampling_rate=RATE, resonance=first)


def replayed(rng: np.random.Generator) -> xr.Dataset:
    """Command of 24 whiskers."""
    motions = [motion(rng) for _ in range(3)]
    band = Band(norm="mag")
    plain = replay_command(motions, sampling_rate=RATE, band=band)
    found = float(analytic_envelope(plain.command.values[0])[0].mean())
    command = replay_command(motions, sampling_rate=RATE, band=band, scale=MEAN_ENVELOPE / found)
    return command.assign_attrs(first=motions[0].resonance)


def note(command: xr.Dataset) -> str:
    """How the stimulus was made, for the captions."""
    return (
        f" Stimulus: predicted motion {1e3 * DISTANCE:.0f} mm from the base, first mode at "
        f"{command.attrs['first']:.0f} Hz, filtered to 0.1–83 Hz forwards and backwards, then scaled by "
        f"{command.attrs['scale']:.1f} to a mean envelope of {1e6 * MEAN_ENVELOPE:.0f} µm, chosen because the paper "
        f"prints none; {TRIALS} presentations."
    )


def analysed(spikes: xr.Dataset, command: xr.Dataset, how: EnvelopeAnalysis, n_trials: int = TRIALS) -> xr.Dataset:
    """Analyse each unit against the motion of its own whisker."""
    tables = []
    for whisker in np.unique(spikes.unit_whisker.values).tolist():
        index = np.flatnonzero(spikes.unit_whisker == whisker)
        own = np.flatnonzero(np.isin(spikes.spike_unit, index))
        of = np.searchsorted(index, spikes.spike_unit.values[own])
        names, trial = spikes.unit_name.values[index].tolist(), spikes.spike_trial.values[own]
        table = spike_table(spikes.spike_time.values[own], of, names, trial=trial)
        table.attrs["n_trials"] = n_trials
        stimulus = dataset(time=command.time.values, point_displacement=command.command.values[whisker])
        tables.append(analyse_units(table, stimulus, n_trials, how).assign_coords(unit=index))
    joined = xr.concat(tables, "unit", combine_attrs="override", join="exact").sortby("unit").drop_vars("unit")
    return joined.assign(unit_quality=("unit", spikes.unit_quality.values))


def one_unit(spikes: xr.Dataset, units: xr.Dataset, command: xr.Dataset) -> dict[str, xr.Dataset]:
    """Datasets of the single unit whose fit explains most among those whose threshold is near the median."""
    usual = np.abs(units.threshold - 42.3e-6) < 10e-6
    sure = units.significant & units.identified & (units.unit_quality == "SU") & usual
    k = int(np.argmax(np.where(sure, units.tuning_r_squared, -1)))
    own = of_unit(spikes, str(units.unit_name.values[k]))
    moved = command.command.values[int(spikes.unit_whisker[k])]
    edges = BIN * np.arange(1001)
    rates = psth(own, edges, n_trials=TRIALS).squeeze("unit")
    envelope = analytic_envelope(moved)[0].reshape(1000, -1).mean(axis=1)
    return {
        "spikes": own,
        "response": dataset(
            {"bin_width": BIN, "n_trials": TRIALS, "note": note(command)},
            bin=edges[:-1],
            firing_rate=rates.firing_rate.values,
            bin_envelope=envelope,
        ),
        "motion": dataset(time=command.time.values, point_displacement=moved),
        "unit": units.isel(unit=k),
    }


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    command = replayed(np.random.default_rng(1))
    truth = draw_population(rng=np.random.default_rng(2))
    spikes = record_population(truth, command.time.values, command.command.values, TRIALS, rng=np.random.default_rng(3))
    how = EnvelopeAnalysis(delays=tuple(np.unique(command.delay.values)[1:].tolist()))
    units = analysed(spikes, command, how).assign(unit_session=truth.unit_session)
    units.attrs["note"] = note(command) + " Chance values are adjusted over the units of each whisker."
    figures = {
        "fig8.png": fig8.draw(fig8.compute(one_unit(spikes, units, command))),
        "fig9.png": fig9.draw(fig9.compute(units, rng=np.random.default_rng(4), truth=truth)),
    }
    for name, figure in figures.items():
        figure.savefig(folder / name, metadata={"Software": None})
