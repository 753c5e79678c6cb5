"""The part ``[laboratory]`` of a study: many virtual sweeps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import cycle
from typing import Literal

import numpy as np

from vibrissa.errors import RangeError, TooFewError, UnknownError
from vibrissa.mechanics.quasi_static.response import Form
from vibrissa.mechanics.vibration.dynamics import JumpRule
from vibrissa.study.spec.nuisance import Nuisance
from vibrissa.study.spec.recorded_sweeps import refuse_long
from vibrissa.texture.surface import Gaps, random_grating
from vibrissa.video.camera.camera import Camera
from vibrissa.whisker import atlas
from vibrissa.whisker.cone import DAMPING, DENSITY, YOUNGS_MODULUS

Interval = tuple[float, float]
Truth = Literal["rod", "modes"]

MOST_SWEEPS = 100_000
WHISKER, CONDITION, TEXTURE, SWEEP, REPEAT = range(5)  # what a seed is for


@dataclass(frozen=True, kw_only=True)
class Laboratory:
    """Sweeps of every whisker in every condition over every texture, again and again.

    Everything follows from ``seed`` and the numbers of animal, whisker, condition, texture and run: more animals,
    conditions or runs leave the other sweeps as they are.

    Geometry is drawn per animal and whisker. L and α, independent, are Gaussian with the atlas's means and standard
    deviations, drawn anew beyond two of these; the tip is the atlas's mean. A condition is a speed, in turn, and a base
    height H and angle θ_b, even in their intervals; ε follows from Eq. 1. Conditions that cannot be are drawn anew and
    counted: a height out of reach of the whisker, a contact out of ``contacts`` or beyond the tip, a posture beyond
    the fold or that the widest gap would carry there.

    Attributes
    ----------
    animals : int
        Number of animals.
    whiskers : (str, ...)
        Positions in the atlas; or a list of them for each animal in turn.
    conditions : int
        Conditions per whisker; or a number for each whisker in turn.
    textures : int
        Textures per condition, the same plates for all; or a number for each condition in turn.
    runs : int
        Repeats of the same sweep.
    speeds : (float, ...)
        Scanning speeds [m/s].
    base_heights : (float, float)
        H [m].
    base_angles : (float, float)
        θ_b [rad].
    contacts : (float, float)
        ε that are looked at, over L.
    friction : float
        μ.
    youngs_modulus, density, damping : float
        Means of the truth E [Pa], ρ [kg/m³] and ζ.
    youngs_modulus_spread, damping_spread : float
        Standard deviations across whiskers of ln E and ln ζ.
    truth : {"rod", "modes"}
        What the whiskers do: a rod that touches the ground wherever it reaches it, or the one contact and the modes
        that the analysis assumes. The analysis is the same.
    response : {"exact", "linear"}
        Quasi-static response of the modes.
    jump : {"continuous", "ramp-limit", "paper2014"}
        What the velocity of the modes does where the contact jumps.
    reading : {"telegraph", "widths"}
        Reading of the random gratings.
    texture_length, mean_period : float
        [m].
    n_frames : int or "plate"
        Frames of a movie; ``plate``: as many as the texture lasts at the sweep's speed.
    subframes : int
        Instants of an exposure.
    camera : Camera
        Its ``width`` and ``height`` are those of the field of view; they do not count if ``crop``.
    crop : bool
        Film only the whisker and 24 pixels about it: the rest of the field costs time and holds no data.
    fur : bool
        Whether the head is seen.
    shadow : float
        Length of shaft that the substrate's shadow hides before the contact [m].
    nuisance : Nuisance
        What disturbs the sweeps; nothing by default.
    seed : int
        Of everything.
    """

    animals: int = 2
    whiskers: tuple[str, ...] | tuple[tuple[str, ...], ...] = ("beta", "C1", "C2")
    conditions: int | tuple[int, ...] = 2
    textures: int | tuple[int, ...] = 6
    runs: int = 1
    speeds: tuple[float, ...] = (0.1, 0.15, 0.2)
    base_heights: Interval = (14e-3, 33e-3)
    base_angles: Interval = (0.8, 1.5)
    contacts: Interval = (0.1, 0.6)
    friction: float = 0.4
    youngs_modulus: float = YOUNGS_MODULUS
    youngs_modulus_spread: float = 0.0
    density: float = DENSITY
    damping: float = DAMPING
    damping_spread: float = 0.0
    truth: Truth = "rod"
    response: Form = "exact"
    jump: JumpRule = "continuous"
    reading: Literal["telegraph", "widths"] = "telegraph"
    texture_length: float = 0.35
    mean_period: float = 0.6e-3
    n_frames: int | Literal["plate"] = 3500
    subframes: int = 3
    camera: Camera = field(default_factory=lambda: Camera(width=500, height=450))
    crop: bool = True
    fur: bool = False
    shadow: float = 0.0
    nuisance: Nuisance = field(default_factory=Nuisance)
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("animals", "conditions", "textures", "runs"):
            if not in_turn(getattr(self, name)) or min(in_turn(getattr(self, name))) < 1:
                raise RangeError(f"Laboratory.{name}", "must be at least 1", getattr(self, name))
        counts = [max(in_turn(getattr(self, name))) for name in ("animals", "conditions", "textures", "runs")]
        if math.prod(counts) > MOST_SWEEPS:
            raise RangeError("Laboratory", f"must have at most {MOST_SWEEPS:,} sweeps of a whisker", math.prod(counts))
        known = {entry.name for entry in atlas() if entry.n_cone}
        for names in self._lists:
            for name in names or ("none",):
                if name not in known:
                    raise UnknownError("Laboratory.whiskers", "must be positions of the atlas with a cone", repr(name))
        for name, top in (("base_heights", np.inf), ("base_angles", np.pi / 2), ("contacts", 1.0)):
            low, high = getattr(self, name)
            if not 0 < low <= high < top:
                raise RangeError(f"Laboratory.{name}", f"must rise within 0 … {top:.4g}", (low, high))
        if not self.whiskers or not self.speeds or not all(0 < speed < np.inf for speed in self.speeds):
            raise TooFewError("Laboratory", "must have whiskers, and speeds that are positive (m/s)", self.speeds)
        longest = self._plate(max(self.speeds))
        if self.n_frames != "plate" and not 1 <= self.n_frames <= longest:
            raise RangeError("Laboratory.n_frames", "must not outlast the texture", self.n_frames, f"at most {longest}")
        refuse_long(max(self.frames(speed) for speed in self.speeds))

    @property
    def _lists(self) -> tuple[tuple[str, ...], ...]:
        """Whiskers of each animal in turn."""
        lists = tuple(one for one in self.whiskers if not isinstance(one, str))
        return lists or (tuple(one for one in self.whiskers if isinstance(one, str)),)

    def whiskers_of(self, animal: int) -> tuple[str, ...]:
        """Positions of the whiskers of one animal.

        Parameters
        ----------
        animal : int
            From 0.

        Returns
        -------
        (str, ...)
            Names of the atlas.
        """
        return self._lists[animal % len(self._lists)]

    def _plate(self, speed: float) -> int:
        return int(self.camera.frame_rate * self.texture_length / speed + 1e-6)

    def frames(self, speed: float) -> int:
        """Frames of a sweep at a speed [m/s].

        Parameters
        ----------
        speed : float
            [m/s].

        Returns
        -------
        int
            Number of frames.
        """
        return self._plate(speed) if self.n_frames == "plate" else self.n_frames

    def rng(self, purpose: int, *numbers: int) -> np.random.Generator:
        """Source of randomness for one purpose, and the numbers it goes by.

        Parameters
        ----------
        purpose : int
            ``WHISKER``, ``CONDITION``, ``TEXTURE``, ``SWEEP`` or ``REPEAT``.
        *numbers : int
            Of animal, whisker, condition, texture, run.

        Returns
        -------
        Generator
            The same for the same numbers.
        """
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(purpose, *numbers)))

    def grating(self, number: int) -> Gaps:
        """One of the textures.

        Parameters
        ----------
        number : int
            From 0.

        Returns
        -------
        Gaps
            Its gaps.
        """
        rng = self.rng(TEXTURE, number)
        return random_grating(self.texture_length, rng=rng, reading=self.reading, mean_period=self.mean_period)

    def preparations(self) -> Iterator[tuple[int, int, str, list[int]]]:
        """Animal, number and position of each whisker, and how many textures each of its conditions has."""
        conditions, textures = cycle(in_turn(self.conditions)), cycle(in_turn(self.textures))
        for a in range(self.animals):
            for w, name in enumerate(self.whiskers_of(a)):
                yield a, w, name, [next(textures) for _ in range(next(conditions))]

    @property
    def n_sweeps(self) -> int:
        """Number of sweeps."""
        return self.runs * sum(sum(textures) for _, _, _, textures in self.preparations())


def in_turn(count: int | tuple[int, ...]) -> tuple[int, ...]:
    """Numbers that are taken in turn.

    Parameters
    ----------
    count : int or (int, ...)
        One for all, or several.

    Returns
    -------
    (int, ...)
        The numbers.
    """
    return (count,) if isinstance(count, int) else count
