"""What the model alone shows for a study: Figures 2, 6A–B and 7E, of its whisker and posture."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, InputError
from vibrissa.figures.paper import fig2, fig6_model, fig7e
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities.kinds import Progress

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.store.run_state import Run
    from vibrissa.whisker import Whisker

GAP = 0.6e-3  # [m] of Figure 2: the paper's mean period
CELLS = 40  # along each axis of the map: as fine as a report shows


def model_results(
    whisker: Whisker, posture: Posture, scan: Scan, progress: Progress | None = None
) -> dict[str, xr.Dataset]:
    """Compute the figures of the model.

    Parameters
    ----------
    whisker, posture, scan
        Of the study, or of the sweep that it shows.
    progress : callable, optional
        Called with ("figures of the model", done, total).

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
    report = progress or (lambda *_: None)
    report("figures of the model", 0, len(makers))
    for done, (name, make) in enumerate(makers.items(), 1):
        try:
            results[name] = make()
        except (InputError, ConvergenceError):  # a wide gap that this posture falls into: the figure is left out
            continue
        finally:
            report("figures of the model", done, len(makers))
    return results


def model_figures(run: Run) -> dict[str, xr.Dataset]:
    """Compute the figures of the model for the surface of a study, or for the sweep that it shows.

    Parameters
    ----------
    run : Run
        ``modelled`` holds whisker, posture and scan; nothing is made where it is None.

    Returns
    -------
    dict of Datasets
        As :func:`model_results` gives them.
    """
    return {} if run.modelled is None else model_results(*run.modelled, run.progress)


def _thin(axis: Array) -> Array:
    return np.linspace(axis[0], axis[-1], CELLS)
