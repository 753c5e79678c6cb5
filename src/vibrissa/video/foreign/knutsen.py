"""Splines of Knutsen's WhiskerTracker (MATLAB): three points a whisker."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from vibrissa.errors import FormatError, ShapeError
from vibrissa.files import existing
from vibrissa.reader_process import tables_read_by
from vibrissa.video.foreign import knutsen_tables
from vibrissa.video.foreign.keypoints import Keypoints
from vibrissa.video.foreign.whisk_files import FURTHEST
from vibrissa.video.tracking import Calibration

POINTS = ["base", "middle", "tip"]


def read_knutsen(path: str | Path) -> tuple[Keypoints, Calibration | None]:
    """Spline points of a WhiskerTracker ``.mat`` file (before version 7.3), and its calibration.

    ``g_tMovieInfo.SplinePoints`` is 3 points × (x, y) × frames × whiskers. MATLAB counts pixels from 1, so 1 is taken
    from x and y; points at 0, 0 are those never set, hence NaN.

    Parameters
    ----------
    path : path
        The file.

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
    if existing(path).read_bytes()[:10] == b"MATLAB 7.3":
        raise FormatError(str(path), "must be a MATLAB file before version 7.3", remedy="save it with -v7")
    rule = "must be a MATLAB file with numbers in g_tMovieInfo.SplinePoints"
    tables = tables_read_by(knutsen_tables.__name__, Path(path), rule)
    splines = tables["splines"]
    splines = splines.reshape(*splines.shape, *(1,) * (4 - splines.ndim)) if splines.ndim in (2, 3) else splines
    if splines.ndim != 4 or splines.shape[:2] != (3, 2) or not splines.size:
        rule = "must hold 3 points × (x, y) × frames × whiskers in SplinePoints"
        raise ShapeError(str(path), rule, f"shape {splines.shape}")
    if np.isinf(splines).any() or np.nanmax(np.abs(splines), initial=0) > FURTHEST:
        raise FormatError(str(path), f"must have coordinates below {FURTHEST:g} px", remedy="the file is damaged")
    unset = np.all(splines == 0, axis=1, keepdims=True)
    x, y = np.where(unset, np.nan, splines - 1).transpose(1, 3, 2, 0)
    return Keypoints(POINTS, x, y, np.full(x.shape, np.nan)), _calibration(tables)


def _calibration(tables: Mapping[str, np.ndarray]) -> Calibration | None:
    rate, per_mm = (float(tables[name]) for name in ("FramesPerSecond", "PixelsPerMM"))
    if not (np.isfinite(rate) and np.isfinite(per_mm) and rate > 0 and per_mm > 0):
        return None
    return Calibration(frame_rate=rate, pixel_size=1e-3 / per_mm)
