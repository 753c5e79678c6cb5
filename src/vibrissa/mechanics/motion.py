"""What the whisker does when its contact moves: the vibration that any quasi-static drive excites."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.mechanics.dynamics import Drive, amplitudes, vibrate

if TYPE_CHECKING:
    from vibrissa.mechanics.ground import GroundResponse
    from vibrissa.mechanics.profile import Posture
    from vibrissa.mechanics.response import Response
    from vibrissa.mechanics.superposition import Scan
    from vibrissa.whisker import Whisker

Array = NDArray[np.float64]


class Motion(ABC):
    """The whisker's predicted motion in one posture, at any time and place.

    Attributes
    ----------
    whisker, posture, scan
        What was asked.
    response
        The quasi-static response to where the contact is.
    """

    whisker: Whisker
    posture: Posture
    scan: Scan
    response: Response | GroundResponse

    @property
    @abstractmethod
    def end(self) -> float:
        """When the contact has come to rest [s]."""

    @property
    @abstractmethod
    def surface(self) -> dict[str, float]:
        """What the surface is, in numbers."""

    @property
    @abstractmethod
    def gaps(self) -> tuple[Array, Array, float]:
        """Where gaps begin and how wide they are [m], (J,) each, and their depth [m]; of any surface what lies low."""

    @cached_property
    @abstractmethod
    def drive(self) -> Drive:
        """Quasi-static amplitudes of the modes, then what the follicle and the contact feel of them."""

    @abstractmethod
    def excursion(self, t: Array) -> Array:
        """Excursion d over L at times t [s], (T,)."""

    @abstractmethod
    def quasi_static_displacement(self, t: Array, s: Array) -> Array:
        """U_qs − U₁ along the normal at points s, over L, (T, S)."""

    @abstractmethod
    def quasi_static_position(self, t: Array, s: Array) -> tuple[Array, Array]:
        """Position of the points s from the base without vibration, over L, (T, S) each."""

    @property
    def kappa(self) -> Array:
        """Adimensional frequencies of the modes, (M,)."""
        return self.response.kappa

    @property
    def c(self) -> Array:
        """Linear couplings c_i of the modes to the excursion, (M,)."""
        return self.response.c

    @property
    def omega(self) -> Array:
        """Resonant angular frequencies [rad/s], (M,)."""
        return self.kappa / self.whisker.timescale

    @cached_property
    def mode_drive(self) -> Drive:
        """Quasi-static amplitudes Q_i of the modes."""
        n = len(self.kappa)
        return Drive(self.drive.time, self.drive.coefficients[:n], self.drive.before[:n])

    def amplitudes(self, t: Array) -> Array:
        """Vibration amplitudes q_i(t) that the contact's history excites, over L, (M, T).

        A change of slope of d kicks q̇: Eq. (12) of [Boubenec2014]_, in the linear response by −c_i Δḋ. A drop of d
        lets q jump: Eq. (13) of [Boubenec2014]_, in the linear response by +c_i λ, since ΔU_qs = −λŪ and q takes −ΔU_qs
        (whose minus its general form lacks); q̇ follows the rule.
        """
        return amplitudes(t, self.mode_drive, self.omega, self.scan.damping, self.scan.jump)

    def mode_displacement(self, t: Array) -> Array:
        """What a movie shows of each mode before its mean is taken away, q_i + Q_i(d), over L, (M, T)."""
        return self.amplitudes(t) + self.mode_drive(t)

    def vibration(self, t: Array) -> tuple[Array, Array]:
        """Vibration amplitudes q, over L, and q̇ [1/s], (M, T) each."""
        return vibrate(t, self.mode_drive, self.omega, self.scan.damping, self.scan.jump)

    def displacement(self, t: Array, s: Array) -> Array:
        """Transverse displacement of the points s about the stationary profile, over L.

        Eq. (19) of [Boubenec2014]_, which lacks the time: R(s, t) = Σ_j r_{λ_j}(s, t − x_j/v), the sum over
        gaps of U_qs(s, t) − U₁(s) + Σ_i q_i(t) V_i(s).

        Parameters
        ----------
        t : (T,) array
            Times [s].
        s : (S,) array
            Positions; below ε the free end, straight.

        Returns
        -------
        (T, S) array
            Along n = (−sin θ, cos θ), away from the substrate.
        """
        angle, (along, up) = self.response.flat.angle(s), self.response.basis.displacement(s)
        across = up * np.cos(angle) - along * np.sin(angle)
        return self.quasi_static_displacement(t, s) + self.amplitudes(t).T @ across

    def position(self, t: Array, s: Array) -> tuple[Array, Array]:
        """Position of the points s from the base, along the substrate and up, over L, (T, S) each.

        The vibration moves them along the normal of the profile on the flat, and along the shaft as far as it must not
        stretch.
        """
        x, y = self.quasi_static_position(t, s)
        q, (along, up) = self.amplitudes(t).T, self.response.basis.displacement(s)
        return x + q @ along, y + q @ up
