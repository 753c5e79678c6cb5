"""Types of results and of what reports progress, which many rooms name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import xarray as xr

Datasets = dict[str, "xr.Dataset"]  # results by name, to be added to
Results = Mapping[str, "xr.Dataset"]  # results by name, to be read
Series = Callable[[int], "xr.Dataset"]  # number of a sweep → its time series
Method = Literal["auto", "follow", "link"]  # how whiskers are tracked in a movie
Progress = Callable[[str, int, int], None]  # called with (stage, done, total); total 0 where it is not known
