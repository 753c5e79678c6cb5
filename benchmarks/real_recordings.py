"""Tables of real recordings, as `vibrissa` reads them: made from the files that packages and public repositories hold.

`docs/validation-spikes.md` says where each is from. Every function writes its tables into a folder, and raises
FileNotFoundError where the recording is not there.
"""

from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

import numpy as np

STEP = 0.01  # [s] of the tables of headings
HEADINGS = np.arange(0, 360, 45)  # [°]
ODOURS = ("ctr", "fly", "4ol", "cVA", "IAA", "PAA")  # of the six sweeps of every file
SONGS = ("A0", "A8", "B0", "C0", "C8")
BEFORE_SONG = 2.0  # [s]
DEFLECTIONS = 0.5 + np.arange(16) / 8  # [s]


def write(path: Path, header: str, columns: Iterable[np.ndarray]) -> None:
    """A table of numbers."""
    np.savetxt(path, np.column_stack(list(columns)), delimiter=",", header=header, comments="", fmt="%.7g")


def write_spikes(path: Path, rows: Iterable[tuple[str, int, float]]) -> None:
    """A table of spikes [s]."""
    lines = [f"{unit},{trial},{time:.6f}\n" for unit, trial, time in rows]
    path.write_text("".join(["unit,trial,spike_time\n", *lines]), encoding="utf-8")


def locust(folder: Path, k: int) -> None:
    """Receptor k of the package nitime: amplitude of the sound, at 5 kHz and as a tone, and spikes."""
    spec = find_spec("nitime")
    if spec is None or spec.origin is None:
        raise FileNotFoundError("nitime")
    data = Path(spec.origin).parent / "data"
    micro = np.loadtxt(data / f"grasshopper_spike_times{k}.txt")
    amplitude = np.loadtxt(data / f"grasshopper_stimulus{k}.txt")[:, 1]
    time = np.arange(amplitude.size) / 20e3
    write_spikes(folder / f"locust{k}.csv", [("receptor", 0, one) for one in micro / 1e6])
    slow = amplitude[: amplitude.size // 4 * 4].reshape(-1, 4).mean(1)
    write(folder / f"locust{k}-sound.csv", "time,envelope_au", [(np.arange(slow.size) + 0.375) / 5e3, slow])
    write(folder / f"locust{k}-tone.csv", "time,sound_au", [time, amplitude * np.sin(2 * np.pi * 2500 * time)])


def headings(folder: Path, session: Path) -> None:
    """Head-direction session of pynapple's tests: 1 + cos(angle to each of eight headings), and spikes while awake."""
    import h5py

    with h5py.File(session) as file:
        angle = file["acquisition/CompassDirection/ry"]
        time, unwrapped = angle["timestamps"][:], np.unwrap(angle["data"][:])
        ends, all_spikes = file["units/spike_times_index"][:], file["units/spike_times"][:]
        places = [name.decode() for name in file["units/location"][:]]
    grid = np.arange(0, time[-1] - time[0] - STEP, STEP)
    seen = np.interp(grid + time[0], time, unwrapped)
    likeness = 1 + np.cos(seen[:, None] - np.deg2rad(HEADINGS))
    write(folder / "headings.csv", ",".join(["time", *(f"h{one}_au" for one in HEADINGS)]), [grid, likeness])
    parts = [part - time[0] for part in np.split(all_spikes, ends[:-1])]
    kept = [part[(part >= 0) & (part < grid[-1])] for part in parts]
    write_spikes(folder / "cells.csv", [(f"{places[k]}{k}", 0, one) for k, part in enumerate(kept) for one in part])


def thalamus(folder: Path, table: Path) -> None:
    """Thalamic unit: which trial fired is not on file, so every spike gets a trial at random."""
    counts = np.loadtxt(table, delimiter=",").astype(int).ravel()
    rng = np.random.default_rng(0)
    when = [(k + rng.random(n)) / 1e3 for k, n in enumerate(counts)]
    trials = [rng.permutation(50)[:n] for n in counts]
    rows = zip(np.concatenate(trials).tolist(), np.concatenate(when).tolist(), strict=True)
    write_spikes(folder / "thalamus.csv", [("VPM", trial, one) for trial, one in rows])
    time = np.arange(3000) / 1e3
    pulse = sum(np.exp(-(((time - one - 0.01) / 0.005) ** 2)) for one in DEFLECTIONS)
    write(folder / "deflections.csv", "time,envelope_au", [time, np.asarray(pulse)])


def songs(folder: Path, source: Path) -> None:
    """Starling's unit: five songs, five presentations of each; a trial begins 2 s before the song."""
    rows, names = [], []
    for song in SONGS:
        for line in (source / f"{song}.txt").read_text("utf-8").splitlines():
            rows += [("st11", len(names), float(one) / 1e3 + BEFORE_SONG) for one in line.split()]
            names.append(song)
    write_spikes(folder / "songs.csv", rows)
    write_spikes(folder / "song-a0.csv", [row for row in rows if names[row[1]] == SONGS[0]])
    lines = [f"{trial},{name}\n" for trial, name in enumerate(names)]
    (folder / "song-of-trial.csv").write_text("".join(["trial,texture\n", *lines]), encoding="utf-8")


def odours(folder: Path, source: Path) -> None:
    """Fly's lateral-horn neuron: six odours from 2 to 2.5 s, seven presentations of each, odours in turn."""
    rows, names, only = [], [], []
    for block, path in enumerate(sorted(source.glob("*.txt"))):
        cells = [line.split("\t") for line in path.read_text("utf-8").splitlines()[1:]]
        for time, sweep in cells:
            if "NAN" not in (time, sweep):
                rows.append(("neuron", block * len(ODOURS) + int(sweep), float(time) / 1e3))
                only += [("neuron", block, float(time) / 1e3)] if ODOURS[int(sweep)] == "PAA" else []
        names += ODOURS
    if not names:
        raise FileNotFoundError(source)
    write_spikes(folder / "odours.csv", rows)
    write_spikes(folder / "one-odour.csv", only)
    lines = [f"{trial},{name}\n" for trial, name in enumerate(names)]
    (folder / "odour-of-trial.csv").write_text("".join(["trial,texture\n", *lines]), encoding="utf-8")
    time = np.arange(4000) / 1e3
    write(folder / "valve.csv", "time,envelope_au", [time, (time >= 2) & (time < 2.5)])
