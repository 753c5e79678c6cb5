"""Options that several commands share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from vibrissa.errors import InputError
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    from vibrissa.mechanics.profile import Posture

Json = Annotated[
    bool,
    Parameter(
        name="--json",
        negative="",
        help="Print one JSON object instead of a table: SI units, or adimensional as the names of `vibrissa` say.",
    ),
]
Out = Annotated[Path | None, Parameter(help="Write the results as a dataset (NetCDF).")]
OfWhisker = Annotated[Whisker | None, Parameter(help="The whisker's geometry and material (SI units).")]
OfModes = Annotated[
    Literal["straight", "curved", "curved-coulomb", "curved-edge"],
    Parameter(
        help="Modes of a straight shaft (the paper's), or about the curved profile: of a point of the shaft that "
        "slides, friction constant or following the load, or of a shaft that slips over an edge; curved ones carry "
        "axial force."
    ),
]
Scheduler = Annotated[
    str,
    Parameter(
        help="Who does what comes by the many: processes, threads or synchronous, of this machine, or the address of a "
        "Dask scheduler, tcp://HOST:PORT, or its scheduler file, FILE.json. The results are the same."
    ),
]
Workers = Annotated[int | None, Parameter(help="Processes or threads of this machine; one per core by default.")]
Atlas = Annotated[str | None, Parameter(help="Take a measured rat whisker instead: C2, beta, …")]


@dataclass(frozen=True, kw_only=True)
class PostureOptions:
    """How the whisker is held.

    Attributes
    ----------
    contact : float, optional
        Position of the contact along the shaft, over L: 0 at the cone's tip, 1 at the base. This or --base-distance.
    base_distance : float, optional
        Instead: height of the base above the substrate, over L.
    base_angle : float
        Angle of the shaft at the base to the substrate [rad], below π/2.
    friction : float
        Coefficient of friction of the substrate, which moves away from the base.
    """

    contact: float | None = None
    base_distance: float | None = None
    base_angle: float
    friction: float = 0.4

    def posture(self) -> Posture:
        """The posture that the options name."""
        from vibrissa.mechanics.profile import Posture

        if self.contact is None and self.base_distance is not None:
            return Posture.at_height(self.base_distance, self.base_angle, self.friction)
        if self.contact is None or self.base_distance is not None:
            raise InputError("posture", "must be given once", remedy="either --contact or --base-distance")
        return Posture(contact=self.contact, base_angle=self.base_angle, friction=self.friction)


AtPosture = Annotated[PostureOptions, Parameter(name="*")]


def cone_of(whisker: Whisker | None, atlas: str | None) -> Whisker | None:
    """The whisker that is given, by its numbers or by its name in the atlas; None if neither is."""
    if whisker is not None and atlas is not None:
        raise InputError("whisker", "must be given once", remedy="either --whisker.length and the rest, or --atlas")
    if atlas is None:
        return whisker
    from vibrissa.whisker import atlas_whisker

    return atlas_whisker(atlas)


def needed_cone(whisker: Whisker | None, atlas: str | None) -> Whisker:
    """The whisker that is given; refused if none is."""
    cone = cone_of(whisker, atlas)
    if cone is None:
        raise InputError("whisker", "must be given", remedy="--whisker.length and --whisker.cone-angle, or --atlas")
    return cone
