"""Drives of a unit taken from the motion: envelope, speed, rise of the envelope, smoothed envelope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers, Mask, Window
from vibrissa.errors import RangeError
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.neural.coupling.threshold_linear import BinnedDrive
from vibrissa.neural.io.tables.stimuli import require_motion
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.signals.smoothing import low_pass

DRIVES = ("envelope", "speed", "rise", "smoothed")
LATEST = 0.03  # [s] latencies searched, at most: so much is left out at the start
SAMPLES = 10  # of a drive in each bin: hinges are exact for a signal that is straight between them


@dataclass(frozen=True, kw_only=True)
class Stimuli:
    """Several stimuli one after the other, and the drives of each.

    Attributes
    ----------
    drives : dict of BinnedDrive
        By the names of ``DRIVES``: envelope A [m], speed (envelope of the velocity, ωA) [m/s], rise dA/dt [m/s],
        smoothed (A through a low-pass of first order) [m]. All count the same bins.
    starts : (J,) array
        First bin of each stimulus on its own time [s].
    stimulus : (K,) array of int
        Stimulus of each bin.
    carrier : (J,) array
        Mean frequency of each stimulus, weighted by power [Hz].
    """

    drives: dict[str, BinnedDrive]
    starts: Array
    stimulus: Integers
    carrier: Array

    @classmethod
    def of(
        cls,
        stimuli: Sequence[xr.Dataset],
        *,
        bin_width: float = 0.01,
        skip: float = 0.5,
        smoothing: float = 0.03,
        band: Window | None = None,
        latest: float = LATEST,
    ) -> Stimuli:
        """Drives of all stimuli, one stimulus after the other.

        Parameters
        ----------
        stimuli : sequence of Dataset
            ``time`` and ``point_displacement`` of one presentation each.
        bin_width, skip, band
            As in :class:`vibrissa.neural.coupling.analysis.EnvelopeAnalysis`.
        smoothing : float
            Time constant of the low-pass [s].
        latest : float
            Longest latency searched [s].

        Returns
        -------
        Stimuli
            On one time axis.

        Raises
        ------
        InputError
            If there is no stimulus, or one is too short; see ``Presentation.of``.
        """
        if not stimuli:
            raise RangeError("stimuli", "must be at least one", 0)
        for one in stimuli:
            require_motion(one, "speed")
        shown = [Presentation.of(one, bin_width=bin_width, skip=skip, band=band) for one in stimuli]
        fine = bin_width / SAMPLES
        parts = [_signals(seen, fine, smoothing) for seen in shown]
        sizes = [len(seen.edges) - 1 for seen in shown]
        edges: Array = bin_width * np.arange(sum(sizes) + 1, dtype=float)
        time: Array = fine * np.arange(sum(len(part["envelope"]) for part in parts), dtype=float)
        valid = np.concatenate([seen.drive().valid for seen in shown])
        joined = {name: np.concatenate([part[name] for part in parts]) for name in DRIVES}
        return cls(
            drives={
                name: BinnedDrive(time=time, envelope=signal, edges=edges, valid=valid, latencies=(0.0, latest))
                for name, signal in joined.items()
            },
            starts=np.array([seen.edges[0] for seen in shown]),
            stimulus=np.repeat(np.arange(len(shown)), sizes),
            carrier=np.array([seen.frequency for seen in shown]),
        )

    @property
    def valid(self) -> Mask:
        """Bins that count, (K,)."""
        return self.drives["envelope"].valid

    @property
    def bin_width(self) -> float:
        """Width of the bins [s]."""
        edges = self.drives["envelope"].edges
        return float(edges[1] - edges[0])

    def likeness(self, one: str, other: str) -> float:
        """Correlation of two drives over the bins that count; near 1, no unit separates them.

        Parameters
        ----------
        one, other : str
            Names of drives.

        Returns
        -------
        float
            Pearson's r.
        """
        a, b = (self.drives[name].hinged(-1e3, 0.0) for name in (one, other))  # so low a threshold cuts nothing
        return float(np.corrcoef(a, b)[0, 1])


def _signals(shown: Presentation, fine: float, smoothing: float) -> dict[str, Array]:
    """Drives of one stimulus, on a grid that its bins hold a whole number of times."""
    own = shown.time
    step = (own[-1] - own[0]) / (len(own) - 1)
    carrier = shown.carrier
    found = {
        "envelope": shown.envelope,
        "speed": analytic_envelope(np.gradient(carrier, step))[0],
        "rise": np.gradient(shown.envelope, step),
        "smoothed": low_pass(own, shown.envelope, smoothing),
    }
    count = round((shown.edges[-1] - shown.edges[0]) / fine)
    grid = shown.edges[0] + fine * np.arange(count)
    return {name: np.interp(grid, own, signal) for name, signal in found.items()}
