"""A line for each whisker of what was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr


def per_whisker(data: xr.Dataset) -> xr.Dataset:
    """Medians over the frames of each whisker, and its number of touches.

    Parameters
    ----------
    data : Dataset
        From :func:`vibrissa.measures.kinematics.kinematics_of`.

    Returns
    -------
    Dataset
        On (whisker); NaN where nothing was measured.
    """
    names = data.whisker_label.values
    touches: dict[str, Any] = {}
    if "touch_whisker" in data:
        touches["touches"] = np.array([int((data.touch_whisker.values == name).sum()) for name in names])
    return dataset(
        whisker=data.whisker.values,
        whisker_label=names,
        frames_measured=np.isfinite(data.whisker_angle.values).sum(axis=1),
        median_angle=_median(data.whisker_angle.values),
        median_amplitude=_median(data.whisking_amplitude.values),
        median_set_point=_median(data.set_point.values),
        median_frequency=_median(data.whisking_frequency.values),
        median_curvature=_median(data.whisker_curvature.values),
        **touches,
    )


def _median(values: Array) -> Array:
    """Median of each row over what is not NaN; NaN where all is."""
    return np.array([np.median(row[np.isfinite(row)]) if np.isfinite(row).any() else np.nan for row in values])
