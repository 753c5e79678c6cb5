"""Trackers that ``benchmarks/whisking_truth.py`` compares: movie in, named lines out."""

import importlib
import importlib.util
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import tifffile
import xarray as xr
from identity_scores import Lines, lines_of

from vibrissa.quantities import dataset
from vibrissa.video.camera.pad.settings import WhiskingScene
from vibrissa.video.foreign.whisk_files import read_measurements, read_whiskers

FINDER, LINKER = "vibrissa.video.find.movie_segments", "vibrissa.video.link.thorough_linking"
Tracker = Callable[[np.ndarray, WhiskingScene], Lines]


def there(module: str) -> bool:
    """Whether a module can be imported."""
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        return False


def vibrissa_tracker() -> Tracker | None:
    """Finder and linker of this package, or None with a message."""
    if not there(FINDER):
        print(f"skipped: vibrissa, which has no {FINDER} here", file=sys.stderr)
        return None
    finder = importlib.import_module(FINDER)
    linker = importlib.import_module(LINKER) if there(LINKER) else None
    if linker is None:
        print(f"only lines, without names: vibrissa has no {LINKER} here", file=sys.stderr)

    def track(frames: np.ndarray, scene: WhiskingScene) -> Lines:
        segments = finder.find_segments(frames, finder.LineSearch(polarity=scene.polarity))
        if linker is None:
            return lines_of(segments)
        segments, linking = linker.link_thoroughly(segments)
        return lines_of(segments, linking.identity())

    return track


def whisk_tracker(folder: Path | None) -> Tracker | None:
    """WHISK [Clack2012], whose programs and ``default.parameters`` are in a folder; or None with a message."""
    if folder is None or not (folder / "trace").is_file():
        print("skipped: WHISK, of which no folder with its programs is given", file=sys.stderr)
        return None

    def track(frames: np.ndarray, scene: WhiskingScene) -> Lines:
        if scene.polarity == "bright":
            frames = 255 - frames  # it knows dark whiskers only
        middle = round(scene.head.nose[0] / scene.camera.pixel_size)
        parts = (
            [(slice(None), "left")]
            if len(scene.sides) == 1
            else [(slice(middle), "right"), (slice(middle, None), "left")]
        )
        found, first = [], 0
        for columns, face in parts:
            found.append(whisk_lines(folder, frames[:, :, columns], face, scene, columns.start or 0, first))
            first = max([first, *(one[0] + 1 for one in found[-1])])
        return lines_of(as_segments([one for part in found for one in part], scene, len(frames)))

    return track


def whisk_lines(
    folder: Path, frames: np.ndarray, face: str, scene: WhiskingScene, left: int, first: int
) -> list[tuple[int, int, np.ndarray, np.ndarray]]:
    """Name from ``first`` on (−1 none), frame, columns and rows of what WHISK makes of one pad.

    It is given the number of whiskers and the side of the image on which the face is. ``trace`` wants FFmpeg 6, even
    for TIFF; its libraries are looked for in ``folder`` and wherever LD_LIBRARY_PATH says.
    """
    paths = [str(folder), os.environ.get("LD_LIBRARY_PATH", "")]
    environment = os.environ | {"LD_LIBRARY_PATH": os.pathsep.join(path for path in paths if path)}
    count, scale = str(len(scene.names)), f"{1e3 * scene.camera.pixel_size:.4f}"
    steps = [
        ["trace", "movie.tif", "movie.whiskers"],
        ["measure", "--face", face, "movie.whiskers", "movie.measurements"],
        ["classify", "movie.measurements", "movie.measurements", face, "--px2mm", scale, "-n", count],
        ["reclassify", "-n", count, "movie.measurements", "named.measurements"],
    ]
    with tempfile.TemporaryDirectory() as name:
        here = Path(name)
        for path in (*folder.glob("default.parameters"), *folder.glob("*.detectorbank")):
            (here / path.name).symlink_to(path)
        tifffile.imwrite(here / "movie.tif", np.ascontiguousarray(frames), photometric="minisblack")
        for program, *words in steps:
            done = subprocess.run([folder / program, *words], cwd=here, capture_output=True, env=environment)
            if done.returncode and program != "reclassify":
                raise RuntimeError(f"{program} failed: {done.stderr[-500:].decode(errors='replace')}")
        if done.returncode:
            print("reclassify refuses this movie: names are those of classify", file=sys.stderr)
        table = read_measurements(here / ("movie.measurements" if done.returncode else "named.measurements"))
        names = {(row["frame"], row["wid"]): int(row["identity"]) for row in table}
        lines = read_whiskers(here / "movie.whiskers")
    given = [names.get((one.frame, one.wid), -1) for one in lines]
    return [
        (name + first if name >= 0 else -1, one.frame, one.x + left, one.y)
        for name, one in zip(given, lines, strict=True)
    ]


def as_segments(lines: list[tuple[int, int, np.ndarray, np.ndarray]], scene: WhiskingScene, frames: int) -> xr.Dataset:
    """Dataset ``segments`` of named lines."""
    lines = sorted(lines, key=lambda one: one[1])
    size = [one[2].size for one in lines]
    unknown = np.full(sum(size), np.nan)
    attrs = {"frames": frames, "width": scene.camera.width, "height": scene.camera.height, "source": "WHISK"}
    return dataset(
        attrs,
        segment_frame=np.array([one[1] for one in lines]),
        segment_start=np.cumsum([0, *size[:-1]]),
        segment_whisker=np.array([one[0] for one in lines]),
        column=np.concatenate([one[2] for one in lines]),
        row=np.concatenate([one[3] for one in lines]),
        line_width=unknown,
        line_contrast=unknown,
        position_sd=unknown,
    )
