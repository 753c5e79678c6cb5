"""What the model alone shows for a study: Figures 2, 6A–B and 7E, of its whisker and posture."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.figures import fig2, fig6_model, fig7e
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.superposition import Scan

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.whisker import Whisker

GAP = 0.6e-3  # [m] of Figure 2: the paper's mean period
CELLS = 40  # along each axis of the map: as fine as a report shows


def model_results(whisker: Whisker, posture: Posture, scan: Scan) -> dict[str, xr.Dataset]:
    """Compute the figures of the model.

    Parameters
    ----------
    whisker, posture, scan
        Of the study, or of the sweep that it shows.

    Returns
    -------
    dict of Datasets
        ``gap`` (Figure 2), ``gaps`` (6A–B), ``gain_map`` (7E), without those that the posture cannot cross.
    """
    makers: dict[str, Callable[[], xr.Dataset]] = {
        "gap": lambda: fig2.compute(posture, whisker, GAP, scan),
        "gaps": lambda: fig6_model.compute(posture, whisker, scan, rng=np.random.default_rng(1)),
        "gain_map": lambda: fig7e.compute(whisker, contacts=_thin(fig7e.CONTACTS), base_angles=_thin(fig7e.ANGLES)),
    }
    results: dict[str, xr.Dataset] = {}
    for name, make in makers.items():
        try:
            results[name] = make()
        except (InputError, ConvergenceError):  # a wide gap that this posture falls into: the figure is left out
            continue
    return results


def _thin(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.linspace(axis[0], axis[-1], CELLS)
