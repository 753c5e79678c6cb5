"""What a whisking scene is made of: pads, their whisking, the head's motion, a paw, a pole."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from vibrissa.errors import ConflictError, RangeError, UnknownError
from vibrissa.video.camera.camera import FINITE, NOT_NEGATIVE, PLACE, POSITIVE, SHARE, Camera, check, counted
from vibrissa.video.camera.scenery import Light
from vibrissa.whisker import atlas

SIDES = {"left": -1.0, "right": 1.0}  # of an animal seen from above; from below they change places
TWELVE = ("C1", "D1", "C2", "D2", "B1", "E1", "gamma", "delta", "B2", "E2", "C3", "D3")


@dataclass(frozen=True, kw_only=True)
class Whisks:
    """How the pads whisk, and how its whiskers differ.

    Attributes
    ----------
    frequency : float
        Whisks per second [Hz].
    amplitude : float
        Half of the range of a whisk, of the mean whisker [rad].
    set_point : float
        Protraction of the middle of the whisks beyond rest [rad].
    lag : float
        Phase by which each column follows the one behind it [rad].
    variability : float
        Standard deviation of a cycle's amplitude over its mean; a cycle's duration has half as much, and its set point
        that share of the amplitude.
    individual : float
        Standard deviation of a whisker's gain about 1.
    own : float
        Standard deviation of a whisker's motion apart from the others [rad].
    """

    frequency: float = 8.0
    amplitude: float = math.radians(18.0)
    set_point: float = 0.0
    lag: float = 0.25
    variability: float = 0.2
    individual: float = 0.1
    own: float = math.radians(1.0)

    def __post_init__(self) -> None:
        check(self, POSITIVE, frequency="Hz")
        check(self, NOT_NEGATIVE, amplitude="rad", variability="", individual="", own="rad")
        check(self, FINITE, set_point="rad", lag="rad")


@dataclass(frozen=True, kw_only=True)
class Head:
    """Where the head is, how it moves, what grows on it.

    Attributes
    ----------
    nose : (float, float)
        Mean place of the tip of the nose in the image, x and y [m].
    heading : float
        Mean direction of the snout [rad]: 0 to the right, π/2 down, −π/2 up.
    shift : float
        Standard deviation of the nose's motion along each axis of the image [m].
    turn : float
        Standard deviation of the heading [rad].
    fastest : float
        Frequency of the fastest part of these motions [Hz].
    opacity : float
        Share of the light that the body takes; of a paw and a pole too.
    fur : float
        Hairs per length of skin [1/m].
    """

    nose: tuple[float, float]
    heading: float = np.pi / 2
    shift: float = 0.0
    turn: float = 0.0
    fastest: float = 3.0
    opacity: float = 0.88
    fur: float = 4e3

    def __post_init__(self) -> None:
        check(self, PLACE, nose="m")
        check(self, FINITE, heading="rad")
        check(self, NOT_NEGATIVE, shift="m", turn="rad", fur="1/m")
        check(self, POSITIVE, fastest="Hz")
        check(self, SHARE, opacity="")


@dataclass(frozen=True, kw_only=True)
class Paw:
    """A paw that comes from below the head over the whiskers of one side, and goes back.

    Attributes
    ----------
    start, stop : float
        When it leaves the head, when it is back [s].
    side : {"left", "right"}
        Side on which it comes.
    """

    start: float
    stop: float
    side: Literal["left", "right"] = "right"

    def __post_init__(self) -> None:
        check(self, FINITE, start="s", stop="s")
        if not self.stop > self.start:
            raise ConflictError("Paw.stop", "must be after Paw.start", f"{self.start:g} and {self.stop:g} s")
        _check_side("Paw.side", self.side)


@dataclass(frozen=True, kw_only=True)
class FilmedPole:
    """A pole that does not move, at which some whiskers bend as they protract; the others pass above or below it.

    Attributes
    ----------
    position : (float, float)
        Its centre, x and y [m].
    radius : float
        Its radius [m].
    touched_by : tuple of int
        Numbers of the whiskers at its height.
    """

    position: tuple[float, float]
    radius: float = 0.7e-3
    touched_by: tuple[int, ...] = (0,)

    def __post_init__(self) -> None:
        check(self, PLACE, position="m")
        check(self, POSITIVE, radius="m")


@dataclass(frozen=True, kw_only=True)
class WhiskingScene:
    """A head with one or two whisking pads before the camera.

    Attributes
    ----------
    camera : Camera
        The camera; its ``contrast`` is not used: that follows from diameter, blur and ``hair_opacity``.
    head : Head
        The head.
    names : tuple of str
        Positions of the atlas that the whiskers of a pad have.
    sides : tuple of {"left", "right"}
        The pads, of an animal seen from above; from below right and left change places.
    whisks : Whisks
        How they whisk.
    polarity : {"dark", "bright"}
        Dark whiskers before a light, or lit ones before a dark floor.
    hair_opacity : float
        Share of the light that a shaft takes, or sends back, where it is wider than the blur.
    light : Light
        Unevenness and drift of the light.
    paw, pole
        Absent if None.
    seed : int
        Seed of the individuals, their motion, the fur and the noise.
    """

    camera: Camera
    head: Head
    names: tuple[str, ...] = TWELVE
    sides: tuple[Literal["left", "right"], ...] = ("left", "right")
    whisks: Whisks = field(default_factory=Whisks)
    polarity: Literal["dark", "bright"] = "dark"
    hair_opacity: float = 0.9
    light: Light = field(default_factory=Light)
    paw: Paw | None = None
    pole: FilmedPole | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        check(self, SHARE, hair_opacity="")
        counted("WhiskingScene.seed", self.seed, least=0)
        if self.polarity not in ("dark", "bright"):
            raise UnknownError("WhiskingScene.polarity", "must be 'dark' or 'bright'", repr(self.polarity))
        known = {entry.name for entry in atlas()}
        if not self.names or not set(self.names) <= known or len(set(self.names)) < len(self.names):
            raise UnknownError("WhiskingScene.names", "must be different positions of the atlas", self.names)
        if not self.sides or len(set(self.sides)) < len(self.sides):
            raise UnknownError("WhiskingScene.sides", "must be one or two different sides", self.sides)
        for side in self.sides:
            _check_side("WhiskingScene.sides", side)
        if self.pole is not None and not all(0 <= who < self.n_whiskers for who in self.pole.touched_by):
            rule = f"must be numbers of whiskers, 0 to {self.n_whiskers - 1}"
            raise RangeError("FilmedPole.touched_by", rule, self.pole.touched_by)

    @property
    def n_whiskers(self) -> int:
        """Whiskers on all pads; those of the first side have the first numbers."""
        return len(self.names) * len(self.sides)


def _check_side(name: str, side: str) -> None:
    if side not in SIDES:
        raise UnknownError(name, "must be 'left' or 'right'", repr(side))
