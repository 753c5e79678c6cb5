"""The case of every program: one whisker, one posture, gaps of one width, and the motion seen through one mode."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import xarray as xr
from held_contact import held_contacts, held_frequency, held_kappa
from scipy.optimize import curve_fit

from vibrissa.exact import cone_kappa
from vibrissa.mechanics.modes.basis import Modes
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.mechanics.statics.edge_contact import Held, hold, on_the_flat
from vibrissa.mechanics.statics.gap import excursion_at_jump
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.vibration.dynamics import Drive, amplitudes
from vibrissa.mechanics.whisking.drifting_oscillator import drift
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

Array = np.ndarray
DEPTH = 35e-6  # [m] of a gap
SETTLE = 60e-3  # [s] before the first gap, or before the pluck ends; the first half near critical damping
STEP = 5e-5  # [s] between kept samples


@dataclass(frozen=True, kw_only=True)
class Case:
    """A whisker drawn over gaps, its shaft cut beyond the contact.

    Attributes
    ----------
    base_angle, contact : float
        θ_b [rad] and ε of the posture.
    modes : str
        Modes of the prediction, in which every program's motion is seen.
    gap, period : float
        Width of a gap and distance from one to the next [m].
    gaps : int
        How many.
    speed : float
        Of the substrate, away from the base [m/s].
    beyond : float or None
        Length of the shaft beyond the contact [m]; by default as far as the contact slides before it jumps.
    damping : float
        Damping ratio of the first straight mode.
    damped : {"mass", "stiffness"}
        What damping is proportional to: ζ_i = ζ₁ ω₁/ω_i, or ζ₁ ω_i/ω₁.
    after : float
        Time that is simulated after the last gap, or after the pluck [s].
    """

    base_angle: float
    contact: float = 0.3
    modes: Modes = "straight"
    gap: float = 0.3e-3
    period: float = 0.0
    gaps: int = 1
    speed: float = 0.02
    beyond: float | None = None
    damping: float = 0.1
    damped: Literal["mass", "stiffness"] = "mass"
    after: float = 25e-3

    @cached_property
    def whisker(self) -> Whisker:
        return Whisker(length=40e-3, cone_angle=1.5e-3)

    @cached_property
    def posture(self) -> Posture:
        return Posture(contact=self.contact, base_angle=self.base_angle)

    @cached_property
    def flat(self) -> Held:
        return on_the_flat(self.posture)

    @cached_property
    def tip(self) -> float:
        """Where the shaft is cut, over L."""
        if self.beyond is None:
            return hold(self.flat, excursion_at_jump(self.posture, self.gap / self.whisker.length)).contact
        return self.contact - self.beyond / self.whisker.length

    @cached_property
    def drag(self) -> float:
        """Damping over mass, 2ζ₁ω₁ of the first straight mode [1/s]."""
        return 2 * self.damping * float(cone_kappa(self.contact, 1)[0]) / self.whisker.timescale

    @property
    def lag(self) -> float:
        """Damping over stiffness, 2ζ₁/ω₁ of the first straight mode [s]."""
        return 4 * self.damping**2 / self.drag

    @cached_property
    def starts(self) -> Array:
        """Positions of the gaps' far edges, along the substrate, on the contact's path [m]."""
        return SETTLE * self.speed + self.period * np.arange(self.gaps)

    @cached_property
    def time(self) -> Array:
        """Times of kept samples [s]; the substrate starts at 0."""
        return np.arange(0, (self.starts[-1] + self.gap) / self.speed + self.after, STEP)

    @cached_property
    def prediction(self) -> Prediction:
        texture = Gaps(position=self.starts, width=np.full(self.gaps, self.gap), depth=DEPTH)
        return predict(self.whisker, self.posture, texture, Scan(speed=self.speed, damping=0, modes=self.modes))

    @cached_property
    def held(self) -> xr.Dataset:
        """Where the edge of a gap holds the contact, from the jump until it is back on the flat; ζ₁ of every mode."""
        damped = replace(self.prediction.scan, damping=float(self.zeta[0]))
        return held_contacts(replace(self.prediction, scan=damped))

    @property
    def held_kappa(self) -> float:
        """κ₁ in the mean while the edge of the first gap holds the contact, whatever modes the prediction takes."""
        at_rest = held_kappa(self.flat, self.contact, 0.0, 1, straight=self.modes == "straight")
        return float(at_rest[0] * self.held.held_shift[0, 0])

    @property
    def zeta(self) -> Array:
        """Damping ratio of every mode, (M,)."""
        omega = self.prediction.omega
        if self.damped == "mass":
            return self.drag / (2 * omega)
        return np.minimum(self.lag * omega / 2, 0.999)

    def ours(self, time: Array) -> Array:
        """First mode, q₁ + Q₁(d), over L, (T,)."""
        p = self.prediction
        return (amplitudes(time, p.mode_drive, p.omega, self.zeta, "continuous") + p.mode_drive(time))[0]

    def drifting(self, time: Array) -> Array:
        """As :meth:`ours`, but ringing at the frequency that the edge gives it, carrying the contact along, (T,)."""
        drive, frequency = self.prediction.mode_drive, held_frequency(self.prediction)
        first, omega = (Drive(one.time, one.coefficients[:1], one.before[:1]) for one in (drive, frequency))
        here = time >= drive.time[0]
        out = np.zeros(len(time))
        out[here] = drift(time[here], first, omega, float(self.zeta[0]))[0][0]
        return out + drive(time)[0]

    def seen(self, s: Array, x: Array, y: Array, rest: tuple[Array, Array]) -> Array:
        """First mode in what another program's nodes do, over L, (T,): ∫ s² (r − r₁)·l₁ ds.

        Parameters
        ----------
        s : (S,) array
            Nodes, over L, ascending.
        x, y : (T, S) arrays
            Their positions, over L.
        rest : (S,) arrays
            The program's own r₁.
        """
        here = s >= self.contact
        along, up = self.prediction.response.basis.adjoint(s[here])[:, 0]
        return np.trapezoid(s[here] ** 2 * ((x - rest[0])[:, here] * along + (y - rest[1])[:, here] * up), s[here])


def ring(t: Array, q: Array, omega: float, zeta: float) -> tuple[float, float]:
    """ω [rad/s] and ζ of a ring-down, by a damped cosine about a constant; NaN where none fits."""

    def model(t, w, z, a, b, c):
        Omega = w * np.sqrt(1 - z**2)
        return np.exp(-z * w * t) * (a * np.cos(Omega * t) + b * np.sin(Omega * t)) + c

    start, low, high = (omega, zeta, 1.0, 0.0, 0.0), (0.3 * omega, 0.0, *3 * [-np.inf]), (3 * omega, 0.9, *3 * [np.inf])
    try:
        found, _ = curve_fit(model, t - t[0], q / np.abs(q).max(), start, bounds=(low, high))
    except (RuntimeError, ValueError):
        return np.nan, np.nan
    return float(found[0]), float(found[1])
