"""Which jumps of the one contact the free end beyond it allows: where it does not, the shaft bridges the gap."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.texture.relief import HeightProfile

if TYPE_CHECKING:
    import xarray as xr


TOO_LARGE = 30  # times: MuJoCo with the whole length on the ground moves 3 to 6 % as far, see docs/validation.md
_EXCESS = f"the vibration is up to {TOO_LARGE} times too large"
TOUCH = 1e-9  # [m] of ground above the free end that counts as a contact: rounding is 1e-16


def gaps_allowed(free_end: float | Array, width: Array, contact_angle: Array, depth: float) -> Mask:
    """Whether a free end allows the jumps over rectangular gaps in level land.

    After the jump the shaft is turned by θ_ε at its contact on the near edge, and the straight free end beyond hangs
    into the gap. The model's one contact needs it to be shorter than the gap, else it bears on the land behind, and to
    hang less deep than the gap, else it bears on its bottom.

    Parameters
    ----------
    free_end : float or (J,) array
        Length of shaft beyond the contact [m].
    width : (J,) array
        Widths λ of the gaps [m].
    contact_angle : (J,) array
        θ_ε just after each jump [rad].
    depth : float
        Depth of the gaps [m].

    Returns
    -------
    (J,) array of bool
        Where the model's jump is one that the whisker would make.

    Examples
    --------
    >>> gaps_allowed(0.2e-3, np.array([0.1e-3, 0.6e-3]), np.array([0.02, 0.1]), 35e-6)
    array([False,  True])
    """
    return np.asarray((free_end < width) & (free_end * np.sin(contact_angle) < depth))


def relief_allows(free_end: float, place: Array, height: Array, contact_angle: Array, relief: HeightProfile) -> Mask:
    """Whether a free end clears any ground just after each jump; of rectangular gaps as :func:`gaps_allowed`.

    Parameters
    ----------
    free_end : float
        Length of shaft beyond the contact [m].
    place, height : (J,) arrays
        Contact just after each jump [m].
    contact_angle : (J,) array
        θ_ε there [rad].
    relief : HeightProfile
        The ground: straight between its points, so that the straight free end touches at one of them or at its tip.

    Returns
    -------
    (J,) array of bool
        Where no point of the ground is above the free end.
    """
    points, drop = relief.position, np.sin(contact_angle)
    first, last = np.searchsorted(points, place - free_end), np.searchsorted(points, place - TOUCH)
    tip = np.asarray(relief.at(place - free_end) - (height - drop * free_end))
    for j in range(len(place)):
        some = slice(first[j], last[j])
        above = relief.height[some] - (height[j] - drop[j] * (place[j] - points[some]))
        tip[j] = max(tip[j], above.max(initial=-np.inf))
    return np.asarray(tip <= TOUCH)


def free_end_facts(length: float, allowed: Mask) -> dict[str, Any]:
    """Length of the free end [m], number of jumps, how many of them it allows, and their share (NaN without jumps).

    Parameters
    ----------
    length : float
        Of the free end [m].
    allowed : (J,) array of bool
        Which jumps it allows.

    Returns
    -------
    dict
        By the names of ``quantities``.
    """
    share = allowed.mean() if allowed.size else np.nan
    names = ("free_end_length", "jump_count", "jumps_allowed", "jumps_allowed_share")
    return dict(zip(names, (length, allowed.size, int(allowed.sum()), share), strict=True))


def free_end_lines(facts: Mapping[str, Any] | xr.Dataset, deepest: float = np.nan) -> list[str]:
    """Say what share of the jumps the free end allows, and what follows for the others.

    Parameters
    ----------
    facts : mapping or Dataset
        What :func:`free_end_facts` gives.
    deepest : float
        How far below the land the free end would hang at worst [m], if known.

    Returns
    -------
    list of str
        One sentence of at most 70 characters, or three where a jump is not allowed.
    """
    length, count, allowed = (float(facts[name]) for name in ("free_end_length", "jump_count", "jumps_allowed"))
    if not count:
        return [f"the free end is {1e3 * length:.3g} mm long; the contact never jumps"]
    lines = [f"the free end is {1e3 * length:.3g} mm long and prevents {count - allowed:.0f} of {count:.0f} jumps"]
    if allowed == count:
        return lines
    lines.append(f"{'elsewhere ' if allowed else ''}it bridges the gap: {_EXCESS}")
    dip = f"it would dip by up to {1e6 * deepest:.0f} µm below the land"
    return [*lines, f"{dip if deepest >= 5e-7 else 'it is measured'} (docs/validation.md)"]


def unknown_free_end(contact: float, gap_width: float) -> list[str]:
    """Say which free end would allow the jump over a gap, where the whisker is not known; lengths over L.

    Parameters
    ----------
    contact, gap_width : float
        ε and λ, over L.

    Returns
    -------
    list of str
        Three sentences.
    """
    return [
        "without the whisker it is not known whether its free end allows this",
        f"it must end beyond s = {contact - gap_width:.3g}, clear of the bottom of the gap",
        f"else it bridges the gap: {_EXCESS}",
    ]
