"""Splines of Knutsen's WhiskerTracker (MATLAB): three points a whisker."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vibrissa.errors import InputError
from vibrissa.video.keypoints import Keypoints
from vibrissa.video.tracking import Calibration
from vibrissa.video.whisk_files import FURTHEST, existing

POINTS = ["base", "middle", "tip"]


def read_knutsen(path: str | Path) -> tuple[Keypoints, Calibration | None]:
    """Spline points of a WhiskerTracker ``.mat`` file (before version 7.3), and its calibration.

    ``g_tMovieInfo.SplinePoints`` is 3 points × (x, y) × frames × whiskers. MATLAB counts pixels from 1, so 1 is taken
    from x and y; points at 0, 0 are those never set, hence NaN.

    Returns
    -------
    points : Keypoints
        An individual for each whisker, keypoints ``base``, ``middle``, ``tip`` in the order of the file.
    calibration : Calibration or None
        From ``FramesPerSecond`` and ``PixelsPerMM``; None unless both are there and positive.

    Raises
    ------
    InputError
        If the file is missing, no MATLAB file or of version 7.3, or has no such points.
    """
    from scipy.io import loadmat

    if existing(path).read_bytes()[:10] == b"MATLAB 7.3":
        raise InputError(str(path), "must be a MATLAB file before version 7.3", remedy="save it with -v7")
    try:
        info = loadmat(Path(path), squeeze_me=False)["g_tMovieInfo"][0, 0]
        splines = np.asarray(info["SplinePoints"], float)
    except Exception as error:  # whatever scipy raises on a damaged file
        rule = "must be a MATLAB file with numbers in g_tMovieInfo.SplinePoints"
        raise InputError(str(path), rule, remedy=(str(error) or type(error).__name__).splitlines()[0]) from error
    splines = splines.reshape(*splines.shape, *(1,) * (4 - splines.ndim)) if splines.ndim in (2, 3) else splines
    if splines.ndim != 4 or splines.shape[:2] != (3, 2) or not splines.size:
        rule = "must hold 3 points × (x, y) × frames × whiskers in SplinePoints"
        raise InputError(str(path), rule, f"shape {splines.shape}")
    if np.isinf(splines).any() or np.nanmax(np.abs(splines), initial=0) > FURTHEST:
        raise InputError(str(path), f"must have coordinates below {FURTHEST:g} px", remedy="the file is damaged")
    unset = np.all(splines == 0, axis=1, keepdims=True)
    x, y = np.where(unset, np.nan, splines - 1).transpose(1, 3, 2, 0)
    return Keypoints(POINTS, x, y, np.full(x.shape, np.nan)), _calibration(info)


def _calibration(info: Any) -> Calibration | None:
    rate, per_mm = (_number(info, name) for name in ("FramesPerSecond", "PixelsPerMM"))
    if not (np.isfinite(rate) and np.isfinite(per_mm) and rate > 0 and per_mm > 0):
        return None
    return Calibration(frame_rate=rate, pixel_size=1e-3 / per_mm)


def _number(info: Any, name: str) -> float:
    """One number of the structure, NaN if it is not there or none."""
    value = np.ravel(info[name]) if name in (info.dtype.names or ()) else np.empty(0)
    return float(value[0]) if value.size == 1 and value.dtype.kind in "fiu" else float("nan")
