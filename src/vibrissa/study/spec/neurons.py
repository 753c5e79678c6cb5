"""The parts ``[[neural]]`` of a study: recorded spikes, and what was played meanwhile."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

from vibrissa.errors import ConflictError
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis
from vibrissa.study.spec.given import SpikesInput, StimulusInput

Window = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Neurons(SpikesInput, StimulusInput):
    """Recorded spikes, what was played meanwhile, and how they are analysed: the options of the verb ``neural``.

    Attributes
    ----------
    spikes, trials, period, first_onset, event, trial_table, only, group, unsorted, counted_bin, kept
        See :class:`vibrissa.study.spec.given.SpikesInput`.
    stimulus, whisker, signal_unit, envelope
        See :class:`vibrissa.study.spec.given.StimulusInput`.
    name : str
        For the report; that of the file of spikes by default.
    null, fit, first_segment, level, bin_width, skip, window, band, spontaneous, seed
        See :class:`vibrissa.neural.coupling.analysis.EnvelopeAnalysis`.
    delay : (float, ...)
        Delays at which other whiskers had the same stimulus [s].
    """

    name: str = ""
    null: Literal["circular", "paper2014"] = "circular"
    fit: Literal["forward", "paper2014"] = "forward"
    first_segment: Literal["flat-first", "free-first"] = "flat-first"
    level: float = 0.01
    bin_width: float = 0.01
    skip: float = 1.0
    window: Window | None = None
    band: Window | None = None
    delay: tuple[float, ...] = ()
    spontaneous: Window | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.first_segment != "flat-first" and self.fit != "paper2014":
            raise ConflictError("first_segment", "must go with `fit='paper2014'`", self.first_segment)
        self.analysis()

    @property
    def label(self) -> str:
        """Name in the report."""
        return self.name or Path(self.spikes).stem

    def analysis(self) -> EnvelopeAnalysis:
        """How the units are tested and fitted."""
        shared = {field.name for field in fields(self)} & {field.name for field in fields(EnvelopeAnalysis)}
        return EnvelopeAnalysis(delays=self.delay, **{name: getattr(self, name) for name in sorted(shared)})
