"""Line segments of a movie linked to whiskers: what the dataset ``identity`` has besides the segments."""

from __future__ import annotations

from vibrissa.quantities.quantity import Quantity

SURE = 0.7  # probability from which on a line is called a whisker's, unless asked otherwise
IDENTITY: dict[str, Quantity] = {
    "segment_whisker": Quantity(("segment",), "1", "whisker of the segment, −1 for none"),
    "segment_other": Quantity(("segment",), "1", "another whisker that runs along the same line, −1 for none"),
    "segment_probability": Quantity(("segment",), "1", "probability that the segment is that whisker's"),
    "whisker_segment": Quantity(("whisker", "time"), "1", "main segment of the whisker, −1 where it is lost"),
    "whisker_probability": Quantity(("whisker", "time"), "1", "probability that the segment is the whisker's"),
    "lost_reason": Quantity(("whisker", "time"), "1", "why the whisker is lost, 0 where it is followed"),
    "identity_probability": Quantity(("whisker",), "1", "mean probability over the frames with a segment"),
}
