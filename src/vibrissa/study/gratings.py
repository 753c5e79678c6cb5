"""How prediction is held against measurement, and the gratings that tell what chance gives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from vibrissa.errors import InputError
from vibrissa.study.laboratory import Laboratory
from vibrissa.texture.shuffled import shuffled
from vibrissa.texture.surface import Troughs

Textures = Callable[[int], Troughs]

MOST = 10_000
_FIRST_NEW = 1_000_000  # number of a laboratory's first grating that no sweep has scanned


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """How prediction is held against measurement.

    Attributes
    ----------
    gratings : int
        New gratings of the same statistics whose predictions tell what correlation chance gives; the least p is
        1/(1 + their number). 0 for none.
    jitter : int
        Sweeps whose prediction is disturbed by jitter of the tip, to see what jitter does to the correlation; 0: none.
    repeats : int
        Sweeps of a laboratory that are run five times each; 0: none.
    """

    gratings: int = 39
    jitter: int = 0
    repeats: int = 0

    def __post_init__(self) -> None:
        for name in ("gratings", "jitter", "repeats"):
            if not 0 <= getattr(self, name) <= MOST:
                raise InputError(f"Comparison.{name}", f"must lie between 0 and {MOST}", getattr(self, name))


def new_gratings(source: Laboratory | Textures, numbers: Sequence[int], count: int) -> list[Troughs]:
    """Gratings that were not scanned, of the statistics of those that were.

    Parameters
    ----------
    source : Laboratory or callable
        A laboratory draws new ones; of a user's textures, number → Troughs, each in turn is shuffled.
    numbers : sequence of int
        The textures that were scanned; only of a user's.
    count : int
        How many are wanted.

    Returns
    -------
    list of Troughs
        None where no texture is known.
    """
    if isinstance(source, Laboratory):
        return [source.grating(_FIRST_NEW + number) for number in range(count)]
    if not numbers:
        return []
    known, rng = [source(number) for number in numbers], np.random.default_rng(0)
    return [shuffled(known[k % len(known)], rng) for k in range(count)]
