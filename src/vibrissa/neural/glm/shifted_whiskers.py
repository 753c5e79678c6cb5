"""Chance of a whisker's weight: its stimulus shifted beside the others', threshold and latency chosen again."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Complex
from vibrissa.neural.glm.delayed_envelopes import LATEST
from vibrissa.neural.glm.shift_null import p_of_shifts
from vibrissa.neural.glm.whisker_weights import SurroundGrid

SMALLEST = 1e-6  # of a column's size: with less beyond the others it follows from them
TINY = 1e-300  # in place of the 0 of a whisker that never passes a threshold


class ShiftedWhiskers:
    """What each whisker adds to the others at every shift of its stimulus: made once for a stimulus.

    The statistic is the sum of squares of the rate that all whiskers explain together, less what the others do, each
    at the threshold and latency of the grid that are best for it. The choice of threshold and latency is made anew at
    every shift, as it was made for the stimulus that was played.

    Parameters
    ----------
    grid : SurroundGrid
        Hinged envelopes over thresholds and latencies.
    width : float
        Width of a bin [s].
    """

    def __init__(self, grid: SurroundGrid, width: float) -> None:
        self._columns, self._inverse = grid.centred, grid.inverse
        self._transforms = np.fft.rfft(self._columns)
        self._left = np.zeros_like(self._columns)
        for node in np.ndindex(*self._columns.shape[:2]):
            self._left[node] = _left(self._columns[node], self._inverse[node], self._transforms[node])
        self._latest = round(LATEST / width)

    def p_values(self, rate: Array, guard: int) -> Array:
        """p-value of each whisker for one unit.

        Parameters
        ----------
        rate : (K,) array
            Mean rate in the bins that count, in any unit.
        guard : int
            Bins over which a drive is like itself.

        Returns
        -------
        (W,) array
            Not adjusted over whiskers.
        """
        gained, left = self.explained(rate), self._left.mean((0, 1))
        return np.array([p_of_shifts(*one, guard, self._latest) for one in zip(gained, left, strict=True)])

    def explained(self, rate: Array) -> Array:
        """Sum of squares that each whisker adds at every shift.

        Parameters
        ----------
        rate : (K,) array
            Mean rate in the bins that count, in any unit.

        Returns
        -------
        (W, K) array
            In the square of the rate's unit; column 0 is the stimulus as it was played.
        """
        centred = rate - rate.mean()
        together, others = (np.full(self._columns.shape[2:], -np.inf) for _ in range(2))
        for row in zip(self._columns, self._inverse, self._transforms, self._left, strict=True):
            added, without = _at_threshold(centred, *row)
            others = np.maximum(others, without.max(0)[:, None])
            together = np.maximum(together, (without[..., None] + added).max(0))
        return together - others


def _left(columns: Array, inverse: Array, transforms: Complex) -> Array:
    """Size of each whisker's column beyond those of the others, at every shift of it; (W, K)."""
    found = np.empty_like(columns)
    for k, own in enumerate(transforms):
        shared = np.fft.irfft(transforms * own.conj(), columns.shape[1])
        others = inverse - np.outer(inverse[:, k], inverse[k]) / max(inverse[k, k], TINY)
        found[k] = columns[k] @ columns[k] - ((others @ shared) * shared).sum(0)
    return np.maximum(found, np.maximum(SMALLEST * (columns**2).sum(1, keepdims=True), TINY))


def _at_threshold(rate: Array, columns: Array, inverse: Array, transforms: Complex, left: Array) -> tuple[Array, Array]:
    """What each shifted whisker adds, (J, W, K), to what the others explain, (J, W), at every latency."""
    product = columns @ rate
    b = np.einsum("jwv,jv->jw", inverse, product)
    own = np.maximum(np.einsum("jww->jw", inverse), TINY)
    without = (product * b).sum(1, keepdims=True) - b**2 / own
    of_others = b[:, None] - inverse * (b / own)[..., None]  # (J, whisker left out, W)
    rest = np.fft.rfft(rate) - of_others @ transforms
    pull = np.fft.irfft(rest * transforms.conj(), rate.size)
    return pull**2 / left, without
