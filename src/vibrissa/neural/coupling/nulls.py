"""Null distributions of the correlation of rate and envelope: two, by name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibrissa.arrays import Array, Complex, Integers, Mask
from vibrissa.errors import RangeError, ShapeError, TooFewError

Lags = tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class BinnedRecord:
    """Binned rates of units and the envelope presented, with what of them counts.

    Attributes
    ----------
    rates : (U, K) array
        Trial-averaged rate of each unit in each bin, in any unit.
    envelope : (K,) array
        Envelope in the same bins, in any unit.
    rate_valid, envelope_valid : (K,) arrays of bool
        Bins that count: without onset and edges.
    """

    rates: Array
    envelope: Array
    rate_valid: Mask
    envelope_valid: Mask

    def __post_init__(self) -> None:
        shapes = {np.shape(self.envelope), np.shape(self.rate_valid), np.shape(self.envelope_valid)}
        if np.ndim(self.rates) != 2 or shapes != {np.shape(self.rates)[1:]}:
            raise ShapeError("rates, envelope and masks", "must have the same bins", np.shape(self.rates))
        if min(self.rate_valid.sum(), self.envelope_valid.sum()) < 20:
            raise RangeError("bins that count", "must be at least 20", remedy="give a longer record or narrower bins")

    @classmethod
    def whole(cls, rates: Array, envelope: Array) -> BinnedRecord:
        """Record in which every bin counts.

        Parameters
        ----------
        rates : (U, K) or (K,) array
            Rate of each unit in each bin.
        envelope : (K,) array
            Envelope in the same bins.

        Returns
        -------
        BinnedRecord
            With masks that are true throughout.
        """
        every = np.ones(len(envelope), bool)
        return cls(rates=np.atleast_2d(rates), envelope=envelope, rate_valid=every, envelope_valid=every)


def circular_correlogram(rate: Array, rate_valid: Mask, envelope: Array, envelope_valid: Mask) -> Array:
    """Pearson's r of rate and envelope at all circular shifts, over the pairs in which both count.

    The six sums of r run through the Fourier transform, so that all shifts cost about as much as one.

    Parameters
    ----------
    rate, envelope : (..., K) arrays
        Leading dimensions are matched by broadcasting.
    rate_valid, envelope_valid : (K,) arrays of bool
        Bins that count.

    Returns
    -------
    (..., K) array
        r at shift k: rate at bin i beside envelope at bin i − k (mod K). NaN where one of them is constant, or fewer
        than 3 pairs remain.
    """
    n, (r, rr), (e, ee) = len(rate_valid), _moments(rate, rate_valid), _moments(envelope, envelope_valid)
    m, w = np.fft.rfft(rate_valid.astype(float)), np.fft.rfft(envelope_valid.astype(float))

    def sums(a: Complex, b: Complex) -> Array:
        return np.fft.irfft(a * b.conj(), n)

    pairs = np.round(sums(m, w))
    with np.errstate(invalid="ignore", divide="ignore"):
        sum_r, sum_e = sums(r, w), sums(m, e)
        variance_r = sums(rr, w) - sum_r**2 / pairs
        variance_e = sums(m, ee) - sum_e**2 / pairs
        smallest = 1e-10  # of variances scaled to 1 for each bin: anything below is round-off
        flat = (variance_r <= smallest * pairs) | (variance_e <= smallest * pairs) | (pairs < 3)
        correlation = (sums(r, e) - sum_r * sum_e / pairs) / np.sqrt(variance_r * variance_e)
    return np.where(flat, np.nan, correlation)


def _moments(values: Array, valid: Mask) -> tuple[Complex, Complex]:
    """Transforms of the values, scaled to mean 0 and variance 1 where they count, and of their squares."""
    counted = values[..., valid]
    centre, spread = counted.mean(-1, keepdims=True), counted.std(-1, keepdims=True)
    constant = np.ptp(counted, axis=-1, keepdims=True) == 0
    scaled = np.where(valid & ~constant, values - centre, 0.0) / np.where(constant, 1.0, spread)
    return np.fft.rfft(scaled), np.fft.rfft(scaled**2)


@dataclass(frozen=True, kw_only=True)
class Circular:
    """All circular shifts of the envelope against the rate, without chance draws.

    Each shift gives the largest correlation over the same lags as the observed one. Where one stimulus runs on all
    whiskers with fixed delays, shifts by another whisker's delay hold real responses and must be left out.

    Attributes
    ----------
    guard : int
        Shifts left out on both sides of the lags tried, and of each delay [bins]: the envelope is like itself there.
    delays : tuple of int
        Delays at which other whiskers had the same stimulus [bins].
    """

    guard: int = 6
    delays: tuple[int, ...] = ()

    def shifts(self, n_bins: int, lags: Lags) -> Integers:
        """Shifts that count as chance [bins].

        Parameters
        ----------
        n_bins : int
            Bins K of the record.
        lags : (int, int)
            First and last lag tried [bins].

        Returns
        -------
        (S,) array of int
            In ascending order.

        Raises
        ------
        InputError
            If fewer than 20 remain.
        """
        first, last = lags
        shift = np.arange(n_bins)
        kept = np.ones(n_bins, bool)
        for real in (0, *self.delays):
            # lags at this shift span shift + first … shift + last; those of the response, real + first … real + last
            distance = (shift - real + n_bins // 2) % n_bins - n_bins // 2
            kept &= np.abs(distance) > self.guard + last - first
        if kept.sum() < 20:
            raise TooFewError("circular shifts", "must leave at least 20", int(kept.sum()), "fewer delays, less guard")
        return shift[kept]

    def values(self, record: BinnedRecord, unit: int, correlogram: Array, lags: Lags) -> Array:
        """Largest correlation over the lags at each shift that counts.

        Parameters
        ----------
        record, unit, correlogram, lags
            As in :meth:`vibrissa.neural.coupling.envelope_coupling.Null.values`.

        Returns
        -------
        (C,) array
            Chance values of the correlation.
        """
        tried = self.shifts(len(correlogram), lags)[:, None] + np.arange(lags[0], lags[1] + 1)
        r = correlogram[tried % len(correlogram)]
        return np.where(np.isnan(r), -np.inf, r).max(-1, initial=-np.inf)


@dataclass(frozen=True, kw_only=True)
class Paper2014:
    """The paper's null: all values of the correlograms of shuffled bins.

    Shuffling takes the rate's own correlation in time away, and the values are not maximised over lags as the observed
    one is: rates that are slow, or that answer something else, are significant too often.

    Attributes
    ----------
    seed : int
        Seed of the shuffles.
    shuffles : int
        Shuffles of the trial-averaged rate.
    reach : int
        Largest lag of the correlograms [bins].
    """

    seed: int = 0
    shuffles: int = 300
    reach: int = 20

    def values(self, record: BinnedRecord, unit: int, correlogram: Array, lags: Lags) -> Array:
        """All correlogram values of all shuffles of the bins that count.

        Parameters
        ----------
        record, unit, correlogram, lags
            As in :meth:`vibrissa.neural.coupling.envelope_coupling.Null.values`.

        Returns
        -------
        (C,) array
            Chance values of the correlation.
        """
        rng = np.random.default_rng(self.seed)
        valid = record.rate_valid
        rate = record.rates[unit][valid]
        scaled = (rate - rate.mean()) / rate.std()
        shuffled = rng.permuted(np.tile(scaled, (self.shuffles, 1)), axis=1)
        return _correlations(shuffled, *self._shifted(record)).ravel()

    def _shifted(self, record: BinnedRecord) -> tuple[Array, Array]:
        """Envelope, scaled, and whether it counts, beside each valid bin of the rate at each lag; (valid, lags)."""
        lags = np.arange(-self.reach, self.reach + 1)
        source = (np.flatnonzero(record.rate_valid)[:, None] - lags) % len(record.envelope)
        counts = record.envelope_valid[source]
        counted = record.envelope[record.envelope_valid]
        return np.where(counts, record.envelope[source] - counted.mean(), 0.0) / counted.std(), counts.astype(float)


def _correlations(rates: Array, envelopes: Array, counts: Array) -> Array:
    """Pearson's r of (N, V) scaled rates with (V, L) scaled envelopes over the pairs that count (1, else 0)."""
    pairs, sum_r, sum_e = counts.sum(0), rates @ counts, envelopes.sum(0)
    variance_r = rates**2 @ counts - sum_r**2 / pairs
    variance_e = (envelopes**2).sum(0) - sum_e**2 / pairs
    return (rates @ envelopes - sum_r * sum_e / pairs) / np.sqrt(variance_r * variance_e)
