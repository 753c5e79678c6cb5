"""Options of the whole whisker, which `gap` and `scan` take with ``--model rod``."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from math import inf
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from vibrissa.cli.shared.options import Flag, WhiskerOptions
from vibrissa.cli.shared.words.units import Length
from vibrissa.errors import ConflictError
from vibrissa.tables.quantity import number

if TYPE_CHECKING:
    from vibrissa.mechanics.rod.rod_settings import Rod
    from vibrissa.whisker import IntrinsicCurvature

_PER_METRE = re.compile(r"\s*(?:1?/m|m\^?-1|m⁻¹)$")  # 15/m: the unit of a curvature that is a number

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
    """Properties of the whole whisker that the single-contact model lacks; with --model rod only.

    Attributes
    ----------
    intrinsic_curvature : str
        Curvature of the free shaft: a number [1/m], a table of it, or atlas, which takes the regression for --atlas;
        positive lifts its free end off the ground.
    flip_curvature : bool
        Turn the whisker about its shaft: curvature of the other sign.
    hold_contact : bool
        Hold the base where the curved shaft touches the flat in --contact, instead of where a straight one would.
    edge_radius : float
        Radius of the upper edges of gaps [m].
    thick : bool
        The ground touches the surface of the shaft, whose tip is rounded by its radius, instead of its midline.
    follicle_rotation : float
        Stiffness of the follicle against rotation of the base, over EI/L; clamped without one.
    follicle_translation : float
        Stiffness of the follicle against translation of the base, over EI/L³; clamped without one.
    """

    intrinsic_curvature: Annotated[str, Parameter(allow_leading_hyphen=True)] = "0"
    flip_curvature: Flag = False
    hold_contact: Flag = False
    edge_radius: Length = 0.0
    thick: Flag = False
    follicle_rotation: float = inf
    follicle_translation: float = inf

    def settings(self, of: WhiskerOptions) -> Rod:
        """Of the rod.

        Parameters
        ----------
        of : WhiskerOptions
            The whisker, whose name in the atlas may give the curvature.

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
            intrinsic_curvature=self._curvature(of),
            hold_contact=self.hold_contact,
            edge_radius=self.edge_radius,
            thick=self.thick,
            follicle_translation=self.follicle_translation,
            follicle_rotation=self.follicle_rotation,
        )

    def _curvature(self, of: WhiskerOptions) -> float | IntrinsicCurvature:
        """Number, table or regression, with the requested sign."""
        from vibrissa.whisker import atlas_curvature, read_curvature

        value = number(_PER_METRE.sub("", self.intrinsic_curvature))
        if value is not None:
            return -value if self.flip_curvature else value
        if self.intrinsic_curvature != "atlas":
            table = read_curvature(self.intrinsic_curvature)
        elif of.atlas is None:
            raise ConflictError("--intrinsic-curvature", "must be a number or a file without --atlas", "atlas")
        else:
            table = atlas_curvature(of.atlas, of.needed_cone())
        return table.flipped() if self.flip_curvature else table

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
