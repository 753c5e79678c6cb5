"""How whiskers follow the phase of their pad: further or less far along the pad, and one after the other.

Whiskers of one column lag behind those of the next. To first order, a whisker that lags by an angle of a whisk is where
a whisker without lag is, less that angle times what the phase was a quarter of a whisk before: its *quarter*.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vibrissa.arrays import Array

LITTLE = 100.0  # sum of squared swings below which nothing is known of how they change along the pad [°²]
SMOOTH = 2.0  # frames over which the change of the phase is averaged
GAINS = 0.3, 2.0  # least and largest gain that is expected of a whisker
MOST = 0.6  # lag that is expected of a whisker at most [rad]


class Along(NamedTuple):
    """How whiskers follow the phase, by their place.

    Attributes
    ----------
    growth : float
        Growth of the gain along the pad [1/°].
    lead : float
        Growth along the pad of how far whiskers are ahead [rad/°].
    quarter : float
        Frames of a whisk over 2π.
    """

    growth: float
    lead: float
    quarter: float


ALIKE = Along(0.0, 0.0, 0.0)  # all whiskers follow alike


def along_of(swing: Array) -> Along:
    """How b goes with a, and with its change, in the swing (a, b), (frames − 1, 2) from each frame to the next."""
    if len(swing) < 3:
        return Along(0.0, 0.0, 0.0)
    change = np.gradient(gaussian_filter1d(swing[:, 0], SMOOTH))
    quarter = float(np.std(gaussian_filter1d(swing[:, 0], SMOOTH)) / max(float(np.std(change)), 1e-6))
    terms = np.stack([swing[:, 0], quarter * change], axis=1)
    growth, lead = np.linalg.solve(terms.T @ terms + LITTLE * np.eye(2), terms.T @ swing[:, 1])
    return Along(float(growth), float(lead), quarter)


def quartered(phase: Array, along: Along) -> Array:
    """Phase (T,) and, beside it, its quarter: its change in the frames of a whisk over 2π, (T, 2) [°]."""
    change = np.gradient(phase) if phase.size > 1 else np.zeros(phase.size)
    return np.stack([phase, along.quarter * gaussian_filter1d(change, SMOOTH)], axis=1)


def gains_at(place: Array, along: Along) -> Array:
    """Gains (n, 2) on the phase and on its quarter of whiskers at places (n,) [°]."""
    gain, lead = 1 + along.growth * place, along.lead * place
    return np.stack([np.clip(gain, *GAINS), np.clip(lead, -MOST, MOST)], axis=-1)
