"""One gap that passes under the rod."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import RangeError
from vibrissa.mechanics.rod.rod_prediction import RodPrediction
from vibrissa.mechanics.rod.rod_settings import USUAL_ROD, Rod
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.scan_span import GAP_RATE, with_largest
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.surface import DEPTH, Gaps
from vibrissa.whisker import DAMPING, Whisker

if TYPE_CHECKING:
    import xarray as xr

_WIDEST = 0.2  # of a gap, over L: a wider one is given in another unit


def rod_gap(crossing: RodPrediction, *, progress: Callable[[int, int], None] | None = None) -> xr.Dataset:
    """Draw one gap under the rod, from when it meets the contact until it has left the free end and all is quiet.

    Parameters
    ----------
    crossing : RodPrediction
        From :func:`gap_prediction`.
    progress : callable, optional
        Takes the records that are done, and all of them.

    Returns
    -------
    Dataset
        As :meth:`vibrissa.mechanics.rod.rod_prediction.RodPrediction.sampled` gives it, and
        ``largest_mode_displacement`` (mode), the largest |q + Q| over L.

    Raises
    ------
    InputError
        If a setting is out of range.
    """
    return with_largest(crossing.sampled(GAP_RATE, progress=progress))


def gap_prediction(
    whisker: Whisker,
    posture: Posture,
    *,
    width: float,
    depth: float = DEPTH,
    speed: float = 0.1,
    damping: float = DAMPING,
    n_modes: int = 3,
    settings: Rod = USUAL_ROD,
) -> RodPrediction:
    """One gap that will be drawn under the rod.

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
    settings : Rod
        Of the rod; cells and steps of the default are halved, since one gap is short.

    Returns
    -------
    RodPrediction
        With the gap at the contact at time 0.

    Raises
    ------
    InputError
        If the gap is wider than a fifth of L.
    """
    if not width <= _WIDEST * whisker.length:
        most = 1e3 * _WIDEST * whisker.length
        raise RangeError("gap_width", f"must be at most {most:.3g} mm for the rod", f"{width:g} m", "for example 0.5mm")
    if (settings.fineness, settings.step) == (USUAL_ROD.fineness, USUAL_ROD.step):
        settings = replace(settings, fineness=settings.fineness.refined(2), step=settings.step / 2)
    gap = Gaps(np.array([0.0]), np.array([width]), depth)
    return RodPrediction(whisker, posture, gap, Scan(speed=speed, damping=damping), n_modes, settings)
