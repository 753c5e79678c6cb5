"""What a user says of the rod."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibrissa.errors import RangeError
from vibrissa.mechanics.rod.kernels.step_kernels import Follicle
from vibrissa.mechanics.rod.mesh import USUAL, Fineness


@dataclass(frozen=True, kw_only=True)
class Rod:
    """What the rod has that the single-contact model has not, and how finely it is computed.

    Attributes
    ----------
    intrinsic_curvature : float
        Intrinsic curvature of the free shaft [1/m]; positive where it bends as a pressed one does, away from the ground
        towards the base.
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
        Longest step in time [s].
    ground : float
        Stiffness of the ground, over force unit and L.
    tolerance : float
        Largest motion of a step's last iteration, over L.
    """

    intrinsic_curvature: float = 0.0
    edge_radius: float = 0.0
    thick: bool = False
    follicle_translation: float = np.inf
    follicle_rotation: float = np.inf
    fineness: Fineness = USUAL
    step: float = 25e-6
    ground: float = 1e6
    tolerance: float = 1e-7

    def __post_init__(self) -> None:
        if not 0 < self.step <= 1e-3:
            raise RangeError("Rod.step", "must lie in (0, 1 ms]", self.step, "in seconds")
        if not np.isfinite(self.intrinsic_curvature):
            raise RangeError("Rod.intrinsic_curvature", "must be finite (1/m)", self.intrinsic_curvature)
        for name in ("follicle_translation", "follicle_rotation", "ground", "tolerance"):
            if not getattr(self, name) > 0:
                raise RangeError(f"Rod.{name}", "must be positive", getattr(self, name))

    @property
    def follicle(self) -> Follicle:
        """How the base is held."""
        return Follicle(self.follicle_translation, self.follicle_rotation)


USUAL_ROD = Rod()  # the free end straight, the base clamped
