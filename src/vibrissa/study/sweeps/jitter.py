"""What differs from run to run of the same sweep, and one more run."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.study.spec.checked import refuse_outside
from vibrissa.study.sweeps.nuisance import with_edges


@dataclass(frozen=True, kw_only=True)
class Jitter:
    """What differs from run to run; the noise of the pixels always does.

    The paper gives none of these. The defaults follow its set-up as far as it is described: runs are aligned by a lamp
    seen in the movie, so to the nearest frame; the rest are guesses at a stepping motor and an anaesthetised animal,
    made once and not fitted to anything. What moves with heart and breath is not modelled.

    Of a ripple it is the travel that counts, r v / 2πf. In the built-in experiment, node at 15 mm, true motion, each
    alone: correlation of a run with the mean of five 0.997 from the start, 0.9995 from the ripple, 0.9996 from the
    contact (0.002 is 0.09 mm of H); but 0.95 from the same ripple at 2 Hz.

    Attributes
    ----------
    clock : float
        Start of the scan against the frames, evenly within ± this many frames.
    ripple : float
        Amplitude of the ripple of the scanning speed, over the speed, of a phase that differs from run to run.
    ripple_frequency : float
        Its frequency [Hz].
    contact : float
        Standard deviation of the contact's position ε; the base angle is kept, so that the pad moves towards the
        substrate or away from it.
    """

    clock: float = 0.5
    ripple: float = 0.01
    ripple_frequency: float = 20.0
    contact: float = 0.002

    def __post_init__(self) -> None:
        names = ("clock", "ripple", "contact")
        refuse_outside(self, names, "must be finite and not negative", lambda value: 0 <= value < np.inf)
        rule = "must be positive and finite (Hz)"
        refuse_outside(self, ("ripple_frequency",), rule, lambda value: 0 < value < np.inf)


def run_again(prediction: Prediction, jitter: Jitter, frame_rate: float, rng: np.random.Generator) -> Prediction:
    """Predict one more run.

    The edge x is met when the stage has travelled that far, v (t − t₀) + (r v / 2πf) sin(2πft + φ) = x. To first
    order in the ripple r that is a texture with its edges moved.

    Parameters
    ----------
    prediction : Prediction
        The scan without jitter.
    jitter : Jitter
        What differs.
    frame_rate : float
        Frames per second [Hz], the measure of ``jitter.clock``.
    rng : numpy.random.Generator
        Draws start, phase and contact.

    Returns
    -------
    Prediction
        Of that run.
    """
    speed, turn = prediction.scan.speed, 2 * np.pi * jitter.ripple_frequency
    start = rng.uniform(-1, 1) * jitter.clock / frame_rate
    phase = rng.uniform(0, 2 * np.pi)
    contact = prediction.posture.contact + jitter.contact * rng.standard_normal()

    def moved(edge: Array) -> Array:
        return edge + speed * start - jitter.ripple * speed / turn * np.sin(turn * edge / speed + phase)

    posture, warped = replace(prediction.posture, contact=contact), with_edges(prediction.texture, moved)
    return predict(prediction.whisker, posture, warped, prediction.scan, n_modes=len(prediction.kappa))
