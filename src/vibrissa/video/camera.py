"""A virtual high-speed camera: its parameters, its instants, its empty field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError

Array = NDArray[np.float64]
Frames = NDArray[np.uint8]

WHITE = 255  # eight bits


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
        for name, unit in (("frame_rate", "Hz"), ("pixel_size", "m")):
            _check(name, 0 < getattr(self, name) < np.inf, "must be positive and finite", getattr(self, name), unit)
        for name in ("width", "height"):
            size = getattr(self, name)
            _check(name, _whole(size) and size >= 1, "must be a whole number of pixels, at least 1", size)
        longest = 1 / self.frame_rate
        within = 0 < self.exposure <= longest * (1 + 1e-12)
        _check("exposure", within, f"must lie between 0 and one frame, {longest:.4g} s", self.exposure, "s")
        _check("blur", 1 <= self.blur < np.inf, "must be at least 1 pixel", self.blur, "pixels (FWHM)")
        _check("noise", 0 <= self.noise < np.inf, "must be finite and not negative", self.noise, "grey levels")
        _check("shot", 0 <= self.shot <= 1, "must lie between 0 and 1", self.shot)
        self._check_grey_levels()

    def _check_grey_levels(self) -> None:
        swing = sum(map(abs, self.gradient)) / 2
        lit = swing < self.background <= WHITE - swing
        _check("background", lit, f"must keep the field within 0–{WHITE}, gradient included", self.background)
        dark = len(self.contrast) == 2 and all(0 <= grey <= self.background for grey in self.contrast)
        _check(
            "contrast",
            dark,
            f"must be two values (base, tip) from 0 to the background {self.background:g}",
            self.contrast,
        )


def _check(name: str, good: bool, rule: str, value: object, unit: str = "") -> None:
    if not good:
        raise InputError(f"Camera.{name}", rule, value, f"give it in {unit}" if unit else "")


def _whole(value: object) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def exposure_times(camera: Camera, n_frames: int, subframes: int = 1) -> Array:
    """Instants at which :func:`render` wants the curves: midpoints of equal parts of each exposure.

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
    """The value, if it is a whole number from ``least`` to 2⁶⁴ − 1."""
    if not (_whole(value) and least <= value < 2**64):
        raise InputError(name, f"must be a whole number, at least {least} and below 2⁶⁴", value)
    return int(value)


def illumination(camera: Camera) -> Array:
    """Grey levels of the empty field, a plane, before rounding.

    Returns
    -------
    (height, width) array
        Grey levels; ``camera.background`` in the middle.
    """
    across, down = (np.linspace(-0.5, 0.5, n) if n > 1 else np.zeros(1) for n in (camera.width, camera.height))
    return camera.background + camera.gradient[0] * across + camera.gradient[1] * down[:, None]


def digitise(grey: Array) -> Frames:
    """Eight-bit grey levels: rounded to the nearest, clipped to 0–255."""
    return np.clip(np.rint(grey), 0, WHITE).astype(np.uint8)
