"""One gap that passes under a whisker with a free end, by the fast model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.mechanics.free_end.free_end_prediction import FreeEndPrediction
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.scan_span import GAP_RATE, with_largest
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.surface import DEPTH, Gaps
from vibrissa.whisker import DAMPING, Whisker

if TYPE_CHECKING:
    import xarray as xr


def free_end_gap(
    whisker: Whisker,
    posture: Posture,
    *,
    width: float,
    depth: float = DEPTH,
    speed: float = 0.1,
    damping: float = DAMPING,
    n_modes: int = 3,
) -> xr.Dataset:
    """Draw one gap past the whisker, from when it meets the contact until it has left the free end and all is quiet.

    Parameters
    ----------
    whisker : Whisker
        The cone, to its physical tip.
    posture : Posture
        On the flat.
    width, depth : float
        Of the gap [m].
    speed : float
        [m/s].
    damping : float
        ζ of the first three modes on land.
    n_modes : int
        Number of pinned modes that are fitted.

    Returns
    -------
    Dataset
        As :meth:`vibrissa.mechanics.free_end.free_end_prediction.FreeEndPrediction.sampled` gives it, and
        ``largest_mode_displacement`` (mode), the largest |q + Q| over L.

    Raises
    ------
    InputError
        If a setting is out of range, or the whisker cannot follow across the gap.
    """
    gap = Gaps(np.array([0.0]), np.array([width]), depth)
    drawn = FreeEndPrediction(whisker, posture, gap, Scan(speed=speed, damping=damping), n_modes)
    return with_largest(drawn.sampled(GAP_RATE))
