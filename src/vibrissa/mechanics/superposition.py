"""A whole texture: the whisker's response as the sum of its gaps (Eqs. 12, 13 and 19)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.follicle import base_curvature
from vibrissa.mechanics.gap import UnitResponse, coupling, excursions_at_jump, unit_response
from vibrissa.mechanics.oscillator import ring
from vibrissa.mechanics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.texture.surface import Troughs

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.whisker import Whisker

Array = NDArray[np.float64]
JumpRule = Literal["continuous", "ramp-limit", "paper2014"]

# q̇ after a jump Δq of the quasi-static part, in units of −ζωΔq
_RECOIL = {"continuous": 0.0, "ramp-limit": 2.0, "paper2014": 1.0}


@dataclass(frozen=True, kw_only=True)
class Scan:
    """How the texture is drawn past the whisker.

    Attributes
    ----------
    speed : float
        Scanning speed v_scan [m/s].
    damping : float
        Damping ratio ζ of every mode, in [0, 1).
    jump : {"continuous", "ramp-limit", "paper2014"}
        What the velocity does where the contact jumps: displacement and velocity of the whole whisker continuous
        (default); the limit of ever steeper ramps, q̇ = −2ζωΔq; Eq. (13) as printed, q̇ = −ζωΔq.
    """

    speed: float
    damping: float
    jump: JumpRule = "continuous"

    def __post_init__(self) -> None:
        if not (self.speed > 0 and np.isfinite(self.speed)):
            raise InputError("Scan.speed", "must be positive (m/s)", self.speed)
        if not 0 <= self.damping < 1:
            raise InputError("Scan.damping", "must lie in [0, 1)", self.damping)
        if self.jump not in _RECOIL:
            raise InputError("Scan.jump", f"must be one of {', '.join(_RECOIL)}", repr(self.jump))


@dataclass(frozen=True)
class Events:
    """The contact's history over a texture: d(t) rises at v, falls by λ at each jump.

    Attributes
    ----------
    time : (3J,) array
        t₁, t₂, t₃ of every gap in turn [s].
    drop : (3J,) array
        Step of the excursion, over L: −λ at t₂, else 0.
    rate : (3J,) array
        Step of its rate, over L [1/s]: +v at t₁, −v at t₃, else 0.
    """

    time: Array
    drop: Array
    rate: Array

    def excursion(self, t: Array) -> Array:
        """d(t) over L at times t [s], (T,)."""
        last = np.searchsorted(self.time, t, side="right")

        def total(steps: Array) -> Array:
            return np.concatenate([[0.0], np.cumsum(steps)])[last]

        return total(self.drop) + total(self.rate) * t - total(self.rate * self.time)


def trough_events(texture: Troughs, whisker: Whisker, posture: Posture, speed: float) -> Events:
    """When an edge takes the contact along (t₁), when the contact jumps (t₂), when it is back on the flat (t₃).

    t₂ − t₁ = d₂/v, t₃ − t₁ = λ/v (the paper's "t₃ = λ/v").
    """
    width = texture.width / whisker.length
    start = texture.position / speed
    jump = excursions_at_jump(posture, width) * whisker.length / speed
    time = np.stack([start, start + jump, start + texture.width / speed], axis=1)
    rate = np.full(len(width), speed / whisker.length)
    none = np.zeros(len(width))
    return Events(
        time.ravel(),
        np.stack([none, -width, none], axis=1).ravel(),
        np.stack([rate, none, -rate], axis=1).ravel(),
    )


def mode_amplitudes(events: Events, t: Array, c: Array, omega: Array, damping: float, jump: JumpRule) -> Array:
    """Vibration amplitudes q_i(t) that the contact's history excites, linear response.

    A change of slope of d kicks q̇ by −c_i Δḋ: Eq. (12) of [Boubenec2014]_. A drop of d by λ lets q jump
    by +c_i λ: Eq. (13) of [Boubenec2014]_, since ΔU_qs = −λŪ and q takes −ΔU_qs (whose minus its general form
    lacks); q̇ follows the rule.

    Parameters
    ----------
    events : Events
        The contact's history.
    t : (T,) array
        Times [s], ascending.
    c, omega : (M,) arrays
        Couplings [1] and resonant angular frequencies [rad/s].
    damping : float
        Damping ratio ζ.
    jump : JumpRule
        See :class:`Scan`.

    Returns
    -------
    (M, T) array
        q_i over L.
    """
    step = -c[:, None] * events.drop
    kick = -c[:, None] * events.rate - _RECOIL[jump] * damping * omega[:, None] * step
    return ring(t, events.time, step, kick, omega, np.full(len(omega), float(damping)))


@dataclass(frozen=True)
class Prediction:
    """The whisker's predicted motion over one texture, at any time and place.

    Attributes
    ----------
    whisker, posture, scan
        What was asked.
    events : Events
        The contact's history.
    response : UnitResponse
        The quasi-static shape Ū.
    kappa, c : (M,) arrays
        Adimensional frequencies and couplings of the modes used.
    """

    whisker: Whisker
    posture: Posture
    scan: Scan
    events: Events
    response: UnitResponse
    kappa: Array
    c: Array

    @property
    def omega(self) -> Array:
        """Resonant angular frequencies [rad/s], (M,)."""
        return self.kappa / self.whisker.timescale

    def amplitudes(self, t: Array) -> tuple[Array, Array]:
        """Excursion d (T,) and vibration amplitudes q (M, T) at times t [s], over L."""
        q = mode_amplitudes(self.events, t, self.c, self.omega, self.scan.damping, self.scan.jump)
        return self.events.excursion(t), q

    def displacement(self, t: Array, s: Array) -> Array:
        """Transverse displacement of the points s about the stationary profile, over L.

        Eq. (19) of [Boubenec2014]_, which lacks the time: R(s, t) = Σ_j r_{λ_j}(s, t − x_j/v), the sum over
        gaps of d(t) Ū(s) + Σ_i q_i(t) V_i(s).

        Parameters
        ----------
        t : (T,) array
            Times [s].
        s : (S,) array
            Positions in [ε, 1].

        Returns
        -------
        (T, S) array
            Along n = (−sin θ, cos θ), away from the substrate.
        """
        d, q = self.amplitudes(t)
        shapes = cone_modes(self.kappa, self.posture.contact, s)
        return d[:, None] * self.response.displacement(s) + q.T @ shapes


def predict(whisker: Whisker, posture: Posture, texture: Troughs, scan: Scan, *, n_modes: int = 12) -> Prediction:
    """Prepare the prediction for one whisker, posture, texture and scan.

    Raises
    ------
    InputError
        If the contact lies beyond the whisker's tip, or the posture beyond the fold.
    """
    if posture.contact < whisker.tip:
        raise InputError(
            "Posture.contact", f"must not lie beyond the whisker's tip at {whisker.tip:.4g}", posture.contact
        )
    response = unit_response(posture)
    events = trough_events(texture, whisker, posture, scan.speed)
    kappa = cone_kappa(posture.contact, n_modes)
    return Prediction(whisker, posture, scan, events, response, kappa, coupling(response, n_modes))


def predicted_signals(prediction: Prediction, t: Array) -> xr.Dataset:
    """Signals of a prediction at times t.

    Parameters
    ----------
    prediction : Prediction
        From :func:`predict`.
    t : (T,) array
        Times [s]; 0 is the moment x = 0 meets the contact.

    Returns
    -------
    Dataset
        ``excursion`` d, ``mode_amplitude`` q, ``mode_displacement`` q + c d (what a movie shows, before its mean
        is taken away), ``kappa``, ``resonant_frequency`` [Hz], ``coupling``; ``base_curvature`` of the vibration [1/m].
    """
    d, q = prediction.amplitudes(t)
    return dataset(
        {"response": "linear", "jump": prediction.scan.jump, "damping": prediction.scan.damping},
        time=t,
        mode=np.arange(1, len(q) + 1),
        excursion=d,
        mode_amplitude=q,
        mode_displacement=q + prediction.c[:, None] * d,
        kappa=prediction.kappa,
        resonant_frequency=prediction.omega / (2 * np.pi),
        coupling=prediction.c,
        base_curvature=base_curvature(prediction.whisker, prediction.kappa, prediction.posture.contact, q),
    )
