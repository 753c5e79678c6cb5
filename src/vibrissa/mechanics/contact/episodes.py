"""Quasi-static contact along any height profile: it sticks, glides and jumps, and the base side decides."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import InputError, RangeError
from vibrissa.mechanics.contact.clearance import Ground
from vibrissa.mechanics.contact.events import ABOVE, BELOW, follow, trace
from vibrissa.mechanics.contact.profile_tables import Tables
from vibrissa.mechanics.quasi_static.held_table import ContactBox, HeldTable, held_table
from vibrissa.mechanics.quasi_static.relief_response import flat_tilt
from vibrissa.mechanics.statics.edge_contact import Held
from vibrissa.texture.relief import HeightProfile
from vibrissa.whisker import Whisker

STICK, GLIDE = 0, 1
_TRIES = 24  # enlargements of the tables
_WIDER = 1.5  # each
_FIRST = (-0.2, 0.05)  # excursions first tabulated, over the distance at which the profile clears all heights
_MARGIN = 1.1  # of the excursions expected, over those of the like scan
_LEAST = 2e-3  # [L] neither box nor reach is smaller


@dataclass(frozen=True)
class Episodes:
    """The contact's history, episode by episode: stuck to a point of the ground or gliding up a facet.

    Attributes
    ----------
    travelled : (E,) array
        Travel of the texture v t at which each begins, over L.
    kind : (E,) array
        0 stick, 1 glide.
    place, height : (E,) arrays
        Point X, h(X) of the ground that is touched at the beginning, over L.
    slope : (E,) array
        Of the facet on which the contact glides.
    jumped : (E,) array of bool
        Whether the contact came by a jump.
    table : HeldTable
        The profiles that were held against the ground.
    """

    travelled: Array
    kind: Integers
    place: Array
    height: Array
    slope: Array
    jumped: Mask
    table: HeldTable

    @property
    def counts(self) -> dict[str, int]:
        """Number of episodes of each kind, and of jumps."""
        stick = int((self.kind == STICK).sum())
        return {"stick": stick, "glide": len(self.kind) - stick, "jump": int(self.jumped.sum())}

    @property
    def extent(self) -> tuple[float, float]:
        """Least and largest excursion, sheared as in ``relief_response.ContactBox``, over L; 0 lies within."""
        begin, end = self.within(self.travelled, np.arange(len(self.kind))), self._ends
        sheared = [d - self.table.box.tilt * z for d, z, _ in (begin, end)]
        return float(min(0.0, *map(np.min, sheared))), float(max(0.0, *map(np.max, sheared)))

    @property
    def _ends(self) -> tuple[Array, Array, Array]:
        """As :meth:`contact`, where each episode ends."""
        ends = np.append(self.travelled[1:], self.travelled[-1])
        return self.within(ends, np.arange(len(self.kind)))

    def contact(self, travelled: ArrayLike) -> tuple[Array, Array, Array]:
        """Excursion d, height z and place X of the contact after some travel v t, over L, (T,) each.

        d = v t − X, positive away from the base. Before the first episode the contact glides on level ground.

        Parameters
        ----------
        travelled : (T,) array
            v t over L.

        Returns
        -------
        d, z, X : (T,) arrays
            Over L.
        """
        tau = np.asarray(travelled, float)
        return self.within(tau, np.searchsorted(self.travelled, tau, side="right") - 1)

    def within(self, travelled: Array, episode: Integers) -> tuple[Array, Array, Array]:
        """As :meth:`contact`, in an episode named for each travel: at a jump, before or after it.

        Parameters
        ----------
        travelled : (T,) array
            v t over L.
        episode : (T,) array
            Number of the episode of each.

        Returns
        -------
        d, z, X : (T,) arrays
            Over L.
        """
        e = np.maximum(episode, 0)
        place = follow(travelled, e, self.kind, self.place, self.height, self.slope, tables(self.table))
        rise = np.where(self.kind[e] == GLIDE, self.slope[e] * (place - self.place[e]), 0.0)
        return travelled - place, self.height[e] + rise, place


def tables(table: HeldTable) -> Tables:
    """Coefficients in the order in which the kernels read them.

    Parameters
    ----------
    table : HeldTable
        The profiles.

    Returns
    -------
    tuple
        ``tables`` of :mod:`vibrissa.mechanics.contact.clearance`.
    """
    box = table.box
    ahead = np.ascontiguousarray(table.ahead.transpose(2, 1, 0))
    signs = (-1.0) ** np.arange(ahead.shape[2])  # at u = 0 y/u is the slope
    return ahead, np.ascontiguousarray(ahead @ signs), np.array([*box.low, *box.high, box.tilt]), table.reach


def episodes(
    relief: HeightProfile,
    whisker: Whisker,
    flat: Held,
    table: HeldTable | None = None,
    like: Episodes | None = None,
) -> Episodes:
    """Follow the contact over a relief.

    The contact sticks to its point of the ground, d growing with the travel, until the base side of the profile held
    there would touch the ground: just beside the contact, where it then glides up the facet with θ_ε along it; or
    elsewhere, where it jumps to, over points in between from which the shaft would clear as well but which it does not
    touch. The tip side is not tested. On smooth ground it glides over hills; in valleys it jumps, by c/4K where the
    ground bends by c and the shaft rises as K u³, since ground and base side touch at two points there.

    Parameters
    ----------
    relief : HeightProfile
        The surface.
    whisker : Whisker
        Gives L.
    flat : Held
        The posture on the flat, at height 0.
    table : HeldTable, optional
        Of the same posture, to be used as far as it serves.
    like : Episodes, optional
        Of a scan that went much the same way: where no table serves, one is made at once as large and fine as it took.

    Returns
    -------
    Episodes
        From travel 0 until the level ground behind.

    Raises
    ------
    InputError
        If the posture cannot follow the surface; the message says where.
    """
    if like is not None:
        with suppress(InputError):  # as much may be more than this posture can follow, and than this surface asks for
            return _followed(relief, whisker, flat, table, like)
    return _followed(relief, whisker, flat, table, None)


def _followed(
    relief: HeightProfile, whisker: Whisker, flat: Held, table: HeldTable | None, like: Episodes | None
) -> Episodes:
    ground = _ground(relief, whisker.length)
    heights = float(ground[1].min()), float(ground[1].max())
    if table is None or not _serves(table, flat, heights):
        try:
            table = _first_table(flat, heights, like)
        except InputError as error:
            raise _too_much("the relief", error, flat) from None
    for _ in range(_TRIES):
        (travelled, place, height, slope), (kind, jumped), status, where = trace(tables(table), ground)
        if status == 0:
            return Episodes(travelled, kind, place, height, slope, jumped.astype(bool), table)
        try:
            table = _wider(table, status)
        except InputError as error:
            raise _too_much(f"the relief at {where * whisker.length * 1e3:.4g} mm", error, flat) from None
    raise _too_much(f"the relief at {where * whisker.length * 1e3:.4g} mm", None, flat)


def _too_much(place: str, error: InputError | None, flat: Held) -> InputError:
    """What to say of a surface that the posture cannot follow."""
    why = "" if error is None else f": {error.quantity} is beyond it"
    remedy = "check the heights' unit, take the tilt away, scan a part, lower the base angle or raise the contact"
    if flat.posture.friction < 0:
        remedy = "its friction is negative: a surface that moves away from the base has a positive one"
    return RangeError(place, f"must be within what the posture can follow before the fold{why}", remedy=remedy)


def _ground(relief: HeightProfile, length: float) -> Ground:
    """Points over L between level ends, slopes of the facets; of blocks of 8ⁿ facets the highest point and chord."""
    x, h = relief.position / length, relief.height / length
    x = np.concatenate([[x[0] - 1.0], x, [x[-1] + 1.0]])
    h = np.concatenate([h[:1], h, h[-1:]])
    rise, step = np.diff(h), np.diff(x)
    slope = np.where(step > 0, rise / np.where(step > 0, step, 1.0), np.copysign(np.inf, rise))
    peaks, chords, block = [], [], 1
    while True:
        starts = np.arange(0, slope.size, block)
        peaks.append(np.maximum.reduceat(np.maximum(h[1:], h[:-1]), starts))
        chords.append(np.maximum.reduceat(_chords(x, h, np.repeat(starts, block)[: slope.size]), starts))
        if starts.size == 1:
            break
        block *= 8
    return x, h, slope, np.concatenate(peaks), np.concatenate(chords), np.cumsum([0, *map(len, peaks)])


def _chords(x: Array, h: Array, start: Integers) -> Array:
    """Slope from the first point of its block to the end of each facet; ∞ straight up or down."""
    step, rise = x[1:] - x[start], h[1:] - h[start]
    return np.divide(rise, step, out=np.full(step.shape, np.inf), where=step > 0)


def _first_table(flat: Held, heights: tuple[float, float], like: Episodes | None) -> HeldTable:
    x, y = flat.position(np.linspace(flat.contact, 1, 400))
    clear = int(np.searchsorted(y - y[0], 2 * (heights[1] - heights[0])))
    reach = max(10 * _LEAST, float(1.3 * (x - x[0])[min(clear, 300)]))
    low, high = (share * reach for share in _FIRST)
    if like is not None:
        went = [_MARGIN * end for end in like.extent]
        low, high = min(went[0], low / _WIDER), max(went[1], high / _WIDER)
    margin = 1e-3 * (heights[1] - heights[0]) + 1e-6
    box = ContactBox((low, min(heights[0], 0) - margin), (high, max(heights[1], 0) + margin), flat_tilt(flat))
    return held_table(flat, box, reach) if like is None else held_table(flat, box, reach, like.table.enough)


def _serves(table: HeldTable, flat: Held, heights: tuple[float, float]) -> bool:
    same = table.flat.posture == flat.posture
    return same and table.box.low[1] <= heights[0] and heights[1] <= table.box.high[1]


def _wider(table: HeldTable, status: int) -> HeldTable:
    """Tables that reach farther where the contact left them."""
    (low, bottom), (high, top), reach = table.box.low, table.box.high, table.reach
    if status == BELOW:
        low = _WIDER * low
    elif status == ABOVE:
        high = _WIDER * high
    elif _WIDER * reach > 0.9 * table.flat.base[0]:
        raise RangeError("the base side", "must clear the ground on its way to the base")
    else:
        reach *= _WIDER
    return held_table(table.flat, ContactBox((low, bottom), (high, top), table.box.tilt), reach)
