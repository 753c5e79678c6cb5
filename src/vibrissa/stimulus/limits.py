"""Limits of the stimulator, and ramps from rest into a loop."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, require_positive
from vibrissa.stimulus.delays import WHISKERS


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of the stimulator; None where one is not known.

    Attributes
    ----------
    travel : float or None
        Largest displacement to either side of rest [m].
    speed : float or None
        Largest speed [m/s].
    acceleration : float or None
        Largest acceleration [m/s²].
    """

    travel: float | None = None
    speed: float | None = None
    acceleration: float | None = None

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            require_positive(f"Limits.{name}", value)


def rate_of(loop: Array, sampling_rate: float, times: int = 1) -> Array:
    """Time derivative of a loop, by its Fourier series: unit/s, or unit/s² for ``times`` = 2.

    Parameters
    ----------
    loop : (T,) array
        One period.
    sampling_rate : float
        [Hz].
    times : int
        Order of the derivative.

    Returns
    -------
    (T,) array
        The derivative.
    """
    series = np.fft.rfft(loop) * (2j * np.pi * np.fft.rfftfreq(len(loop), 1 / sampling_rate)) ** times
    return np.fft.irfft(series, len(loop))


def refuse_beyond(loop: Array, shifts: Integers, sampling_rate: float, limits: Limits, scale: float = 1.0) -> None:
    """Refuse a command that the stimulator cannot follow; nothing is ever clipped.

    Parameters
    ----------
    loop : (T,) array
        One period of the command [m].
    shifts : (W,) array of int
        Of the whiskers [samples].
    sampling_rate : float
        [Hz].
    limits : Limits
        Of the stimulator.
    scale : float
        Factor that the command has already.

    Raises
    ------
    InputError
        Names the limit that is exceeded most, when the command is largest and on which whisker first, by how much, and
        the scale that would fit all limits.
    """
    kinds = ("travel", "m", 0), ("speed", "m/s", 1), ("acceleration", "m/s²", 2)
    found = {
        kind: (np.abs(rate_of(loop, sampling_rate, times) if times else loop), unit) for kind, unit, times in kinds
    }
    bounds = {kind: limit for kind, limit in asdict(limits).items() if limit is not None}
    shares = {kind: limit / float(found[kind][0].max()) for kind, limit in bounds.items()}
    if not shares or min(shares.values()) >= 1:
        return
    kind = min(shares, key=lambda one: shares[one])
    values, unit = found[kind]
    at = (int(np.argmax(values)) + shifts) % len(loop)
    first = int(np.argmin(at))
    where = f"{kind} of {WHISKERS[first]} at {at[first] / sampling_rate:.4f} s"
    digit = 10.0 ** (np.floor(np.log10(scale * shares[kind])) - 3)
    fitting = digit * np.floor(scale * shares[kind] / digit * (1 - 1e-12))
    remedy = f"`scale={fitting:.4g}` would fit, or raise `{kind}`"
    raise RangeError(where, f"must be at most {bounds[kind]:.6g} {unit}", f"{values.max():.6g} {unit}", remedy)


def ramped(copies: Array, count: int) -> Array:
    """Loops led in from rest and out to rest, each over ``count`` samples of their own continuation.

    Weighted by sin²(πu/2), u from 0 to 1, so value and slope are 0 at rest. (W, T) → (W, T + 2·count) array.

    Parameters
    ----------
    copies : (W, T) array
        One period of each whisker.
    count : int
        Length of a ramp [samples].

    Returns
    -------
    (W, T + 2·count) array
        From rest to rest.
    """
    rise = np.sin(np.pi / 2 * np.arange(count) / max(count, 1)) ** 2
    before = copies[:, copies.shape[1] - count :] * rise
    return np.concatenate([before, copies, copies[:, :count] * rise[::-1]], axis=1)


def refuse_ramps(command: Array, count: int, sampling_rate: float, limits: Limits) -> None:
    """Refuse a ramp too steep for the stimulator; the loop itself has been looked at.

    Parameters
    ----------
    command : (W, N) array
        With its ramps [m].
    count : int
        Length of a ramp [samples].
    sampling_rate : float
        [Hz].
    limits : Limits
        Of the stimulator.

    Raises
    ------
    InputError
        Names the whisker, the time and the limit.
    """
    if count == 0:
        return
    around = np.pad(command, ((0, 0), (2, 2)))  # rest
    for start in (0, command.shape[1] - count):
        for times, kind, unit in ((1, "speed", "m/s"), (2, "acceleration", "m/s²")):
            limit = getattr(limits, kind)
            moved = np.abs(np.diff(around[:, start : start + count + 4], times, axis=1)) * sampling_rate**times
            if limit is not None and moved.max() > limit:
                whisker, at = np.unravel_index(np.argmax(moved), moved.shape)
                where = f"{kind} of {WHISKERS[whisker]} in the ramp at {(start - count + at - 2) / sampling_rate:.4f} s"
                value, rule = f"{moved.max():.6g} {unit}", f"must be at most {limit:.6g} {unit}"
                raise RangeError(where, rule, value, "lengthen `ramp` or lower `scale`")
