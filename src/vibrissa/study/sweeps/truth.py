"""What a virtual whisker truly does: by the rod, or by the modes that the analysis assumes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError
from vibrissa.mechanics.rod.rod_scan import RodRun, drag
from vibrissa.mechanics.rod.rod_settings import USUAL_ROD
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.study.spec.laboratory import Truth
from vibrissa.study.spec.settings import Film

_RATE = 10_000.0  # records of the rod per second: cubics between them err by 1e-3 at the third resonance (1 kHz)
_BEFORE = 5e-3  # [s] before the first frame that the rod starts at rest
_BESIDE = 8  # records on either side of the times that are asked for
_MODES = 3
_HALVED = 3  # times that the step is halved where a run does not converge


@dataclass(frozen=True)
class TrueMotion(ABC):
    """The motion of a virtual whisker over the surface that it meets.

    Attributes
    ----------
    prediction : Prediction
        Whisker, posture, scan and the texture that is met; and the single-contact model's motion there.
    """

    prediction: Prediction

    @property
    @abstractmethod
    def resonances(self) -> Array:
        """True resonant frequencies [Hz], (M,)."""

    @abstractmethod
    def position(self, t: Array, s: Array) -> tuple[Array, Array]:
        """Position of the points s from the base, along the substrate and up, over L, (T, S) each.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.
        s : (S,) array
            Points of the shaft, over L; above 1 inside the follicle.

        Returns
        -------
        x, y : (T, S) arrays
            Over L.
        """

    @abstractmethod
    def mode_displacement(self, t: Array) -> Array:
        """What a movie shows of each mode, over L, (M, T).

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            Over L.
        """


class ModalMotion(TrueMotion):
    """The single-contact model's own motion: a test of the analysis alone."""

    @property
    def resonances(self) -> Array:
        """Of the pinned modes of the straight shaft [Hz], (M,)."""
        return self.prediction.omega / (2 * np.pi)

    def position(self, t: Array, s: Array) -> tuple[Array, Array]:
        """See :meth:`TrueMotion.position`."""
        return self.prediction.position(t, s)

    def mode_displacement(self, t: Array) -> Array:
        """See :meth:`TrueMotion.mode_displacement`."""
        return self.prediction.mode_displacement(t)


@dataclass(frozen=True)
class RodMotion(TrueMotion):
    """The motion of the whole shaft, from its base to its physical tip.

    Attributes
    ----------
    run : RodRun
        Recorded with the whole shaft, every 0.1 ms from 5 ms before the first frame.
    """

    run: RodRun

    @property
    def resonances(self) -> Array:
        """Of the modes of the shaft that slides on the flat, about its equilibrium [Hz], (M,)."""
        return self.run.rod.modes.kappa / (2 * np.pi * self.prediction.whisker.timescale)

    def position(self, t: Array, s: Array) -> tuple[Array, Array]:
        """See :meth:`TrueMotion.position`; inside the follicle the shaft continues straight."""
        shaft = self.run.rod.shaft.s
        x, y = self._nodes(t)
        out = np.empty((2, len(t), len(s)))
        outside = s <= 1
        for axis, nodes in enumerate((x, y)):
            curve = CubicSpline(shaft, nodes, axis=1)
            slope = curve(1.0, 1)
            out[axis][:, outside] = curve(s[outside])
            out[axis][:, ~outside] = nodes[:, -1:] + slope[:, None] * (s[~outside] - 1)
        return out[0], out[1]

    def mode_displacement(self, t: Array) -> Array:
        """See :meth:`TrueMotion.mode_displacement`."""
        return self._between(t, self.run.mode_displacement.T).T

    def _nodes(self, t: Array) -> tuple[Array, Array]:
        """Positions of the nodes from the base at rest, over L, (T, N) each."""
        at = self._between(t, self.run.record.shapes)[:, :-1]
        x, y = at[:, ::2], at[:, 1::2]
        base = self.run.record.shapes[0, -3:-1]
        return x - base[0], y - base[1]

    def _between(self, t: Array, recorded: Array) -> Array:
        """Cubic between the records about the times that are asked for, (T, K)."""
        time = self.run.time
        first = max(0, int(np.searchsorted(time, t[0])) - _BESIDE)
        some = slice(first, int(np.searchsorted(time, t[-1])) + _BESIDE)
        return np.asarray(CubicSpline(time[some], recorded[some])(t))


def true_motion(prediction: Prediction, truth: Truth, film: Film) -> TrueMotion:
    """The motion that a film shows.

    Parameters
    ----------
    prediction : Prediction
        Whisker, to its physical tip, posture, scan and the texture that is met.
    truth : {"rod", "modes"}
        Whose motion.
    film : Film
        How long it lasts.

    Returns
    -------
    TrueMotion
        From the film's first instant to its last.

    Raises
    ------
    InputError
        If the rod cannot be set up.
    ConvergenceError
        If it does not come to rest.
    """
    if truth == "modes":
        return ModalMotion(prediction)
    duration = _BEFORE + (film.n_frames + 1) / film.camera.frame_rate
    for halved in range(_HALVED):
        try:
            return RodMotion(prediction, _run(prediction, duration, USUAL_ROD.step / 2**halved))
        except ConvergenceError:  # of a whisker that is stiff for this step
            continue
    return RodMotion(prediction, _run(prediction, duration, USUAL_ROD.step / 2**_HALVED))


def _run(prediction: Prediction, duration: float, step: float) -> RodRun:
    return drag(
        prediction.whisker,
        prediction.posture,
        prediction.texture,
        speed=prediction.scan.speed,
        damping=prediction.scan.damping,
        start=-_BEFORE,
        duration=duration,
        sampling_rate=_RATE,
        n_modes=_MODES,
        settings=replace(USUAL_ROD, step=step),
        shapes=True,
    )
