"""The part ``[cortex]`` of a study: a simulated population at the stimulator."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vibrissa.errors import RangeError
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.neural.simulated.population import Counts
from vibrissa.study.spec.checked import refuse_outside
from vibrissa.whisker import DAMPING, Whisker

LEAD = 0.05  # [s] left out at both ends of a texture, where the whisker meets and leaves it
MOST = 10_000  # trials, or textures


@dataclass(frozen=True, kw_only=True)
class Cortex:
    """A simulated population that the 24-whisker stimulator drives with a whisker's motion on textures.

    As in the paper's Methods, textures are scanned, the motion near the base is read, filtered to the stimulator's
    band, joined into a loop of 10 s and given to 24 whiskers with delays. The whisker is a long one, whose first mode
    lies within the band. The units are drawn with the paper's counts, thresholds and slopes: their results test
    the analysis, not the brain.

    Attributes
    ----------
    counts : {"results", "methods"}
        Which of the paper's two counts of units: 170 single and 344 multi-units, or 143 and 289.
    every : int
        Every n-th unit of these is recorded; 1 for all.
    n_trials : int
        Presentations; the paper's 40 to 100.
    n_textures : int
        Textures that are scanned one after the other.
    whisker : Whisker
        The whisker whose motion is replayed.
    posture : Posture
        How it touches the textures.
    scan : Scan
        How they are drawn past it.
    distance : float
        From the base to where the motion is read [m].
    grating_length : float
        Length of a texture [m].
    sampling_rate : float
        Of the command [Hz].
    mean_envelope : float
        Mean envelope to which the command is scaled [m]: chosen, since the paper prints no amplitude.
    bin_width : float
        Width of the bins [s].
    texture_seed : int
        Of the textures.
    population_seed : int
        Of who the units are.
    spike_seed : int
        Of their spikes.
    """

    counts: Counts = "results"
    every: int = 1
    n_trials: int = 100
    n_textures: int = 3
    whisker: Whisker = field(default_factory=lambda: Whisker(length=0.055, cone_angle=1.2e-3, tip=0.05))
    posture: Posture = field(default_factory=lambda: Posture(contact=0.29, base_angle=1.2))
    scan: Scan = field(default_factory=lambda: Scan(speed=0.1, damping=DAMPING))
    distance: float = 5e-3
    grating_length: float = 0.36
    sampling_rate: float = 4000.0
    mean_envelope: float = 55e-6
    bin_width: float = 0.01
    texture_seed: int = 1
    population_seed: int = 2
    spike_seed: int = 3

    def __post_init__(self) -> None:
        sizes, seeds = (
            ("mean_envelope", "sampling_rate", "bin_width"),
            ("texture_seed", "population_seed", "spike_seed"),
        )
        few = f"must be 1 to {MOST:,}"
        refuse_outside(self, ("every", "n_trials", "n_textures"), few, lambda value: 1 <= value <= MOST)
        refuse_outside(self, sizes, "must be positive", lambda value: 0 < value < np.inf)
        refuse_outside(self, seeds, "must be zero or positive", lambda value: value >= 0)
        if not 0 < self.distance < self.whisker.length:
            raise RangeError("Cortex.distance", "must lie on the whisker (m)", self.distance)
        if not self.grating_length > 2 * LEAD * self.scan.speed:
            rule = f"must be longer than what passes in {2 * LEAD:g} s"
            raise RangeError("Cortex.grating_length", rule, self.grating_length)
