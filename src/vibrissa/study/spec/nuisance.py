"""The part ``[laboratory.nuisance]`` of a study: what a real sweep has and the model leaves out."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from vibrissa.study.spec.checked import refuse_outside


@dataclass(frozen=True, kw_only=True)
class Nuisance:
    """What disturbs a sweep; 0 switches each off, and off is the default.

    The paper gives no size for any of them. A real one is either measured beforehand or tried over a range.

    Attributes
    ----------
    clock, ripple, ripple_frequency, contact
        The stage's start [frames], the ripple of its speed (over the speed; its frequency [Hz]) and the standard
        deviation of ε from run to run: see :class:`vibrissa.study.sweeps.jitter.Jitter`.
    wander : float
        Standard deviation of a slow motion of the tip along the texture [m]: edges are met early or late.
    wander_time : float
        Shortest period of that motion [s].
    friction_noise : float
        Standard deviation of the coefficient of friction about its mean [1]. The base is held; the profile follows
        the friction, and the modes are driven by it as by any quasi-static motion.
    friction_corner : float
        Above this frequency [Hz] the noise's power density falls as 1/f²; below, it is flat.
    hum : float
        Amplitude of the motion of the whole whisker across the substrate at ``hum_frequency`` [m], with two
        harmonics, a half and a third as large.
    hum_frequency : float
        [Hz].
    head_drift : float
        Standard deviation of a slow motion of the whole whisker in the image, along the substrate and across it [m].
    light_drift : float
        Standard deviation of the light's level, over the level: see :class:`vibrissa.video.camera.scenery.Light`.
    drift_time : float
        Shortest period of head and light [s].
    """

    clock: float = 0.0
    ripple: float = 0.0
    ripple_frequency: float = 20.0
    contact: float = 0.0
    wander: float = 0.0
    wander_time: float = 0.2
    friction_noise: float = 0.0
    friction_corner: float = 30.0
    hum: float = 0.0
    hum_frequency: float = 50.0
    head_drift: float = 0.0
    light_drift: float = 0.0
    drift_time: float = 1.0

    def __post_init__(self) -> None:
        positive = ("ripple_frequency", "wander_time", "friction_corner", "hum_frequency", "drift_time")
        others = [field.name for field in fields(self) if field.name not in positive]
        refuse_outside(self, positive, "must be positive and finite", lambda value: 0 < value < np.inf)
        refuse_outside(self, others, "must be finite and not negative", lambda value: 0 <= value < np.inf)
