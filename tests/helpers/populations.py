"""Synthetic cortex of known truth: ringing stimuli, and units that do not answer their envelope."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.signal import lfilter

from vibrissa.neural.coupling.nulls import circular_correlogram
from vibrissa.signals.envelope import analytic_envelope

WIDTH, BINS = 0.01, 1000
BETWEEN_WHISKERS = 42  # [bins] a 24th of 10 s


def ringing(rng, *, duration=10.0, rate=2000.0, frequency=70.0, damping=0.11, events=167.0):
    """Displacement [m] of an oscillator kicked at random moments, scaled to a mean envelope of 55 µm."""
    time = np.arange(round(duration * rate)) / rate
    kicks = np.bincount(rng.integers(0, time.size, rng.poisson(events * duration)), minlength=time.size).astype(float)
    omega = 2 * np.pi * frequency
    pole = np.exp((-damping + 1j * np.sqrt(1 - damping**2)) * omega / rate)
    x = lfilter([0, pole.imag], [1, -2 * pole.real, abs(pole) ** 2], kicks)
    return time, (x - x.mean()) * 55e-6 / analytic_envelope(x)[0].mean()


def envelopes(n, rng):
    """Envelopes of n stimuli in 1,000 bins of 10 ms [m]; (n, 1000)."""
    return np.array([analytic_envelope(ringing(rng)[1])[0].reshape(BINS, -1).mean(-1) for _ in range(n)])


@cache
def first_envelopes(n, seed):
    """Envelopes of n stimuli, the first that a seed draws, and the state in which they leave its generator."""
    rng = np.random.default_rng(seed)
    drawn = envelopes(n, rng)
    drawn.flags.writeable = False
    return drawn, rng.bit_generator.state


def stimulated(n, seed):
    """Envelopes of n stimuli and the generator that drew them; those of a seed are computed once."""
    drawn, state = first_envelopes(n, seed)
    rng = np.random.default_rng()
    rng.bit_generator.state = state
    return drawn, rng


def wander(shape, correlation_time, rng):
    """Noise of mean 0 and variance 1 that forgets exponentially over the last axis [s]."""
    keep = np.exp(-WIDTH / correlation_time)
    noise = rng.normal(size=(*shape[:-1], shape[-1] + 200))
    return lfilter([np.sqrt(1 - keep**2)], [1, -keep], noise)[..., 200:]


def poisson(envelope, n_trials, rng):
    return rng.poisson(5 * WIDTH * n_trials, envelope.shape)


def states(envelope, n_trials, rng):
    """Activity that comes and goes over 150 ms, differently in each trial."""
    total = np.zeros(envelope.shape)
    for _ in range(n_trials):
        total += np.exp(0.8 * wander(envelope.shape, 0.15, rng) - 0.32)
    return rng.poisson(5 * WIDTH * total)


def locked(envelope, n_trials, rng):
    """Answers something slow in every trial alike, but not the envelope."""
    return rng.poisson(5 * WIDTH * n_trials * np.maximum(1 + 0.6 * wander(envelope.shape, 0.05, rng), 0))


def other_whisker(envelope, n_trials, rng):
    delays = BETWEEN_WHISKERS * rng.integers(1, 23, len(envelope))
    theirs = np.array([np.roll(one, delay) for one, delay in zip(envelope, delays, strict=True)])
    return driven(theirs, n_trials, rng, slope=1e5)


def adapting(envelope, n_trials, rng):
    """Begins high and settles within a second."""
    rate = 5 * (1 + 3 * np.exp(-np.arange(BINS) * WIDTH / 1.0))
    return rng.poisson(rate * WIDTH * n_trials * np.ones_like(envelope))


def driven(envelope, n_trials, rng, *, slope, threshold=42.3e-6, baseline=5.0, lag=1):
    """Counts of units that follow the binned envelope above the threshold, a bin later."""
    above = np.maximum(np.roll(envelope, lag, axis=-1) - threshold, 0)
    return rng.poisson((baseline + slope * above) * WIDTH * n_trials)


UNCOUPLED = {one.__name__: one for one in (poisson, states, locked, other_whisker, adapting)}


@dataclass(frozen=True, kw_only=True)
class PseudoTexture:
    """Null of ``envelope_coupling``: textures that the unit never met."""

    envelopes: np.ndarray  # (N, K), in the bins and with the edges of the one presented

    def values(self, record, unit, correlogram, lags):
        """Largest correlation with each of them over the same lags."""
        r = circular_correlogram(record.rates[unit], record.rate_valid, self.envelopes, record.envelope_valid)
        return r[:, np.arange(lags[0], lags[1] + 1)].max(1)
