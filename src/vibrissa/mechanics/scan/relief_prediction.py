"""Any surface scanned: the contact's way over a relief, and what the whisker answers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import ConvergenceError, FormatError
from vibrissa.mechanics.contact.episodes import Episodes, episodes
from vibrissa.mechanics.quasi_static.held_table import HeldTable
from vibrissa.mechanics.quasi_static.relief_response import GroundResponse, ground_response
from vibrissa.mechanics.scan.free_end import relief_allows
from vibrissa.mechanics.scan.motion import PredictedMotion
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import check_scale
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.gap import unit_response
from vibrissa.mechanics.statics.profile import Posture, check_tip
from vibrissa.mechanics.vibration.dynamics import Drive
from vibrissa.texture.relief import HeightProfile
from vibrissa.whisker import Whisker

_DEGREE = 7  # of the polynomials of time
_FIT = 1e-9  # their largest miss, over the largest row of its kind
_FLOOR = 1e-6  # no row counts as smaller: rounding is 1e-16
_HALVINGS = 20


@dataclass(frozen=True)
class ReliefPrediction(PredictedMotion):
    """The whisker's predicted motion over one relief, at any time and place.

    Attributes
    ----------
    whisker, posture, scan, relief
        What was asked.
    episodes : Episodes
        The contact's history.
    response : GroundResponse
        The quasi-static response to it.
    """

    whisker: Whisker
    posture: Posture
    scan: Scan
    relief: HeightProfile
    episodes: Episodes
    response: GroundResponse

    @cached_property
    def drive(self) -> Drive:
        """Quasi-static amplitudes of the modes, then what the follicle and the contact feel of them."""
        return relief_drive(self.episodes, self.response, self._per_second)

    @cached_property
    def allowed_jumps(self) -> Mask:
        """Which jumps of the contact the free end allows, (J,)."""
        d, z, place = self.jumps[1]
        angle = replace(self.response, form="exact")(d, z)[-1]
        length = self.whisker.length
        return relief_allows(self.free_end_length, place * length, z * length, angle, self.relief)

    @property
    def end(self) -> float:
        """When the contact glides on the level ground behind the relief [s]."""
        return float(self.episodes.travelled[-1] / self._per_second)

    @property
    def surface(self) -> dict[str, float]:
        """Points and length [m] of the relief."""
        return {"relief_points": len(self.relief.position), "relief_length": self.relief.length}

    @property
    def gaps(self) -> tuple[Array, Array, float]:
        """Stretches below the middle of the heights, and from the lowest to the highest [m]."""
        return *self.relief.low(), float(np.ptp(self.relief.height))

    def contact(self, t: Array) -> tuple[Array, Array, Array]:
        """Excursion d, height z and place X of the contact over L at times t [s], (T,) each.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        d, z, X : (T,) arrays
            Over L.
        """
        return self.episodes.contact(t * self._per_second)

    def where(self, t: Array) -> dict[str, Array]:
        """Excursion and height of the contact, see ``vibrissa.mechanics.scan.motion.Motion.where``."""
        return dict(zip("dz", self.contact(t)[:2], strict=True))

    @property
    def jumps(self) -> tuple[Array, Array]:
        """Excursion, height and place of the contact just before and just after each jump, over L, (3, J) each."""
        episode = np.flatnonzero(self.episodes.jumped)
        travelled = self.episodes.travelled[episode]
        before, after = (self.episodes.within(travelled, one) for one in (episode - 1, episode))
        return np.array(before), np.array(after)

    @property
    def _per_second(self) -> float:
        return self.scan.speed / self.whisker.length


def predict_relief(
    whisker: Whisker,
    posture: Posture,
    relief: HeightProfile,
    scan: Scan,
    *,
    n_modes: int = 12,
    table: HeldTable | None = None,
    like: Episodes | None = None,
) -> ReliefPrediction:
    """Prepare the prediction for one whisker, posture, relief and scan.

    The posture is that on level ground at height 0. The contact's history is that of the exactly held profiles in
    either form of the response.

    Parameters
    ----------
    whisker, posture, relief, scan
        What is drawn past what.
    n_modes : int
        Number of modes.
    table : HeldTable, optional
        Profiles of the same posture, from an earlier prediction's ``episodes.table``; widened where it falls short.
    like : Episodes, optional
        Of an earlier prediction that went much the same way, which saves time.

    Returns
    -------
    ReliefPrediction
        At any time and place.

    Raises
    ------
    InputError
        If the contact lies beyond the whisker's tip, the posture beyond the fold, or the surface is more than it can
        follow; or if it is :class:`vibrissa.texture.surface.Gaps`, which
        :func:`vibrissa.mechanics.scan.texture_prediction.predict` takes.
    """
    _check_heights(relief)
    check_tip(posture, whisker)
    check_scale(whisker, relief.position)
    unit_response(posture)  # refuse at once a posture beyond the fold
    found = episodes(relief, whisker, on_the_flat(posture), table, like)
    response = ground_response(found.table, form=scan.response, n_modes=n_modes, modes=scan.modes)
    return ReliefPrediction(whisker, posture, scan, relief, found, response)


def _check_heights(relief: object) -> None:
    """Refuse gaps where a height profile is wanted."""
    if not isinstance(relief, HeightProfile):
        remedy = "for gaps use vibrissa.mechanics.scan.texture_prediction.predict, or HeightProfile.from_gaps"
        raise FormatError("relief", "must be heights (HeightProfile)", f"a {type(relief).__name__}", remedy)


def relief_drive(history: Episodes, response: GroundResponse, per_second: float) -> Drive:
    """Everything quasi-static as polynomials of time: of degree 7, on episodes halved until they miss by 1e-9.

    The miss is over the largest amplitude of all modes, and over the largest value of every other row.

    Parameters
    ----------
    history : Episodes
        The contact's history.
    response : GroundResponse
        The response to it.
    per_second : float
        Speed of the scan over L [1/s].

    Returns
    -------
    Drive
        Rows as of :class:`vibrissa.mechanics.quasi_static.response.Response`.

    Raises
    ------
    ConvergenceError
        If 20 halvings do not suffice.
    """
    begin, end = history.travelled[:-1], history.travelled[1:]
    episode = np.flatnonzero(end > begin)
    low, high = begin[episode], end[episode]
    done: list[tuple[Array, Array]] = []
    scale = np.zeros(len(response.rows))
    for _ in range(_HALVINGS):
        coefficients, miss, size = _fitted(history, response, low, high, episode)
        scale = np.maximum(scale, size)
        good = (miss <= _FIT * scale[:, None]).all(axis=0)
        done.append((low[good], coefficients[:, good] * ((per_second / (high - low)[good])[:, None] ** _POWERS)))
        low, high, episode = low[~good], high[~good], episode[~good]
        if not len(low):
            return _assembled(history, response, per_second, done)
        middle = (low + high) / 2
        low, high, episode = np.append(low, middle), np.append(middle, high), np.append(episode, episode)
    raise ConvergenceError("drive of a relief", float(np.max(miss / scale[:, None])), _HALVINGS)


_POWERS = np.arange(_DEGREE + 1)


def _fitted(
    history: Episodes, response: GroundResponse, low: Array, high: Array, episode: Integers
) -> tuple[Array, Array, Array]:
    """Coefficients (K, E, n) of powers of the share of each interval, their largest miss (K, E), sizes of rows (K,)."""
    nodes = (1 - np.cos(np.pi * _POWERS / _DEGREE)) / 2  # with both ends: no step where two pieces meet
    between = (nodes[1:] + nodes[:-1]) / 2
    points = np.concatenate([nodes, between])
    tau = low[:, None] + (high - low)[:, None] * points
    d, z, _ = history.within(tau.ravel(), np.repeat(episode, len(points)))
    values = response(d, z).reshape(-1, *tau.shape)
    coefficients = values[..., : len(nodes)] @ np.linalg.inv(np.vander(nodes, increasing=True)).T
    miss = np.abs(coefficients @ np.vander(between, _DEGREE + 1, increasing=True).T - values[..., len(nodes) :])
    size, modes = np.abs(values).max(axis=(1, 2), initial=_FLOOR), len(response.c)
    size[:modes] = size[:modes].max()
    return coefficients, miss.max(axis=2), size


def _assembled(
    history: Episodes, response: GroundResponse, per_second: float, done: list[tuple[Array, Array]]
) -> Drive:
    """All pieces in order; the last episode rests."""
    ends = history.travelled[[0, -1]]
    rest = response(*history.contact(ends)[:2])
    last = np.zeros((len(rest), 1, _DEGREE + 1))
    last[:, 0, 0] = rest[:, 1]
    travelled = np.concatenate([*(low for low, _ in done), ends[1:]])
    coefficients = np.concatenate([*(piece for _, piece in done), last], axis=1)
    order = np.argsort(travelled, kind="stable")
    return Drive(travelled[order] / per_second, coefficients[:, order], rest[:, 0])


_FREE_END = 64  # points of the free end that are looked at


def free_end_depth(prediction: ReliefPrediction, t: Array) -> Array:
    """How deep the straight free end lies below the ground at its worst of 64 points, without vibration [m], (T,).

    Positive where it would touch: the model has one contact, and does not resolve it.

    Parameters
    ----------
    prediction : ReliefPrediction
        Over a relief.
    t : (T,) array
        Times [s].

    Returns
    -------
    (T,) array
        Depth [m].
    """
    _, z, place = prediction.contact(t)
    whisker, slope = prediction.whisker, np.tan(prediction.drive(t)[-1])
    back = np.linspace(0, 1, _FREE_END + 1)[1:] * (prediction.posture.contact - whisker.tip)
    ground = prediction.relief.at((place[:, None] - back) * whisker.length)
    shaft = (z[:, None] - slope[:, None] * back) * whisker.length
    return np.asarray((ground - shaft).max(axis=1), float)
