"""What a user says of the rod."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.mechanics.rod.kernels.state import Follicle
from vibrissa.mechanics.rod.mesh import USUAL, Fineness
from vibrissa.tables.stated import number
from vibrissa.whisker.curvature import MOST, IntrinsicCurvature

_UNITS = {"intrinsic_curvature": "1/m", "edge_radius": "m", "follicle_translation": "1", "follicle_rotation": "1"}
_UNITS |= {"step": "s", "ground": "1", "tolerance": "1"}


@dataclass(frozen=True, kw_only=True)
class Rod:
    """What the rod has that the single-contact model has not, and how finely it is computed.

    Attributes
    ----------
    intrinsic_curvature : float or IntrinsicCurvature
        Curvature of the free shaft [1/m], or a table of it; positive where the free end bends away from the ground, as
        that of a pressed whisker does.
    hold_contact : bool
        The base is held where a shaft of this curvature would be tangent to the ground at the posture's contact;
        otherwise where a straight one would be.
    edge_radius : float
        Radius of the upper edges of gaps [m].
    thick : bool
        The ground touches the surface of the shaft, whose tip is rounded by its radius; otherwise its midline.
    follicle_translation, follicle_rotation : float
        Stiffness of the follicle against translation of the base, over EI/L³, and against its rotation, over EI/L;
        infinite where it is clamped.
    fineness : Fineness
        Of the mesh.
    step : float
        Longest step in time [s]; for a whisker whose time k is below 15 ms, that times k over 15 ms.
    ground : float
        Stiffness of the ground, over force unit and L.
    tolerance : float
        Largest motion of a step's last iteration, over L.
    """

    intrinsic_curvature: float | IntrinsicCurvature = 0.0
    hold_contact: bool = False
    edge_radius: float = 0.0
    thick: bool = False
    follicle_translation: float = np.inf
    follicle_rotation: float = np.inf
    fineness: Fineness = USUAL
    step: float = 25e-6
    ground: float = 1e6
    tolerance: float = 1e-7

    def __post_init__(self) -> None:
        for name, unit in _UNITS.items():
            if not isinstance(getattr(self, name), IntrinsicCurvature):
                object.__setattr__(self, name, number(f"Rod.{name}", getattr(self, name), unit))
        if not 0 < self.step <= 1e-3:
            raise RangeError("Rod.step", "must lie in (0, 1 ms]", self.step, "in seconds")
        if not isinstance(self.intrinsic_curvature, IntrinsicCurvature) and not abs(self.intrinsic_curvature) <= MOST:
            rule = f"must be a number of at most {MOST:g} /m, or a table"
            raise RangeError("Rod.intrinsic_curvature", rule, self.intrinsic_curvature)
        for name in ("follicle_translation", "follicle_rotation", "ground", "tolerance"):
            if not getattr(self, name) > 0:
                raise RangeError(f"Rod.{name}", "must be positive", getattr(self, name))

    def curvature_at(self, s: Array, length: float) -> Array:
        """Curvature of the free shaft.

        Parameters
        ----------
        s : (N,) array
            Points, over L from the tip of the cone.
        length : float
            L [m].

        Returns
        -------
        (N,) array
            Over 1/L.
        """
        if isinstance(self.intrinsic_curvature, IntrinsicCurvature):
            return length * self.intrinsic_curvature.at((1 - s) * length)
        return np.full(s.shape, self.intrinsic_curvature * length)

    @property
    def curvature_attributes(self) -> dict[str, float | list[float]]:
        """Curvature of the free shaft, as attributes of a Dataset."""
        own = self.intrinsic_curvature
        held = {"hold_contact": float(self.hold_contact)} if self.hold_contact else {}
        if not isinstance(own, IntrinsicCurvature):
            return {"intrinsic_curvature": own, **held}
        table = {"intrinsic_curvature": list(own.curvature), "intrinsic_curvature_distance": list(own.distance)}
        return {**table, **held}

    @property
    def follicle(self) -> Follicle:
        """How the base is held."""
        return Follicle(float(self.follicle_translation), float(self.follicle_rotation))


USUAL_ROD = Rod()  # the free end straight, the base clamped
