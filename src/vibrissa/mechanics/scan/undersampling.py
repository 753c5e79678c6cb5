"""Whether a record has samples enough to follow the contact over the surface."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.scan.motion import PredictedMotion
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps

_FINER = 64  # samples that are looked at for each one of the record
_MOST = 16  # times the rate that may be named: at 64 times nothing lies between the samples that are looked at
_WINDOWS, _LENGTH = 24, 64  # stretches of the record that are looked at, and samples of each at least
_LASTS = 3.2e-3  # [s] of a stretch at least: within shorter ones a rough surface is alike, however finely it is sampled
_LOST = 0.35  # share of the contact's motion that may lie between samples: 8 for each period of a sawtooth, 4 of a sine
_STILL = 1e-12  # [L] a contact that moves by less is at rest


def contact_rate(prediction: PredictedMotion, rate: float) -> float:
    """Sampling rate at which a record follows the contact.

    Excursion, height and whatever is quasi-static are sampled where the contact is, however fast that changes; the
    modes' vibration is computed between events and is right at any rate.

    Parameters
    ----------
    prediction : PredictedMotion
        The motion.
    rate : float
        Samples per second that are asked for [Hz].

    Returns
    -------
    float
        ``rate`` if it is enough; else the first of its doubles at which straight lines between samples miss the
        contact's motion by less than 35 % (root mean square over its standard deviation, median over stretches of the
        record); infinite beyond 16 times.
    """
    return _enough(_looked_at(prediction, rate), rate)


def contact_lines(prediction: PredictedMotion, rate: float) -> list[str]:
    """What to know of a record whose samples do not follow the contact.

    Parameters
    ----------
    prediction : PredictedMotion
        The motion.
    rate : float
        Samples per second [Hz].

    Returns
    -------
    list of str
        One line, or none.
    """
    needed = contact_rate(prediction, rate)
    if needed == rate:
        return []
    enough = f"{needed:g} would do" if np.isfinite(needed) else f"not even {rate * _MOST:g} would do"
    wrong = "excursion and what is quasi-static are aliased (vibration and its envelope are not)"
    return [f"{rate:g} samples per second do not follow the contact: {wrong}; {enough}"]


def surface_remarks(surface: Gaps | HeightProfile, speed: float, rate: float) -> list[str]:
    """What to know of a record of the whole whisker whose samples do not follow the surface below it.

    Forces and moments at the base follow the surface under each contact at once, and are recorded at the samples alone.

    Parameters
    ----------
    surface : Gaps or HeightProfile
        As it moves below the whisker.
    speed : float
        [m/s].
    rate : float
        Samples per second [Hz].

    Returns
    -------
    list of str
        One line, or none. A rate is enough by the rule of :func:`contact_rate`, for heights that pass a fixed place.
    """
    heights, end = (
        (surface.at, surface.position) if isinstance(surface, HeightProfile) else (surface.height, surface.end)
    )
    start = float(surface.position[0])
    steps = _steps(int((float(end[-1]) - start) / speed * rate), rate)
    needed = _enough(heights(start + steps.ravel() * speed / rate).reshape(1, *steps.shape), rate)
    if needed == rate:
        return []
    enough = f"{needed:g} would do" if np.isfinite(needed) else f"not even {rate * _MOST:g} would do"
    lost = "what is fast in forces, moments and motion is aliased or lost"
    return [f"{rate:g} samples per second do not follow the surface at {speed:g} m/s: {lost}; {enough}"]


def _enough(fine: Array, rate: float) -> float:
    """First double of a rate at which straight lines between samples are near enough; infinite if none is."""
    finer = (1 << k for k in range(_MOST.bit_length()))
    return next((rate * k for k in finer if _missed(fine, _FINER // k) < _LOST), np.inf)


def _steps(samples: int, rate: float) -> Array:
    """Stretches of a record of this number of samples, finely, (stretches, samples) in samples from its start."""
    count = max(samples, 1)
    length = min(count, max(_LENGTH, round(_LASTS * rate)))
    starts = np.linspace(0, count - length, min(count // length, _WINDOWS)).astype(int)
    return np.asarray(starts[:, None] + np.arange(length * _FINER + 1) / _FINER)


def _looked_at(prediction: PredictedMotion, rate: float) -> Array:
    """Place of the contact in stretches of the record, finely sampled, (places, stretches, samples) over L."""
    steps = _steps(int(prediction.end * rate), rate)
    where = prediction.where(steps.ravel() / rate)
    return np.array([where[one].reshape(steps.shape) for one in where])


def _missed(fine: Array, every: int) -> float:
    """Miss of straight lines between every n-th sample, over the standard deviation."""
    grid, worst = np.arange(fine.shape[-1]), 0.0
    for place in fine:
        moving = place[place.std(axis=-1) > _STILL]
        if len(moving):
            lines = np.array([np.interp(grid, grid[::every], one[::every]) for one in moving])
            missed = np.sqrt(np.mean((moving - lines) ** 2, axis=-1)) / moving.std(axis=-1)
            worst = max(worst, float(np.median(missed)))
    return worst
