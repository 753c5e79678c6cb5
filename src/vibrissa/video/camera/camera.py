"""A virtual high-speed camera: its parameters, its instants, its empty field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.errors import FormatError, RangeError
from vibrissa.limits import require_memory

Frames = NDArray[np.uint8]

WHITE = 255  # eight bits


class Rule(NamedTuple):
    """A rule for the fields of a dataclass, and its words."""

    holds: Callable[[Any], bool]
    words: str


_COPIES = 20  # of a frame, of 8 bytes a pixel, as it is rendered and written
POSITIVE = Rule(lambda value: 0 < value < np.inf, "must be positive and finite")
NOT_NEGATIVE = Rule(lambda value: 0 <= value < np.inf, "must be finite, not negative")
FINITE = Rule(lambda value: bool(np.isfinite(value)), "must be finite")
SHARE = Rule(lambda value: 0 <= value <= 1, "must lie between 0 and 1")
PLACE = Rule(lambda place: len(place) == 2 and bool(np.isfinite(place).all()), "must be two finite values (x, y)")


def check(owner: object, rule: Rule, **units: str) -> None:
    """Refuse the first of some fields that breaks a rule.

    Parameters
    ----------
    owner : object
        What has the fields.
    rule : Rule
        The rule for all of them.
    **units : str
        Unit by the name of each field, for the remedy; nothing where there is none.

    Raises
    ------
    RangeError
        Names class and field.
    """
    for name, unit in units.items():
        value = getattr(owner, name)
        if not rule.holds(value):
            raise RangeError(f"{type(owner).__name__}.{name}", rule.words, value, f"give it in {unit}" if unit else "")


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A camera above a back-lit whisker; the defaults are those of the paper and of real back-lit stills.

    Attributes
    ----------
    frame_rate : float
        Frames per second [Hz].
    pixel_size : float
        Side of a pixel in the plane of the whisker [m].
    width, height : int
        Size of the image [pixels].
    exposure : float
        Time the shutter is open [s], at most one frame.
    blur : float
        Full width at half maximum of the image of an infinitely thin line [pixels]; optics and the pixel's own width
        together, hence at least 1. Real stills show 1.5–2.3, whisker included.
    background : float
        Grey level of the empty field, in the middle of the image, of 0–255.
    gradient : (float, float)
        Change of the empty field from the left edge to the right and from the top to the bottom [grey levels].
    contrast : (float, float)
        Darkening on the centreline at the whisker's base and at its tip [grey levels], where the field is
        ``background``; it scales with the field elsewhere.
    noise : float
        Standard deviation of a pixel's noise [grey levels], where its light is ``background``.
    shot : float
        Share of that noise's variance that comes with the light, in proportion to it; the rest is there in the dark
        too. 0 for the same noise everywhere; near 1 in a real back-lit still, of SD 0.6 in the dark and 3.0 at 190.

    Raises
    ------
    InputError
        Names the first parameter out of range.
    """

    frame_rate: float = 2000.0
    pixel_size: float = 95e-6
    width: int = 320
    height: int = 200
    exposure: float = 1 / 3000
    blur: float = 1.8
    background: float = 184.0
    gradient: tuple[float, float] = (0.0, 0.0)
    contrast: tuple[float, float] = (110.0, 24.0)
    noise: float = 3.0
    shot: float = 0.0

    def __post_init__(self) -> None:
        check(self, POSITIVE, frame_rate="Hz", pixel_size="m")
        check(
            self,
            Rule(lambda size: _whole(size) and size >= 1, "must be a whole number of pixels, at least 1"),
            width="",
            height="",
        )
        require_memory("Camera", f"{self.width} x {self.height} pixels", _COPIES * 8 * float(self.width * self.height))
        longest = 1 / self.frame_rate
        within = f"must lie between 0 and one frame, {longest:.4g} s"
        check(self, Rule(lambda time: 0 < time <= longest * (1 + 1e-12), within), exposure="s")
        check(self, Rule(lambda width: 1 <= width < np.inf, "must be at least 1 pixel"), blur="pixels (FWHM)")
        check(self, NOT_NEGATIVE, noise="grey levels")
        check(self, SHARE, shot="")
        swing = sum(map(abs, self.gradient)) / 2
        lit = f"must keep the field within 0–{WHITE}, gradient included"
        check(self, Rule(lambda level: swing < level <= WHITE - swing, lit), background="")
        dark = f"must be two values (base, tip) from 0 to the background {self.background:g}"
        check(
            self,
            Rule(lambda two: len(two) == 2 and all(0 <= grey <= self.background for grey in two), dark),
            contrast="",
        )


def _whole(value: object) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def exposure_times(camera: Camera, n_frames: int, subframes: int = 1) -> Array:
    """Instants at which ``render`` wants the curves: midpoints of equal parts of each exposure.

    Parameters
    ----------
    camera : Camera
        Its frame rate and exposure count.
    n_frames : int
        Number of frames.
    subframes : int
        Instants per frame. A steady motion is blurred with (1 − 1/subframes²) of the variance of a true shutter.

    Returns
    -------
    (n_frames·subframes,) array
        Times [s]; frame n is centred on n/frame_rate, so the first instants are a little negative.
    """
    part = (np.arange(counted("subframes", subframes)) + 0.5) / subframes - 0.5
    frame_time = np.arange(counted("number of frames", n_frames)) / camera.frame_rate
    return (frame_time[:, None] + camera.exposure * part).ravel()


def counted(name: str, value: int, *, least: int = 1) -> int:
    """The value, if it is a whole number from ``least`` to 2⁶⁴ − 1.

    Parameters
    ----------
    name : str
        Name of the value, for the error.
    value : int
        As given.
    least : int
        Smallest that is allowed.

    Returns
    -------
    int
        The value.

    Raises
    ------
    InputError
        If it is another.
    """
    if not (_whole(value) and least <= value < 2**64):
        raise FormatError(name, f"must be a whole number, at least {least} and below 2⁶⁴", value)
    return int(value)


def illumination(camera: Camera) -> Array:
    """Grey levels of the empty field, a plane, before rounding.

    Parameters
    ----------
    camera : Camera
        Its background and gradient.

    Returns
    -------
    (height, width) array
        Grey levels; ``camera.background`` in the middle.
    """
    across, down = (np.linspace(-0.5, 0.5, n) if n > 1 else np.zeros(1) for n in (camera.width, camera.height))
    return camera.background + camera.gradient[0] * across + camera.gradient[1] * down[:, None]


def digitise(grey: Array) -> Frames:
    """Eight-bit grey levels: rounded to the nearest, clipped to 0–255.

    Parameters
    ----------
    grey : array
        Grey levels.

    Returns
    -------
    array of uint8
        Of the same shape.
    """
    return np.clip(np.rint(grey), 0, WHITE).astype(np.uint8)
