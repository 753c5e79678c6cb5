"""How long a surface is under a whisker with a free end: until it has left the tip and the ringing is over."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.exact import cone_kappa
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr

GAP_RATE = 20e3  # [Hz] at which one gap is sampled
_RINGING, _LONGEST_RINGING = 7.0, 1.0  # decay times of mode 1 after the surface: to a thousandth; and [s] at most


@dataclass(frozen=True)
class SpannedScan:
    """A surface that will be drawn under a whisker, and its times.

    Attributes
    ----------
    whisker : Whisker
        The cone, to its physical tip.
    posture : Posture
        On the flat; the base is held at the height and angle of Eq. (1).
    texture : Gaps or HeightProfile
        In metres.
    scan : Scan
        Its speed and damping; the forms of the single-contact model do not count.
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
        return scan_duration(self.end, self.scan.damping * 2 * np.pi * float(self.resonances[0]))


def scan_duration(end: float, decay: float) -> float:
    """From time 0 until the ringing after the surface has died away.

    Parameters
    ----------
    end : float
        When the surface has passed [s].
    decay : float
        Rate ζω at which mode 1 decays [1/s].

    Returns
    -------
    float
        [s]. At most one second later: without damping it would never end.

    Raises
    ------
    InputError
        If the surface has passed before time 0.
    """
    if not end >= 0:
        remedy = "add to its positions: the contact is at position 0 at time 0"
        raise RangeError("surface", "must not have passed before time 0", f"its end at {end:.4g} s", remedy)
    return end + min(_RINGING / max(decay, 1e-300), _LONGEST_RINGING)


def with_largest(data: xr.Dataset) -> xr.Dataset:
    """A scan with the largest displacement of each mode.

    Parameters
    ----------
    data : Dataset
        With ``mode_displacement`` (mode, time).

    Returns
    -------
    Dataset
        With ``largest_mode_displacement`` (mode), the largest |q + Q| over L.
    """
    largest = np.abs(data.mode_displacement.to_numpy()).max(axis=1)
    return data.merge(dataset(mode=data.mode.to_numpy(), largest_mode_displacement=largest), combine_attrs="override")
