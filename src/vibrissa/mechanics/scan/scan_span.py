"""How long a surface is under a whisker with a free end: from its contact until it has left the tip and all is quiet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibrissa.arrays import Array
from vibrissa.exact import cone_kappa
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

_RINGING, _LONGEST_RINGING = 7.0, 1.0  # decay times of the first mode after the last event, and [s] at most


@dataclass(frozen=True)
class SpannedScan:
    """A surface that will be drawn under a whisker, and its times.

    Attributes
    ----------
    whisker : Whisker
        The cone, to its physical tip.
    posture : Posture
        As Eq. (1) has it.
    texture : Gaps or HeightProfile
        In metres.
    scan : Scan
        Its speed and damping.
    n_modes : int
        Number of pinned modes that are fitted.
    """

    whisker: Whisker
    posture: Posture
    texture: Gaps | HeightProfile
    scan: Scan
    n_modes: int = 3

    @property
    def end(self) -> float:
        """Time at which the surface has left the free end [s]."""
        last = self.texture.end[-1] if isinstance(self.texture, Gaps) else self.texture.position[-1]
        free_end = (self.posture.contact - self.whisker.tip) * self.whisker.length
        return float(last + free_end) / self.scan.speed

    @property
    def resonances(self) -> Array:
        """Resonant frequencies of the pinned modes that are fitted [Hz], (M,)."""
        return cone_kappa(self.posture.contact, self.n_modes) / (2 * np.pi * self.whisker.timescale)

    @property
    def duration(self) -> float:
        """From time 0 until the ringing after the end has died away [s]."""
        decay = self.scan.damping * 2 * np.pi * float(self.resonances[0])
        return self.end + min(_RINGING / max(decay, 1e-300), _LONGEST_RINGING)
