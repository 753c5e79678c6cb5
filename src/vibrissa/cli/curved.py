"""Options of the modes about a curved profile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.whisker import Whisker


@dataclass(frozen=True, kw_only=True)
class ProfileOptions:
    """How the whisker is held, for modes about its profile.

    Attributes
    ----------
    base_angle : float, optional
        About the profile: angle of the shaft at the base to the substrate [rad], below π/2.
    friction : float, optional
        About the profile: coefficient of friction of the substrate, 0.4 by default.
    contact_condition : {"slide", "stick", "edge", "flat"}, optional
        About the profile: whether one point of the shaft slides along the substrate (default) or sticks to it, or the
        shaft slips over an edge, or its free end lies on smooth ground and the contact moves along both.
    friction_law : {"constant", "coulomb"}, optional
        About the profile: whether friction keeps its value as the whisker vibrates (default) or follows the load (on
        an edge always).
    """

    base_angle: float | None = None
    friction: float | None = None
    contact_condition: Literal["slide", "stick", "edge", "flat"] | None = None
    friction_law: Literal["constant", "coulomb"] | None = None

    def modes(self, contact: float, count: int, cone: Whisker | None) -> xr.Dataset:
        """The modes about the profile that the options name."""
        from vibrissa.mechanics.profile import Posture
        from vibrissa.mechanics.shift import curved_eigenmodes

        if self.base_angle is None:
            raise InputError("--base-angle", "must be given about a profile", remedy="for example --base-angle 1.2")
        friction = 0.4 if self.friction is None else self.friction
        posture = Posture(contact=contact, base_angle=self.base_angle, friction=friction)
        condition = self.contact_condition or "slide"
        return curved_eigenmodes(posture, count, condition=condition, law=self.friction_law, whisker=cone)

    def refuse(self) -> None:
        """Refuse options that a straight shaft does not take."""
        for name, value in vars(self).items():
            if value is not None:
                option = "--" + name.replace("_", "-")
                raise InputError(option, "must stand with --about profile", value, "a straight shaft has no profile")


OfProfile = Annotated[ProfileOptions, Parameter(name="*")]
NO_PROFILE = ProfileOptions()
