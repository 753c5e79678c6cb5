"""How a surface is scanned: speed, damping, and which form of the model answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np

from vibrissa.errors import RangeError, UnknownError, give_in
from vibrissa.mechanics.modes.basis import Modes
from vibrissa.mechanics.quasi_static.response import Form
from vibrissa.mechanics.vibration.dynamics import JumpRule

FASTEST = 10.0  # [m/s] of a scan: beyond it a unit is wrong
QUICK = 15e-3  # [s] whiskers with a shorter time k ring faster: steps in time are the same share of k as at this one


@dataclass(frozen=True, kw_only=True)
class Scan:
    """How the texture is drawn past the whisker, and how the answer is computed.

    Attributes
    ----------
    speed : float
        Scanning speed v_scan [m/s], at most 10.
    damping : float
        Damping ratio ζ of every mode, in [0, 1).
    jump : {"continuous", "ramp-limit", "paper2014"}
        What the velocity does where the contact jumps: displacement and velocity of the whole whisker continuous
        (default); the limit of ever steeper ramps, q̇ = −2ζωΔq; Eq. (13) as printed, q̇ = −ζωΔq. On the ramps between
        jumps Eq. (6) holds under every rule: damping acts on the vibration.
    response : {"exact", "linear"}
        Quasi-static part: Q_i(d) of the profile held by the edge (default), or the paper's c_i d.
    modes : {"straight", "curved", "curved-coulomb", "curved-edge"}
        The paper's modes of a straight shaft (default), or those about the curved profile of a contact that slides,
        friction constant or following the load: see :mod:`vibrissa.mechanics.modes.curved`.
    """

    speed: float
    damping: float
    jump: JumpRule = "continuous"
    response: Form = "exact"
    modes: Modes = "straight"

    def __post_init__(self) -> None:
        if not (self.speed > 0 and np.isfinite(self.speed)):
            raise RangeError("Scan.speed", "must be positive (m/s)", self.speed)
        if self.speed > FASTEST:
            remedy = give_in("m/s", self.speed, "mm/s", 1e-3)
            raise RangeError("Scan.speed", f"must be at most {FASTEST:g} m/s", self.speed, remedy)
        if not 0 <= self.damping < 1:
            percent = f"give it as a ratio: {self.damping / 100:g} for {self.damping:g} %" if self.damping > 1 else ""
            raise RangeError("Scan.damping", "must lie in [0, 1)", self.damping, percent)
        choices = (("jump", self.jump, JumpRule), ("response", self.response, Form), ("modes", self.modes, Modes))
        for name, value, rule in choices:
            if value not in get_args(rule):
                raise UnknownError(f"Scan.{name}", f"must be one of {', '.join(get_args(rule))}", repr(value))
