"""What is known of each whisker: its place in the pad, its swing, how it strays, its look."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.chain_kernel import near
from vibrissa.video.link.pad.pads import Lines

SPREAD = np.diag([0.8, 0.3, 0.8]) ** 2  # of a whisker's deviation at the three radii [°], but for its own swing
OWN = 1.5  # standard deviation of its own swing [°]
FEW = 40.0  # frames of evidence that this prior counts for
WIDEST = 5.0  # variance of a whisker's deviation over that of the prior, at most
KEEP = 0.85  # correlation of the deviation from frame to frame before it is estimated
EQUAL = 0.2  # standard deviation of the gain of whiskers on the pad's phase
NOTHING = -8.0  # logarithm of the density of lines that are no whiskers' [°⁻³ per frame]
LOOK = np.array([0.35, 0.25])  # standard deviation of the two parts of a line's look, at least
RANGE = np.array([2.0, 2.0])  # in which those of lines that are no whiskers' are
CUT = np.array([0.0, 0.15])  # share of lines for which either says nothing: those cut short where others cross them
GATE = 9.0  # log density below that of the mean at which a line is no candidate


class Model(NamedTuple):
    """One whisker.

    Attributes
    ----------
    place : (3,) array
        Where it is across the pad when the phase is 0, at the three radii [°].
    gain : (2, 3) array
        How far it goes with each degree of the phase and of its quarter, see :mod:`vibrissa.video.link.pad.phase`.
    spread : (3, 3) array
        Covariance of its deviation.
    keep : float
        Correlation of the deviation from frame to frame.
    missed : float
        Chance that it has no line in a frame.
    look, look_sd : (2,) arrays
        Of its line.
    course : (T, 3) array, optional
        Slow drift from the place in each frame [°].
    """

    place: Array
    gain: Array
    spread: Array
    keep: float
    missed: float
    look: Array
    look_sd: Array
    course: Array | None = None

    @property
    def slow(self) -> Array:
        """Variance of the drift at the three radii [°²], (3,)."""
        return np.zeros(3) if self.course is None else self.course.var(axis=0)


def prior_spread(gain: Array) -> Array:
    """Covariance of a deviation of which nothing is known but the lever of the pad."""
    return np.asarray(SPREAD + OWN**2 * np.outer(gain, gain))


def deviations(model: Model, place: Array, phase: Array, frame: Integers) -> Array:
    """Deviations (n, 3) of lines at a place (n, 3) in some frames (n,), when the pad has a phase (n, 2) [°]."""
    x = place - model.place - phase @ model.gain
    return np.asarray(x if model.course is None else x - model.course[frame])


def worth(model: Model, look: Array) -> Array:
    """Logarithm of what lines of this look (n, 2) are worth as this whisker's, (n,)."""
    off = (look - model.look) / model.look_sd
    density = RANGE / (model.look_sd * np.sqrt(2 * np.pi)) * (1 + off**2 / 4) ** -2.5
    each = np.log((1 - CUT) * density + CUT)
    return np.asarray(each.sum(axis=1) - NOTHING + np.log(1 - model.missed))


def candidates(
    model: Model, lines: Lines, who: Integers, phase: Array, frame: Integers
) -> tuple[Integers, Array, Array]:
    """Segments that can be the whisker, their deviations and log densities; ``phase`` and ``frame`` of each segment."""
    x = deviations(model, lines.place[who], phase[who], frame[who])
    kept, again = near(x, lines.covariance[who], model.spread, GATE)
    return who[kept], x[kept], again


def refit(
    model: Model, lines: Lines, seen: Integers, chance: Array, phase: Array, frame: Integers, expected: Array
) -> Model:
    """Model from its lines.

    Parameters
    ----------
    model : Model
        As it was.
    lines : Lines
        All lines.
    seen, chance : (n,) arrays
        Candidates and their probabilities.
    phase, frame : (S, 2) and (S,) arrays
        Phase of the pad and frame of each segment.
    expected : (2, 3) array
        Expected gain.

    Returns
    -------
    Model
        With the prior of the pad for what few frames do not show.
    """
    clear = chance > 0.5
    seen, w = seen[clear], chance[clear]
    if w.sum() < 3:
        return model
    z, a = lines.place[seen], phase[seen]
    if model.course is not None:
        z = z - model.course[frame[seen]]
    precision = 1 / (np.diagonal(lines.covariance[seen], axis1=1, axis2=2) + np.diag(model.spread))
    lever, terms, found = expected[0], np.column_stack([np.ones(len(a)), a]), np.zeros((3, 3))
    for m in range(3):
        p = w * precision[:, m] / max(1.0, (1 + model.keep) / (1 - model.keep) / 4)
        prior = np.array([0.0, 1.0, 1.0]) / (EQUAL * lever[m]) ** 2
        left = (p[:, None] * terms).T @ terms + np.diag(prior)
        found[:, m] = np.linalg.solve(left, terms.T @ (p * z[:, m]) + prior * np.append(0.0, expected[:, m]))
    place, gain = found[0], found[1:]
    x = z - terms @ found
    # deviation without the error of the reading; never below a part of the prior
    total = np.einsum("i,ij,ik->jk", w, x, x) - 0.7 * np.einsum("i,ijk->jk", w, lines.covariance[seen])
    values, vectors = np.linalg.eigh(total)
    total = (vectors * np.maximum(values, 0)) @ vectors.T
    spread = (total + FEW * prior_spread(lever)) / (w.sum() + FEW)
    # a whisker that strays as far as its neighbours are is no longer known
    spread *= min(1.0, WIDEST * np.trace(prior_spread(lever)) / np.trace(spread))
    near = np.diff(frame[seen]) == 1
    u, v = x[:-1, 1][near], x[1:, 1][near]
    keep = float(np.clip((u @ v + 0.85 * FEW) / (np.sqrt((u @ u) * (v @ v)) + FEW), 0.5, 0.97))
    look = np.median(lines.look[seen], axis=0)
    sd = np.maximum(1.5 * np.median(np.abs(lines.look[seen] - look), axis=0), LOOK)
    span = max(int(np.ptp(frame[seen])) + 1, 1)
    missed = float(np.clip(1 - (w.sum() + 8) / (span + 10), 0.02, 0.5))
    return Model(place, gain, spread, keep, missed, look, sd, model.course)
