"""A whole texture: the whisker's response as the sum of its gaps (Eqs. 12, 13 and 19)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.mechanics.basis import Modes
from vibrissa.mechanics.dynamics import Drive, JumpRule
from vibrissa.mechanics.gap import JumpTable, jump_table
from vibrissa.mechanics.motion import Motion
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.response import Form, Response, quasi_static
from vibrissa.texture.surface import Troughs

if TYPE_CHECKING:
    from vibrissa.whisker import Whisker

Array = NDArray[np.float64]


FASTEST = 10.0  # [m/s] of a scan: beyond it a unit is wrong
_FARTHEST = 50  # [L] of a texture: beyond it a unit is wrong
_NARROWEST = 1e-5  # [L] of a gap: the shaft sags into it by a thousandth of an atom


@dataclass(frozen=True, kw_only=True)
class Scan:
    """How the texture is drawn past the whisker, and how the answer is reckoned.

    Attributes
    ----------
    speed : float
        Scanning speed v_scan [m/s], at most 10.
    damping : float
        Damping ratio ζ of every mode, in [0, 1).
    jump : {"continuous", "ramp-limit", "paper2014"}
        What the velocity does where the contact jumps: displacement and velocity of the whole whisker continuous
        (default); the limit of ever steeper ramps, q̇ = −2ζωΔq; Eq. (13) as printed, q̇ = −ζωΔq. On the ramps between
        jumps Eq. (6) holds under every rule: damping acts on the vibration.
    response : {"exact", "linear"}
        Quasi-static part: Q_i(d) of the profile held by the edge (default), or the paper's c_i d.
    modes : {"straight", "curved", "curved-coulomb", "curved-edge"}
        The paper's modes of a straight shaft (default), or those about the curved profile of a contact that slides,
        friction constant or following the load: see :mod:`vibrissa.mechanics.curved`.
    """

    speed: float
    damping: float
    jump: JumpRule = "continuous"
    response: Form = "exact"
    modes: Modes = "straight"

    def __post_init__(self) -> None:
        if not (self.speed > 0 and np.isfinite(self.speed)):
            raise InputError("Scan.speed", "must be positive (m/s)", self.speed)
        if self.speed > FASTEST:
            raise InputError("Scan.speed", f"must be at most {FASTEST:g} m/s", self.speed, "give it in m/s")
        if not 0 <= self.damping < 1:
            raise InputError("Scan.damping", "must lie in [0, 1)", self.damping)
        choices = (("jump", self.jump, JumpRule), ("response", self.response, Form), ("modes", self.modes, Modes))
        for name, value, rule in choices:
            if value not in get_args(rule):
                raise InputError(f"Scan.{name}", f"must be one of {', '.join(get_args(rule))}", repr(value))


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

    @property
    def gaps(self) -> tuple[Array, Array]:
        """Excursions d₂ before and d₂ − λ after each jump, over L, (J,) each."""
        before = self.rate[0] * (self.time[1::3] - self.time[0::3])
        return before, before + self.drop[1::3]

    def excursion(self, t: Array) -> Array:
        """d(t) over L at times t [s], (T,)."""
        last = np.searchsorted(self.time, t, side="right")

        def total(steps: Array) -> Array:
            return np.concatenate([[0.0], np.cumsum(steps)])[last]

        return total(self.drop) + total(self.rate) * t - total(self.rate * self.time)


def trough_events(
    texture: Troughs, whisker: Whisker, posture: Posture, speed: float, jumps: JumpTable | None = None
) -> Events:
    """When an edge takes the contact along (t₁), when the contact jumps (t₂), when it is back on the flat (t₃).

    t₂ − t₁ = d₂/v, t₃ − t₁ = λ/v (the paper's "t₃ = λ/v").
    """
    width = texture.width / whisker.length
    start = texture.position / speed
    jump = (jumps or jump_table(posture, width))(width) * whisker.length / speed
    time = np.stack([start, start + jump, start + texture.width / speed], axis=1)
    rate = np.full(len(width), speed / whisker.length)
    none = np.zeros(len(width))
    return Events(
        time.ravel(),
        np.stack([none, -width, none], axis=1).ravel(),
        np.stack([rate, none, -rate], axis=1).ravel(),
    )


def drive(events: Events, response: Response) -> Drive:
    """Everything quasi-static as polynomials of time, from event to event.

    On the ramps d is linear in time, so each piece of the response is a polynomial of time; where d passes from one
    piece to the next there is an event without a step.

    Returns
    -------
    Drive
        Rows as in :class:`vibrissa.mechanics.response.Response`.
    """
    speed = events.rate[0]
    before, after = events.gaps
    borders = np.array([piece.high for piece in response.pieces[:-1]])
    rising = [(events.time[0::3][before > b] + b / speed, b) for b in borders if b > 0]
    falling = [(events.time[2::3][after < b] + b / speed, b) for b in borders if b < 0]
    time = np.concatenate([events.time, *(t for t, _ in (*rising, *falling))])
    start = [np.stack([0 * after, after, 0 * after], axis=1).ravel()]
    d = np.concatenate([*start, *(np.full(len(t), b) for t, b in (*rising, *falling))])
    rate = np.full(len(time), speed)
    rate[2 : len(events.time) : 3] = 0.0
    order = np.argsort(time, kind="stable")
    coefficients = response.taylor(d[order])
    coefficients *= rate[order][:, None] ** np.arange(coefficients.shape[2])
    return Drive(time[order], coefficients, response(np.zeros(1))[:, 0])


@dataclass(frozen=True)
class Prediction(Motion):
    """The whisker's predicted motion over one texture, at any time and place.

    Attributes
    ----------
    whisker, posture, scan, texture
        What was asked.
    events : Events
        The contact's history.
    response : Response
        The quasi-static response to it.
    """

    whisker: Whisker
    posture: Posture
    scan: Scan
    texture: Troughs
    events: Events
    response: Response

    @cached_property
    def drive(self) -> Drive:
        """Quasi-static amplitudes of the modes, then what the follicle and the contact feel of them."""
        return drive(self.events, self.response)

    @property
    def end(self) -> float:
        """When the contact is back on the flat behind the last gap [s]."""
        return float(self.events.time[-1])

    @property
    def surface(self) -> dict[str, float]:
        """Number and depth [m] of the gaps."""
        return {"gaps": len(self.texture.width), "gap_depth": self.texture.depth}

    @property
    def gaps(self) -> tuple[Array, Array, float]:
        """Positions, widths and depth of the gaps [m]."""
        return self.texture.position, self.texture.width, self.texture.depth

    def excursion(self, t: Array) -> Array:
        """Excursion d over L at times t [s], (T,)."""
        return self.events.excursion(t)

    def quasi_static_displacement(self, t: Array, s: Array) -> Array:
        """U_qs − U₁ along the normal at points s, over L, (T, S)."""
        return self.response.displacement(self.events.excursion(t), s)

    def quasi_static_position(self, t: Array, s: Array) -> tuple[Array, Array]:
        """Position of the points s from the base without vibration, over L, (T, S) each."""
        return self.response.position(self.events.excursion(t), s)


def check_tip(posture: Posture, whisker: Whisker) -> None:
    """Refuse a contact that lies beyond the whisker's physical tip."""
    if posture.contact < whisker.tip:
        rule = f"must not lie beyond the whisker's tip at {whisker.tip:.4g}"
        raise InputError("Posture.contact", rule, posture.contact)


def check_scale(whisker: Whisker, places: Array, widths: Array | None = None) -> None:
    """Refuse a texture whose positions [m] are, for this whisker, in a wrong unit: too long, or its gaps too narrow."""
    farthest, most = float(np.abs(places).max()), _FARTHEST * whisker.length
    remedy = "check the unit of its positions: that in the table's header, or --x-unit"
    if farthest > most:
        rule = f"must end within {_FARTHEST} whisker lengths of x = 0, {most:.3g} m"
        raise InputError("texture", rule, f"a place at {farthest:.4g} m", remedy)
    if widths is not None and widths.min() < _NARROWEST * whisker.length:
        rule = f"must have gaps of {_NARROWEST:g} whisker lengths or more, {_NARROWEST * whisker.length:.2g} m"
        raise InputError("texture", rule, f"one of {widths.min():.3g} m", remedy)


def predict(
    whisker: Whisker,
    posture: Posture,
    texture: Troughs,
    scan: Scan,
    *,
    n_modes: int = 12,
    response: Response | None = None,
    jumps: JumpTable | None = None,
) -> Prediction:
    """Prepare the prediction for one whisker, posture, texture and scan.

    Parameters
    ----------
    whisker, posture, texture, scan
        What is drawn past what.
    n_modes : int
        Number of modes.
    response, jumps : Response, JumpTable, optional
        Tables of the same posture that reach as far, made for a batch: see :func:`predict_all`.

    Raises
    ------
    InputError
        If the contact lies beyond the whisker's tip, the posture beyond the fold, or a gap is too wide for it.

    Examples
    --------
    >>> from vibrissa.texture.surface import periodic_grating
    >>> from vibrissa.whisker import Whisker
    >>> whisker, posture = Whisker(length=0.04, cone_angle=1.5e-3), Posture(contact=0.29, base_angle=1.2)
    >>> prediction = predict(whisker, posture, periodic_grating(0.01, period=1e-3), Scan(speed=0.1, damping=0.11))
    >>> round(float(prediction.omega[0] / (2 * np.pi)), 2)  # first resonance [Hz]
    123.15
    >>> t = np.arange(0, 0.1, 5e-4)
    >>> prediction.mode_displacement(t).shape  # q + Q(d) over L, as a movie shows it
    (12, 200)
    """
    check_tip(posture, whisker)
    check_scale(whisker, texture.end, texture.width)
    events = trough_events(texture, whisker, posture, scan.speed, jumps)
    before, after = events.gaps
    reach = float(after.min()), float(before.max())
    if response is None:
        response = quasi_static(posture, reach, form=scan.response, n_modes=n_modes, modes=scan.modes)
    elif not _serves(response, posture, scan, n_modes, reach):
        raise InputError("response", "must be of the same posture, form and modes, and reach as far", reach)
    return Prediction(whisker, posture, scan, texture, events, response)


def predict_all(
    whisker: Whisker, posture: Posture, textures: Sequence[Troughs], scan: Scan, *, n_modes: int = 12
) -> list[Prediction]:
    """Predictions for a batch of textures under one posture, whose tables are made once; see :func:`predict`."""
    widths = np.concatenate([texture.width for texture in textures]) / whisker.length
    jumps, widest = jump_table(posture, widths), widths.max(keepdims=True)
    deepest = float(jumps(widest)[0])
    slack = 1 + 1e-9  # rounding in the textures' own times
    reach = (deepest - float(widest[0])) * slack, deepest * slack
    response = quasi_static(posture, reach, form=scan.response, n_modes=n_modes, modes=scan.modes)
    tables: dict[str, Any] = {"response": response, "jumps": jumps}
    return [predict(whisker, posture, texture, scan, n_modes=n_modes, **tables) for texture in textures]


def _serves(response: Response, posture: Posture, scan: Scan, n_modes: int, reach: tuple[float, float]) -> bool:
    low, high = response.reach
    asked = posture, scan.response, scan.modes, n_modes
    same = (response.posture, response.form, response.modes, len(response.c)) == asked
    slack = 1e-9 * (high - low)  # rounding in the times of the events, which differ with the speed
    return same and (response.form == "linear" or (low - slack <= reach[0] and reach[1] <= high + slack))
