"""Types of arrays by what they hold, and of windows in time or frequency."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]
Frames = NDArray[np.uint8] | NDArray[np.uint16]  # (T, height, width) of a movie
Window = tuple[float, float]  # start and stop, or low and high
