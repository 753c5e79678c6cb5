"""The state of a run: what its stages read and what they have made so far."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.quantities.kinds import Progress
from vibrissa.study.store.outcome import Attempt, Failures, attempting

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.scan.motion import PredictedMotion
    from vibrissa.mechanics.scan.scan_settings import Scan
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.study.spec.settings import Study
    from vibrissa.sweep.engine import Engine
    from vibrissa.whisker import Whisker


def _silent(stage: str, done: int, total: int) -> None:
    """Report no progress."""


@dataclass
class Run:
    """A run of a study, as its stages see it.

    Attributes
    ----------
    study : Study
        What is asked.
    work : Path
        Folder where the files of this run are written first.
    out : Path
        Folder of the results, where sweeps and units are stored one by one.
    engine : Engine, optional
        Runs the work that can be shared.
    progress : callable
        Called with (stage, done, total); total 0 where it is not known.
    results : dict of Datasets
        What the stages have made so far.
    failed : dict
        Reasons by the name of the part that failed.
    motion : PredictedMotion, optional
        Predicted motion of the virtual movie.
    modelled : (Whisker, Posture, Scan), optional
        For which the figures of the model are made.
    """

    study: Study
    work: Path
    out: Path
    engine: Engine | None = None
    progress: Progress = field(default_factory=lambda: _silent)
    results: dict[str, xr.Dataset] = field(default_factory=dict)
    failed: Failures = field(default_factory=dict)
    motion: PredictedMotion | None = None
    modelled: tuple[Whisker, Posture, Scan] | None = None

    @property
    def attempt(self) -> Attempt:
        """Do one part of the study; see :func:`vibrissa.study.store.outcome.attempting`."""
        return attempting(self.study, self.failed)


Work = Callable[[Run], "dict[str, xr.Dataset]"]
