"""Options of the whole whisker, which `gap` and `scan` take with ``--model rod``."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from vibrissa.cli.shared.options import Flag
from vibrissa.cli.shared.units import Length
from vibrissa.errors import ConflictError

if TYPE_CHECKING:
    from vibrissa.mechanics.rod.rod_settings import Rod

Model = Annotated[
    Literal["modes", "rod"],
    Parameter(
        help="What predicts: the paper's modes of a shaft with a single contact, or the whole whisker as a rod that "
        "touches the ground wherever it reaches it, its free end too."
    ),
]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RodOptions:
    """What the whole whisker has that the single-contact model has not; with --model rod only.

    Attributes
    ----------
    intrinsic_curvature : float
        Curvature of the free shaft [1/m]; positive lifts its free end off the ground.
    edge_radius : float
        Radius of the upper edges of gaps [m].
    thick : bool
        The ground touches the surface of the shaft, whose tip is rounded by its radius, instead of its midline.
    follicle_rotation : float
        Stiffness of the follicle against rotation of the base, over EI/L; clamped without one.
    follicle_translation : float
        Stiffness of the follicle against translation of the base, over EI/L³; clamped without one.
    """

    intrinsic_curvature: float = 0.0
    edge_radius: Length = 0.0
    thick: Flag = False
    follicle_rotation: float = inf
    follicle_translation: float = inf

    def settings(self) -> Rod:
        """Of the rod.

        Returns
        -------
        Rod
            With these.

        Raises
        ------
        InputError
            If one is out of range.
        """
        from vibrissa.mechanics.rod.rod_settings import Rod

        return Rod(
            curvature=self.intrinsic_curvature,
            edge_radius=self.edge_radius,
            thick=self.thick,
            follicle_translation=self.follicle_translation,
            follicle_rotation=self.follicle_rotation,
        )

    def refuse_without_rod(self) -> None:
        """Refuse options of the rod where the modes predict.

        Raises
        ------
        InputError
            Names the first of them.
        """
        for one in fields(self):
            if getattr(self, one.name) != one.default:
                option = f"--{one.name.replace('_', '-')}"
                raise ConflictError(option, "must go with --model rod", getattr(self, one.name))


ScanModel = Annotated[
    Literal["modes", "free-end", "rod", "auto"],
    Parameter(
        help="What predicts: the paper's modes of a shaft with a single contact; a model as fast whose free end bears "
        "on the land behind each gap; the whole whisker as a rod, which touches the ground wherever it reaches it; or "
        "auto: the second for gaps, else the first; its first line names the rod where neither is valid."
    ),
]

NO_ROD = RodOptions()
