"""Columns of a Poisson model on trials that share their stimulus, and the draws: trials, or blocks of the stimulus."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import RangeError, ShapeError

Places = tuple[Mask | slice, Mask | slice]  # trials and bins


@dataclass(frozen=True, kw_only=True)
class TrialDesign:
    """Columns that explain the counts of repeated trials.

    The stimulus is the same in every trial, so its columns are kept once; only a unit's own past differs.

    Attributes
    ----------
    shared : (K, P) array
        Columns equal in all trials, such as the constant and the stimulus; K bins.
    own : (N, K, Q) array
        Columns that differ from trial to trial, such as the unit's own spikes; Q may be 0.
    starts : (M,) array of int, optional
        First bin of each block of the stimulus, from 0, where blocks are the draws; by default trials are.
    """

    shared: Array
    own: Array
    starts: Integers | None = None

    def __post_init__(self) -> None:
        if self.shared.ndim != 2 or self.own.ndim != 3 or self.own.shape[1] != len(self.shared):
            raise ShapeError("columns", "must be (K, P) and (N, K, Q)", f"{self.shared.shape}, {self.own.shape}")
        if not (np.isfinite(self.shared).all() and np.isfinite(self.own).all()):
            raise RangeError("columns", "must be finite")

    @classmethod
    def repeated(cls, shared: Array, n_trials: int) -> TrialDesign:
        """Design of columns that are equal in all trials.

        Parameters
        ----------
        shared : (K, P) array
            Columns.
        n_trials : int
            Trials N.

        Returns
        -------
        TrialDesign
            Without columns of single trials.
        """
        return cls(shared=shared, own=np.empty((n_trials, len(shared), 0)))

    @property
    def size(self) -> int:
        """Number of columns."""
        return self.shared.shape[1] + self.own.shape[2]

    @property
    def n_draws(self) -> int:
        """Number of draws: trials, or blocks of the stimulus."""
        return len(self.own) if self.starts is None else self.starts.size

    def places(self, kept: Mask) -> Places:
        """Trials and bins of some of the draws.

        Parameters
        ----------
        kept : (draws,) array of bool
            Whether each is kept.

        Returns
        -------
        Places
            Index into counts (N, K).
        """
        if self.starts is None:
            return kept, slice(None)
        return slice(None), np.repeat(kept, np.diff(np.append(self.starts, len(self.shared))))

    def part(self, places: Places) -> TrialDesign:
        """Keep some of the trials and bins.

        Parameters
        ----------
        places : Places
            From :meth:`places`.

        Returns
        -------
        TrialDesign
            Of these, trials being its draws.
        """
        return TrialDesign(shared=self.shared[places[1]], own=self.own[places])

    def log_rate(self, coefficients: Array) -> Array:
        """Columns times coefficients, (N, K).

        Parameters
        ----------
        coefficients : (P + Q,) array
            In the order shared, own.

        Returns
        -------
        (N, K) array
            ln(rate).
        """
        p = self.shared.shape[1]
        common = self.shared @ coefficients[:p]
        return common + self.own @ coefficients[p:]

    def trial_sums(self, weights: Array) -> Array:
        """Each trial's columnsᵀ · weights (N, K); (N, P + Q).

        Parameters
        ----------
        weights : (N, K) array
            Of each trial and bin.

        Returns
        -------
        (N, P + Q) array
            Sum over the bins of each trial.
        """
        return np.hstack([weights @ self.shared, np.einsum("nk,nkq->nq", weights, self.own)])

    def scores(self, excess: Array, middle: Array) -> Array:
        """Each draw's pull on the coefficients; (draws, P + Q).

        Parameters
        ----------
        excess : (N, K) array
            Counts less those expected.
        middle : (N, P + Q) array
            What is taken from the columns of each trial where blocks are the draws: what its gain follows.

        Returns
        -------
        (draws, P + Q) array
            Slope of the log-likelihood, by trial, or by block over all trials.
        """
        if self.starts is None:
            return self.trial_sums(excess)
        of_bins = np.hstack([excess.sum(0)[:, None] * self.shared, np.einsum("nk,nkq->kq", excess, self.own)])
        return np.asarray(np.add.reduceat(of_bins - excess.T @ middle, self.starts))

    def information(self, weights: Array) -> Array:
        """Columnsᵀ · weights · columns over all trials, weights (N, K).

        Parameters
        ----------
        weights : (N, K) array
            Counts expected.

        Returns
        -------
        (P + Q, P + Q) array
            Sum over trials.
        """
        p, q = self.shared.shape[1], self.own.shape[2]
        found = np.empty((p + q, p + q))
        # the stimulus is equal in all trials: their weights add up before the product
        found[:p, :p] = self.shared.T @ (weights.sum(0)[:, None] * self.shared)
        if q:
            weighted = weights[..., None] * self.own
            found[:p, p:] = self.shared.T @ weighted.sum(0)
            found[p:, :p] = found[:p, p:].T
            found[p:, p:] = weighted.reshape(-1, q).T @ self.own.reshape(-1, q)
        return found
