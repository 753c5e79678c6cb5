"""Columns of a Poisson model: every whisker's envelope at every latency, and the unit's own past."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Mask
from vibrissa.errors import TooFewError, require_not_negative, require_positive
from vibrissa.limits import require_bins
from vibrissa.neural.coupling.presentation import BinnedAnalysis
from vibrissa.neural.coupling.threshold_linear import between_edges
from vibrissa.neural.glm.bases import lagged, raised_cosines
from vibrissa.neural.glm.delayed_envelopes import Copies
from vibrissa.neural.glm.trial_design import TrialDesign

MOST_LAGS = 10_000  # of a kernel: beyond, its columns would fill the memory
STRETCH = 0.002  # [s] the spacing of shapes over the own past is about even below this lag, and widens above


@dataclass(frozen=True, kw_only=True)
class KernelAnalysis(BinnedAnalysis):
    """Settings of the kernels' fit.

    Attributes
    ----------
    bin_width, skip, window, band
        As in :class:`vibrissa.neural.coupling.presentation.BinnedAnalysis`.
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
        that predicts unseen trials best is chosen: it shrinks strong kernels, and their intervals are then too narrow.
    level : float
        Largest p-value, adjusted over whiskers, at which a whisker is said to matter.
    """

    bin_width: float = 0.005
    reach: float = 0.04
    shapes: int = 6
    past: float = 0.1
    past_shapes: int = 4
    penalty: float | None = 10.0
    level: float = 0.05

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive("reach", self.reach, "s")
        require_not_negative("past", self.past, "s")
        for quantity in ("reach", "past"):
            require_bins(getattr(self, quantity), self.bin_width, MOST_LAGS, quantity)
        if self.reach < self.shapes * self.bin_width:
            raise TooFewError("reach", f"must be {self.shapes} bins at least, one for each shape", self.reach)
        if self.past and self.past < self.past_shapes * self.bin_width:
            raise TooFewError("past", f"must be 0, or {self.past_shapes} bins at least", self.past)
        require_not_negative("penalty", self.penalty)

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
    edges : (K + 1,) array
        Edges of the bins [s].
    """

    whiskers: tuple[str, ...]
    shared: Array
    shapes: Array
    spread: float
    valid: Mask
    edges: Array

    @property
    def drives(self) -> Array:
        """One column of each whisker in the bins that count, (W, K'): how long the stimulus stays like itself."""
        return self.shared[:, 1 :: self.shapes.shape[1]].T

    @classmethod
    def of(cls, command: xr.Dataset, how: KernelAnalysis) -> Columns:
        """Columns of a stimulus: the envelopes of all whiskers, weighted by the shapes.

        Parameters
        ----------
        command : Dataset
            ``command`` (whisker, time) [m].
        how : KernelAnalysis
            Bins, lags and shapes.

        Returns
        -------
        Columns
            In the bins that count.
        """
        copies = Copies.of(command, how, fewest=1)
        edges, lags = copies.edges, how.lags()[0]
        binned = np.array([between_edges(drive.time, drive.envelope, edges) for drive in copies.drives])
        spread = float(binned[:, copies.valid].std())
        shapes = raised_cosines(lags, how.shapes)
        seen = lagged((binned - binned.mean(1, keepdims=True)) / spread, shapes)
        early = np.arange(len(edges) - 1) >= len(lags)  # before, the kernels would reach out of the record
        valid = copies.valid & early
        columns = seen[:, valid].transpose(1, 0, 2).reshape(int(valid.sum()), -1)
        columns = columns - columns.mean(0)
        shared = np.column_stack([np.ones(len(columns)), columns])
        return cls(whiskers=copies.whiskers, shared=shared, shapes=shapes, spread=spread, valid=valid, edges=edges)


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

    Returns
    -------
    TrialDesign
        Columns in the bins that count.
    """
    lags = how.lags()[1]
    if not lags.size:
        return TrialDesign.repeated(columns.shared, len(counts))
    shapes = raised_cosines(lags, how.past_shapes, stretch=STRETCH)
    return TrialDesign(shared=columns.shared, own=lagged(counts, shapes, first=1)[:, columns.valid])
