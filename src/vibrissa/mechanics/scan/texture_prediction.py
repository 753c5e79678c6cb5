"""A whole texture: the whisker's response as the sum of its gaps (Eqs. 12, 13 and 19)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import ConflictError, RangeError
from vibrissa.limits import require_memory
from vibrissa.mechanics.contact.gap_events import Events, check_gaps, drive, trough_events
from vibrissa.mechanics.quasi_static.response import Response, quasi_static
from vibrissa.mechanics.quasi_static.response_rows import FOLLICLE
from vibrissa.mechanics.scan.free_end import gaps_allowed
from vibrissa.mechanics.scan.motion import PredictedMotion
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.gap import JumpTable, jump_table
from vibrissa.mechanics.statics.profile import Posture, check_tip
from vibrissa.mechanics.vibration.dynamics import Drive
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

_FARTHEST = 50  # [L] of a texture: beyond it a unit is wrong
_ANY_SURFACE = "for any other surface use vibrissa.mechanics.scan.relief_prediction.predict_relief"
_NARROWEST = 1e-5  # [L] of a gap: the shaft sags into it by a thousandth of an atom
_ROOM = 1.6  # memory that a scan takes over that of its polynomials


@dataclass(frozen=True)
class Prediction(PredictedMotion):
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
    texture: Gaps
    events: Events
    response: Response

    @cached_property
    def drive(self) -> Drive:
        """Quasi-static amplitudes of the modes, then what the follicle and the contact feel of them."""
        return drive(self.events, self.response)

    @cached_property
    def exact(self) -> Response:
        """The exact response, whichever the prediction was made with."""
        if self.response.form == "exact":
            return self.response
        before, after = self.events.gaps
        reach = float(after.min()), float(before.max())
        return quasi_static(self.posture, reach, n_modes=len(self.c), modes=self.response.modes)

    @cached_property
    def allowed_jumps(self) -> Mask:
        """Which jumps of the contact the free end allows, (J,)."""
        angle = self.exact(self.events.gaps[1])[len(self.c) + FOLLICLE.index("contact_angle")]
        return gaps_allowed(self.free_end_length, self.texture.width, angle, self.texture.depth)

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

    def where(self, t: Array) -> dict[str, Array]:
        """Excursion of the contact, see ``vibrissa.mechanics.scan.motion.Motion.where``."""
        return {"d": self.events.excursion(t)}


def check_scale(whisker: Whisker, places: Array, widths: Array | None = None) -> None:
    """Refuse a texture whose positions [m] are, for this whisker, in a wrong unit: too long, or its gaps too narrow.

    Parameters
    ----------
    whisker : Whisker
        Gives L.
    places : (J,) array
        Places on the texture [m].
    widths : (J,) array, optional
        Widths of its gaps [m].

    Raises
    ------
    InputError
        If it is too long for this whisker, or a gap too narrow.
    """
    farthest, most = float(np.abs(places).max()), _FARTHEST * whisker.length
    remedy = "check the unit of its positions: that in the table's header, or `x_unit`"
    if farthest > most:
        rule = f"must end within {_FARTHEST} whisker lengths of x = 0, {most:.3g} m"
        raise RangeError("texture", rule, f"a place at {farthest:.4g} m", remedy)
    if widths is not None and widths.min() < _NARROWEST * whisker.length:
        rule = f"must have gaps of {_NARROWEST:g} whisker lengths or more, {_NARROWEST * whisker.length:.2g} m"
        raise RangeError("texture", rule, f"one of {widths.min():.3g} m", remedy)


def predict(
    whisker: Whisker,
    posture: Posture,
    texture: Gaps,
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

    Returns
    -------
    Prediction
        At any time and place.

    Raises
    ------
    InputError
        If the contact lies beyond the whisker's tip, the posture beyond the fold, or a gap is too wide for it; or if
        the texture is a :class:`vibrissa.texture.relief.HeightProfile`, which
        :func:`vibrissa.mechanics.scan.relief_prediction.predict_relief` takes.

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
    check_gaps(texture, _ANY_SURFACE)
    check_tip(posture, whisker)
    check_scale(whisker, texture.end, texture.width)
    events = trough_events(texture, whisker, posture, scan.speed, jumps)
    before, after = events.gaps
    reach = float(after.min()), float(before.max())
    if response is None:
        response = quasi_static(posture, reach, form=scan.response, n_modes=n_modes, modes=scan.modes)
    elif not _serves(response, posture, scan, n_modes, reach):
        raise ConflictError("response", "must be of the same posture, form and modes, and reach as far", reach)
    _refuse_many(texture, response)
    return Prediction(whisker, posture, scan, texture, events, response)


def _refuse_many(texture: Gaps, response: Response) -> None:
    """Refuse more gaps than the polynomials of their three events fit into memory, with what is derived from them."""
    rows, powers = response.pieces[0].coefficients.shape
    gaps = len(texture.width)
    require_memory("texture", f"{gaps:,} gaps", 8.0 * 3 * gaps * rows * powers * _ROOM, "scan it in parts")


def predict_all(
    whisker: Whisker, posture: Posture, textures: Sequence[Gaps], scan: Scan, *, n_modes: int = 12
) -> list[Prediction]:
    """Predictions for a batch of textures under one posture, whose tables are made once; see :func:`predict`.

    Parameters
    ----------
    whisker, posture, textures, scan, n_modes
        As of :func:`predict`, several textures.

    Returns
    -------
    list of Prediction
        One for each texture.
    """
    for texture in textures:
        check_gaps(texture, _ANY_SURFACE)
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
