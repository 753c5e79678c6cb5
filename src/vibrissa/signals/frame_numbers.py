"""Numbers of a profile's frames in its movie: the time says, also where the profile was cut."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Integers

if TYPE_CHECKING:
    import xarray as xr


def frame_numbers(profile: xr.Dataset) -> Integers:
    """Numbers of the frames of a profile in its movie, at whose first frame time is mostly 0.

    Attributes do not change where a part is selected, so that ``first_frame`` is that of the whole.

    Parameters
    ----------
    profile : Dataset
        With ``time`` [s], and ``frame_rate`` [Hz] of the movie; without it that of the times. The attribute
        ``movie_begins`` [s] is the time of the movie's first frame, where that is not 0.

    Returns
    -------
    (T,) array of int
        From 0.
    """
    time = np.asarray(profile.time.values, float)
    rate = profile.attrs.get("frame_rate", 1 / np.median(np.diff(time)) if time.size > 1 else 1.0)
    return np.rint((time - float(profile.attrs.get("movie_begins", 0.0))) * float(rate)).astype(np.int64)
