"""A prediction at sampled times, as a dataset."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, give_in
from vibrissa.limits import require_samples
from vibrissa.mechanics.scan.diagnostics import diagnostics, relief_diagnostics
from vibrissa.mechanics.scan.follicle import follicle_signals
from vibrissa.mechanics.scan.motion import PredictedMotion
from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction, free_end_depth
from vibrissa.mechanics.scan.scan_span import scan_duration
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.mechanics.scan.verdict import verdict
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr


Predicted: TypeAlias = Prediction | ReliefPrediction


def predicted_signals(prediction: PredictedMotion, t: Array, *, nodes: Array | None = None) -> xr.Dataset:
    """Signals of a prediction at times t.

    Parameters
    ----------
    prediction : Prediction
        From :func:`vibrissa.mechanics.scan.texture_prediction.predict`.
    t : (T,) array
        Times [s]; 0 is the moment x = 0 meets the contact.
    nodes : (N,) array, optional
        Distances from the base of points of the shaft whose motion is wanted [m].

    Returns
    -------
    Dataset
        ``excursion`` d; ``mode_amplitude`` q; ``mode_displacement`` q + Q(d), what a movie shows before its mean is
        taken away, and its ``envelope`` [m] on an even grid of 4 times or more; ``kappa``, ``resonant_frequency`` [Hz],
        ``coupling``; what :func:`vibrissa.mechanics.scan.follicle.follicle_signals` gives; ``displacement`` (time,
        node) [m] along the normal.
    """
    scan, whisker = prediction.scan, prediction.whisker
    shown = prediction.mode_displacement(t)
    more: dict[str, Any] = dict(follicle_signals(prediction, t))
    if len(t) > 3 and np.allclose(np.diff(t), (t[-1] - t[0]) / (len(t) - 1), rtol=1e-6, atol=0):
        more["envelope"] = whisker.length * analytic_envelope(shown)[0]
    if nodes is not None:
        motion = prediction.displacement(t, 1 - nodes / whisker.length) * whisker.length
        more |= {"node": np.arange(len(nodes)), "arc_length": nodes, "displacement": motion}
    posture = prediction.posture
    attrs = {
        "response": scan.response,
        "jump": scan.jump,
        "modes": scan.modes,
        "damping": scan.damping,
        "scan_speed": scan.speed,
        "contact": posture.contact,
        "base_angle": posture.base_angle,
        **posture.friction_attributes,
        **whisker.attributes,
        **prediction.surface,
    }
    return dataset(
        attrs,
        time=t,
        mode=np.arange(1, len(shown) + 1),
        excursion=prediction.excursion(t),
        mode_amplitude=prediction.amplitudes(t),
        mode_displacement=shown,
        mode_sd=shown.std(axis=1),
        kappa=prediction.kappa,
        resonant_frequency=prediction.omega / (2 * np.pi),
        coupling=prediction.c,
        **more,
    )


def scanned(prediction: Prediction, sampling_rate: float, *, nodes: Sequence[float] | None = None) -> xr.Dataset:
    """The whole scan, from time 0 until the ringing after the last gap has died away, with its diagnostics.

    Parameters
    ----------
    prediction : Prediction
        From :func:`vibrissa.mechanics.scan.texture_prediction.predict`.
    sampling_rate : float
        [Hz].
    nodes : sequence of float, optional
        Distances from the base of points whose motion is wanted [m].

    Returns
    -------
    Dataset
        :func:`predicted_signals` and :func:`vibrissa.mechanics.scan.diagnostics.diagnostics`; as the attribute
        ``verdict`` what :func:`vibrissa.mechanics.scan.verdict.verdict` says of them.

    Raises
    ------
    InputError
        If the sampling rate is not positive or the record too long, or a node is not on the whisker.
    """
    t = sampling_times(prediction, sampling_rate)
    signals = predicted_signals(prediction, t, nodes=node_distances(prediction.whisker, nodes))
    return _judged(signals.merge(diagnostics(prediction, t), combine_attrs="override"))


def scanned_relief(
    prediction: ReliefPrediction, sampling_rate: float, *, nodes: Sequence[float] | None = None
) -> xr.Dataset:
    """The whole scan of a relief, from time 0 until the ringing after its end has died away.

    Parameters
    ----------
    prediction : ReliefPrediction
        From :func:`vibrissa.mechanics.scan.relief_prediction.predict_relief`.
    sampling_rate : float
        [Hz].
    nodes : sequence of float, optional
        Distances from the base of points whose motion is wanted [m].

    Returns
    -------
    Dataset
        As :func:`predicted_signals`; ``contact_ground``, ``contact_rise`` (time):
        place X and height z of the contact [m]; ``free_end_depth`` (time) [m]: how deep the straight free end lies
        below the ground at worst, which is not resolved; what
        :func:`vibrissa.mechanics.scan.diagnostics.relief_diagnostics` gives; attributes ``sticks``, ``glides``,
        ``jumps``.

    Raises
    ------
    InputError
        If the sampling rate is not positive or the record too long, or a node is not on the whisker.
    """
    t = sampling_times(prediction, sampling_rate)
    signals = predicted_signals(prediction, t, nodes=node_distances(prediction.whisker, nodes))
    _, z, place = prediction.contact(t)
    length, counts = prediction.whisker.length, prediction.episodes.counts
    extra = dataset(
        {f"{kind}s": count for kind, count in counts.items()},
        time=t,
        contact_ground=place * length,
        contact_rise=z * length,
        free_end_depth=free_end_depth(prediction, t),
    )
    judged = relief_diagnostics(prediction, t)
    whole = signals.merge(extra, combine_attrs="no_conflicts")
    return _judged(whole.merge(judged, combine_attrs="override"))


def _judged(data: xr.Dataset) -> xr.Dataset:
    """With the attribute ``verdict``."""
    return data.assign_attrs(verdict=verdict(data))


def sampling_times(prediction: PredictedMotion, sampling_rate: float) -> Array:
    """Times from 0 until the ringing after the contact's last event has died away [s].

    Parameters
    ----------
    prediction : PredictedMotion
        Any prediction.
    sampling_rate : float
        [Hz].

    Returns
    -------
    (T,) array
        Times [s].

    Raises
    ------
    InputError
        If the sampling rate is not positive or the record too long.
    """
    if not (sampling_rate > 0 and np.isfinite(sampling_rate)):
        raise RangeError("sampling_rate", "must be positive (Hz)", sampling_rate)
    end = scan_duration(prediction.end, prediction.scan.damping * float(prediction.omega[0]))
    require_samples("scan", end, sampling_rate)
    return np.arange(int(np.floor(end * sampling_rate)) + 1) / sampling_rate


def node_distances(whisker: Whisker, nodes: Sequence[float] | None) -> Array | None:
    """Distances from the base of points of the shaft [m], checked to lie on it.

    Parameters
    ----------
    whisker : Whisker
        Gives the length.
    nodes : sequence of float, optional
        Distances [m].

    Returns
    -------
    (N,) array or None
        The same, if any.

    Raises
    ------
    InputError
        If one is not on the whisker.
    """
    if nodes is None:
        return None
    points, longest = np.asarray(nodes, float), (1 - whisker.tip) * whisker.length
    if not np.all((points >= 0) & (points <= longest)):
        largest = float(points.max(initial=0.0))
        remedy = give_in("m", largest, "mm", 1e-3) if longest < largest <= 1e3 * longest else ""
        raise RangeError("node", f"must lie on the whisker, 0 to {longest:.4g} m from the base", str(nodes), remedy)
    return points
