"""GOP artifact: grey levels that beat with the key frames of a lossy codec, a false line in every spectrum.

A lossy codec codes a key frame afresh and the frames after it as changes, so the grey levels of things at rest jump at
every key frame. What is tracked on them jumps too, at the rate of the key frames and its multiples.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.special import gammaln
from scipy.stats import rankdata

from vibrissa.arrays import Integers
from vibrissa.errors import RangeError
from vibrissa.video.io.grey import Frames

CELLS = 8  # patches along either side of the image
LATTICE = 8  # pixels looked at along either side of a patch, at most
SHORTEST = 4  # [frames] period; two and three are those of interlaced fields and flickering lamps
PERIODS = 8  # of one pumping that must pass before it is looked for
NEIGHBOURS = 41  # bins by whose median the power of a bin is judged
SURE = 1e-4  # chance of finding pumping in a movie that has none
_SEEN = 0.05  # [grey levels] rms: a weaker beat is not remarked on


@dataclass(frozen=True, kw_only=True)
class GopArtifact:
    """Beat of the grey levels with a period of some frames.

    Attributes
    ----------
    period : int
        Frames from beat to beat.
    frequency : float
        Of the line it puts into spectra [Hz of the acquisition]; more are at its multiples.
    amplitude : float
        Root mean square over time of the periodic part of a pixel's grey level, median over 64 pixels spread over the
        image, the share of noise taken away [grey levels].
    p_value : float
        Bound of the chance that a movie without pumping looks like this, all periods tried counted.
    at_key_frames : bool
        Whether the period is that of the container's key frames; if not it may be a flickering lamp's.
    """

    period: int
    frequency: float
    amplitude: float
    p_value: float
    at_key_frames: bool


class GopArtifactWatch:
    """Looks for pumping while the frames of a movie pass by.

    Parameters
    ----------
    frame_rate : float
        Of the acquisition [Hz].
    key_frames : sequence of int
        Numbers of the key frames, from :func:`vibrissa.video.io.container.key_frames`. If they come evenly, only their
        period is tried; if they are not known, every period is.
    """

    def __init__(self, frame_rate: float, key_frames: ArrayLike = ()) -> None:
        if not (np.isfinite(frame_rate) and frame_rate > 0):
            raise RangeError("frame_rate", "must be positive and finite", frame_rate)
        self.frame_rate = frame_rate
        self._key_period = _even(np.asarray(key_frames))
        self._last: NDArray[np.int32] | None = None
        self._changes: list[NDArray[np.float32]] = []
        self._pixels: list[NDArray[Any]] = []

    def see(self, block: Frames) -> None:
        """Take note of the next block of frames (T, height, width); at most 384 bytes are kept of each frame.

        Parameters
        ----------
        block : (T, height, width) array
            The frames that follow those seen before.
        """
        if not len(block):
            return
        seen = _lattice(block)
        before = seen[:1] if self._last is None else self._last
        change = np.abs(np.diff(seen, axis=0, prepend=before))
        self._changes.append(change.mean(axis=(2, 4), dtype=np.float32).reshape(len(block), -1))
        self._pixels.append(block[(slice(None), *_middles(block))].reshape(len(block), -1))
        self._last = seen[-1:]

    def found(self) -> GopArtifact | None:
        """GOP artifact in all frames seen, or None: none, or fewer than eight periods of it."""
        if not self._changes:
            return None
        changes = np.concatenate(self._changes)[1:]
        period, log_p = _beat(changes, self._key_period)
        if log_p > log(SURE):
            return None
        return GopArtifact(
            period=period,
            frequency=self.frame_rate / period,
            amplitude=_amplitude(np.concatenate(self._pixels), period),
            p_value=float(np.exp(log_p)),
            at_key_frames=period == self._key_period,
        )

    def remark(self) -> str | None:
        """One sentence on the pumping found, None if there is none."""
        found = self.found()
        if found is None or found.amplitude < _SEEN:
            return None
        cause = "the codec's key frames" if found.at_key_frames else "key frames of a lossy codec, or a flickering lamp"
        return (
            f"the grey levels beat every {found.period} frames, with {cause} "
            f"({found.amplitude:.2g} grey levels rms, p < {_rounded_up(found.p_value)}): "
            f"lines at {found.frequency:.4g} Hz and its multiples are false; record without loss"
        )


def _even(key_frames: Integers) -> int:
    """Period of key frames that come evenly, else 0."""
    steps = np.unique(np.diff(key_frames))
    return int(steps[0]) if steps.size == 1 and steps[0] >= SHORTEST else 0


def _middles(block: Frames) -> tuple[Integers, Integers]:
    """Rows (as a column) and columns of the pixel in the middle of each patch."""
    rows, columns = (
        np.arange(min(CELLS, size)) * (size // min(CELLS, size)) + size // min(CELLS, size) // 2
        for size in block.shape[1:]
    )
    return rows[:, None], columns


def _lattice(block: Frames) -> NDArray[np.int32]:
    """Some pixels of each patch (T, patches, pixels, patches, pixels), down and across."""
    lattice, shape = block, [len(block)]
    for axis in (1, 2):
        cells = min(CELLS, block.shape[axis])
        side = block.shape[axis] // cells
        places = np.arange(0, side, -(-side // LATTICE))
        lattice = np.take(lattice, (np.arange(cells)[:, None] * side + places).ravel(), axis=axis)
        shape += [cells, len(places)]
    return lattice.reshape(shape).astype(np.int32)


def _beat(changes: NDArray[np.float32], key_period: int) -> tuple[int, float]:
    """Period that is most prominent, and the bound of the log of its probability by chance.

    The change of a typical patch shows the period; most patches by themselves must show it too, or it is something
    that moves there. Half a period is prominent as well: of the multiples that add teeth, the longest.
    """
    change = np.median(changes, axis=1)
    longest = len(change) // PERIODS
    periods = [key_period] if key_period else range(SHORTEST, longest + 1)
    tried = [(_log_p(change, period), period) for period in periods if SHORTEST <= period <= longest]
    log_p, period = min(tried, default=(0.0, 0))
    log_p = min(log_p + log(max(len(tried), 1)), 0.0)
    if log_p > log(SURE) or not _in_most(changes, period):
        return 0, 0.0
    multiples = [more for _, more in tried if more > period and more % period == 0]
    longer = [
        more for more in multiples if _log_p(change, more, period) < log(SURE) and _in_most(changes, more, period)
    ]
    return max(longer, default=period), log_p


def _in_most(changes: NDArray[np.float32], period: int, beside: int = 0) -> bool:
    """Whether most patches show a period by themselves."""
    return bool(np.median([_log_p(patch, period, beside) for patch in changes.T]) < log(0.05))


def _log_p(change: NDArray[np.float32], period: int, beside: int = 0) -> float:
    """Bound of the log-probability that the comb of a period exceeds the spectrum by chance.

    The change from frame to frame is ranked, so that its distribution does not matter. Under chance, power over its
    local mean is exponential. Most teeth of the comb must exceed it: the k-th smallest of their H probabilities, k the
    majority, is below p with a probability of at most C(H, k) pᵏ. A vibration, with few harmonics, makes no such comb.
    The teeth that the comb of the period ``beside`` has too are left out.
    """
    ranks = rankdata(change[: len(change) // period * period])
    power = np.abs(np.fft.rfft(ranks - ranks.mean())) ** 2
    spacing = len(ranks) // period
    others = median_filter(np.delete(power, np.arange(0, len(power), spacing)), NEIGHBOURS, mode="nearest") / log(2)
    tooth = np.arange(1, (period - 1) // 2 + 1)
    if beside:
        tooth = tooth[tooth % (period // beside) != 0]
    local = np.maximum(others[tooth * (spacing - 1)], 1e-9)
    # the local mean is itself measured, by some forty bins
    p = np.sort(-NEIGHBOURS * np.log1p(power[tooth * spacing] / local / NEIGHBOURS))
    k = len(tooth) // 2 + 1
    ways = gammaln(len(tooth) + 1) - gammaln(k + 1) - gammaln(len(tooth) - k + 1)
    return float(min(ways + k * p[k - 1], 0.0))


def _amplitude(pixels: NDArray[Any], period: int) -> float:
    """Root mean square of the periodic part, median over pixels [grey levels]."""
    whole = pixels[: len(pixels) // period * period].astype(np.float64)
    whole -= uniform_filter1d(whole, period, axis=0, mode="reflect")  # drift, and nothing of the period
    beats = whole.reshape(-1, period, whole.shape[1])
    beat = beats.mean(axis=0)
    noise = beats.var(axis=0, ddof=1).mean(axis=0) / len(beats)
    return float(np.sqrt(max(np.median((beat**2).mean(axis=0) - noise), 0.0)))


def _rounded_up(p: float) -> str:
    return f"{max(10.0 ** np.ceil(np.log10(max(p, 1e-300))), 1e-12):.0e}"
