"""Types of arrays by what they hold, of windows in time or frequency, and records of arrays that compare by value."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]
Frames = NDArray[np.uint8] | NDArray[np.uint16]  # (T, height, width) of a movie
Window = tuple[float, float]  # start and stop, or low and high


class ByValue:
    """A frozen record that equals another of its class where all fields do, arrays too."""

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and all(map(np.array_equal, vars(self).values(), vars(other).values()))

    def __hash__(self) -> int:
        return hash((type(self), *((np.asarray(one, float) + 0.0).tobytes() for one in vars(self).values())))
