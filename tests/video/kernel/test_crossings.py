"""Whiskers that cross, move, and are marked by one seed each: on movies whose centrelines are known."""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from vibrissa.video.camera.rendering import Camera, exposure_times, render
from vibrissa.video.follow.following import centrelines

MOVIES, FRAMES = 50, 12
BUNDLES = 30
CAMERA = Camera(width=400, height=300, noise=3.0)
COLUMNS = np.arange(40, 361)
U = (COLUMNS - COLUMNS[0]) / np.ptp(COLUMNS)
HOP = 2.0  # [px] beyond it a row is on another line


class Crossing(NamedTuple):
    frames: np.ndarray
    rows: np.ndarray  # (whisker, frame, column)
    seeds: list[tuple[float, float]]


def slopes(rng, count, least, most):
    """Angles to the columns [rad], in any order: two that are ``least`` to ``most`` apart, or ``count`` within most."""
    steps = rng.uniform(least, most if count == 2 else most / (count - 1), count - 1)
    angles = np.append(0, np.cumsum(steps))
    return np.deg2rad(rng.permutation(angles - angles.mean()) + rng.uniform(-5, 5))


def crossing(seed, count, least=8.0, most=60.0, speed=1.0):
    """Curved whiskers, of 50–110 grey levels at the base, that cross near the middle and move by ``speed`` px/frame."""
    rng = np.random.default_rng(seed)
    slope, bend = np.tan(slopes(rng, count, least, most)), rng.uniform(-12, 12, count)
    middle = rng.uniform(140, 260) + rng.uniform(-60, 60, count)
    rest = 150 + slope[:, None] * (COLUMNS - middle[:, None]) + 4 * bend[:, None] * U * (1 - U)
    time = exposure_times(CAMERA, FRAMES, 4) * CAMERA.frame_rate
    period, phase = rng.uniform(10, 40, (count, 1)), rng.uniform(0, 2 * np.pi, (count, 1))
    swing = speed * period / (2 * np.pi) * np.sin(2 * np.pi * time / period + phase)
    rows = rest[:, None] + swing[..., None] * (0.2 + 0.8 * U)
    contrast = rng.uniform(50, 110, (count, 1)) * (1 - U * rng.uniform(0.4, 0.75, (count, 1)))
    x, y = np.broadcast_to(COLUMNS, rows.shape) * CAMERA.pixel_size, rows * CAMERA.pixel_size
    frames = next(render(x, y, CAMERA, seed=seed, subframes=4, contrast=contrast, block=FRAMES))
    truth = rows.reshape(count, FRAMES, 4, -1).mean(axis=2)
    return Crossing(frames, truth, [clear_point(truth[:, 0], w, rng) for w in range(count)])


def clear_point(rows, w, rng):
    """A point of whisker w with no other one within 10 px over 41 columns, as far as there is such a stretch."""
    away = np.abs(np.delete(rows, w, axis=0) - rows[w]).min(axis=0)
    away[(rows[w] < 8) | (rows[w] > CAMERA.height - 9)] = 0
    clear = np.lib.stride_tricks.sliding_window_view(np.pad(away, 20, mode="edge"), 41).min(axis=1)
    k = rng.choice(np.flatnonzero(clear >= min(10, clear.max())))
    return float(COLUMNS[k]), float(np.rint(rows[w, k]))


@cache
def followed(count, **scene):
    """For each movie the share of rows that are on another line, of those that are lost, and of swapped frames."""
    found = []
    for seed in range(BUNDLES if count > 2 else MOVIES):
        frames, truth, seeds = crossing(seed, count, **scene)
        (lines,) = centrelines([frames], seeds=seeds)
        row = lines.row[..., COLUMNS]
        seen = ~np.isnan(row)
        clear = (truth > 6) & (truth < CAMERA.height - 7)
        off = np.abs(row[:, None] - truth)  # (whisker, of whom, frame, column)
        nearer = (off < off[range(count), range(count)][:, None]).sum(axis=-1).max(axis=1)
        own = off[range(count), range(count)]
        found.append(((own > HOP)[seen].mean(), (~seen)[clear].mean(), (2 * nearer > seen.sum(axis=-1)).mean()))
    return np.array(found).T


def test_two_whiskers_that_cross_are_followed_each_on_its_own_line():
    hopped, lost, swapped = followed(2)
    assert np.mean(hopped > 0.05) <= 0.02
    assert np.mean(lost > 0.05) <= 0.04
    assert not swapped.any()


def test_two_whiskers_that_cross_at_eight_degrees_are_not_swapped():
    hopped, _, swapped = followed(2, most=10.0)
    assert np.mean(hopped > 0.05) <= 0.04
    assert not swapped.any()


def test_of_five_whiskers_in_a_bundle_none_is_swapped():
    """Ten crossings within 120 columns."""
    hopped, _, swapped = followed(5)
    assert np.mean(hopped > 0.05) <= 0.04
    assert not swapped.any()


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_the_seeds_changes_nothing(seed):
    frames, _, seeds = crossing(seed, 5)
    (one,) = centrelines([frames], seeds=seeds)
    (other,) = centrelines([frames], seeds=seeds[::-1])
    np.testing.assert_array_equal(one.row, other.row[::-1])
