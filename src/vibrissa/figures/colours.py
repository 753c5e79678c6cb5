"""The colours of the figures: one colour has one meaning in all of them, safe for the colour-blind (Okabe and Ito)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MEASURED = FOUND = "#0072B2"  # what was measured or found
TRUTH = "0.72"  # what was put into a simulation: it lies behind, broad and pale
FITTED = OTHER = "#D55E00"  # a curve that was fitted
PREDICTED = "#009E73"  # what the model predicts from the texture
SINGLE, MULTI = "#CC79A7", "#E69F00"  # firing of single units, of multi-units
ENVELOPE = "black"  # of a measured motion
PAPER = "0.25"  # a number that the paper prints
LAND, GAP = "0.45", "0.9"  # of a texture
KINDS = ("#332288", "#56B4E9", "#882255", "#999933", "#44AA99", "#DDCC77")  # codes, drives, states: side by side
DOUBTFUL = "#8FBBD9"  # found, but not surely
ON_PICTURE = ("#56B4E9", "#E69F00", "#009E73", "#CC79A7", "#F0E442", "#D55E00")  # lines over a grey photograph
OF_QUALITY = {"SU": SINGLE, "MU": MULTI}
_DARKEST, _PALEST = 0.0, 0.8  # of the map of an ordered quantity


def ordered(count: int) -> list[str]:
    """Colours of an ordered quantity, dark to pale: modes, widths, instants.

    Parameters
    ----------
    count : int
        How many.

    Returns
    -------
    list of str
        One for each.
    """
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](place)) for place in np.linspace(_DARKEST, _PALEST, count)]


def rgb(whisker: int) -> NDArray[np.uint8]:
    """Colour of a whisker on a picture.

    Parameters
    ----------
    whisker : int
        Its number.

    Returns
    -------
    (3,) array of uint8
        Red, green and blue.
    """
    return np.frombuffer(bytes.fromhex(ON_PICTURE[whisker % len(ON_PICTURE)][1:]), np.uint8)
