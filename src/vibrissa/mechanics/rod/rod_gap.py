"""One gap that passes under the rod."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.exact import cone_kappa
from vibrissa.mechanics.rod.rod_model import RodSettings
from vibrissa.mechanics.rod.rod_scan import RodRun, drag
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.surface import DEPTH, Gaps
from vibrissa.whisker import Whisker

_RATE = 20e3  # [Hz]
_RINGING = 4.0  # decay times of the slowest mode after the gap has left the free end
_LONGEST = 0.3  # [s] without damping it would never end


class GapCrossing(NamedTuple):
    """One gap, as the rod meets it.

    Attributes
    ----------
    largest : (M,) array
        Largest |q_i + Q_i| while the gap passes, over L.
    run : RodRun
        The whole record.
    """

    largest: Array
    run: RodRun


def rod_gap(
    whisker: Whisker,
    posture: Posture,
    *,
    width: float,
    depth: float = DEPTH,
    speed: float = 0.1,
    damping: float = 0.11,
    n_modes: int = 3,
    settings: RodSettings = RodSettings(),
) -> GapCrossing:
    """Draw one gap under the rod, from before it meets the contact until it has left the free end and all is quiet.

    Parameters
    ----------
    whisker : Whisker
        The cone, to its physical tip.
    posture : Posture
        Its base is held at the height and angle of Eq. (1).
    width, depth : float
        Of the gap [m].
    speed : float
        [m/s].
    damping : float
        ζ of the first three modes.
    n_modes : int
        Number of pinned modes that are fitted.
    settings : RodSettings
        Of the rod.

    Returns
    -------
    GapCrossing
        Time 0 is the moment the gap meets the contact.

    Raises
    ------
    InputError
        If a setting is out of range.
    """
    free_end = (posture.contact - whisker.tip) * whisker.length
    decay = damping * float(cone_kappa(posture.contact, 1)[0]) / whisker.timescale
    quiet = min(_LONGEST, _RINGING / max(decay, 1e-12))
    before = 0.1 * width / speed + 1e-3
    run = drag(
        whisker,
        posture,
        Gaps(np.array([0.0]), np.array([width]), depth),
        speed=speed,
        damping=damping,
        start=-before,
        duration=before + (width + free_end) / speed + quiet,
        sampling_rate=_RATE,
        n_modes=n_modes,
        settings=settings,
    )
    return GapCrossing(np.abs(run.mode_displacement).max(axis=1), run)
