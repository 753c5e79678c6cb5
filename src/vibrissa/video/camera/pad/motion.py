"""How head and whiskers move: functions of time, so that any instant follows from the scene's seed alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from vibrissa.arrays import Array
from vibrissa.video.camera.pad.layout import Whiskers
from vibrissa.video.camera.pad.settings import WhiskingScene, Whisks

_TONES = 8
_OWN_FASTEST = 12.0  # Hz
_MARGIN = 4  # cycles drawn before zero and after the last instant


class HeadPath(NamedTuple):
    """Nose (T, 2) [m] in the image and heading (T,) [rad]."""

    nose: Array
    heading: Array


def tones(rng: np.random.Generator, count: int, fastest: float, time: Array) -> Array:
    """Smooth random functions of time: sums of sinusoids, one in each eighth of the band from 0 to ``fastest``.

    Parameters
    ----------
    rng : Generator
        Draws frequencies and phases.
    count : int
        Number of functions.
    fastest : float
        Upper end of the band [Hz].
    time : (T,) array
        Instants [s].

    Returns
    -------
    (count, T) array
        Of variance 1 over all time.
    """
    band = fastest * (np.arange(_TONES) + rng.uniform(size=(count, _TONES))) / _TONES
    phase = rng.uniform(0, 2 * np.pi, (count, _TONES, 1))
    return np.asarray(np.sqrt(2 / _TONES) * np.sin(2 * np.pi * band[..., None] * time + phase).sum(axis=1))


def head_path(scene: WhiskingScene, time: Array) -> HeadPath:
    """Where the head is.

    Parameters
    ----------
    scene : WhiskingScene
        Its head and seed count.
    time : (T,) array
        Instants [s].

    Returns
    -------
    HeadPath
        At these instants.
    """
    head = scene.head
    x, y, turn = tones(np.random.default_rng([scene.seed, 2]), 3, head.fastest, time)
    nose = np.stack([head.nose[0] + head.shift * x, head.nose[1] + head.shift * y], axis=1)
    return HeadPath(nose, head.heading + head.turn * turn)


def whisker_angles(scene: WhiskingScene, whiskers: Whiskers, time: Array) -> Array:
    """Directions of all whiskers at their bases.

    Parameters
    ----------
    scene : WhiskingScene
        Its whisks and seed count.
    whiskers : Whiskers
        The whiskers.
    time : (T,) array
        Instants [s], ascending, from about zero.

    Returns
    -------
    (W, T) array
        Angle from tailwards to the whisker [rad], protraction positive.
    """
    whisks = scene.whisks
    phase, amplitude, middle = _cycles(whisks, np.random.default_rng([scene.seed, 3]), time)
    delay = whiskers.column * whisks.lag / (2 * np.pi * whisks.frequency)
    own = tones(np.random.default_rng([scene.seed, 4]), len(delay), _OWN_FASTEST, time)
    swing = np.stack([middle(time - d) + amplitude(time - d) * np.cos(2 * np.pi * phase(time - d)) for d in delay])
    return np.asarray(whiskers.rest[:, None] + whiskers.gain[:, None] * swing + whisks.own * own)


def _cycles(
    whisks: Whisks, rng: np.random.Generator, time: Array
) -> tuple[PchipInterpolator, PchipInterpolator, PchipInterpolator]:
    """Phase [cycles], amplitude and middle [rad] as functions of time; each cycle has its own."""
    first = rng.uniform()
    # cycle after cycle is drawn from a fixed start, so that an instant's are the same in a longer movie
    count = int(np.ceil(2 * max(time[-1], 0.0) * whisks.frequency)) + 4 * _MARGIN
    draws = rng.standard_normal((count, 3)).clip(-2.5, 2.5).T
    period = (1 + whisks.variability / 2 * draws[0]).clip(0.4) / whisks.frequency
    knots = np.cumsum(period) - period[0] - _MARGIN / whisks.frequency
    amplitude = whisks.amplitude * (1 + whisks.variability * draws[1]).clip(0)
    middle = whisks.set_point + whisks.variability * whisks.amplitude * draws[2]
    return tuple(PchipInterpolator(knots, values) for values in (np.arange(count) + first, amplitude, middle))
