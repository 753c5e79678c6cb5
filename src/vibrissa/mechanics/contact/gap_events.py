"""When gaps carry the contact along and let it jump, and what that imposes on the whisker."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import FormatError
from vibrissa.mechanics.quasi_static.response import Response
from vibrissa.mechanics.statics.gap import JumpTable, jump_table
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.vibration.dynamics import Drive
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker


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
        """d(t) over L at times t [s], (T,).

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (T,) array
            d over L.
        """
        last = np.searchsorted(self.time, t, side="right")

        def total(steps: Array) -> Array:
            return np.concatenate([[0.0], np.cumsum(steps)])[last]

        return total(self.drop) + total(self.rate) * t - total(self.rate * self.time)


def trough_events(
    texture: Gaps, whisker: Whisker, posture: Posture, speed: float, jumps: JumpTable | None = None
) -> Events:
    """When an edge takes the contact along (t₁), when the contact jumps (t₂), when it is back on the flat (t₃).

    t₂ − t₁ = d₂/v, t₃ − t₁ = λ/v (the paper's "t₃ = λ/v").

    Parameters
    ----------
    texture : Gaps
        The gaps.
    whisker : Whisker
        Gives L.
    posture : Posture
        On the flat.
    speed : float
        [m/s].
    jumps : JumpTable, optional
        d₂ by width; made here by default.

    Returns
    -------
    Events
        Three for each gap.
    """
    check_gaps(texture, "for any other surface use vibrissa.mechanics.contact.episodes.episodes")
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

    Parameters
    ----------
    events : Events
        The contact's history.
    response : Response
        The response to it.

    Returns
    -------
    Drive
        Rows as in :class:`vibrissa.mechanics.quasi_static.response.Response`.
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


def check_gaps(texture: object, remedy: str) -> None:
    """Refuse any other surface where gaps are wanted; the remedy names the function that takes it.

    Parameters
    ----------
    texture : object
        A surface.
    remedy : str
        What to do instead.

    Raises
    ------
    InputError
        If it is not gaps.
    """
    if not isinstance(texture, Gaps):
        raise FormatError("texture", "must be gaps (Gaps)", f"a {type(texture).__name__}", remedy)
