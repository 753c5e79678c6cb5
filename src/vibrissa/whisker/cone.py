"""The whisker as a straight cone: its parameters and what follows from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibrissa.errors import RangeError, give_in, give_share
from vibrissa.tables.stated import number

YOUNGS_MODULUS = 3.74e9  # Pa, where the measured resonances of the paper fit best
DENSITY = 1140.0  # kg/m³
DAMPING = 0.11  # damping ratio of the first mode, mean of the paper
SOFTEST, LIGHTEST = 1e3, 10.0  # Pa and kg/m³: below them the unit is another one
_UNITS = {"length": "m", "cone_angle": "rad", "tip": "1", "youngs_modulus": "Pa", "density": "kg/m³"}
STEEPEST_CONE = 0.1  # rad: beyond it sin α ≈ α is wrong by 0.2 % and slender-beam theory goes with it


@dataclass(frozen=True, kw_only=True)
class Whisker:
    """A straight cone of homogeneous keratin, clamped at its base, perhaps cut before its tip.

    Attributes
    ----------
    length : float
        Length L of the NONtruncated cone [m], at most 1.
    cone_angle : float
        Cone angle α = base radius / L [rad], at most 0.1: slopes, not arcs, so α counts as small.
    tip : float
        Position s of the physical tip, over L: 0 at the cone's own tip (sharp, the default), below 1 (the base).
    youngs_modulus : float
        Young's modulus E [Pa], at least 1000.
    density : float
        Density ρ [kg/m³], at least 10.

    Raises
    ------
    InputError
        Names the first parameter that is not finite or out of range.

    Examples
    --------
    >>> whisker = Whisker(length=0.04, cone_angle=1.5e-3)
    >>> round(1e3 * whisker.timescale, 2)  # k [ms]
    29.45
    >>> Whisker(length=40, cone_angle=1.5e-3)
    Traceback (most recent call last):
    vibrissa.errors.RangeError: Whisker.length must be at most 1 m, got 40; give it in m: 0.04 for 40 mm
    """

    length: float
    cone_angle: float
    tip: float = 0.0
    youngs_modulus: float = YOUNGS_MODULUS
    density: float = DENSITY

    def __post_init__(self) -> None:
        for name, unit in _UNITS.items():
            object.__setattr__(self, name, number(f"Whisker.{name}", getattr(self, name), unit))
        _check_positive("length", self.length, most=1.0, unit="m")
        _check_positive("cone_angle", self.cone_angle, most=STEEPEST_CONE, unit="rad")
        _check_positive("youngs_modulus", self.youngs_modulus, unit="Pa")
        _check_positive("density", self.density, unit="kg/m³")
        if self.youngs_modulus < SOFTEST:
            remedy = give_in("Pa", self.youngs_modulus, "GPa", 1e9)
            raise RangeError("Whisker.youngs_modulus", f"must be at least {SOFTEST:g} Pa", self.youngs_modulus, remedy)
        if self.density < LIGHTEST:
            remedy = give_in("kg/m³", self.density, "g/cm³", 1e3)
            raise RangeError("Whisker.density", f"must be at least {LIGHTEST:g} kg/m³", self.density, remedy)
        if not 0 <= self.tip < 1:
            rule = "must lie in [0, 1), as a fraction of the length from the tip"
            raise RangeError("Whisker.tip", rule, self.tip, give_share(self.tip) if self.tip > 1 else "")

    @property
    def base_radius(self) -> float:
        """Radius at the base b = αL [m]."""
        return self.cone_angle * self.length

    @property
    def timescale(self) -> float:
        """Unit of time k = (2L/α)√(ρ/E) [s]: resonances are ω = κ/k."""
        return 2 * self.length / self.cone_angle * float(np.sqrt(self.density / self.youngs_modulus))

    @property
    def attributes(self) -> dict[str, float]:
        """Its parameters, as attributes of a Dataset."""
        return {f"whisker_{name}": float(value) for name, value in vars(self).items()}

    @property
    def physical_length(self) -> float:
        """Length from the base to the physical tip L(1 − tip) [m]."""
        return self.length * (1 - self.tip)


def _check_positive(name: str, value: float, *, most: float = np.inf, unit: str) -> None:
    if not 0 < value < np.inf:
        raise RangeError(f"Whisker.{name}", "must be positive and finite", value, f"give it in {unit}")
    if value > most:
        rule = f"must be at most {most:g} {unit}"
        raise RangeError(f"Whisker.{name}", rule, value, give_in(unit, value, f"m{unit}", 1e-3))
