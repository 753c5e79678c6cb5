"""The whisker: a cone, its fit from measured diameters, and the measured rat whiskers."""

from vibrissa.whisker.cone import DENSITY, YOUNGS_MODULUS, Whisker
from vibrissa.whisker.diameters import WhiskerFit, from_diameters, read_diameters
from vibrissa.whisker.measured import AtlasEntry, IsolatedWhisker, atlas, atlas_whisker, isolated_whiskers

__all__ = [
    "DENSITY",
    "YOUNGS_MODULUS",
    "AtlasEntry",
    "IsolatedWhisker",
    "Whisker",
    "WhiskerFit",
    "atlas",
    "atlas_whisker",
    "from_diameters",
    "isolated_whiskers",
    "read_diameters",
]
