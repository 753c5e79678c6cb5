"""Options that several commands share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import tell
from vibrissa.cli.shared.words.units import Angle, Density, Length, OverLength, Pressure, over_length
from vibrissa.errors import ConflictError, MissingError, RangeError
from vibrissa.whisker import DENSITY, YOUNGS_MODULUS, Whisker, atlas_whisker

if TYPE_CHECKING:
    from vibrissa.mechanics.statics.profile import Posture


def _from_zero(_: object, seed: int) -> None:
    if seed < 0:
        raise RangeError("--seed", "must be 0 or a positive whole number", seed)


def _remarked(_: object, friction: float | None) -> None:
    if friction is not None and not 0 <= friction <= 1:  # the rest is imported where it may be needed
        from vibrissa.mechanics.statics.contact_law import friction_remarks

        tell(*friction_remarks(friction))


Friction = Annotated[float, Parameter(validator=_remarked)]
Flag = Annotated[bool, Parameter(negative="")]
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
        help="Engine for repeated work: processes, threads or synchronous, of this machine, or the address of a "
        "Dask scheduler, tcp://HOST:PORT, or its scheduler file, FILE.json. The results are the same."
    ),
]
Seed = Annotated[int, Parameter(validator=_from_zero)]
Workers = Annotated[int | None, Parameter(help="Processes or threads of this machine; one per core by default.")]


@dataclass(frozen=True, kw_only=True)
class ConeOptions:
    """A whisker by its numbers.

    Attributes
    ----------
    length : float
        Length L of the nontruncated cone [m], at most 1.
    cone_angle : float
        Cone angle α = base radius / L [rad], at most 0.1.
    tip : float
        Position of the physical tip, over L, or its distance from the tip of the cone (2mm): 0 of a sharp whisker.
    youngs_modulus : float
        Young's modulus E [Pa].
    density : float
        Density ρ [kg/m³].
    """

    length: Length
    cone_angle: Angle
    tip: OverLength = 0.0
    youngs_modulus: Pressure = YOUNGS_MODULUS
    density: Density = DENSITY

    def cone(self) -> Whisker:
        """The whisker.

        Raises
        ------
        InputError
            If a number is out of range.
        """
        sharp = Whisker(
            length=self.length, cone_angle=self.cone_angle, youngs_modulus=self.youngs_modulus, density=self.density
        )
        return replace(sharp, tip=over_length(self.tip, "--whisker.tip", sharp))


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class WhiskerOptions:
    """The whisker, by its numbers or by its name in the atlas.

    Attributes
    ----------
    whisker : ConeOptions, optional
        The whisker's geometry and material.
    atlas : str, optional
        Take a measured rat whisker instead: C2, beta, …
    """

    whisker: ConeOptions | None = None
    atlas: str | None = None

    def cone(self) -> Whisker | None:
        """The whisker that the options give; None if they give none.

        Raises
        ------
        InputError
            If it is given twice, or the atlas has no such name.
        """
        if self.atlas is None:
            return None if self.whisker is None else self.whisker.cone()
        if self.whisker is not None:
            remedy = "either --whisker.length and the rest, or --atlas"
            raise ConflictError("whisker", "must be given once", remedy=remedy)
        return atlas_whisker(self.atlas)

    def needed_cone(self) -> Whisker:
        """The whisker that the options give, for a command that needs one.

        Raises
        ------
        InputError
            If it is given twice or not at all, or the atlas has no such name.
        """
        cone = self.cone()
        if cone is None:
            remedy = "--whisker.length and --whisker.cone-angle, or --atlas"
            raise MissingError("whisker", "must be given", remedy=remedy)
        return cone


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class PostureOptions:
    """How the whisker is held.

    Attributes
    ----------
    contact : float, optional
        Position of the contact along the shaft, over L: 0 at the cone's tip, 1 at the base; or, with a whisker, its
        distance from the tip of the cone along the shaft (11.6mm). This or --base-distance.
    base_distance : float, optional
        Instead: height of the base above the substrate, over L; or, with a whisker, in its unit (18.5mm).
    base_angle : float
        Angle of the shaft at the base to the substrate [rad], below π/2.
    friction : float
        Coefficient of friction of the substrate, which moves away from the base.
    adhesion : float
        Strength b of adhesive friction, T/N = μ + b N̂^(−1/3) with the normal load N̂ = N/(πEα⁴L²ε²/4); 0 for Coulomb's.
    """

    contact: OverLength | None = None
    base_distance: OverLength | None = None
    base_angle: Angle
    friction: Friction = 0.4
    adhesion: float = 0.0

    def posture(self, cone: Whisker | None) -> Posture:
        """The posture that the options name.

        Parameters
        ----------
        cone : Whisker, optional
            Gives L, where a length was typed.

        Returns
        -------
        Posture
            The posture.

        Raises
        ------
        InputError
            If it is given twice or not at all.
        """
        from vibrissa.mechanics.statics.profile import Posture

        held = {"base_angle": self.base_angle, "friction": self.friction, "adhesion": self.adhesion}
        if self.contact is None and self.base_distance is not None:
            return Posture.at_height(over_length(self.base_distance, "--base-distance", cone), **held)
        if self.contact is None or self.base_distance is not None:
            raise ConflictError("posture", "must be given once", remedy="either --contact or --base-distance")
        return Posture(contact=over_length(self.contact, "--contact", cone), **held)


NO_WHISKER = WhiskerOptions()
