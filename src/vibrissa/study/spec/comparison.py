"""The part ``[comparison]`` of a study: how prediction is compared with measurement in many sweeps."""

from __future__ import annotations

from dataclasses import dataclass

from vibrissa.study.spec.checked import refuse_outside

MOST = 10_000


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """How prediction is compared with measurement.

    Attributes
    ----------
    gratings : int
        New gratings of the same statistics whose predictions give the correlation by chance; the least p is
        1/(1 + their number). 0 for none.
    jitter : int
        Sweeps whose prediction is disturbed by jitter of the tip, to see what jitter does to the correlation; 0: none.
    repeats : int
        Sweeps of a laboratory that are run five times each; 0: none.
    modes : int
        Where the truth of a laboratory is the rod, every how many-th sweep is also filmed with the paper's model, one
        contact and straight modes, as the truth; 0: none.
    """

    gratings: int = 39
    jitter: int = 0
    repeats: int = 0
    modes: int = 1

    def __post_init__(self) -> None:
        names, rule = ("gratings", "jitter", "repeats", "modes"), f"must lie between 0 and {MOST}"
        refuse_outside(self, names, rule, lambda value: 0 <= value <= MOST)
