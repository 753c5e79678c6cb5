"""Lines of text as pixels, for the frames of a movie."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array

TEXT = 12  # height of the text [px]
LETTER = round(0.62 * TEXT)  # width of a letter [px]


def text_strip(text: str, width: int, ink: tuple[int, ...]) -> NDArray[np.uint8]:
    """A line of text on black.

    Parameters
    ----------
    text : str
        What does not fit is cut off.
    width : int
        Of the strip [px].
    ink : (red, green, blue)
        Colour of the text, 0 to 255.

    Returns
    -------
    (height, width, 3) array
        Picture.
    """
    strip = np.zeros((TEXT + 6, width, 3), np.uint8)
    at = 6
    for letter in text:
        mask = _glyph(letter)
        if at + mask.shape[1] > width:
            break
        strip[:, at : at + mask.shape[1]] = (mask[..., None] * np.array(ink, float)).astype(np.uint8)
        at += mask.shape[1]
    return strip


@cache
def _glyph(letter: str) -> Array:
    """A letter of a fixed-width face, 0 to 1, in a box of the strip's height."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    height, width = TEXT + 6, LETTER
    figure = Figure(figsize=(width / 100, height / 100), dpi=100)
    figure.text(0, 0.3, letter, family="DejaVu Sans Mono", fontsize=TEXT * 0.72)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    return 1 - np.asarray(canvas.buffer_rgba())[:height, :width, 0] / 255  # type: ignore[no-untyped-call]
