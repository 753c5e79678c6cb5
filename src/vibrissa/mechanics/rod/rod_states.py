"""What the contacts of the rod do along the way: slip, stick, bridge a gap, or none at all."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps

STATES = ("detached", "slip", "stick", "bridge")
_SLACK = 1e-3  # over L: how far the shaft moves along the ground, so that a contact at a gap's edge is one
_APART = 0.01  # over L: contacts farther apart bridge what is between, on a surface that has no gaps by name


def contact_states(
    summary: Array, time: Array, surface: Gaps | HeightProfile, *, speed: float, contact: float, length: float
) -> Integers:
    """State of the contacts at each time, as numbers of ``STATES``.

    Parameters
    ----------
    summary : (9, T) array
        ``Touch.summary`` of each time.
    time : (T,) array
        [s].
    surface : Gaps or HeightProfile
        In metres; a whole gap between the first contact and the last is bridged. Of a profile of heights, contacts
        farther apart than 0.01 L bridge what is between them.
    speed : float
        [m/s].
    contact : float
        ε on the flat.
    length : float
        L [m].

    Returns
    -------
    (T,) array
        0 without contact; 3 with contacts on both sides of a gap; 2 where every contact sticks; 1 otherwise.
    """
    first, last, count, sticking = summary[2], summary[3], summary[4], summary[5]
    state = np.where(count == 0, 0, np.where(sticking == count, 2, 1))
    low, high = ((s - contact) * length + speed * time for s in (first, last))  # the free end is nearly straight
    if isinstance(surface, HeightProfile):
        bridged = last - first > _APART
    else:
        near = np.searchsorted(surface.position, low - _SLACK * length)
        far = np.searchsorted(surface.end, high + _SLACK * length, side="right")
        bridged = far > near  # gaps that begin after the first contact and end before the last
    state[(count > 1) & bridged] = 3
    return state.astype(np.int64)
