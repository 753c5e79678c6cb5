"""How large the paper's mean rms of mode 1, 2.64e-3 (Fig. 7D), is on the whisker: at the antinode and near the base."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.study.paper.sweep_measures import MeasuredNumber, column, mean, whiskers_of

if TYPE_CHECKING:
    import xarray as xr

Norm = Literal["orthonormal", "unit-antinode"]

NEAR_BASE = 5e-3  # [m] from the base: where the paper reads the motion that it replays
_POINTS = 2001  # of the shaft: the antinode's height to 1e-6 of itself


class Amplitude(NamedTuple):
    """Displacement of mode 1 [m]: rms at its antinode, and mean envelope near the base."""

    antinode: float
    near_base: float


def amplitude(rms: float, contact: float, length: float, norm: Norm = "orthonormal") -> Amplitude:
    """Displacement that an rms of the first mode's amplitude q₁ means.

    The rms of q₁V₁ at the antinode is rms · max V₁ · L. The envelope of a narrow-band Gaussian motion of rms σ has the
    mean σ√(π/2). The base angle does not enter, since the modes are those of the straight shaft.

    Parameters
    ----------
    rms : float
        Root mean square of q₁, over L.
    contact : float
        ε, over L.
    length : float
        L [m].
    norm : {"orthonormal", "unit-antinode"}
        What scales V₁: ∫ s² V₁² ds = 1, as Eq. 14 takes it; or max V₁ = 1.

    Returns
    -------
    Amplitude
        In metres.

    Examples
    --------
    >>> [round(1e6 * one) for one in amplitude(2.64e-3, 0.29, 0.04)]
    [376, 47]
    >>> [round(1e6 * one) for one in amplitude(2.64e-3, 0.29, 0.04, "unit-antinode")]
    [106, 13]
    """
    top, place = _antinode(contact), np.array([1 - NEAR_BASE / length])
    near = float(np.abs(cone_modes(cone_kappa(contact, 1), contact, place)[0, 0]))
    scale = rms * length / (top if norm == "unit-antinode" else 1.0)
    return Amplitude(scale * top, scale * near * float(np.sqrt(np.pi / 2)))


@lru_cache(maxsize=10_000)
def _antinode(contact: float) -> float:
    """Largest V₁ along the shaft, V₁ orthonormal under s²."""
    shaft = np.linspace(contact, 1, _POINTS)
    return float(np.abs(cone_modes(cone_kappa(contact, 1), contact, shaft)[0]).max())


def amplitude_here(part: Literal["antinode", "near_base"], sweeps: xr.Dataset) -> MeasuredNumber:
    """Mean over sweeps of the same, each by its own ε and L.

    Parameters
    ----------
    part : {"antinode", "near_base"}
        Which displacement.
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    MeasuredNumber
        The number and its interval, or a note why there is none.
    """
    rows = zip(column(sweeps, "mode_rms", 1), column(sweeps, "contact"), column(sweeps, "length"), strict=True)
    found = [getattr(amplitude(*row), part) if 0 < row[1] < 1 else np.nan for row in rows]
    return mean(np.array(found), whiskers_of(sweeps))
