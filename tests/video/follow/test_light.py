"""Light that is uneven and drifts by a fifth: the line stays where it is, whatever the background is taken from."""

from __future__ import annotations

import line_movie
import numpy as np
import pytest
from refusals import refusal

from vibrissa.video.follow.background import levelled
from vibrissa.video.tracking import Calibration, track

CALIBRATION = Calibration(frame_rate=5000.0, pixel_size=1.0e-4)
SEED = (250, 226)
FRAMES = 48
COLUMN, ROW = np.arange(line_movie.WIDTH), np.arange(line_movie.HEIGHT)[:, None]
VIGNETTE = 1 - 0.175 * (((COLUMN - 250) / 250) ** 2 + ((ROW - 225) / 225) ** 2)  # a third darker at the corners
EVEN = np.full((line_movie.HEIGHT, line_movie.WIDTH), 184.0)
PATTERN = 150 + 30 * np.sin(2 * np.pi * ROW / 24) * np.cos(2 * np.pi * COLUMN / 60)  # finer than a closing tells
DRIFT = 0.2 * np.sin(2 * np.pi * np.arange(FRAMES) / FRAMES)


def scene(row: np.ndarray, behind: np.ndarray, light: np.ndarray, noise: float, rng: np.random.Generator) -> np.ndarray:
    """Frames of uint8: what is behind, less the line, in the light of each frame."""
    contrast = np.where((COLUMN >= line_movie.FIRST) & (COLUMN <= line_movie.LAST), line_movie.contrast_of(COLUMN), 0)
    frames = np.empty((len(row), *behind.shape), np.uint8)
    for i, centre in enumerate(row):
        line = np.exp(-((ROW - centre) ** 2) / (2 * line_movie.SIGMA**2))
        image = (behind - contrast * line) * VIGNETTE * light[i] + noise * rng.standard_normal(behind.shape)
        frames[i] = np.clip(np.rint(image), 0, 255)
    return frames


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    return line_movie.truth(FRAMES)


def errors(frames: np.ndarray, truth: np.ndarray, **settings) -> np.ndarray:
    """Rows found less rows drawn [px], (frame, node)."""
    data = track([frames], seeds=[SEED], calibration=CALIBRATION, node_spacing=1e-4, **settings)
    size = CALIBRATION.pixel_size
    inner = slice(8, -8)
    x, y = data.x.values[0][:, inner] / size, data.y.values[0][:, inner] / size
    assert np.isfinite(y).mean() > 0.99
    return y - np.array([np.interp(x[t], COLUMN, truth[t]) for t in range(len(y))])


def following(error: np.ndarray) -> float:
    """Mean over nodes of the row's shift with the light [px], at 20 % more light."""
    return float(np.nanmean(error * DRIFT[:, None]) / np.mean(DRIFT**2) * 0.2)


@pytest.mark.parametrize("estimator", ["matched", "barycentre"])
def test_drifting_uneven_light_does_not_move_the_line_where_the_background_is_estimated(truth, estimator):
    frames = scene(truth, EVEN, 1 + DRIFT, 3.0, np.random.default_rng(3))
    error = errors(frames, truth, estimator=estimator)
    assert abs(np.nanmean(error)) < 0.01
    assert abs(following(error)) < 0.002


@pytest.mark.parametrize("estimator", ["matched", "barycentre"])
def test_frames_are_brought_to_the_light_of_a_reference(truth, estimator):
    """Without, a fifth of the pattern stays behind: the line shifts with the light by 0.007 px (barycentre 0.013)."""
    rng = np.random.default_rng(3)
    frames = scene(truth, PATTERN, 1 + DRIFT, 3.0, rng)
    empty = scene(np.full((1, line_movie.WIDTH), -50.0), PATTERN, np.ones(1), 0.0, rng)[0]
    error = errors(frames, truth, background=empty, estimator=estimator)
    assert abs(np.nanmean(error)) < 0.01
    assert abs(following(error)) < 0.002


def test_levelled_movie_has_the_light_of_the_reference():
    rng = np.random.default_rng(0)
    nowhere = np.full((3, line_movie.WIDTH), -50.0)
    light = np.array([0.8, 1.0, 1.2])
    frames = scene(nowhere, PATTERN, light, 0.0, rng)
    movie, image = levelled(lambda: [frames], frames[1], finer=True)
    (out,) = movie()
    assert out.dtype == np.uint16
    # whole grey levels of 0.8 to 1.2 times the light: half a level is up to 0.63 of one
    assert np.abs(out / 128.0 - image / 128.0).max() < 1.3
    with refusal("range", "background"):
        next(iter(levelled(lambda: [np.zeros_like(frames)], frames[1], finer=True)[0]()))


def test_wide_frames_are_levelled_alike(truth):
    rng = np.random.default_rng(3)
    frames = scene(truth[:6], PATTERN, 1 + DRIFT[:6], 3.0, rng)
    empty = scene(np.full((1, line_movie.WIDTH), -50.0), PATTERN, np.ones(1), 0.0, rng)[0]
    narrow = errors(frames, truth, background=empty)
    wide = errors(frames.astype(np.uint16) * 64, truth, background=empty.astype(np.uint16) * 64)
    # 1/64 of a grey level against 1/128: a tie between two paths may fall the other way
    off = np.abs(wide - narrow)
    assert np.median(off) < 1e-3
    assert np.quantile(off, 0.99) < 0.03
