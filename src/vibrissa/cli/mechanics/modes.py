"""The verb `modes`: of a straight shaft, or about its curved profile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.options import NO_WHISKER, Friction, WhiskerOptions
from vibrissa.cli.shared.words.units import Angle, OverLength, over_length
from vibrissa.errors import ConflictError, MissingError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.whisker import Whisker


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ProfileOptions:
    """How the whisker is held, for modes about its profile.

    Attributes
    ----------
    base_angle : float, optional
        About the profile: angle of the shaft at the base to the substrate [rad], below π/2.
    friction : float, optional
        About the profile: coefficient of friction of the substrate, 0.4 by default.
    adhesion : float, optional
        About the profile: strength b of adhesive friction, as of ``profile``; 0 by default.
    contact_condition : {"slide", "stick", "edge", "flat"}, optional
        About the profile: whether one point of the shaft slides along the substrate (default) or sticks to it, or the
        shaft slips over an edge, or its free end lies on smooth ground and the contact moves along both.
    friction_law : {"constant", "coulomb"}, optional
        About the profile: whether friction keeps its value as the whisker vibrates (default) or follows the load (on
        an edge always).
    """

    base_angle: Angle | None = None
    friction: Friction | None = None
    adhesion: float | None = None
    contact_condition: Literal["slide", "stick", "edge", "flat"] | None = None
    friction_law: Literal["constant", "coulomb"] | None = None

    def modes(self, contact: float, count: int, cone: Whisker | None) -> xr.Dataset:
        """The modes about the profile that the options name.

        Parameters
        ----------
        contact : float
            Over L.
        count : int
            Number of modes.
        cone : Whisker, optional
            For frequencies in hertz.

        Returns
        -------
        Dataset
            The modes.

        Raises
        ------
        InputError
            If no base angle is given.
        """
        from vibrissa.mechanics.modes.shift import curved_eigenmodes
        from vibrissa.mechanics.statics.profile import Posture

        if self.base_angle is None:
            raise ConflictError("--base-angle", "must be given about a profile", remedy="for example --base-angle 1.2")
        friction = 0.4 if self.friction is None else self.friction
        posture = Posture(contact=contact, base_angle=self.base_angle, friction=friction, adhesion=self.adhesion or 0.0)
        condition = self.contact_condition or "slide"
        return curved_eigenmodes(posture, count, condition=condition, law=self.friction_law, whisker=cone)

    def refuse(self) -> None:
        """Refuse options that a straight shaft does not take.

        Raises
        ------
        InputError
            At the first that is given.
        """
        for name, value in vars(self).items():
            if value is not None:
                option = "--" + name.replace("_", "-")
                raise ConflictError(option, "must go with --about profile", value, "a straight shaft has no profile")


NO_PROFILE = ProfileOptions()


def modes(
    *,
    contact: OverLength | None = None,
    n_modes: int = 3,
    boundary: Literal["pinned", "free"] = "pinned",
    about: Literal["straight", "profile"] = "straight",
    pressed: ProfileOptions = NO_PROFILE,
    of: WhiskerOptions = NO_WHISKER,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Compute the modes of a whisker: pinned at a contact or with a free tip; straight or about its curved profile.

    Modes about the profile are printed next to those of the straight shaft; a stable mode has a growth rate of 0.

    Parameters
    ----------
    contact
        Position of the contact (or of the free end) over the length of the nontruncated cone: 0 at the cone's tip,
        1 at the base; or, with a whisker, its distance from the tip of the cone along the shaft (11.6mm).
        May be left out for a free tip: the whisker's own tip, or the whole cone.
    n_modes
        Number of modes.
    boundary
        Boundary condition at the contact.
    about
        Modes of a straight shaft (the paper's), or about the profile of a whisker pressed on flat ground, which needs
        --base-angle.
    """
    from vibrissa.mechanics.modes.straight import eigenmodes, resonances

    cone = of.cone()
    if contact is None and boundary == "pinned":
        raise MissingError("--contact", "must be given for a pinned whisker", remedy="for example --contact 0.3")
    where = over_length(contact, "--contact", cone) if contact is not None else cone.tip if cone else 0.0
    names = ["contact", "kappa"]
    if about == "profile":
        if boundary == "free":
            remedy = "a free whisker is straight"
            raise ConflictError("--boundary", "must be 'pinned' about a profile", "'free'", remedy)
        with stage("modes"):
            data = pressed.modes(where, n_modes, cone)
        names = ["contact", "base_angle", "kappa", "kappa_straight", "resonance_ratio", "growth_rate"]
    else:
        pressed.refuse()
        data = (
            resonances(cone, where, n_modes, boundary=boundary)
            if cone
            else eigenmodes(where, n_modes, boundary=boundary)
        )
    drawing.draw("others.contents", data)
    output.show(data, [*names, "resonant_frequency"] if cone else names)
