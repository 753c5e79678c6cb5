"""Twelve evenly spaced frames of a tracked movie: python make_contact_sheet.py STUDY.toml PROFILE.nc OUT.jpg."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
import numpy as np
import xarray as xr
from scipy.ndimage import gaussian_filter

from vibrissa.study.spec.settings import read_study
from vibrissa.video.io.movie import read_blocks

matplotlib.use("Agg")
import matplotlib.pyplot as plt

FRAMES, ACROSS, WIDE = 12, 3, 3.3  # inches of a frame
COLOURS = ("red", "deepskyblue", "lime", "orange", "magenta")
EVERY = 3  # nodes between two dots, so that the whisker stays visible
BOX = {"facecolor": "white", "edgecolor": "none", "pad": 1}  # behind the number, where the arm is black


def sheet(study: str, profile: str, out: str, chosen: list[int] | None = None) -> None:
    """Draw the contact sheet; ``chosen`` are other frames than the evenly spaced ones."""
    settings = read_study(study)
    data = xr.load_dataset(profile)
    x, y = (data[name].values / data.attrs["pixel_size"] for name in ("x", "y"))
    frames = chosen or np.linspace(0, x.shape[1] - 1, FRAMES).round().astype(int).tolist()
    left, right = np.nanmin(x) - 5, np.nanquantile(x, 0.98) + 5
    top, bottom = np.nanquantile(y, 0.005) - 5, np.nanmax(y) + 5
    down = -(-len(frames) // ACROSS)
    tall = WIDE * (bottom - top) / (right - left)
    figure, axes = plt.subplots(down, ACROSS, figsize=(ACROSS * WIDE, down * tall))
    wanted = iter(sorted(set(frames)))
    images, done, frame = {}, 0, next(wanted)
    for block in read_blocks(Path(settings.folder) / settings.movie.path):
        while frame is not None and frame < done + len(block):
            images[frame] = block[frame - done].copy()
            frame = next(wanted, None)
        done += len(block)
    for axis, f in zip(axes.flat, frames, strict=False):
        grey = gaussian_filter(images[f].astype(float), 0.7) + 10
        axis.imshow(grey / gaussian_filter(grey, 8), cmap="gray", vmin=0.82, vmax=1.06)
        for w, colour in zip(range(x.shape[0]), COLOURS, strict=False):
            axis.plot(x[w, f, ::EVERY], y[w, f, ::EVERY], ".", color=colour, markersize=6, markeredgewidth=0)
        axis.set(xlim=(left, right), ylim=(bottom, top))
        axis.text(right - 4, top + 4, str(f), color="blue", fontsize=8, ha="right", va="top", bbox=BOX)
    for axis in axes.flat:
        axis.axis("off")
    figure.subplots_adjust(0, 0, 1, 1, 0.01, 0.01)
    figure.savefig(out, dpi=150, pil_kwargs={"quality": 82})


if __name__ == "__main__":
    sheet(*sys.argv[1:4])
