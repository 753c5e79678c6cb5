"""What the analyses of spikes are given: the spikes of a recording, its trials, and what was presented."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vibrissa.errors import ConflictError, RangeError


@dataclass(frozen=True, kw_only=True)
class SpikesInput:
    """Spikes of a recording, and its trials.

    Attributes
    ----------
    spikes : str
        CSV with columns unit,trial,spike_time, or what else :func:`vibrissa.neural.io.recording.recorded_spikes` reads,
        relative to the study file.
    trials : int, optional
        Presentations, silent ones included; must be given where the file does not hold it.
    period : float, optional
        From one onset to the next [s], of spikes on the session's clock; needs ``trials``.
    first_onset : float
        The first of these onsets [s].
    event, only, unsorted, counted_bin
        See :func:`vibrissa.neural.io.recording.recorded_spikes`.
    trial_table : str, optional
        Table of the trials (CSV: start, stop, …), instead of the file's own or of an event, relative to the study file;
        or the name of a table of intervals in an NWB file.
    group : (str, ...), optional
        Groups of units that are taken; those called good of a folder, all of a file, by default.
    kept : str, optional
        Dataset of quality (``vibrissa quality --out``): the units that it keeps are taken, whatever their groups,
        unless these are given too; relative to the study file.
    """

    spikes: str
    trials: int | None = None
    period: float | None = None
    first_onset: float = 0.0
    event: str | None = None
    trial_table: str | None = None
    only: tuple[str, str] | None = None
    group: tuple[str, ...] | None = None
    unsorted: bool = False
    counted_bin: float | None = None
    kept: str | None = None

    def __post_init__(self) -> None:
        if self.trials is not None and self.trials < 1:
            raise RangeError("trials", "must be at least 1", self.trials)
        if self.period is not None and not 0 < self.period < np.inf:
            raise RangeError("period", "must be positive (s)", self.period)
        if self.period is None and self.first_onset != 0:
            raise ConflictError("first_onset", "must go with `period`", self.first_onset)
        if self.period is not None and self.trials is None:
            raise ConflictError("trials", "must be given with `period`")
        if self.period is not None and (self.event or self.trial_table or self.only):
            raise ConflictError("period", "must not go with `event`, `trial_table` or `only`")

    @property
    def groups(self) -> tuple[str, ...] | None:
        """Groups that are read: whatever their labels, where a dataset of quality chooses among them."""
        return self.group or (("all",) if self.kept else None)

    def trial_table_file(self, folder: Path) -> str | None:
        """The table of trials where it is a file.

        Parameters
        ----------
        folder : Path
            Where relative paths start.

        Returns
        -------
        str or None
            None without a table, or where it is one in the NWB file of the spikes.
        """
        table = self.trial_table
        within = table is not None and self.spikes.lower().endswith(".nwb") and not (folder / table).is_file()
        return None if within else table


@dataclass(frozen=True, kw_only=True)
class StimulusInput:
    """What was presented.

    Attributes
    ----------
    stimulus : str
        Table (CSV), dataset (``.nc``), NWB file or command, see :func:`vibrissa.study.neurons.stimuli.read_stimulus`;
        relative to the study file.
    whisker : str, optional
        Channel of the stimulus: whisker of a command, column of a table, series of an NWB file.
    signal_unit : str, optional
        Unit of numbers whose file states none: ``um``, ``deg``, ``dB``, ``a.u.``; metres by default.
    envelope : bool
        Whether the stimulus is an envelope already.
    """

    stimulus: str
    whisker: str | None = None
    signal_unit: str | None = None
    envelope: bool = False
