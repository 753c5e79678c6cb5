"""Columns of a Poisson model: every whisker's envelope at every latency, and the unit's own past."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.neural.bases import lagged, raised_cosines
from vibrissa.neural.copies import Copies
from vibrissa.neural.poisson import TrialDesign

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Window = tuple[float, float]

STRETCH = 0.002  # [s] lags of the own past below this are told evenly, longer ones ever more coarsely


@dataclass(frozen=True, kw_only=True)
class KernelAnalysis:
    """How kernels are fitted.

    Attributes
    ----------
    bin_width : float
        Width of the bins [s].
    skip, window, band
        As in :class:`vibrissa.neural.analysis.EnvelopeAnalysis`.
    reach : float
        Longest latency of a whisker's kernel [s].
    shapes : int
        Raised cosines of each whisker's kernel, over latencies from 0.
    past : float
        Longest lag of the unit's own past [s]; 0 leaves it out.
    past_shapes : int
        Raised cosines of the own past.
    penalty : float or None
        On the squared coefficients of the whiskers, whose columns have a spread of about 1. Where it is None, the one
        that foresees unseen trials best is taken: it shrinks strong kernels, and their intervals are then too narrow.
    level : float
        Largest p-value, adjusted over whiskers, at which a whisker is said to matter.
    """

    bin_width: float = 0.005
    skip: float = 1.0
    window: Window | None = None
    band: Window | None = None
    reach: float = 0.04
    shapes: int = 6
    past: float = 0.1
    past_shapes: int = 4
    penalty: float | None = 10.0
    level: float = 0.05

    def __post_init__(self) -> None:
        for name in ("bin_width", "reach"):
            if not 0 < getattr(self, name) < np.inf:
                raise InputError(name.replace("_", " "), "must be positive (s)", getattr(self, name))
        for name in ("skip", "past"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(name, "must be zero or positive (s)", getattr(self, name))
        if self.reach < self.shapes * self.bin_width:
            raise InputError("reach", f"must be {self.shapes} bins at least, one for each shape", self.reach)
        if self.past and self.past < self.past_shapes * self.bin_width:
            raise InputError("past", f"must be 0, or {self.past_shapes} bins at least", self.past)
        if self.penalty is not None and not 0 <= self.penalty < np.inf:
            raise InputError("penalty", "must be zero or positive", self.penalty)

    def lags(self) -> tuple[Array, Array]:
        """Lags of the whiskers' kernels from 0, and of the own past from one bin [s]."""
        ends = [round(reach / self.bin_width) + 1 for reach in (self.reach, self.past)]
        return self.bin_width * np.arange(ends[0], dtype=float), self.bin_width * np.arange(1, ends[1], dtype=float)


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Columns of the stimulus: a constant, then those of each whisker.

    Attributes
    ----------
    whiskers : tuple of str
        Names.
    shared : (K', 1 + W·C) array
        In the bins that count; the whiskers' columns have mean 0.
    shapes : (J, C) array
        Raised cosines over latencies.
    spread : float
        Standard deviation of the envelopes, by which they are divided [m].
    valid : (K,) array of bool
        Bins that count.
    start : float
        Start of the first bin [s].
    """

    whiskers: tuple[str, ...]
    shared: Array
    shapes: Array
    spread: float
    valid: NDArray[np.bool_]
    start: float

    @classmethod
    def of(cls, command: xr.Dataset, how: KernelAnalysis) -> Columns:
        """Take the envelopes of all whiskers through the shapes."""
        copies = Copies.of(command, bin_width=how.bin_width, skip=how.skip, window=how.window, band=how.band)
        edges, lags = copies.edges, how.lags()[0]
        binned = np.array([_binned(drive.time, drive.envelope, edges) for drive in copies.drives])
        spread = float(binned[:, copies.valid].std())
        shapes = raised_cosines(lags, how.shapes)
        seen = lagged((binned - binned.mean(1, keepdims=True)) / spread, shapes)
        early = np.arange(len(edges) - 1) >= len(lags)  # before, the kernels would reach out of the record
        valid = copies.valid & early
        columns = seen[:, valid].transpose(1, 0, 2).reshape(int(valid.sum()), -1)
        columns = columns - columns.mean(0)
        shared = np.column_stack([np.ones(len(columns)), columns])
        return cls(
            whiskers=copies.whiskers,
            shared=shared,
            shapes=shapes,
            spread=spread,
            valid=valid,
            start=float(edges[0]),
        )


def _binned(time: Array, envelope: Array, edges: Array) -> Array:
    """Mean over each bin of an envelope that is straight between its samples."""
    step = time[1] - time[0]
    area = np.concatenate([[0.0], np.cumsum(envelope[1:] + envelope[:-1]) * step / 2])
    return np.diff(np.interp(edges, time, area)) / np.diff(edges)


def unit_design(columns: Columns, counts: Array, how: KernelAnalysis) -> TrialDesign:
    """Columns of the stimulus, and of the unit's own spikes in every trial.

    Parameters
    ----------
    columns : Columns
        The stimulus.
    counts : (N, K) array
        Counts of each trial in all bins, those before the bins that count included: they are the past.
    how : KernelAnalysis
        Lags and shapes.
    """
    lags = how.lags()[1]
    if not lags.size:
        return TrialDesign.repeated(columns.shared, len(counts))
    shapes = raised_cosines(lags, how.past_shapes, stretch=STRETCH)
    return TrialDesign(shared=columns.shared, own=lagged(counts, shapes, first=1)[:, columns.valid])
