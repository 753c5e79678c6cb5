"""What a map covers, and what its cells hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array
from vibrissa.errors import FormatError, RangeError, UnknownError
from vibrissa.mechanics.modes.straight import MOST_MODES, check_contact
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import DAMPING

if TYPE_CHECKING:
    from vibrissa.mechanics.quasi_static.response import Form
    from vibrissa.mechanics.rod.rod_settings import Rod
    from vibrissa.mechanics.vibration.dynamics import JumpRule

Quantity = Literal["peak", "rms"]


@dataclass(frozen=True, kw_only=True)
class Grid:
    """The product of parameters that a map covers, each (N,), strictly ascending.

    Attributes
    ----------
    contact : array
        Contacts ε over L.
    base_angle : array
        Angles θ_b at the base [rad], in (0, π/2).
    speed : array
        Scanning speeds [m/s].
    friction : array
        Coefficients of friction μ.

    Raises
    ------
    InputError
        If a value is out of its range, or they do not ascend.
    """

    contact: ArrayLike
    base_angle: ArrayLike
    speed: ArrayLike
    friction: ArrayLike = (0.4,)

    def __post_init__(self) -> None:
        for name in ("contact", "base_angle", "speed", "friction"):
            values = np.asarray(getattr(self, name), float)
            if values.ndim != 1 or values.size == 0 or not np.all(np.diff(values) > 0):
                raise FormatError(
                    f"Grid.{name}", "must be a strictly ascending row of numbers, none twice", values.tolist()
                )
            object.__setattr__(self, name, values)
        contact, base_angle, speed, friction = self.axes
        for one in contact[[0, -1]]:
            check_contact(float(one))
        for angle, mu in zip(base_angle[[0, -1]], friction[[0, -1]], strict=True):
            Posture(contact=0.5, base_angle=float(angle), friction=float(mu))
        Scan(speed=float(speed[0]), damping=0.0)
        Scan(speed=float(speed[-1]), damping=0.0)

    @property
    def axes(self) -> tuple[Array, Array, Array, Array]:
        """Contact, base angle, speed and friction."""
        return tuple(np.asarray(v, float) for v in (self.contact, self.base_angle, self.speed, self.friction))  # type: ignore[return-value]


@dataclass(frozen=True, kw_only=True)
class Measure:
    """What a cell of a map holds.

    Attributes
    ----------
    quantity : {"peak", "rms"}
        Largest |displacement| of the point ``node``, quasi-static and vibration, from the first gap until a period of
        mode 1 after the last; or the rms about its mean of mode 1, q₁ + Q₁, from the first gap to the last.
    response : {"exact", "linear"}
        Quasi-static part, as in :class:`vibrissa.mechanics.scan.scan_settings.Scan`.
    damping : float
        Damping ratio ζ of every mode.
    jump : {"continuous", "ramp-limit", "paper2014"}
        What the velocity does where the contact jumps.
    least_linearity : float
        A cell in which the exact jump of mode 1 at the widest gap is less than this, over the linear one, has no value.
        0 leaves all that jump the linear way; without limit if None.
    n_modes : int
        Modes that the peak sums.
    node : float
        Point s of the shaft whose peak is taken, above every contact.
    rod : Rod, optional
        The whole whisker is run in each cell, with these settings; ``response``, ``jump``, ``least_linearity`` and
        ``n_modes`` do not count. Its mode 1 is what a movie shows of it. Without one, the single-contact model.
    """

    quantity: Quantity = "peak"
    response: Form = "exact"
    damping: float = DAMPING
    jump: JumpRule = "continuous"
    least_linearity: float | None = None
    n_modes: int = 12
    node: float = 0.9
    rod: Rod | None = None

    def __post_init__(self) -> None:
        Scan(speed=1.0, damping=self.damping, jump=self.jump, response=self.response)
        if self.quantity not in get_args(Quantity):
            raise UnknownError("quantity", "must be 'peak' or 'rms'", repr(self.quantity))
        if not 1 <= self.n_modes <= MOST_MODES:
            raise RangeError("number of modes", f"must be between 1 and {MOST_MODES}", self.n_modes)
        if self.least_linearity is not None and not 0 <= self.least_linearity <= 1:
            raise RangeError("least linearity", "must lie between 0 and 1", self.least_linearity)
