"""The virtual laboratory: which animals, whiskers, postures, speeds and textures its sweeps have."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import cycle
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.dynamics import JumpRule
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.response import Form
from vibrissa.mechanics.superposition import Scan, predict
from vibrissa.study.nuisance import Nuisance
from vibrissa.study.sweep_table import refuse_long
from vibrissa.texture.surface import Troughs, random_grating
from vibrissa.video.camera import Camera
from vibrissa.whisker import Whisker, atlas
from vibrissa.whisker.cone import DENSITY, YOUNGS_MODULUS

Array = NDArray[np.float64]
Interval = tuple[float, float]

WHISKER, CONDITION, TEXTURE, SWEEP, REPEAT = range(5)  # what a seed is for
_DIGITS = 10  # of a contact over L: what is kept of a sweep is not to hang on the last bits of a solver
_MOST_DRAWS = 500  # of one posture
_TRUNCATION = 2.0  # standard deviations beyond which a geometry is drawn anew


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
    response : {"exact", "linear"}
        Quasi-static response of the truth.
    jump : {"continuous", "ramp-limit", "paper2014"}
        What the velocity of the truth does where the contact jumps.
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
        Film only the whisker and 24 pixels about it: what a camera would see beyond costs time and tells nothing.
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
    damping: float = 0.11
    damping_spread: float = 0.0
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
                raise InputError(f"Laboratory.{name}", "must be at least 1", getattr(self, name))
        known = {entry.name for entry in atlas() if entry.n_cone}
        for names in self._lists:
            for name in names or ("none",):
                if name not in known:
                    raise InputError("Laboratory.whiskers", "must be positions of the atlas with a cone", repr(name))
        for name, top in (("base_heights", np.inf), ("base_angles", np.pi / 2), ("contacts", 1.0)):
            low, high = getattr(self, name)
            if not 0 < low <= high < top:
                raise InputError(f"Laboratory.{name}", f"must rise within 0 … {top:.4g}", (low, high))
        if not self.whiskers or not self.speeds or not all(0 < speed < np.inf for speed in self.speeds):
            raise InputError("Laboratory", "must have whiskers, and speeds that are positive (m/s)", self.speeds)
        longest = self._plate(max(self.speeds))
        if self.n_frames != "plate" and not 1 <= self.n_frames <= longest:
            raise InputError("Laboratory.n_frames", "must not outlast the texture", self.n_frames, f"at most {longest}")
        refuse_long(max(self.frames(speed) for speed in self.speeds))

    @property
    def _lists(self) -> tuple[tuple[str, ...], ...]:
        """Whiskers of each animal in turn."""
        lists = tuple(one for one in self.whiskers if not isinstance(one, str))
        return lists or (tuple(one for one in self.whiskers if isinstance(one, str)),)

    def whiskers_of(self, animal: int) -> tuple[str, ...]:
        """Positions of the whiskers of one animal."""
        return self._lists[animal % len(self._lists)]

    def _plate(self, speed: float) -> int:
        return int(self.camera.frame_rate * self.texture_length / speed + 1e-6)

    def frames(self, speed: float) -> int:
        """Frames of a sweep at a speed [m/s]."""
        return self._plate(speed) if self.n_frames == "plate" else self.n_frames

    def rng(self, purpose: int, *numbers: int) -> np.random.Generator:
        """Source of randomness for one purpose, and the numbers it goes by."""
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(purpose, *numbers)))

    def grating(self, number: int) -> Troughs:
        """One of the textures."""
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
    """Numbers that are taken in turn."""
    return (count,) if isinstance(count, int) else count


@dataclass(frozen=True)
class VirtualSweep:
    """One sweep that a virtual laboratory plans.

    Attributes
    ----------
    number : int
        In the table.
    animal, whisker_name, condition, texture, run
        What tells it from the others; ``key`` are their numbers.
    whisker, posture, scan
        The truth, E, ρ and ζ included.
    base_height : float
        H [m].
    """

    number: int
    key: tuple[int, int, int, int, int]
    whisker_name: str
    whisker: Whisker
    posture: Posture
    scan: Scan
    base_height: float

    @property
    def animal(self) -> str:
        """Name of the animal."""
        return f"virtual {self.key[0] + 1}"


def plan(laboratory: Laboratory) -> tuple[list[VirtualSweep], dict[str, int]]:
    """Draw the sweeps of a laboratory.

    Returns
    -------
    sweeps : list of VirtualSweep
        Run by run of texture by texture of condition by condition of whisker by whisker of animal by animal.
    impossible : dict
        How many conditions were drawn anew, by reason: ``height``, ``contact``, ``fold``.

    Raises
    ------
    InputError
        If a whisker finds no condition in 500 draws.
    """
    plates = max(in_turn(laboratory.textures))
    widths = np.concatenate([laboratory.grating(number).width for number in range(plates)])
    widest = Troughs(position=np.array([1e-3]), width=widths.max(keepdims=True))
    impossible: Counter[str] = Counter(height=0, contact=0, fold=0)
    sweeps: list[VirtualSweep] = []
    for number, (a, w, name, conditions) in enumerate(laboratory.preparations()):
        whisker, damping = _drawn_whisker(laboratory, a, w, name)
        for c, textures in enumerate(conditions):
            speed = laboratory.speeds[(number + c) % len(laboratory.speeds)]
            scan = Scan(speed=speed, damping=damping, response=laboratory.response, jump=laboratory.jump)
            posture, height = _drawn_posture(laboratory, (a, w, c), whisker, widest, scan, impossible)
            for key in ((a, w, c, t, r) for t in range(textures) for r in range(laboratory.runs)):
                sweeps.append(VirtualSweep(len(sweeps), key, name, whisker, posture, scan, height))
    return sweeps, dict(impossible)


def _drawn_whisker(laboratory: Laboratory, animal: int, whisker: int, name: str) -> tuple[Whisker, float]:
    """Whisker with its true E and ρ, and its true ζ."""
    rng = laboratory.rng(WHISKER, animal, whisker)
    entry = next(entry for entry in atlas() if entry.name == name)
    stiffness, loss = np.exp(rng.standard_normal(2) * (laboratory.youngs_modulus_spread, laboratory.damping_spread))
    drawn = Whisker(
        length=entry.length + entry.length_sd * _truncated(rng),
        cone_angle=entry.cone_angle + entry.cone_angle_sd * _truncated(rng),
        tip=entry.tip,
        youngs_modulus=laboratory.youngs_modulus * float(stiffness),
        density=laboratory.density,
    )
    return drawn, laboratory.damping * float(loss)


def _truncated(rng: np.random.Generator) -> float:
    while abs(value := float(rng.standard_normal())) > _TRUNCATION:
        pass
    return value


def _drawn_posture(
    laboratory: Laboratory,
    key: tuple[int, int, int],
    whisker: Whisker,
    widest: Troughs,
    scan: Scan,
    impossible: Counter[str],
) -> tuple[Posture, float]:
    """Posture and H [m] of one condition; those that cannot be are counted."""
    rng = laboratory.rng(CONDITION, *key)
    for _ in range(_MOST_DRAWS):
        height, angle = rng.uniform(*laboratory.base_heights), rng.uniform(*laboratory.base_angles)
        try:
            stands = Posture.at_height(height / whisker.length, angle, laboratory.friction)
        except InputError:
            impossible["height"] += 1
            continue
        posture = replace(stands, contact=round(stands.contact, _DIGITS))
        low, high = laboratory.contacts
        if not max(low, whisker.tip) < posture.contact < high:
            impossible["contact"] += 1
            continue
        try:
            predict(whisker, posture, widest, scan)
        except (InputError, ConvergenceError):
            impossible["fold"] += 1
            continue
        return posture, float(height)
    raise InputError(
        "Laboratory",
        f"must have postures that whisker {key[1] + 1} of animal {key[0] + 1} can take",
        remedy="widen base_heights, base_angles or contacts",
    )
