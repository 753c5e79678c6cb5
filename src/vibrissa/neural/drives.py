"""What of the motion may drive a unit: its envelope, its speed, the envelope's rise, the envelope smoothed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.neural.demodulator import low_pass
from vibrissa.neural.hinge import Drive
from vibrissa.neural.presentation import Presentation
from vibrissa.signals.envelope import analytic_envelope

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

Array = NDArray[np.float64]
Window = tuple[float, float]

DRIVES = ("envelope", "speed", "rise", "smoothed")
LATEST = 0.03  # [s] latencies searched, at most: so much is left out at the start
SAMPLES = 10  # of a drive in each bin: hinges are exact for what is straight between them


@dataclass(frozen=True, kw_only=True)
class Stimuli:
    """Several stimuli one after the other, and what of each may drive a unit.

    Attributes
    ----------
    drives : dict of Drive
        By the names of ``DRIVES``: envelope A [m], speed (envelope of the velocity, ωA) [m/s], rise dA/dt [m/s],
        smoothed (A through a low-pass of first order) [m]. All count the same bins.
    starts : (J,) array
        First bin of each stimulus on its own time [s].
    stimulus : (K,) array of int
        Stimulus of each bin.
    carrier : (J,) array
        Mean frequency of each stimulus, weighted by power [Hz].
    """

    drives: dict[str, Drive]
    starts: Array
    stimulus: NDArray[np.int64]
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
        """Take the drives of each stimulus and lay them end to end.

        Parameters
        ----------
        stimuli : sequence of Dataset
            ``time`` and ``point_displacement`` of one presentation each.
        bin_width, skip, band
            As in :class:`vibrissa.neural.analysis.EnvelopeAnalysis`.
        smoothing : float
            Time constant of the low-pass [s].
        latest : float
            Longest latency searched [s].

        Raises
        ------
        InputError
            If there is no stimulus, or one is too short; see :meth:`Presentation.of`.
        """
        if not stimuli:
            raise InputError("stimuli", "must be at least one", 0)
        shown = [Presentation.of(one, bin_width=bin_width, skip=skip, band=band) for one in stimuli]
        fine = bin_width / SAMPLES
        parts = [_signals(one, seen, fine, smoothing) for one, seen in zip(stimuli, shown, strict=True)]
        sizes = [len(seen.edges) - 1 for seen in shown]
        edges: Array = bin_width * np.arange(sum(sizes) + 1, dtype=float)
        time: Array = fine * np.arange(sum(len(part["envelope"]) for part in parts), dtype=float)
        valid = np.concatenate([seen.drive().valid for seen in shown])
        joined = {name: np.concatenate([part[name] for part in parts]) for name in DRIVES}
        return cls(
            drives={
                name: Drive(time=time, envelope=signal, edges=edges, valid=valid, latencies=(0.0, latest))
                for name, signal in joined.items()
            },
            starts=np.array([seen.edges[0] for seen in shown]),
            stimulus=np.repeat(np.arange(len(shown)), sizes),
            carrier=np.array([seen.frequency for seen in shown]),
        )

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Bins that count, (K,)."""
        return self.drives["envelope"].valid

    @property
    def bin_width(self) -> float:
        """Width of the bins [s]."""
        edges = self.drives["envelope"].edges
        return float(edges[1] - edges[0])

    def likeness(self, one: str, other: str) -> float:
        """Correlation of two drives over the bins that count; near 1, no unit tells them apart."""
        a, b = (self.drives[name].hinged(-1e3, 0.0) for name in (one, other))  # so low a threshold cuts nothing
        return float(np.corrcoef(a, b)[0, 1])


def _signals(stimulus: xr.Dataset, shown: Presentation, fine: float, smoothing: float) -> dict[str, Array]:
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
