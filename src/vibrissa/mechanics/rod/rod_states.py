"""What the contacts of the rod do along the way: slip, stick, bridge a gap, or none at all."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps

STATES = ("detached", "slip", "stick", "bridge")
_SLACK = 1e-6  # over L: errors of rounding, so that a contact at a gap's edge is one
_APART = 0.01  # over L: contacts farther apart bridge what is between, on a surface that has no gaps by name


def contact_states(summary: Array, surface: Gaps | HeightProfile, length: float) -> Integers:
    """State of the contacts at each time, as numbers of ``STATES``.

    Parameters
    ----------
    summary : (11, T) array
        ``Touch.summary`` of each time.
    surface : Gaps or HeightProfile
        In metres; a whole gap between the first contact and the last is bridged. Of a profile of heights, contacts
        farther apart than 0.01 L bridge what is between them.
    length : float
        L [m].

    Returns
    -------
    (T,) array
        0 without contact; 3 with contacts on both sides of a gap; 2 where every contact sticks; 1 otherwise.
    """
    first, last, count, sticking = summary[2], summary[3], summary[4], summary[5]
    state = np.where(count == 0, 0, np.where(sticking == count, 2, 1))
    if isinstance(surface, HeightProfile):
        bridged = last - first > _APART
    else:
        low, high = length * np.minimum(summary[9], summary[10]), length * np.maximum(summary[9], summary[10])
        near = np.searchsorted(surface.position, low - _SLACK * length)
        far = np.searchsorted(surface.end, high + _SLACK * length, side="right")
        bridged = far > near  # gaps that begin after the first contact and end before the last
    state[(count > 1) & bridged] = 3
    return state.astype(np.int64)
