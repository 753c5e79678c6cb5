"""How whiskers are sought in a movie: the settings that tracking takes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from numpy.typing import NDArray

from vibrissa.errors import RangeError, UnknownError
from vibrissa.video.kernel.estimator_table import ESTIMATORS, Estimator

FURTHEST = 1000  # of the search [px]: its memory grows with the square


@dataclass(frozen=True, kw_only=True)
class Search:
    """How whiskers are sought in a frame.

    Rows are raw: nothing is smoothed along the whisker or over time. Where the line is sought is expected from the
    frame before, by a local quadratic over 31 columns; within ``search`` rows of that, the path of highest contrast
    (mean of three columns) is taken. A step of one row against the expectation costs it 2 standard deviations of
    the pixel noise, a distance of d rows 0.2 d². That prior chooses the line; it does not draw the row, which is
    read from nine pixels of its column.

    Attributes
    ----------
    polarity : {"dark", "bright"}
        Whether whiskers are darker or brighter than the background.
    background : "space" or (height, width) array
        The image without the whisker, or "space": estimated in every frame, by closing across 15 rows.
    columns : (int, int) or None
        First and last column that are read; None for all.
    search : int
        Largest distance of the line from where it is expected, in one column [px].
    threshold : float
        Signal to noise of the five-pixel contrast, averaged over 7 columns, below which a column is lost.
    estimator : str
        Method that places the line in a column, one of ``vibrissa.video.kernel.estimator_table.ESTIMATORS``.
    """

    polarity: Literal["dark", "bright"] = "dark"
    background: str | NDArray[Any] = "space"
    columns: tuple[int, int] | None = None
    search: int = 4
    threshold: float = 3.0
    estimator: Estimator = "matched"

    @property
    def sign(self) -> int:
        """1 for dark whiskers, −1 for bright ones."""
        return 1 if self.polarity == "dark" else -1

    def __post_init__(self) -> None:
        if self.polarity not in ("dark", "bright"):
            raise UnknownError("polarity", "must be 'dark' or 'bright'", repr(self.polarity))
        if isinstance(self.background, str) and self.background != "space":
            raise UnknownError(
                "background",
                "must be 'space' or an image without the whisker",
                repr(self.background),
                "a mean over time holds the whisker itself, and the rest is a derivative of its vibration",
            )
        if self.estimator not in ESTIMATORS:
            raise UnknownError("estimator", f"must be one of {', '.join(ESTIMATORS)}", repr(self.estimator))
        if not 1 <= self.search <= FURTHEST:
            raise RangeError("search", f"must be 1 to {FURTHEST} pixels", self.search)
        if not self.threshold > 0:
            raise RangeError("threshold", "must be positive", self.threshold)
