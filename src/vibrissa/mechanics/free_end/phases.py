"""Supports of the shaft, the course of a texture under it, and the phases of its motion.

LAND: the contact rolls on the flat. FAR: the shaft turns on a gap's far edge. BRIDGE: the near edge bears too. NEAR:
the tip has dropped off the far edge, the shaft turns on the near one. FLOOR: the tip rests on the gap's floor. TIP: it
rests on the flat, and the shaft turns on it.
"""

from __future__ import annotations

from typing import NamedTuple

from vibrissa.arrays import Array, Integers

LAND, FAR, BRIDGE, NEAR, FLOOR, TIP = 0, 1, 2, 3, 4, 5
MODES = (0, 1, 0, 1, 0, 2)  # of land, of an edge, of the tip


class Passage(NamedTuple):
    """What the march passes.

    Attributes
    ----------
    begin, end : (J,) arrays
        When the far and the near edge of each gap come to ε, over k.
    width : (J,) array
        λ over L.
    bridge, floor : (2, J, n) arrays
        Turn and lift on two supports, as powers of d/λ.
    least : float
        Distance x at which the tip is off the floor at the latest, over L.
    depth, free_end, speed : float
        Of the gaps, beyond ε, over L; over L/k.
    step, wait, look : float
        Step of the march; time that a support lasts at least; time after which the slip is looked at again. Over k.
    """

    begin: Array
    end: Array
    width: Array
    bridge: Array
    floor: Array
    least: float
    depth: float
    free_end: float
    speed: float
    step: float
    wait: float
    look: float


class Phases(NamedTuple):
    """Phases of a motion, E of them.

    Attributes
    ----------
    start : (E,) array
        When each begins, over k.
    support : (E,) array
        Which.
    gap : (E,) array
        Whose edge bears, or the last one passed; −1 before the first.
    free : (E, 2, M) array
        Cosine and sine of the free motion of each mode at its start.
    forced : (E, M, n) array
        Powers of the time since the start: the rest of the amplitude; on an edge with Q, on land without.
    held : (E, 2, n) array
        Turn and lift on land.
    """

    start: Array
    support: Integers
    gap: Integers
    free: Array
    forced: Array
    held: Array


class Work(NamedTuple):
    """Room for the phase under way.

    Attributes
    ----------
    still, forced : (M, n) arrays
        Powers of the time since its start: Q and the particular solution.
    held : (2, n) array
        Turn and lift on land.
    rest, turned : (n,) arrays
        Angle on an edge at rest: what the modes leave out of it, and all of it.
    free : (2, M) array
        Cosine and sine of the free motion.
    whole, rate, now : (M,) arrays
        Amplitudes q + Q and their rates at the start; q now.
    moved : (2, M) array
        The free motion now.
    ahead : (3, 2, M) array
        What a step does to it on each support: cosine and sine.
    """

    still: Array
    forced: Array
    held: Array
    rest: Array
    free: Array
    whole: Array
    rate: Array
    now: Array
    turned: Array
    moved: Array
    ahead: Array
