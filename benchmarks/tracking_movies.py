"""Movies of whiskers whose centrelines are known, and the least scatter with which a line in them can be placed."""

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vibrissa.video.camera.rendering import Camera, exposure_times, render
from vibrissa.video.follow.search import Search

FRAMES, WIDTH, HEIGHT = 40, 500, 450
COLUMNS = np.arange(50, 451)  # of every whisker, base on the left
ANIMAL, DARK = slice(0, 40), 15.0  # columns of the animal's silhouette, without which WHISK traces almost nothing; grey
SUBFRAMES = 8
FWHM = np.sqrt(8 * np.log(2))


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One kind of movie; contrast in grey levels (one value: the same from base to tip), speed in pixels per frame."""

    table: str
    name: str
    contrast: tuple[float, float] = (75.0, 75.0)
    noise: float = 3.0
    blur: float = 1.8
    speed: float = 0.1
    whiskers: int = 1
    crossing: bool = False
    gradient: float = 0.0
    threshold: float = Search.threshold  # of the tracker, not of the movie

    @property
    def file(self) -> str:
        return f"{self.table} {self.name}".replace(" ", "_").replace(",", "").replace("→", "to").replace("±", "")

    @property
    def camera(self) -> Camera:
        return Camera(
            width=WIDTH, height=HEIGHT, noise=self.noise, blur=self.blur, gradient=(self.gradient, self.gradient)
        )


def cells() -> list[Cell]:
    """List the movies in the order of the tables."""
    even, shaft = [(c, (float(c), float(c))) for c in (110, 75, 45, 32, 24, 15)], (110.0, 24.0)
    found = [Cell(table="contrast", name=f"{c}", contrast=pair) for c, pair in even]
    found += [Cell(table="contrast", name=f"110 → {c}", contrast=(110.0, float(c))) for c in (45, 24, 15)]
    found += [
        Cell(table="noise", name=f"{noise:g}, contrast {c}", noise=noise, contrast=pair)
        for (c, pair), noise in itertools.product(even[1:5], (1.5, 5.0))
    ]
    found += [
        Cell(table="threshold", name=f"4, contrast {c}, noise {noise:g}", contrast=pair, noise=noise, threshold=4.0)
        for (c, pair), noise in ((even[5], 3.0), (even[4], 5.0))
    ]
    found += [
        Cell(table="blur", name=f"{blur:g}, contrast {c}", blur=blur, contrast=pair)
        for (c, pair), blur in itertools.product((even[1], even[2], even[4]), (1.5, 2.3))
    ]
    found += [Cell(table="speed", name=f"{speed:g}", speed=speed) for speed in (0.5, 1.0, 2.0, 3.0)]
    found += [Cell(table="whiskers", name=f"{n} apart", whiskers=n, contrast=shaft) for n in (3, 5)]
    found += [Cell(table="whiskers", name=f"{n} crossing", whiskers=n, contrast=shaft, crossing=True) for n in (2, 5)]
    found += [Cell(table="light", name=f"±30, contrast {c}", gradient=60.0, contrast=pair) for c, pair in even[1:5:3]]
    hard = {"noise": 5.0, "blur": 2.3, "whiskers": 5, "crossing": True, "gradient": 60.0}
    found += [Cell(table="all", name="at once", contrast=(110.0, 15.0), speed=1.0, **hard)]
    return found


class Scene(NamedTuple):
    """A movie (frames, rows, columns), the rows of its whiskers (whisker, frame, instant, column), and contrasts."""

    frames: np.ndarray
    instants: np.ndarray
    contrast: np.ndarray
    cell: Cell

    @property
    def truth(self) -> np.ndarray:
        return self.instants.mean(axis=2)


def courses(cell: Cell, rng: np.random.Generator) -> np.ndarray:
    """Rows at rest (whisker, column): bases in order from above, tips in order too or changed about."""
    place, u = np.arange(cell.whiskers) - (cell.whiskers - 1) / 2, (COLUMNS - COLUMNS[0]) / np.ptp(COLUMNS)
    order = place
    while cell.crossing and np.array_equal(order, place):
        order = rng.permutation(place)
    middle, tilt, bend = 225 + rng.uniform(-20, 20), rng.uniform(-50, 50), rng.uniform(-20, 20)
    base, tip = (where * step + rng.uniform(-6, 6, cell.whiskers) for where, step in ((place, 45.0), (order, 60.0)))
    bends = bend + rng.uniform(-4, 4, cell.whiskers)
    return middle + base[:, None] * (1 - u) + (tilt + tip[:, None]) * u + 4 * bends[:, None] * u * (1 - u)


def motion(cell: Cell, rng: np.random.Generator) -> np.ndarray:
    """Displacement (whisker, frame, instant, column) [px]: two modes, of periods near 17 and 6 frames, at every phase.

    At the tip the first reaches 0.8 of the speed, the second 0.2; both are 0 at the base.
    """
    u = (COLUMNS - COLUMNS[0]) / np.ptp(COLUMNS)
    time = exposure_times(cell.camera, FRAMES, SUBFRAMES) * cell.camera.frame_rate
    out = np.zeros((cell.whiskers, time.size, u.size))
    for share, near, half_waves in ((0.8, 17.0, 0.5), (0.2, 6.0, 1.5)):
        period, phase = near * rng.uniform(0.9, 1.1, cell.whiskers), rng.uniform(0, 2 * np.pi, cell.whiskers)
        swing = np.sin(2 * np.pi * time / period[:, None] + phase[:, None]) * share * period[:, None] / (2 * np.pi)
        out += cell.speed * swing[:, :, None] * np.sin(np.pi * half_waves * u)
    return out.reshape(cell.whiskers, FRAMES, SUBFRAMES, u.size)


def film(cell: Cell, seed: int) -> Scene:
    """One movie of the cell."""
    rng, camera = np.random.default_rng(seed), cell.camera
    rows = courses(cell, rng)[:, None, None] + motion(cell, rng)
    contrast = np.linspace(*cell.contrast, COLUMNS.size)
    y = rows.reshape(cell.whiskers, -1, COLUMNS.size) * camera.pixel_size
    x = np.broadcast_to(COLUMNS * camera.pixel_size, y.shape)
    blocks = render(x, y, camera, seed=seed, subframes=SUBFRAMES, contrast=contrast, block=FRAMES)
    frames = next(iter(blocks)).copy()
    animal = rng.normal(DARK, cell.noise, frames[..., ANIMAL].shape)
    frames[..., ANIMAL] = np.clip(np.rint(animal), 0, 255)
    return Scene(frames, rows, contrast, cell)


def unexplained(slope: np.ndarray, nuisances: Iterable[np.ndarray]) -> np.ndarray:
    """Sum of squares over the last axis of what no combination of the nuisances explains of the slope."""
    basis: list[np.ndarray] = []
    for one in (*nuisances, slope):
        rest = one
        for unit in basis:
            rest = rest - np.sum(rest * unit, axis=-1, keepdims=True) * unit
        square = np.sum(rest**2, axis=-1)
        basis.append(rest / np.sqrt(square)[..., None])
    return square


def bound(scene: Scene, whisker: int) -> np.ndarray:
    """Cramér–Rao bound (frame, column) of the row of one whisker read in one column [px].

    The line's profile is known: a Gaussian of the camera's blur, 1/cos of the slope wider along the column, drawn out
    by the motion in the exposure. Its row and its amplitude are not; the background is. Noise is white, and rounding
    to whole grey levels adds 1/12 to its variance. Other whiskers are not there.
    """
    rows, cell = scene.instants[whisker], scene.cell
    width = cell.blur / FWHM * np.sqrt(1 + np.gradient(rows, axis=-1) ** 2)
    centre = rows.mean(axis=1)
    pixel = np.rint(centre)[..., None] + np.arange(-12, 13)
    u = (pixel[:, None] - rows[..., None]) / width[..., None]
    bell = np.exp(-(u**2) / 2)
    profile, slope = bell.mean(axis=1), (bell * u / width[..., None]).mean(axis=1)
    across, down = COLUMNS / (WIDTH - 1) - 0.5, centre / (HEIGHT - 1) - 0.5
    light = 1 + cell.gradient * (across + down) / cell.camera.background
    return np.sqrt((cell.noise**2 + 1 / 12) / unexplained(slope, [profile])) / (scene.contrast * light)


def others(truth: np.ndarray) -> np.ndarray:
    """Distance (whisker, frame, column) to the nearest other whisker, in rows; infinite for one whisker."""
    off = np.abs(truth[:, None] - truth)
    off[np.arange(len(truth)), np.arange(len(truth))] = np.inf
    return off.min(axis=1)


def seeds_of(scene: Scene) -> list[tuple[float, float]]:
    """A point near each whisker in the first frame, where it is clear, near column 150."""
    away = others(scene.truth)[:, 0]
    found = []
    for row, space in zip(scene.truth[:, 0], away, strict=True):
        free = np.flatnonzero(space > min(20, space.max() - 1e-9)) if np.isfinite(space).all() else np.arange(len(row))
        k = free[np.argmin(np.abs(COLUMNS[free] - 150))]
        found.append((float(COLUMNS[k]), float(np.rint(row[k]))))
    return found
