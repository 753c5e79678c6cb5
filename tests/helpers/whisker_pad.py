"""A synthetic pad of six whiskers that swing through one another, whose lines are known."""

from __future__ import annotations

import numpy as np

from vibrissa.video.identity.whisker_fan import Fan

HEIGHT, WIDTH, FRAMES = 220, 220, 150
FAN = Fan(pivot=(-16.0, 110.0), radii=(70.0, 130.0), angles=(-50.0, 50.0))
RESTS = np.array([-12.0, -6.0, 0.0, 7.0, 13.0, 20.0])  # of the whiskers [°], when the pad does not protract
GAINS = np.array([1.0, 1.35, 0.95, 1.4, 1.0, 1.3])  # of one row and of another: they cross when the pad protracts
OFFSETS = np.array([-3.0, 3.0, -2.0, 4.0, -3.0, 2.0])
DENSITIES = np.array([0.14, 0.18, 0.12, 0.2, 0.16, 0.13])


def angles_of_pad() -> np.ndarray:
    """(whisker, frame) [°]: whisks of 15 frames whose amplitude changes, up to 7° between frames."""
    t = np.arange(FRAMES)
    phase = 16 * (1 + 0.5 * np.sin(2 * np.pi * t / 70)) * (1 - np.cos(2 * np.pi * t / 15)) / 2
    return RESTS[:, None] - GAINS[:, None] * phase


def rows_of_pad(angles: np.ndarray) -> np.ndarray:
    """(whisker, frame, column): straight lines that pass the pivot at their offsets, drooping a little."""
    column = np.arange(WIDTH)
    slope = np.deg2rad(angles - np.rad2deg(OFFSETS / FAN.middle)[:, None])[..., None]
    away = column - FAN.pivot[0]
    return FAN.pivot[1] + away * np.tan(slope) + OFFSETS[:, None, None] / np.cos(slope) + 2e-4 * away**2


def movie_of_pad(angles: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Whiskers of 2 px full width that take light away, one after the other, with pixel noise."""
    rows = rows_of_pad(angles)
    cosine = np.cos(np.deg2rad(angles))
    frames = np.empty((angles.shape[1], HEIGHT, WIDTH), np.uint8)
    for t in range(len(frames)):
        distance = (np.arange(HEIGHT)[None, :, None] - rows[:, t, None, :]) * cosine[:, t, None, None]
        shade = (DENSITIES[:, None, None] * np.exp(-(distance**2) / 1.5)).sum(axis=0)
        frames[t] = np.clip(180 * np.exp(-shade) + rng.normal(0, 1.5, shade.shape), 0, 255).round()
    return frames


def mark(angles: np.ndarray, w: int, t: int) -> tuple[int, float, float]:
    return t, 90.0, float(rows_of_pad(angles)[w, t, 90])
