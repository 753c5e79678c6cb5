"""Simulate what `vibrissa surround`, `glm`, `demodulation`, `drives` and `information` read, with the truth beside it.

python docs/make_coding.py [FOLDER]

writes motion.csv (a ringing whisker), its 24 delayed copies (command.nc) and the spikes of four units on them
(spikes.csv); stimulus.csv and the spikes of ten units between envelope and phase (mixed.csv); and six stimuli of
different carriers with four units, each of another drive (stimulus0.csv … and drive0.csv …).
"""

import sys
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from vibrissa.neural.io.tables.spikes import join_units
from vibrissa.neural.simulated.virtual import PhaseUnit, ThresholdLinearUnit, simulate_spikes
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.signals.smoothing import low_pass
from vibrissa.stimulus.array import replay_command
from vibrissa.stimulus.export import write_command
from vibrissa.stimulus.waveform import read_motion

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))
from demodulator import Demodulator  # a unit of the tests

RATE, TRIALS, SLOPE, THRESHOLD, LATENCY = 2000.0, 60, 2.5e5, 42.3e-6, 0.012
SURROUND = {  # weight of each whisker, over the slope
    "focused": {"C2": 1.0},
    "broad": {"C2": 1.0, "C1": 0.3, "C3": 0.3, "B2": 0.2, "D2": 0.2},
    "inhibited": {"D1": 1.0, "D2": -0.25, "C1": -0.25},
    "silent": {},
}
CARRIERS = (50, 60, 70, 80, 95, 110)  # [Hz]


def ringing(rng, duration, frequency=70.0, damping=0.11, events=167.0):
    """Displacement [m] of an oscillator kicked at random moments, with a mean envelope of 55 µm."""
    time = np.arange(round(duration * RATE)) / RATE
    kicks = np.bincount(rng.integers(0, time.size, rng.poisson(events * duration)), minlength=time.size).astype(float)
    pole = np.exp((-damping + 1j * np.sqrt(1 - damping**2)) * 2 * np.pi * frequency / RATE)
    motion = lfilter([0, pole.imag], [1, -2 * pole.real, abs(pole) ** 2], kicks)
    return time, (motion - motion.mean()) * 55e-6 / analytic_envelope(motion)[0].mean()


class Adding:
    """A unit that adds up hinges of several whiskers."""

    def __init__(self, weights):
        self.weights = weights

    def rate(self, time, envelopes):
        """Rate [Hz] under the envelopes of all whiskers, by name."""
        one = ThresholdLinearUnit(threshold=THRESHOLD, slope=SLOPE, baseline=0.0, latency=LATENCY)
        driven = sum(share * one.rate(time, envelopes[name]) for name, share in self.weights.items())
        return np.maximum(8.0 + driven + np.zeros(time.size), 0)


class Mixed:
    """A unit between envelope and phase: 20 Hz on average, 35 % of it modulated."""

    def __init__(self, share):
        self.share = share

    def rate(self, time, motion):
        """Rate [Hz] under a displacement."""
        envelope, phase = analytic_envelope(motion)
        a = np.interp(time - LATENCY, time, (envelope - envelope.mean()) / envelope.std())
        wave = np.sqrt(2) * np.cos(np.interp(time - LATENCY, time, np.unwrap(phase)))
        return np.maximum(20 * (1 + 0.35 * (np.cos(self.share) * a + np.sin(self.share) * wave)), 0)


def drive_of(time, motion, name):
    """What drives a unit, by the name of a drive."""
    step, envelope = time[1] - time[0], analytic_envelope(motion)[0]
    if name == "speed":
        return analytic_envelope(np.gradient(motion, step))[0]
    if name == "rise":
        return np.gradient(envelope, step)
    return low_pass(time, envelope, 0.03) if name == "smoothed" else envelope


def write_table(path, units):
    """Spikes of units in trials, as the verbs read them."""
    table = join_units(units)
    names = table.unit_name.values[table.spike_unit.values]
    rows = zip(names, table.spike_trial.values, table.spike_time.values, strict=True)
    path.write_text("unit,trial,spike_time\n" + "".join(f"{u},{n},{t:.6f}\n" for u, n, t in rows))


def write_motion(path, time, motion):
    """Motion as the verbs read it."""
    rows = "".join(f"{t:.6f},{x:.9g}\n" for t, x in zip(time, motion, strict=True))
    path.write_text("time,displacement\n" + rows)


def on_whiskers(folder, rng):
    """The command of 24 whiskers, and units with a surround."""
    time, motion = ringing(rng, 10.1)
    write_motion(folder / "motion.csv", time, motion)
    command = replay_command([read_motion(folder / "motion.csv")], sampling_rate=RATE)
    write_command(command, folder / "command.nc")
    moved = dict(zip(command.whisker.values.tolist(), analytic_envelope(command.command.values)[0], strict=True))
    units = {
        name: simulate_spikes(Adding(weights), command.time.values, moved, TRIALS, rng=rng)
        for name, weights in SURROUND.items()
    }
    write_table(folder / "spikes.csv", units)


def between_envelope_and_phase(folder, rng):
    """One stimulus, and units from envelope to phase."""
    time, motion = ringing(rng, 8.0)
    write_motion(folder / "stimulus.csv", time, motion)
    phase = analytic_envelope(motion)[1]
    units = {f"mix{k}": simulate_spikes(Mixed(k * np.pi / 12), time, motion, 40, rng=rng) for k in range(7)}
    units["rectifier"] = simulate_spikes(Demodulator(), time, motion, 40, rng=rng)
    units["locked"] = simulate_spikes(PhaseUnit(baseline=10.0, depth=0.8), time, phase, 40, rng=rng)
    units["steady"] = simulate_spikes(PhaseUnit(baseline=10.0, depth=0.0), time, phase, 40, rng=rng)
    write_table(folder / "mixed.csv", units)


def of_several_carriers(folder, rng):
    """Six stimuli, and a unit of each drive."""
    scale = {"envelope": 1.0, "speed": 2 * np.pi * 70, "rise": 75.0, "smoothed": 1.0}
    for k, carrier in enumerate(CARRIERS):
        time, motion = ringing(rng, 3.0, frequency=carrier)
        write_motion(folder / f"stimulus{k}.csv", time, motion)
        units = {}
        for name, factor in scale.items():
            corner = 0.0 if name == "rise" else THRESHOLD * factor
            unit = ThresholdLinearUnit(threshold=corner, slope=SLOPE / factor, baseline=5.0, latency=LATENCY)
            units[name] = simulate_spikes(unit, time, drive_of(time, motion, name), 20, rng=rng)
        write_table(folder / f"drive{k}.csv", units)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(7)
    on_whiskers(folder, rng)
    between_envelope_and_phase(folder, rng)
    of_several_carriers(folder, rng)
