"""Whether a record has samples enough to follow the contact over the surface."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.scan.motion import PredictedMotion

_FINER = 64  # samples that are looked at for each one of the record
_WINDOWS, _LENGTH = 24, 64  # stretches of the record that are looked at, and samples of each at most
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
        record); infinite beyond 64 times.
    """
    fine = _looked_at(prediction, rate)
    finer = (1 << k for k in range(_FINER.bit_length()))
    return next((rate * k for k in finer if _missed(fine, _FINER // k) < _LOST), np.inf)


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
    enough = f"{needed:g} would do" if np.isfinite(needed) else f"not even {rate * _FINER:g} would do"
    wrong = "excursion and what is quasi-static are aliased (vibration and its envelope are not)"
    return [f"{rate:g} samples per second do not follow the contact: {wrong}; {enough}"]


def _looked_at(prediction: PredictedMotion, rate: float) -> Array:
    """Place of the contact in stretches of the record, finely sampled, (places, stretches, samples) over L."""
    count = max(int(prediction.end * rate), 1)
    length = min(count, _LENGTH)
    starts = np.linspace(0, count - length, min(count // length, _WINDOWS)).astype(int)
    steps = starts[:, None] + np.arange(length * _FINER + 1) / _FINER
    where = prediction.where(steps.ravel() / rate)
    return np.array([where[one].reshape(steps.shape) for one in where])


def _missed(fine: Array, every: int) -> float:
    """Miss of straight lines between every so many samples, over the standard deviation."""
    grid, worst = np.arange(fine.shape[-1]), 0.0
    for place in fine:
        moving = place[place.std(axis=-1) > _STILL]
        if len(moving):
            lines = np.array([np.interp(grid, grid[::every], one[::every]) for one in moving])
            missed = np.sqrt(np.mean((moving - lines) ** 2, axis=-1)) / moving.std(axis=-1)
            worst = max(worst, float(np.median(missed)))
    return worst
