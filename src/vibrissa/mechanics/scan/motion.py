"""What the whisker does when its contact moves: the vibration that any quasi-static drive excites."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.mechanics.quasi_static.relief_response import GroundResponse
from vibrissa.mechanics.quasi_static.response import Response
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.vibration.dynamics import Drive, amplitudes, vibrate
from vibrissa.whisker import Whisker


class PredictedMotion(ABC):
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
    def allowed_jumps(self) -> Mask:
        """Which jumps of the contact the free end allows, (J,): see :mod:`vibrissa.mechanics.scan.free_end`."""

    @property
    def free_end_length(self) -> float:
        """Length of shaft beyond the contact at rest [m]."""
        return (self.posture.contact - self.whisker.tip) * self.whisker.length

    @cached_property
    @abstractmethod
    def drive(self) -> Drive:
        """Quasi-static amplitudes of the modes, then what the follicle and the contact feel of them."""

    @abstractmethod
    def where(self, t: Array) -> dict[str, Array]:
        """Where the contact is, as the response takes it: excursion d and, over a relief, height z.

        Parameters
        ----------
        t : (T,) array
            Times [s].

        Returns
        -------
        dict of (T,) arrays
            ``d`` and maybe ``z``, over L.
        """

    def excursion(self, t: Array) -> Array:
        """Excursion d of the contact.

        Parameters
        ----------
        t : (T,) array
            Times [s].

        Returns
        -------
        (T,) array
            d over L, positive away from the base.
        """
        return self.where(t)["d"]

    def quasi_static_displacement(self, t: Array, s: Array) -> Array:
        """Displacement U_qs − U₁ along the normal, without vibration.

        Parameters
        ----------
        t : (T,) array
            Times [s].
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        (T, S) array
            Over L, positive away from the substrate.
        """
        return self.response.displacement(**self.where(t), s=s)

    def quasi_static_position(self, t: Array, s: Array) -> tuple[Array, Array]:
        """Position of points of the shaft from the base, without vibration.

        Parameters
        ----------
        t : (T,) array
            Times [s].
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        x, y : (T, S) arrays
            Along the substrate and up, over L.
        """
        return self.response.position(**self.where(t), s=s)

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

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            q over L.
        """
        return amplitudes(t, self.mode_drive, self.omega, self.scan.damping, self.scan.jump)

    def mode_displacement(self, t: Array) -> Array:
        """What a movie shows of each mode before its mean is taken away, q_i + Q_i(d), over L, (M, T).

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            Over L.
        """
        return self.amplitudes(t) + self.mode_drive(t)

    def vibration(self, t: Array) -> tuple[Array, Array]:
        """Vibration amplitudes q, over L, and q̇ [1/s], (M, T) each.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        q, rate : (M, T) arrays
            Over L, and over L [1/s].
        """
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

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        x, y : (T, S) arrays
            Along the substrate and up, over L.
        """
        x, y = self.quasi_static_position(t, s)
        q, (along, up) = self.amplitudes(t).T, self.response.basis.displacement(s)
        return x + q @ along, y + q @ up
