"""The whole forward chain: from a texture to the spikes of a population."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, RangeError, give_in
from vibrissa.mechanics.scan.sampled import node_distances, sampling_times
from vibrissa.neural.simulated.driven import fire
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.spec.textures import predict_surface
from vibrissa.texture.surface import Gaps

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.free_end.free_end_prediction import FreeEndPrediction
    from vibrissa.mechanics.rod.rod_prediction import RodPrediction
    from vibrissa.mechanics.scan.motion import PredictedMotion
    from vibrissa.mechanics.scan.scan_settings import Scan
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.texture.relief import HeightProfile
    from vibrissa.whisker import Whisker

SELDOM = 0.01  # share of the time above its threshold below which a unit carries next to no information


@dataclass(frozen=True, kw_only=True)
class TrialSettings:
    """How units meet the motion of a whisker.

    Attributes
    ----------
    n_trials : int
        Repeats of the scan.
    seed : int
        Seed of the spikes.
    distance : float
        Distance from the base of the point of the shaft whose envelope drives the units [m].
    mean_envelope : float, optional
        Scale the motion so that its mean envelope is this [m], as a stimulator may; as predicted where not given.
    """

    n_trials: int = 40
    seed: int = 0
    distance: float = 5e-3
    mean_envelope: float | None = None

    def __post_init__(self) -> None:
        if self.n_trials < 1:
            raise RangeError("trials", "must be at least 1", self.n_trials)
        if self.seed < 0:
            raise RangeError("seed", "must be zero or positive", self.seed)
        if self.mean_envelope is not None and not 0 < self.mean_envelope <= 0.01:
            remedy = give_in("m", self.mean_envelope, "µm", 1e-6) if self.mean_envelope > 0 else ""
            raise RangeError("mean envelope", "must be above 0 and at most 0.01 m", self.mean_envelope, remedy)

    def scaling(self, motion: Array) -> float:
        """Factor that gives a motion the mean envelope asked for.

        Parameters
        ----------
        motion : (T,) array
            Displacement of the point, on an even grid [m].

        Returns
        -------
        float
            1 where none is asked for.

        Raises
        ------
        InputError
            If the motion is to be scaled but nothing moves.
        """
        if self.mean_envelope is None:
            return 1.0
        found = float(analytic_envelope(motion)[0].mean())
        if not found > 0:
            raise ConflictError("mean envelope", "must be left out where nothing moves", self.mean_envelope)
        return self.mean_envelope / found


def forward(
    texture: Gaps | HeightProfile,
    whisker: Whisker,
    posture: Posture,
    scan: Scan,
    units: xr.Dataset,
    how: TrialSettings = TrialSettings(),
    *,
    sampling_rate: float = 20000.0,
    n_modes: int = 3,
) -> xr.Dataset:
    """From a texture to the spikes of a population, in one call.

    Parameters
    ----------
    texture : Gaps or HeightProfile
        Gaps, or any heights along the scan.
    whisker, posture, scan
        As :func:`vibrissa.mechanics.scan.texture_prediction.predict` takes them.
    units : Dataset
        From :func:`vibrissa.neural.simulated.driven.draw_driven` or
        :func:`~vibrissa.neural.simulated.driven.read_driven`.
    how : TrialSettings, optional
        Point of the shaft, trials, seed.
    sampling_rate : float
        Of motion and rates [Hz].
    n_modes : int
        Modes of the vibration.

    Returns
    -------
    Dataset
        See :func:`spikes_of`.

    Raises
    ------
    InputError
        As the prediction and :func:`spikes_of` do.
    """
    prediction = predict_surface(whisker, posture, texture, scan, n_modes=n_modes)
    return spikes_of(prediction, sampling_times(prediction, sampling_rate), units, how)


def spikes_of(
    prediction: PredictedMotion | RodPrediction | FreeEndPrediction,
    time: Array,
    units: xr.Dataset,
    how: TrialSettings = TrialSettings(),
) -> xr.Dataset:
    """Spikes of units driven by a predicted motion near the base.

    Parameters
    ----------
    prediction : PredictedMotion, RodPrediction or FreeEndPrediction
        Of gaps or of a relief.
    time : (T,) array
        Even grid of one presentation [s].
    units, how
        As in :func:`forward`.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.simulated.driven.fire`; attributes ``distance`` [m] and ``motion_scale``.

    Raises
    ------
    InputError
        If the point is not on the whisker, or the motion is to be scaled but nothing moves.
    """
    point = node_distances(prediction.whisker, [how.distance])
    assert point is not None
    length = prediction.whisker.length
    motion = prediction.displacement(time, 1 - point / length)[:, 0] * length
    scale = how.scaling(motion)
    spikes = fire(units, time, scale * motion, how.n_trials, seed=how.seed)
    return spikes.assign_attrs(distance=how.distance, motion_scale=scale)


def remarks(spikes: xr.Dataset) -> list[str]:
    """What a reader should know: how strong the envelope is beside the units' thresholds.

    Parameters
    ----------
    spikes : Dataset
        From :func:`spikes_of`.

    Returns
    -------
    list of str
        One for each line.
    """
    low, middle, high = 1e6 * np.percentile(spikes.point_envelope, [5, 50, 95])
    silent = int((spikes.time_above_threshold.values < SELDOM).sum())
    lines = [
        f"the envelope {1e3 * spikes.attrs['distance']:g} mm from the base has a median of {middle:.3g} µm, "
        f"{low:.3g} to {high:.3g} µm in 90 % of the time"
    ]
    if silent:
        share = f"less than {SELDOM:.0%} of the time".replace("%", " %")
        lines[0] += f"; the thresholds of {silent} of {spikes.sizes['unit']} units are exceeded in {share}"
    return lines
