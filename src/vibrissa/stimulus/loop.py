"""Motions joined to one loop, without a seam."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from vibrissa.arrays import Array
from vibrissa.errors import FormatError, RangeError, TooFewError, require_positive
from vibrissa.limits import require_samples
from vibrissa.stimulus.waveform import PointMotion

STEEP = 1.5  # step at a seam over the largest elsewhere: weights give two motions at once √2 at most, the fade the rest


class Loop(NamedTuple):
    """Motions joined to one loop.

    Attributes
    ----------
    values : (T,) array
        One period [m], its mean 0.
    seams : (K,) array
        Where each overlap begins [s]; the last motion goes over into the first from 0 on.
    begins : (K,) array
        Time of each motion that is replayed there [s].
    """

    values: Array
    seams: Array
    begins: Array


def joined(motions: Sequence[PointMotion], duration: float, sampling_rate: float, *, fade: float = 0.05) -> Loop:
    """Motions joined to one loop, without a seam at the joints or from the end to the start.

    Each motion gives the same time if it can, cut from its middle and freed from its mean. Neighbours overlap by
    ``fade`` with weights cos(π/2 σ) and sin(π/2 σ), σ = sin²(πu/2), u from 0 to 1: they and their slopes are
    continuous, and their squares sum to 1, so the power of independent motions does not dip. The loop is made at the
    highest sampling rate of the motions (or a multiple of the one asked for) by cubic splines and its Fourier series
    then cut to the one asked for, so nothing folds back into the band.

    Parameters
    ----------
    motions : sequence of PointMotion
        One for each texture, in order.
    duration : float
        Of the loop [s]; a whole number of samples.
    sampling_rate : float
        Of the loop [Hz].
    fade : float
        Overlap of neighbours [s].

    Returns
    -------
    Loop
        Of that duration and sampling rate.

    Raises
    ------
    InputError
        If the motions are too short for the loop, or a parameter is not positive.
    """
    count = samples(duration, sampling_rate)
    if not 0 < fade < duration / (2 * len(motions)):
        raise RangeError("fade", f"must be positive and below {duration / (2 * len(motions)):.3g} s", fade)
    finer = int(np.ceil(max(motion.sampling_rate for motion in motions) / sampling_rate - 1e-9))
    work = sampling_rate * max(finer, 1)
    overlap = max(round(fade * work), 2)
    shares = _shares(motions, duration, overlap / work)
    ends = np.round(np.cumsum([0, *shares]) * work).astype(int)
    whole, begins = np.zeros(ends[-1] + overlap), []
    for motion, start, end in zip(motions, ends[:-1], ends[1:], strict=True):
        begins.append(_begin(motion, end + overlap - start, work))
        piece = _piece(motion, begins[-1], end + overlap - start, overlap, work)
        whole[start : end + overlap] += piece
    loop = whole[: ends[-1]]
    loop[:overlap] += whole[ends[-1] :]
    series = np.fft.rfft(loop)[: count // 2 + 1] * (count / len(loop))
    series[0] = 0
    return Loop(np.fft.irfft(series, count), ends[:-1] / work, np.array(begins))


def samples(duration: float, sampling_rate: float) -> int:
    """Samples in a record; an InputError unless both are positive and the number is whole.

    Parameters
    ----------
    duration : float
        [s].
    sampling_rate : float
        [Hz].

    Returns
    -------
    int
        Their number.

    Raises
    ------
    InputError
        If it is not whole, or above 2,000,000.
    """
    for name, value in (("duration", duration), ("sampling_rate", sampling_rate)):
        require_positive(name, value)
    count = round(duration * sampling_rate)
    require_samples("command", duration, sampling_rate)
    if abs(count - duration * sampling_rate) > 1e-6 or count < 8:
        raise TooFewError("duration", "must be a whole number of at least 8 samples", f"{duration * sampling_rate:.9g}")
    return count


def _shares(motions: Sequence[PointMotion], duration: float, overlap: float) -> Array:
    """Time that each motion fills, without the overlap after it: equal, unless some are shorter."""
    lasting = np.array([motion.duration for motion in motions])
    spare = lasting - overlap
    if spare.min() <= overlap:
        short, rule = motions[int(spare.argmin())], f"must each last longer than two overlaps, {2 * overlap:g} s"
        found = f"{short.duration:.5g} s of {short.source}"
        raise FormatError("inputs", rule, found, "scan a longer texture, or shorten `fade`")
    if spare.sum() < duration:
        rule = f"must last {duration + len(motions) * overlap:g} s in all, one overlap of {overlap:g} s each included"
        remedy = f"scan a longer texture, add one, or shorten `duration` to at most {spare.sum():.5g} s"
        raise FormatError("inputs", rule, f"{lasting.sum():.5g} s", remedy)
    shares = np.zeros(len(spare))
    left = duration
    for rank, index in enumerate(np.argsort(spare)):
        shares[index] = min(spare[index], left / (len(spare) - rank))
        left -= shares[index]
    return shares


def _begin(motion: PointMotion, count: int, rate: float) -> float:
    """Time of a motion from which ``count`` samples are its middle, on a sample: nothing to interpolate."""
    spare = (motion.duration - (count - 1) / rate) / 2
    return float(np.floor(spare * motion.sampling_rate) / motion.sampling_rate)


def _piece(motion: PointMotion, start: float, count: int, overlap: int, rate: float) -> Array:
    """``count`` samples of a motion, faded in and out [m]."""
    t = np.clip(start + np.arange(count) / rate, 0, motion.duration)
    grid = np.arange(len(motion.displacement)) / motion.sampling_rate
    cut = CubicSpline(grid, motion.displacement)(t)
    rise = np.pi / 2 * np.sin(np.pi / 2 * np.arange(overlap) / overlap) ** 2
    weight = np.ones(count)
    weight[:overlap], weight[count - overlap :] = np.sin(rise), np.cos(rise)
    return weight * (cut - cut.mean())


def seam_steps(loop: Array, seams: Array, fade: float, sampling_rate: float) -> tuple[Array, Array]:
    """Largest steps in value and in slope at the seams, over the largest elsewhere.

    At most about 1 where the seam does nothing that the motion does not do by itself.

    Parameters
    ----------
    loop : (T,) array
        One period.
    seams : (K,) array
        Where each overlap begins [s].
    fade, sampling_rate : float
        Length of the overlap [s]; [Hz].

    Returns
    -------
    step, bend : (K,) arrays
        |x(n+1) − x(n)| and |x(n+1) − 2x(n) + x(n−1)|: the largest of each overlap over the largest outside them.
    """
    step = np.abs(np.roll(loop, -1) - loop)
    bend = np.abs(np.roll(loop, -1) - 2 * loop + np.roll(loop, 1))
    about = np.arange(-1, round(fade * sampling_rate) + 2)
    spans = (np.round(seams * sampling_rate).astype(int)[:, None] + about) % len(loop)
    elsewhere = np.delete(np.arange(len(loop)), np.unique(spans))
    return step[spans].max(1) / step[elsewhere].max(), bend[spans].max(1) / bend[elsewhere].max()


def seam_note(steps: Array, seams: Array) -> str:
    """Which seam is steeper than the motions themselves, in one line; empty where none is.

    Parameters
    ----------
    steps : (K,) array
        Largest step at each seam over the largest elsewhere, before the filter.
    seams : (K,) array
        Where each overlap begins [s].

    Returns
    -------
    str
        The line.
    """
    worst = int(np.argmax(steps))
    if steps[worst] < STEEP:
        return ""
    where = f"in the overlap from {seams[worst]:.4g} s on"
    text = f"{where} the motion is {steps[worst]:.2g} times as fast as anywhere else, before the filter"
    return f"{text}: what is joined there lies far apart; lengthen `fade`"
