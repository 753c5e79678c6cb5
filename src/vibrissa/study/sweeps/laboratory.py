"""The virtual laboratory: which animals, whiskers, postures, speeds and textures its sweeps have."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from vibrissa.errors import ConvergenceError, InputError, RangeError
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.study.spec.laboratory import CONDITION, WHISKER, Laboratory, in_turn
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker, atlas

_DIGITS = 10  # of a contact over L: what is stored of a sweep must not depend on the last bits of a solver
_MOST_DRAWS = 500  # of one posture
_TRUNCATION = 2.0  # standard deviations beyond which a geometry is drawn anew


@dataclass(frozen=True)
class VirtualSweep:
    """One sweep that a virtual laboratory plans.

    Attributes
    ----------
    number : int
        In the table.
    animal, whisker_name, condition, texture, run
        What identifies it; ``key`` are their numbers.
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

    Parameters
    ----------
    laboratory : Laboratory
        The virtual laboratory.

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
    sweeps, impossible = _planned(laboratory)
    return list(sweeps), dict(impossible)


@lru_cache(maxsize=2)  # asked for by several stages, of the rod and of the modes
def _planned(laboratory: Laboratory) -> tuple[list[VirtualSweep], dict[str, int]]:
    plates = max(in_turn(laboratory.textures))
    widths = np.concatenate([laboratory.grating(number).width for number in range(plates)])
    widest = Gaps(position=np.array([1e-3]), width=widths.max(keepdims=True))
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
    return sweeps, impossible


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
    widest: Gaps,
    scan: Scan,
    impossible: Counter[str],
) -> tuple[Posture, float]:
    """Posture and H [m] of one condition; those that cannot be are counted."""
    rng = laboratory.rng(CONDITION, *key)
    for _ in range(_MOST_DRAWS):
        height, angle = rng.uniform(*laboratory.base_heights), rng.uniform(*laboratory.base_angles)
        try:
            tried = Posture.at_height(height / whisker.length, angle, laboratory.friction)
        except InputError:
            impossible["height"] += 1
            continue
        posture = replace(tried, contact=round(tried.contact, _DIGITS))
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
    raise RangeError(
        "Laboratory",
        f"must have postures that whisker {key[1] + 1} of animal {key[0] + 1} can take",
        remedy="widen base_heights, base_angles or contacts",
    )
