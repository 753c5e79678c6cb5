"""A prediction at sampled times, as a dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.mechanics.follicle import follicle_signals
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.superposition import Prediction

Array = NDArray[np.float64]


def predicted_signals(prediction: Prediction, t: Array, *, nodes: Array | None = None) -> xr.Dataset:
    """Signals of a prediction at times t.

    Parameters
    ----------
    prediction : Prediction
        From :func:`vibrissa.mechanics.superposition.predict`.
    t : (T,) array
        Times [s]; 0 is the moment x = 0 meets the contact.
    nodes : (N,) array, optional
        Distances from the base of points of the shaft whose motion is wanted [m].

    Returns
    -------
    Dataset
        ``excursion`` d; ``mode_amplitude`` q; ``mode_displacement`` q + Q(d), what a movie shows before its mean is
        taken away, and its ``envelope`` on an even grid; ``kappa``, ``resonant_frequency`` [Hz], ``coupling``; what
        :func:`vibrissa.mechanics.follicle.follicle_signals` gives; ``displacement`` (time, node) [m] along the normal.
    """
    scan, whisker = prediction.scan, prediction.whisker
    shown = prediction.mode_displacement(t)
    more: dict[str, Any] = dict(follicle_signals(prediction, t))
    if len(t) > 2 and np.allclose(np.diff(t), (t[-1] - t[0]) / (len(t) - 1), rtol=1e-6, atol=0):
        more["envelope"] = analytic_envelope(shown)[0]
    if nodes is not None:
        motion = prediction.displacement(t, 1 - nodes / whisker.length) * whisker.length
        more |= {"node": np.arange(len(nodes)), "arc_length": nodes, "displacement": motion}
    attrs = {"response": scan.response, "jump": scan.jump, "damping": scan.damping, "scan_speed": scan.speed}
    return dataset(
        attrs,
        time=t,
        mode=np.arange(1, len(shown) + 1),
        excursion=prediction.events.excursion(t),
        mode_amplitude=prediction.amplitudes(t),
        mode_displacement=shown,
        kappa=prediction.kappa,
        resonant_frequency=prediction.omega / (2 * np.pi),
        coupling=prediction.c,
        **more,
    )
