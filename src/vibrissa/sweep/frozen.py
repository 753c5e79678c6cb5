"""Processes that have work and use no processor time: stopped by a signal, or waiting for a disk that is gone."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from time import monotonic

FROZEN = 120.0  # [s] without any processor time, after which a process that has work is given up
LOOK = 1.0  # [s] from one look to the next


class Stillness:
    """How long each of some processes has used no processor time.

    Only the time in which this process itself looks counts: where a batch system or Ctrl-Z freezes all of them
    together, none is given up when they go on.
    """

    def __init__(self) -> None:
        self._spent: dict[int, int] = {}  # by process, in ticks of the system
        self._still: dict[int, float] = {}  # [s] since it changed
        self._looked = monotonic()

    def look(self, processes: Collection[int]) -> list[int]:
        """Look at all processes that have work.

        Parameters
        ----------
        processes : collection of int
            Their numbers; what was known of others is forgotten.

        Returns
        -------
        list of int
            Those that have used no processor time for ``FROZEN`` seconds; none where the system has no ``/proc``.
        """
        now = monotonic()
        passed, self._looked = min(now - self._looked, 2 * LOOK), now
        spent = {one: ticks for one in processes if (ticks := processor_time(one)) is not None}
        same = {one for one, ticks in spent.items() if self._spent.get(one) == ticks}
        self._still = {one: self._still.get(one, 0.0) + passed if one in same else 0.0 for one in spent}
        self._spent = spent
        return [one for one, still in self._still.items() if still >= FROZEN]


def processor_time(process: int) -> int | None:
    """Processor time of a process and of those that it has waited for.

    Parameters
    ----------
    process : int
        Its number.

    Returns
    -------
    int or None
        In ticks of the system; None where it cannot be known.
    """
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return sum(map(int, fields[11:15]))
