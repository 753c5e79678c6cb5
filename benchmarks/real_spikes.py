"""Verdicts on real recordings beside calculations made without `vibrissa` (a quarter of an hour).

python benchmarks/real_spikes.py FOLDER [RECORDING ...]

Recordings are locust, heading, waking, thalamus, songs and odours. FOLDER holds, for those that no test dependency
brings, the files that docs/validation-spikes.md names; tables are written there, and each command can be repeated
there.
The table docs/validation/real-spikes.csv is printed.
"""

import contextlib
import csv
import io
import json
import os
import shlex
import sys
from pathlib import Path
from typing import Any

import numpy as np
import real_recordings as tables
import real_spikes_apart as apart

from vibrissa.cli import main as command_line

WAKING = "A8604-211122.nwb"
THALAMUS = "rat-vpm-whisker-thaldata.csv"
DATA = Path(__file__).parents[1] / ".." / "shared" / "data" / "spikes"


def vibrissa(line: str) -> dict[str, Any] | str:
    """What a command prints as JSON; or its refusal."""
    sys.argv = ["vibrissa", *shlex.split(line), "--json"]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), contextlib.suppress(SystemExit):
        command_line()
    if not out.getvalue():
        return err.getvalue().strip().splitlines()[-1].removeprefix("vibrissa: ")
    found = json.loads(out.getvalue())
    return found["units"][0] if len(found.get("units", ())) == 1 else found


def report(line: str, verdict: str, beside: str) -> None:
    """One row of the table."""
    csv.writer(sys.stdout, lineterminator="\n").writerow([line, verdict, beside])


def times(path: str, trial: int | None = None) -> np.ndarray:
    """Times of the spikes of a table [s]; of one trial, or of all."""
    rows = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(1, 2)).reshape(-1, 2)
    return rows[rows[:, 0] == trial, 1] if trial is not None else rows[:, 1]


def by_trial(path: str, trials: int, edges: np.ndarray) -> np.ndarray:
    """Counts (trial, bin)."""
    return np.array([np.histogram(times(path, k), edges)[0] for k in range(trials)])


def column(path: str, k: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Times and one column of a stimulus."""
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    return rows[:, 0], rows[:, k]


def locust(_: Path) -> None:
    for k in (1, 2):
        tables.locust(Path(), k)
    for k in (1, 2):
        receptor(k)
        heard_by_model(k)
        judged(f"quality locust{k}.csv --trials 1 --window 0s 10s", [times(f"locust{k}.csv")], 10.0)
    chosen_drive()
    for line in (
        "information --spikes locust1.csv --trials 1 --window 1s 10s",
        "demodulation --spikes locust1.csv --stimulus locust1-tone.csv --trials 1",
    ):
        report(line, f"refused: {vibrissa(line)}", "one presentation")


def receptor(k: int) -> None:
    """Coupling, hinge and plan of one receptor."""
    line = f"neural --spikes locust{k}.csv --stimulus locust{k}-sound.csv --trials 1 --bin-width 1ms"
    found = vibrissa(line)
    edges = np.arange(1, 10.0005, 0.001)
    time, sound = column(f"locust{k}-sound.csv")
    counts = np.histogram(times(f"locust{k}.csv"), edges)[0]
    level = apart.bin_means(time, sound, edges)
    r, lag, p = apart.by_shift(counts, level, 0.001)
    theta, slope, tau, base = apart.hinge(counts, time, sound, edges)
    report(
        line,
        f"driven, r {found['envelope_correlation']:.3f} at {1e3 * found['envelope_lag']:.0f} ms, "
        f"p {found['p_value']:.1g}; threshold {found['threshold']:.3f}, slope {found['slope']:.0f}/s, "
        f"{1e3 * found['latency']:.1f} ms, {found['baseline']:.1f} Hz; {found['reason'].split(',')[0]}",
        f"r {r:.3f} at {1e3 * lag:.0f} ms, p {p:.1g}; {theta:.3f}, {slope:.0f}/s, {1e3 * tau:.1f} ms, {base:.1f} Hz",
    )
    line = (
        f"trials-needed --stimulus locust{k}-sound.csv --threshold {theta:.3f}au --slope {slope:.0f}/s/au "
        f"--baseline {base:.1f}Hz --latency {1e3 * tau:.1f}ms --threshold-within 0.002au --slope-within 0.02 "
        "--bin-width 1ms"
    )
    plan = vibrissa(line)
    typed = [float(f"{theta:.3f}"), float(f"{slope:.0f}"), float(f"{1e3 * tau:.1f}") / 1e3, float(f"{base:.1f}")]
    need = apart.trials_for(time, sound, edges, typed, (0.002, 0.02 * typed[1]))
    report(line, f"{plan['trials_needed'][0]:.0f} trials", f"{need:.1f}")


def heard_by_model(k: int) -> None:
    """Poisson model of one receptor, over blocks of the one presentation."""
    line = f"glm --spikes locust{k}.csv --stimulus locust{k}-sound.csv --trials 1"
    found = vibrissa(line)
    time, sound = column(f"locust{k}-sound.csv")
    edges = np.arange(0, 10.0005, 0.005)
    level = apart.bin_means(time, sound, edges)[200:]
    counts = np.histogram(times(f"locust{k}.csv"), edges)[0][None, 200:]
    shares = apart.explained(counts, level, 9, 20, block=50)
    one = {name: float(np.ravel(found[name])[0]) for name in ("whisker_matters", "n_blocks", "kernel_gain")}
    report(
        line,
        f"the stimulus {'matters' if one['whisker_matters'] else 'is not shown to matter'}; deviance explained "
        f"{np.ravel(found['deviance_explained'])[0]:.3f} in unseen blocks of {one['n_blocks']:.0f}, "
        f"{one['kernel_gain']:.2f} bit per spike",
        f"deviance explained {shares[1]:.3f} in every other 0.25 s; by the stimulus alone {shares[0]:.3f}",
    )


def chosen_drive() -> None:
    """Drives of the receptors, the two sounds being the stimuli."""
    pairs = " ".join(f"--spikes locust{k}.csv --stimulus locust{k}-tone.csv" for k in (1, 2))
    line = f"drives {pairs} --trials 1 --bin-width 1ms"
    found = vibrissa(line)
    gains = dict(zip(found["drive"], np.ravel(found["drive_gain"]), strict=True)) if "drive_gain" in found else {}
    report(
        line,
        f"{np.ravel(found['best_drive'])[0]}: {np.ravel(found['reason'])[0]}; bit per spike: "
        + ", ".join(f"{name} {gain:.2f}" for name, gain in gains.items()),
        ", ".join(f"{name} {gain:.2f}" for name, gain in unseen_bits().items()),
    )


def unseen_bits() -> dict[str, float]:
    """Bits for each spike of unseen blocks of both recordings: the amplitude, its rise, it smoothed over 30 ms."""
    edges, lags = np.arange(1, 10.0005, 0.001), np.arange(0.004, 0.012, 0.001)
    parts: dict[str, list[np.ndarray]] = {"envelope": [], "rise": [], "smoothed": []}
    counts = []
    for k in (1, 2):
        time, sound = column(f"locust{k}-sound.csv")
        counts.append(np.histogram(times(f"locust{k}.csv"), edges)[0])
        kernel = np.exp(-np.arange(0, 0.2, time[1]) / 0.03)
        smooth = np.convolve(sound, kernel / kernel.sum())[: sound.size]
        rise = np.maximum(np.gradient(sound, time), 0)
        for name, one in (("envelope", sound), ("rise", rise), ("smoothed", smooth)):
            parts[name].append(np.array([apart.bin_means(time, one, edges - lag) for lag in lags]))
    return {name: apart.unseen_bits(np.concatenate(counts), np.hstack(both)) for name, both in parts.items()}


def heading(folder: Path) -> None:
    tables.headings(Path(), next(folder.rglob("neurosuite/pynapplenwb/A2929-200711.nwb")))
    rows = np.genfromtxt("cells.csv", delimiter=",", skip_header=1, dtype=str)
    names = sorted(set(rows[:, 0]), key=lambda name: int(name[3:]))
    for at in (0, 180):
        line = f"neural --spikes cells.csv --stimulus headings.csv --whisker h{at} --trials 1"
        found = {unit["unit"]: unit for unit in vibrissa(line)["units"]}
        time, level = column("headings.csv", 1 + at // 45)
        edges = np.arange(1, time[-1] - 0.01, 0.01)
        seen = np.interp((edges[1:] + edges[:-1]) / 2, time, level)
        counts = {name: np.histogram(rows[rows[:, 0] == name, 2].astype(float), edges)[0] for name in names}
        shifts = {name: apart.by_shift(one, seen, 0.01) for name, one in counts.items()}
        p = dict(zip(names, apart.adjusted([one[2] for one in shifts.values()]), strict=True))
        lead = {name: apart.lead(counts[name], seen) for name in names}
        ours = [name for name in names if found[name]["significant"]]
        report(
            line,
            f"driven: {', '.join(ours) or 'none'}; largest correlation at "
            + ", ".join(f"{1e3 * found[name]['peak_lag']:.0f}" for name in ours)
            + " ms",
            f"driven: {', '.join(name for name in names if p[name] <= 0.01) or 'none'}; "
            + ", ".join(f"{1e3 * lead[name]:.0f}" for name in ours)
            + " ms",
        )
    for verb in ("surround", "glm"):
        line = f"{verb} --spikes cells.csv --command headings.csv --trials 1"
        report(line, f"refused: {vibrissa(line)}", "one presentation")
    own = [rows[rows[:, 0] == name, 2].astype(float) for name in names]
    judged("quality cells.csv --trials 1", own, max(one.max() for one in own))


def waking(folder: Path) -> None:
    """Units of a session without stimulus: their quality, by the numbers in the file."""
    import h5py

    path = next(folder.rglob(WAKING), DATA / WAKING)
    with h5py.File(path) as file:
        ends, every = file["units/spike_times_index"][:], file["units/spike_times"][:]
    judged(f"quality {WAKING}", np.split(every, ends[:-1]), float(np.ptp(every)), str(path))


def judged(line: str, trains: list[np.ndarray], span: float, path: str = WAKING) -> None:
    """Quality of units, beside counts of their spikes and of the intervals below 1 ms."""
    found = vibrissa(line.replace(WAKING, path))
    rows = []
    for own in trains:
        close = int((np.diff(np.sort(own)) < 1e-3).sum())
        foreign = 1 - np.sqrt(max(1 - close * span / (own.size**2 * 1e-3), 0))
        rows.append(f"{own.size / span:.2f} Hz, {100 * close / (own.size - 1):.2f} %, {foreign:.2f}")
    columns = (found[name] for name in ("unit_rate", "refractory_violations", "contamination", "kept"))
    ours = [
        f"{rate:.2f} Hz, {100 * share:.2f} %, {foreign:.2f}: {'kept' if kept else 'left out'}"
        for rate, share, foreign, kept in zip(*columns, strict=True)
    ]
    report(line, "rate, intervals below 1 ms, contamination: " + "; ".join(ours), "; ".join(rows))


def informed(line: str, counts: np.ndarray) -> None:
    """Information of a spike, and how few spikes there are."""
    found = vibrissa(line)
    low, high, got = (np.ravel(found[f"spike_information{end}"])[0] for end in ("_low", "_high", ""))
    why = np.ravel(found["reason"])[0]
    found_words = f"{got:.2f} bit per spike ({low:.2f} to {high:.2f})"
    beside = f"{apart.bits_of_a_spike(counts):.2f}; {counts.sum()} spikes in {counts.shape[1]} bins"
    report(line, f"{found_words}; {why}" if why else found_words, beside)


def thalamus(folder: Path) -> None:
    tables.thalamus(Path(), next(folder.rglob(THALAMUS), DATA / THALAMUS))
    line = "neural --spikes thalamus.csv --stimulus deflections.csv --trials 50 --skip 0.2s --level 0.05"
    found = vibrissa(line)
    edges = np.arange(0, 3.0005, 0.01)
    counts, (_, pulse) = by_trial("thalamus.csv", 50, edges), column("deflections.csv")
    seen = np.array([pulse[k : k + 10].mean() for k in range(0, 3000, 10)])
    r, lag, p = apart.by_shift(counts.sum(0)[20:], seen[20:], 0.01)
    report(
        line,
        f"{'driven' if found['significant'] else 'not driven'}, r {found['envelope_correlation']:.2f} at "
        f"{1e3 * found['envelope_lag']:.0f} ms, p {found['p_value']:.2g}; {found['reason']}",
        f"r {r:.2f} at {1e3 * lag:.0f} ms, p {p:.2g}",
    )
    informed("information --spikes thalamus.csv --trials 50 --window 0.5s 2.5s", counts[:, 50:250])
    line = "glm --spikes thalamus.csv --command deflections.csv --trials 50 --skip 0.2s"
    found = vibrissa(line)
    fine = by_trial("thalamus.csv", 50, np.arange(0, 3.0005, 0.005))
    shares = apart.explained(fine, np.array([pulse[k : k + 5].mean() for k in range(0, 3000, 5)]), 8, 20)
    if isinstance(found, str):
        report(line, f"refused: {found}", f"deviance explained {shares[1]:.3f}")
    else:
        matters, share = np.ravel(found["whisker_matters"])[0], np.ravel(found["deviance_explained"])[0]
        report(
            line,
            f"the stimulus {'matters' if matters else 'is not shown to matter'}; deviance explained {share:.3f}",
            f"deviance explained {shares[1]:.3f}; by the stimulus alone {shares[0]:.3f}",
        )


def read(kind: str, trials: int, window: tuple[float, float], folds: int) -> None:
    """Discriminate songs or odours."""
    part = f"--window {window[0]:g}s {window[1]:g}s --folds {folds}"
    line = f"discriminate {kind}s.csv {part} --textures {kind}-of-trial.csv"
    found = vibrissa(line)
    names = np.genfromtxt(f"{kind}-of-trial.csv", delimiter=",", skip_header=1, dtype=str)[:, 1]
    counts = by_trial(f"{kind}s.csv", trials, np.arange(window[0], window[1] + 1e-6, 0.02))
    right, chance = apart.read_by_centroid(counts, names, 0.02)
    k = found["code"].index("time course")
    report(
        line,
        f"time course {found['accuracy'][k]:.2f} ({found['accuracy_low'][k]:.2f} to {found['accuracy_high'][k]:.2f}), "
        f"chance below {found['chance_accuracy_high'][k]:.2f}: {found['code_verdict'][k]}",
        f"nearest centroid {right:.2f}, chance below {chance:.2f}",
    )


def songs(folder: Path) -> None:
    tables.songs(Path(), folder / "starling")
    read("song", 25, (2.0, 12.0), 5)
    counts = by_trial("song-a0.csv", 5, np.arange(2, 12.0005, 0.01))
    informed("information --spikes song-a0.csv --trials 5 --window 2s 12s", counts)


def odours(folder: Path) -> None:
    tables.odours(Path(), folder / "odours")
    for folds in (5, 7):
        read("odour", 42, (2.0, 3.0), folds)
    counts = by_trial("one-odour.csv", 7, np.arange(1, 4.0005, 0.01))
    informed("information --spikes one-odour.csv --trials 7 --window 1s 4s", counts)
    line = "neural --spikes one-odour.csv --stimulus valve.csv --trials 7"
    found = vibrissa(line)
    edges = np.arange(1, 4.0005, 0.01)
    counts = np.histogram(times("one-odour.csv"), edges)[0]
    best = max(
        range(60), key=lambda lag: apart.correlations(counts, ((edges[:-1] >= 2) & (edges[:-1] < 2.5)) * 1.0, [lag])[0]
    )
    report(line, found["reason"], f"largest correlation at {10 * best} ms, beyond the 30 ms that are tested")


RECORDINGS = {
    "locust": locust,
    "heading": heading,
    "waking": waking,
    "thalamus": thalamus,
    "songs": songs,
    "odours": odours,
}


def main(folder: str, *chosen: str) -> None:
    os.chdir(folder)
    report("command", "vibrissa", "calculation")
    for name in chosen or RECORDINGS:
        try:
            RECORDINGS[name](Path())
        except (FileNotFoundError, StopIteration) as error:
            print(f"{name} is not in {folder}: {error}", file=sys.stderr)


if __name__ == "__main__":
    main(*sys.argv[1:])
