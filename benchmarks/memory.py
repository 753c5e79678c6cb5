"""Peak memory of one sweep, by its length: a virtual one, filmed and tracked, and a recorded track; a process for each.

Peaks (resident, MiB) of every stage, as Linux reports them. Nodes and frames say how large the profile is.
Run: python benchmarks/memory.py [FRAMES ...] [--tracks]   (--tracks: only what is done with a track; much quicker)
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

LENGTHS = (3_500, 7_000, 28_000, 100_000)
SPEED = 0.15  # [m/s]
CHUNK = 5_000  # frames of a made track at a time
NODES = 400


def peak() -> float:
    """Most memory that this process had since :func:`forget` [MiB]."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))


def forget() -> None:
    """Begin to measure the peak anew."""
    Path("/proc/self/clear_refs").write_text("5")


def with_peak(stage: str, work: Callable[[], Any]) -> Any:
    forget()
    begin = time.process_time()
    result = work()
    print(f"    {stage:<24}{peak():8.0f} MiB {time.process_time() - begin:7.0f} s CPU", flush=True)
    return result


def laboratory(frames: int) -> Any:
    from vibrissa.study.spec.laboratory import Laboratory

    return Laboratory(
        truth="modes",
        animals=1,
        whiskers=("C1",),
        conditions=1,
        textures=1,
        speeds=(SPEED,),
        n_frames=frames,
        texture_length=max(0.35, frames / 2000 * SPEED * 1.01),
        seed=3,
    )


def virtual(frames: int) -> None:
    """Predict, film, track; decompose, fit; all of it once more as one call."""
    from vibrissa.study.sweeps.laboratory import plan
    from vibrissa.study.sweeps.sweep_analysis import analyse_sweep
    from vibrissa.study.sweeps.virtual_sweep import filmed_sweep, virtual_sweep

    place = laboratory(frames)
    sweep = plan(place)[0][0]
    filmed = with_peak("predicted, filmed, tracked", lambda: filmed_sweep(place, sweep))
    print(f"    {filmed.profile.sizes['time']} frames, {filmed.profile.sizes['node']} nodes")
    with_peak("decomposed, fitted", lambda: analyse_sweep(filmed.profile, filmed.known))
    filmed = None
    with_peak("a virtual sweep", lambda: virtual_sweep(place, sweep))


def make_track(frames: int, folder: Path) -> None:
    """Write a track of the model's own motion with noise, its texture, and the table that names them."""
    import numpy as np

    from vibrissa.mechanics.scan.texture_prediction import predict
    from vibrissa.netcdf import save
    from vibrissa.quantities import dataset
    from vibrissa.study.sweeps.laboratory import plan
    from vibrissa.texture.io import write_gaps

    place = laboratory(frames)
    sweep, texture, rng = plan(place)[0][0], place.grating(0), np.random.default_rng(0)
    motion, length = predict(sweep.whisker, sweep.posture, texture, sweep.scan), sweep.whisker.length
    arc = np.linspace(0.002, (1 - sweep.posture.contact) * length - 0.001, NODES)
    time_, x, y = np.arange(frames) / 2000, np.empty((frames, NODES)), np.empty((frames, NODES))
    for first in range(0, frames, CHUNK):
        part = slice(first, first + CHUNK)
        x[part], y[part] = (length * values for values in motion.position(time_[part], 1 - arc / length))
        y[part] = 1e-6 * rng.normal(size=y[part].shape) - y[part]
    sd, about = np.full(x.shape, 1e-6), {"frame": "image", "pixel_size": 3e-5, "frame_rate": 2000.0}
    save(dataset(about, time=time_, node=np.arange(NODES), x=x, y=y, y_sd=sd, arc_length=arc), folder / "track.nc")
    write_gaps(texture, folder / "plate.csv")
    (folder / "sweeps.csv").write_text(
        "track,animal,whisker,texture,scan_speed,length,cone_angle\n"
        f"track.nc,a,C1,plate.csv,{SPEED},{length},{sweep.whisker.cone_angle}\n"
    )


def recorded(frames: int, folder: str) -> None:
    """Analyse a track that is there."""
    from vibrissa.study.spec.recorded_sweeps import read_sweeps
    from vibrissa.study.sweeps.recorded_sweeps import recorded_sweep

    entry = read_sweeps(Path(folder) / "sweeps.csv")[0]
    with_peak(f"a track of {frames}", lambda: recorded_sweep(entry))


def main(lengths: list[int], virtual_too: bool) -> None:
    for frames in lengths:
        print(f"{frames} frames", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            if virtual_too:
                subprocess.run([sys.executable, __file__, "virtual", str(frames)], check=True)
            subprocess.run([sys.executable, __file__, "make", str(frames), folder], check=True)
            subprocess.run([sys.executable, __file__, "track", str(frames), folder], check=True)


if __name__ == "__main__":
    words = sys.argv[1:]
    if words[:1] == ["virtual"]:
        virtual(int(words[1]))
    elif words[:1] == ["make"]:
        make_track(int(words[1]), Path(words[2]))
    elif words[:1] == ["track"]:
        recorded(int(words[1]), words[2])
    else:
        main([int(word) for word in words if word.isdigit()] or list(LENGTHS), "--tracks" not in words)
