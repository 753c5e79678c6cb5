"""Delayed copies of one texture on many whiskers, as threshold-linear drives averaged over bins."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import RangeError
from vibrissa.neural.coupling.presentation import BinnedAnalysis
from vibrissa.neural.coupling.threshold_linear import BinnedDrive
from vibrissa.neural.io.tables.stimuli import channels_of, presented

FINEST = 2000.0  # [Hz] an envelope is sampled no finer: it changes within milliseconds
LATEST = 0.03  # [s] latencies searched
ALIKE = 0.9  # largest |r| with another copy, at any lag up to the latest, at which a unit still separates them
INFLATED = 10.0  # variance of a weight over that beside uncorrelated copies, above which it is not estimated


@dataclass(frozen=True, kw_only=True)
class Copies:
    """Envelopes of all whiskers, in the same bins.

    Attributes
    ----------
    whiskers : tuple of str
        Names.
    drives : tuple of BinnedDrive
        One for each whisker; all count the same bins.
    """

    whiskers: tuple[str, ...]
    drives: tuple[BinnedDrive, ...]

    @classmethod
    def of(cls, command: xr.Dataset, how: BinnedAnalysis | None = None, *, fewest: int = 2) -> Copies:
        """Envelopes of all whiskers' motions, in the same bins.

        Parameters
        ----------
        command : Dataset
            ``command`` (whisker, time) [m], ``time``, ``whisker``; or any stimulus with the dimension whisker.
        how : BinnedAnalysis, optional
            Bins, window and band.
        fewest : int
            Whiskers that there must be.

        Returns
        -------
        Copies
            One drive for each whisker, in the order of the command.

        Raises
        ------
        InputError
            If there are fewer whiskers, or one that does not move; as ``Presentation.of``.
        """
        how = how or BinnedAnalysis()
        channels = channels_of(command)
        names, time = tuple(channels), command.time.values
        if len(names) < fewest:
            raise RangeError("whiskers", f"must be at least {fewest}", len(names))
        still = np.array([np.ptp(presented(one).values) == 0 for one in channels.values()])
        if still.any():
            raise RangeError(f"whisker {names[int(np.argmax(still))]}", "must move", "a constant", "leave it out")
        drives = [how.presentation(one).drive() for one in channels.values()]
        stride = max(int((len(time) - 1) / (time[-1] - time[0]) / FINEST), 1)
        valid = np.all([one.valid for one in drives], axis=0)
        thin = [replace(one, time=one.time[::stride], envelope=one.envelope[::stride], valid=valid) for one in drives]
        return cls(whiskers=names, drives=tuple(thin))

    @property
    def valid(self) -> Mask:
        """Bins that count, (K,)."""
        return self.drives[0].valid

    @property
    def edges(self) -> Array:
        """Edges of the bins [s], (K + 1,)."""
        return self.drives[0].edges

    def hinged(self, threshold: float, latency: float | Array) -> Array:
        """Mean over each bin that counts of max(A(t − τ) − θ, 0) [m]; (W, ..., K').

        Parameters
        ----------
        threshold : float
            θ [m].
        latency : float or (J,) array
            τ [s].

        Returns
        -------
        (W, ..., K') array
            In metres.
        """
        return np.array([drive.hinged(threshold, latency) for drive in self.drives])

    def thresholds(self) -> tuple[float, float]:
        """Range in which a threshold is looked for [m]."""
        ranges = np.array([drive.range() for drive in self.drives])
        return float(ranges[:, 0].min()), float(ranges[:, 1].max())

    def likeness(self) -> tuple[Array, Integers]:
        """Largest |r| of each envelope with any other within the latest latency, and which one that is.

        Returns
        -------
        likeness : (W,) array
            0 to 1.
        other : (W,) array of int
            Index of the whisker that is most alike.
        """
        step = self.drives[0].time[1] - self.drives[0].time[0]
        stride = max(int(0.002 / step), 1)  # every 2 ms: an envelope changes more slowly
        rows = np.array([drive.envelope[::stride] for drive in self.drives])
        reach, n = int(LATEST / (stride * step)), rows.shape[1]
        r = np.zeros((len(rows), len(rows)))
        for lag in range(reach + 1):
            pair = np.corrcoef(rows[:, lag:], rows[:, : n - lag])[: len(rows), len(rows) :]
            r = np.maximum(r, np.maximum(np.abs(pair), np.abs(pair).T))
        np.fill_diagonal(r, 0)
        return r.max(1), r.argmax(1)


def condition_number(columns: Array) -> float:
    """Largest over smallest singular value of columns scaled to mean 0 and variance 1; 1 where none correlate.

    Parameters
    ----------
    columns : (W, K) array
        One row for each whisker.

    Returns
    -------
    float
        At least 1; infinite where one column follows from others.
    """
    values = np.linalg.svd(_scaled(columns), compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 1e-12 * values[0] else np.inf


def inflation(columns: Array) -> Array:
    """Variance of each weight over what it would be if no columns correlated; infinite where one follows from others.

    Parameters
    ----------
    columns : (W, K) array
        One row for each whisker.

    Returns
    -------
    (W,) array
        At least 1.
    """
    u, values, _ = np.linalg.svd(_scaled(columns), full_matrices=False)
    small = values <= 1e-6 * values[0]
    found = (u[:, ~small] ** 2 / values[~small] ** 2).sum(1)
    return np.where((u[:, small] ** 2).sum(1) > 1e-6, np.inf, np.maximum(found, 1.0))


def _scaled(columns: Array) -> Array:
    centred = columns - columns.mean(1, keepdims=True)
    return centred / np.maximum(np.linalg.norm(centred, axis=1, keepdims=True), 1e-300)
