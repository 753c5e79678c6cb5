"""Phase, amplitude, set point and frequency of whisking, by the procedure of Hill et al. 2011."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import RangeError, ShapeError, TooFewError
from vibrissa.signals.envelope import analytic_signal

BAND = (4.0, 30.0)  # [Hz]
POLES = 4
PERIODS = 2  # of the band's lower corner: a shorter stretch has no cycle
MIRRORED = 4.0  # periods of the lower corner by which a stretch is mirrored at its ends


class WhiskCycle(NamedTuple):
    """The cycle at every time; NaN where the angle was not measured or no cycle is determined.

    Attributes
    ----------
    phase : (T,) array
        0 at the most protracted, ±π at the most retracted, negative in protraction [rad].
    amplitude, set_point : (T,) arrays
        Half of the difference and the mean of the angle at phases 0 and ±π [rad]: angle ≈ set point + amplitude ·
        cos(phase). The amplitude is NaN where the angle at phase 0 is not the larger one.
    frequency : (T,) array
        Rate of the phase over 2π [Hz]; NaN where it is not in the band.
    """

    phase: Array
    amplitude: Array
    set_point: Array
    frequency: Array


def whisk_cycle(time: Array, angle: Array, *, band: tuple[float, float] = BAND, bridged: int = 0) -> WhiskCycle:
    """Cycle of whisking of one whisker.

    As in [Hill2011]_: the phase is that of the analytic signal of the angle, band-passed by a Butterworth filter of
    four poles run forwards and backwards; amplitude and set point (their midpoint) are taken from the angle itself
    where the phase is 0 and where it is ±π, and interpolated linearly between. Before the first and after the last such
    extremes they are NaN.

    The angle is mirrored at the ends of a stretch. Next to them the phase is uncertain all the same: half a period of
    the band's lower corner (0.125 s) is left out at either end, beyond which the error of a sinusoid of 6–18 Hz is
    below 0.1 rad. A stretch shorter than two periods has no cycle.

    Parameters
    ----------
    time : (T,) array
        Even [s].
    angle : (T,) array
        Growing with protraction [rad]; NaN where not measured.
    band : (float, float)
        Corners of the band [Hz].
    bridged : int
        Longest gap, in frames, that is bridged by a straight line for the filter; the result stays NaN there.

    Returns
    -------
    WhiskCycle
        At every time.

    Raises
    ------
    InputError
        If the frames are uneven or too slow for the band.
    """
    rate = frame_rate_of(time)
    low, high = band
    if not 0 < low < high < rate / 2:
        rule = f"must be two frequencies that grow, below half of the frame rate of {rate:g} Hz"
        raise RangeError("whisking_band", rule, f"{low:g} to {high:g} Hz", "choose a band that the frames resolve")
    result = WhiskCycle(*(np.full(time.size, np.nan) for _ in WhiskCycle._fields))
    seen = np.isfinite(angle)
    for start, stop in stretches(seen, bridged):
        if stop - start >= PERIODS * rate / low:
            for whole, part in zip(result, _of_stretch(angle[start:stop], rate, band), strict=True):
                whole[start:stop] = np.where(seen[start:stop], part, np.nan)
    return result


def frame_rate_of(time: Array) -> float:
    """Frames per second of even times.

    Parameters
    ----------
    time : (T,) array
        [s].

    Returns
    -------
    float
        [Hz].

    Raises
    ------
    InputError
        If there are fewer than two, or they are uneven by more than a hundredth of a frame.
    """
    if time.size < 2:
        raise TooFewError("profile", "must have at least two frames", time.size)
    step = float(time[-1] - time[0]) / (time.size - 1)
    if not step > 0 or np.abs(np.diff(time) - step).max() > 0.01 * step:
        raise ShapeError("time", "must be even", remedy="keep every frame; those without a whisker are NaN")
    return 1 / step


def stretches(seen: Mask, bridged: int = 0) -> list[tuple[int, int]]:
    """Stretches of frames in which a whisker was seen.

    Parameters
    ----------
    seen : (T,) array of bool
        Whether it was.
    bridged : int
        Longest gap that does not part two stretches.

    Returns
    -------
    list of (int, int)
        First frame, and the first after the last; both ends of a stretch were seen.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], seen, [False]]).astype(int)))
    runs = [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    joined: list[tuple[int, int]] = []
    for start, stop in runs:
        if joined and start - joined[-1][1] <= bridged:
            joined[-1] = (joined[-1][0], stop)
        else:
            joined.append((start, stop))
    return joined


def _of_stretch(angle: Array, rate: float, band: tuple[float, float]) -> WhiskCycle:
    """The cycle of one stretch, whose ends were seen."""
    from scipy.signal import butter, sosfiltfilt

    seen, frame = np.isfinite(angle), np.arange(angle.size, dtype=float)
    whole = np.interp(frame, frame[seen], angle[seen])
    pad = min(angle.size - 1, round(MIRRORED * rate / band[0]))
    filtered = sosfiltfilt(
        butter(POLES // 2, band, "bandpass", fs=rate, output="sos"), np.pad(whole, pad, mode="reflect")
    )
    analytic = analytic_signal(filtered)[pad:-pad]
    edge = round(rate / band[0] / 2)
    kept = slice(edge, angle.size - edge)
    phase = np.angle(analytic[kept])
    course = np.unwrap(phase)
    measured = np.where(seen, angle, np.nan)[kept]
    top, bottom = (_extremes(frame[kept], course, measured, offset) for offset in (0.0, np.pi))
    amplitude, frequency = (top - bottom) / 2, np.gradient(course) * rate / (2 * np.pi)
    amplitude = np.where(amplitude > 0, amplitude, np.nan)
    frequency = np.where((frequency >= band[0]) & (frequency <= band[1]), frequency, np.nan)
    parts = (phase, amplitude, (top + bottom) / 2, frequency)
    return WhiskCycle(*(np.pad(part, edge, constant_values=np.nan) for part in parts))


def _extremes(frame: Array, course: Array, angle: Array, offset: float) -> Array:
    """Angle where the phase passes the offset, interpolated between; NaN outside of the first and the last."""
    rising = np.maximum.accumulate(course)
    turns = np.arange(np.ceil((rising[0] - offset) / (2 * np.pi)), np.floor((rising[-1] - offset) / (2 * np.pi)) + 1)
    passed = 2 * np.pi * turns + offset
    # where the phase stays behind its own maximum np.interp takes the last time of the plateau: the passage itself
    when = np.interp(passed, rising, frame)
    there = _between(when - frame[0], angle)
    good = np.isfinite(there)
    if good.sum() < 2:
        return np.full(frame.size, np.nan)
    return np.interp(frame, when[good], there[good], left=np.nan, right=np.nan)


def _between(when: Array, angle: Array) -> Array:
    """Angle between frames, by the parabola through the nearest three; NaN where one of them was not seen."""
    k = np.clip(np.rint(when).astype(int), 1, angle.size - 2)
    before, here, after, off = angle[k - 1], angle[k], angle[k + 1], when - k
    return here + off * (after - before) / 2 + off**2 * (after - 2 * here + before) / 2
