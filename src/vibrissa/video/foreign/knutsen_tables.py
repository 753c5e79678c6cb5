"""Numbers of a WhiskerTracker file, read in a separate process; its imports are few, so that it starts at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from vibrissa.reader_process import write_tables


def _tables(path: Path) -> dict[str, Any]:
    """Give the spline points and the two numbers of the calibration."""
    info = loadmat(path, squeeze_me=False)["g_tMovieInfo"][0, 0]
    splines = np.asarray(info["SplinePoints"], float)
    return {"splines": splines, **{name: _number(info, name) for name in ("FramesPerSecond", "PixelsPerMM")}}


def _number(info: Any, name: str) -> float:
    """One number of the structure, NaN if it is not there or none."""
    value = np.ravel(info[name]) if name in (info.dtype.names or ()) else np.empty(0)
    return float(value[0]) if value.size == 1 and value.dtype.kind in "fiu" else float("nan")


if __name__ == "__main__":
    write_tables(_tables)
