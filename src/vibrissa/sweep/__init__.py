"""Parameter sweeps on all cores, or on a Dask cluster: maps of the transduction gain over the context of a scan.

Internal: the public names are those of ``vibrissa`` itself.
"""

from vibrissa.sweep.engine import Engine
from vibrissa.sweep.gratings import Gratings
from vibrissa.sweep.grid import Grid, Measure
from vibrissa.sweep.maps import REASONS, sweep

__all__ = ["REASONS", "Engine", "Gratings", "Grid", "Measure", "sweep"]
