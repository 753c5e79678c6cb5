"""Line segments found in the frames of a movie, before they are linked to whiskers.

The dataset ``segments`` is ragged: the points of all segments follow one another along ``point``, those of one
segment in order along its line, about a pixel apart; ``segment_start`` says where each begins. Segments are in the
order of their frames. Attributes: ``frames`` (number of frames that were searched), ``width`` and ``height`` of the
movie [pixels], ``source`` (the movie or file).
"""

from __future__ import annotations

from vibrissa.quantities.quantity import Quantity

SEGMENTS: dict[str, Quantity] = {
    "segment_frame": Quantity(("segment",), "1", "frame of the movie, from 0"),
    "segment_start": Quantity(("segment",), "1", "index of the first point of the segment"),
    "column": Quantity(("point",), "1", "column of the centreline, 0 in the middle of the first pixel [pixel]"),
    "row": Quantity(("point",), "1", "row of the centreline, 0 in the middle of the first pixel, downward [pixel]"),
    "line_width": Quantity(("point",), "1", "full width of the line at half of its depth [pixel]"),
    "line_contrast": Quantity(("point",), "1", "depth of the line against its two sides [grey level]"),
    "position_sd": Quantity(
        ("point",), "1", "standard deviation of the position across the line, in one frame [pixel]"
    ),
}
