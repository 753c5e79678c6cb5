"""Time stamps of a movie's frames, or the numbers of its images: holes, where frames were dropped, and jitter."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import FormatError, RangeError
from vibrissa.video.io.grey import Frames

_OFF = 0.1  # [frames] by which an interval may differ from whole frames, besides the rounding of its ends
_UNSURE = 0.25  # [frames] of jitter, beyond which it is not known which frames are missing
_TICKS, _LAG = 4, 64  # of intervals shorter than so many ticks, so many are measured at once


@dataclass(frozen=True)
class FrameTimes:
    """Places of the frames of a movie on an even time axis.

    Attributes
    ----------
    slots : (T,) array of int, rising
        Number of each frame if those missing are counted too; the first is 0.
    irregular : int
        Intervals that are no whole number of frames.
    jitter : float
        By how much the worst of them is off [frames].
    source : str
        What shows it, for the messages.
    stride : int
        By how much the numbers of images rise from frame to frame.
    guessed : bool
        Whether frames at holes may have been at other places.
    """

    slots: Integers
    irregular: int
    jitter: float
    source: str = "time stamps"
    stride: int = 1
    guessed: bool = False

    @property
    def missing(self) -> Integers:
        """Numbers of the missing frames on the even axis."""
        return np.setdiff1d(np.arange(self.slots[-1] + 1), self.slots)

    def remarks(self, kept: bool) -> list[str]:
        """What the time stamps show, in a sentence each.

        Parameters
        ----------
        kept : bool
            Whether missing frames keep their place in time.

        Returns
        -------
        list of str
            None of an even movie.
        """
        holes, lines = np.diff(self.slots) - 1, []
        if holes.any():
            count = int(np.count_nonzero(holes))
            found = f"{count} hole{'s' * (count > 1)}, the largest of {holes.max()} frames, {holes.sum()} in all"
            then = (
                "missing frames are NaN, and counted in the numbers of frames"
                if kept
                else "later frames are timed too early"
                + ("" if self.guessed else "; `drop_frames='nan'` corrects this")
            )
            lines.append(f"the {self.source} have {found}: {then}")
        if self.stride > 1:
            lines.append(f"the {self.source} rise in steps of {self.stride}: each step counts as one frame")
        if self.irregular:
            off = f"{self.irregular} intervals are off by up to {self.jitter:.2g} of a frame"
            lines.append(f"the time stamps jitter: {off}; frames are taken as evenly spaced")
        return lines

    def refuse_unsure(self, name: str) -> None:
        """Refuse time stamps that do not show which frames are missing.

        Parameters
        ----------
        name : str
            The movie, for the message.

        Raises
        ------
        InputError
            If they jitter too much, more frames are missing than there are, or places at holes are guessed.
        """
        absent = int(self.slots[-1]) + 1 - len(self.slots)
        if self.jitter > _UNSURE:
            rule = f"must have time stamps that jitter by {_UNSURE} of a frame at most, to find missing frames"
            raise RangeError(name, rule, f"{self.jitter:.2g}", "leave `drop_frames` out")
        if absent and self.guessed:
            rule = "must have a time stamp for each frame in its order, to find missing frames"
            found = "AVI with frames that are coded out of order"
            raise FormatError(name, rule, found, "leave `drop_frames` out, or record MKV or MP4")
        if absent > len(self.slots):
            found = f"{absent} missing, {len(self.slots)} there"
            raise RangeError(name, "must have more frames than are missing", found, f"are its {self.source} right?")


def frame_times(time: Array, tick: float, rate: float) -> FrameTimes:
    """Places of frames by their time stamps.

    Parameters
    ----------
    time : (T,) array
        Time stamps [s], ascending.
    tick : float
        Unit to which they are rounded [s].
    rate : float
        Frame rate that the file states [Hz]; NaN if none. Stamps are exact if its interval is a number of ticks.

    Returns
    -------
    FrameTimes
        Of an even time axis whose interval is the one most common here.
    """
    steps = np.diff(time)
    exact = rate * tick <= 1 + 1e-6 and abs(1 / (rate * tick) - round(1 / (rate * tick))) < 1e-6
    rounding = 0.0 if exact else tick
    interval = float(np.median(steps)) if exact and len(steps) else _interval(time, tick)
    if len(time) < 3 or not interval > 0:
        return FrameTimes(np.arange(len(time)), max(len(time) - 1, 0) if len(time) > 2 else 0, float(len(time) > 2))
    for _ in range(3):  # the mean interval that goes with the places, and the places that go with it
        whole = _whole(steps / interval, rounding / interval)
        interval = float(steps.sum()) / int(whole.sum())
    off = np.abs(steps / interval - whole)
    irregular = off > _OFF + rounding / interval
    jitter = float(off.max()) if irregular.any() else 0.0
    return FrameTimes(np.concatenate([[0], np.cumsum(whole)]), int(np.count_nonzero(irregular)), jitter)


def numbered(numbers: Integers) -> FrameTimes:
    """Places of frames by the numbers of their images.

    Parameters
    ----------
    numbers : (T,) array of int, rising
        Of the images.

    Returns
    -------
    FrameTimes
        A frame is the largest step that divides all others.
    """
    steps = numbers - numbers[0]
    stride = max(int(np.gcd.reduce(steps)), 1)
    return FrameTimes(steps // stride, 0, 0.0, "numbers of the images", stride)


def _whole(steps: Array, rounding: float) -> Integers:
    """Whole intervals of each step; more than one where rounding cannot account for it."""
    return np.where(steps > 1.5 + rounding, np.rint(steps), 1).astype(np.int64)


def _interval(time: Array, tick: float) -> float:
    """Interval between frames [s], from those that are alike; several at once where rounding hides one."""
    if len(time) < 3:
        return 0.0
    lag = 1 if np.median(np.diff(time)) >= _TICKS * tick else min(_LAG, 1 + len(time) // 8)
    spans = time[lag:] - time[:-lag]
    middle = np.median(spans)
    alike = np.abs(spans - middle) <= max(0.5 * middle / lag, tick)
    return float(spans[alike].mean()) / lag if alike.any() else 0.0


def filled(blocks: Iterable[Frames], slots: Integers, name: str) -> Iterator[Frames]:
    """Frames of an even time axis: each missing one is the one before it.

    Parameters
    ----------
    blocks : iterable of (T, height, width) arrays
        The frames that are there.
    slots : (N,) array
        Their places.
    name : str
        The movie, for errors.

    Yields
    ------
    (T, height, width) array
        Blocks as long as those given, or shorter.

    Raises
    ------
    InputError
        If there are not as many frames as places.
    """
    repeats, done = np.diff(slots, append=slots[-1] + 1), 0
    for block in blocks:
        here = repeats[done : done + len(block)]
        done += len(block)
        if done <= len(repeats):
            index = np.repeat(np.arange(len(block)), here)
            yield from (block[index[first : first + len(block)]] for first in range(0, len(index), len(block)))
    if done != len(repeats):
        raise FormatError(name, "must have a time stamp for each frame", f"{len(repeats)} for {done}")
