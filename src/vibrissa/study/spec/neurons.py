"""The parts ``[[neural]]`` of a study: recorded spikes, and what was played meanwhile."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

import numpy as np

from vibrissa.errors import ConflictError, RangeError
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis

Window = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Neurons:
    """Recorded spikes, what was played meanwhile, and how they are analysed: the options of the verb ``neural``.

    Attributes
    ----------
    spikes : str
        CSV with columns unit,trial,spike_time, or what else :func:`vibrissa.neural.io.recording.recorded_spikes` reads,
        relative to the study file.
    stimulus : str
        CSV with columns time,displacement; with a ``whisker`` the command that was played on several; or a dataset.
    name : str
        For the report; that of the file of spikes by default.
    whisker : str, optional
        Whisker of the command whose motion is taken.
    trials : int, optional
        Presentations, silent ones included; must be given where the file does not hold it.
    period : float, optional
        From one onset to the next [s], of spikes on the session's clock; needs ``trials``.
    first_onset : float
        The first of these onsets [s].
    event, only
        See :func:`vibrissa.neural.io.recording.recorded_spikes`.
    trial_table : str, optional
        Table of the trials (CSV: start, stop, …), instead of the file's own or of an event; relative to the study file.
    group : (str, ...)
        Of a folder of sorted units, the groups that are taken.
    null, fit, first_segment, level, bin_width, skip, window, band, spontaneous, seed
        See :class:`vibrissa.neural.coupling.analysis.EnvelopeAnalysis`.
    delay : (float, ...)
        Delays at which other whiskers had the same stimulus [s].
    """

    spikes: str
    stimulus: str
    name: str = ""
    whisker: str | None = None
    trials: int | None = None
    period: float | None = None
    first_onset: float = 0.0
    event: str | None = None
    trial_table: str | None = None
    only: tuple[str, str] | None = None
    group: tuple[str, ...] = ("good",)
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
        if self.first_segment != "flat-first" and self.fit != "paper2014":
            raise ConflictError("first_segment", "must go with `fit='paper2014'`", self.first_segment)
        if self.period is not None and not 0 < self.period < np.inf:
            raise RangeError("period", "must be positive (s)", self.period)
        if self.period is not None and self.trials is None:
            raise ConflictError("trials", "must be given with `period`")
        if self.period is not None and (self.event or self.trial_table or self.only):
            raise ConflictError("period", "must not go with `event`, `trial_table` or `only`")
        self.analysis()

    @property
    def label(self) -> str:
        """Name in the report."""
        return self.name or Path(self.spikes).stem

    def analysis(self) -> EnvelopeAnalysis:
        """How the units are tested and fitted."""
        shared = {field.name for field in fields(self)} & {field.name for field in fields(EnvelopeAnalysis)}
        return EnvelopeAnalysis(delays=self.delay, **{name: getattr(self, name) for name in sorted(shared)})
