"""A sweep of 3,500 frames of 500 × 450 pixels: rendered, tracked, decomposed and fitted, in memory and through a file.

Wall and process time of each stage, after a first run of 500 frames has compiled everything.
Run: python benchmarks/one_sweep.py [FRAMES]
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import xarray as xr

from vibrissa.mechanics.inverse.decomposition import decompose
from vibrissa.mechanics.inverse.resonance import fit_modes
from vibrissa.mechanics.modes.straight import resonances
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.study.movie.virtual import NODE_SPACING, film_motion, lay_out, predicted_motion
from vibrissa.study.spec.settings import Film, read_study
from vibrissa.video.camera.camera import Camera
from vibrissa.video.io.movie import read_blocks, write_movie
from vibrissa.video.tracking import Calibration, track

STUDY = read_study()
CAMERA = replace(STUDY.film.camera, width=500, height=450)
Result = TypeVar("Result")


def timed(stage: str, work: Callable[[], Result]) -> Result:
    wall, used = time.perf_counter(), time.process_time()
    result = work()
    print(f"  {stage:<32}{time.perf_counter() - wall:7.2f} s wall {time.process_time() - used:7.2f} s CPU", flush=True)
    return result


def tracked(prediction: Prediction, film: Film, frames: Iterable[Any]) -> xr.Dataset:
    scene, pixel = lay_out(prediction, film), film.camera.pixel_size
    middle = len(scene.s) // 3
    return track(
        frames,
        seeds=[(scene.x[middle] / pixel, scene.y[middle] / pixel)],
        skin=[(scene.skin[0] / pixel, scene.skin[1] / pixel)],
        calibration=Calibration(frame_rate=film.camera.frame_rate, pixel_size=pixel),
        node_spacing=NODE_SPACING,
    )


def fitted(prediction: Prediction, film: Film, profile: xr.Dataset) -> xr.Dataset:
    modal = decompose(profile.isel(whisker=0), STUDY.whisker, STUDY.posture.contact, n_modes=3)
    expected = resonances(STUDY.whisker, STUDY.posture.contact, 3).resonant_frequency.values
    shutter: dict[str, Any] = {"exposure": film.camera.exposure, "instants": film.subframes}
    return fit_modes(modal, expected, prediction=prediction, **shutter)[0]


def in_memory(film: Film) -> xr.Dataset:
    prediction = timed("predicted", lambda: predicted_motion(STUDY))
    scene = lay_out(prediction, film)
    profile = timed("rendered and tracked", lambda: tracked(prediction, film, film_motion(prediction, film, scene)))
    return timed("decomposed and fitted", lambda: fitted(prediction, film, profile))


def through_a_file(film: Film, path: Path) -> xr.Dataset:
    prediction = timed("predicted", lambda: predicted_motion(STUDY))
    scene = lay_out(prediction, film)
    timed(f"rendered and written, {path.suffix}", lambda: write_movie(path, film_motion(prediction, film, scene)))
    profile = timed("read and tracked", lambda: tracked(prediction, film, read_blocks(path)))
    return timed("decomposed and fitted", lambda: fitted(prediction, film, profile))


def main(frames: int) -> None:
    camera: Camera = CAMERA
    with tempfile.TemporaryDirectory() as folder:
        for title, count in (("warming up", 500), (f"{frames} frames", frames)):
            film = replace(STUDY.film, camera=camera, n_frames=count)
            print(f"{title}, in memory")
            first = timed("all", lambda film=film: in_memory(film))
            print(f"{title}, through FFV1")
            second = timed("all", lambda film=film: through_a_file(film, Path(folder) / "movie.mkv"))
    assert first.equals(second), "the file must hold what was rendered"
    print(f"first resonance {float(first.resonant_frequency[0]):.3f} Hz")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3500)
