"""Curves traced by other programs as the dataset ``segments``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import FormatError
from vibrissa.quantities import dataset
from vibrissa.video.foreign.whisk_files import Segment, read_whiskers
from vibrissa.video.foreign.whiskiwrap import read_whiskiwrap

if TYPE_CHECKING:
    import xarray as xr


def segments_of(curves: Sequence[Segment], source: str) -> xr.Dataset:
    """The dataset ``segments`` of curves of WHISK.

    Parameters
    ----------
    curves : sequence of Segment
        In any order.
    source : str
        Name of the file.

    Returns
    -------
    Dataset
        ``segments``; width and contrast are 1 where unknown.
    """
    ordered = sorted((one for one in curves if one.x.size > 1), key=lambda one: (one.frame, one.wid))
    if not ordered:
        raise FormatError(source, "must hold a line of at least two points")
    sizes = [one.x.size for one in ordered]
    columns, rows, widths, scores = (
        np.concatenate([getattr(one, name) for one in ordered]) for name in ("x", "y", "thick", "score")
    )
    attrs = {"frames": ordered[-1].frame + 1, "width": int(columns.max()) + 1, "height": int(rows.max()) + 1}
    return dataset(
        {**attrs, "source": source},
        segment_frame=np.array([one.frame for one in ordered]),
        segment_start=np.concatenate([[0], np.cumsum(sizes)[:-1]]),
        column=columns,
        row=rows,
        line_width=np.where(np.isfinite(widths), widths, 1.0),
        line_contrast=np.where(np.isfinite(scores), scores, 1.0),
        position_sd=np.full(columns.size, np.nan),
    )


def read_segments(path: str | Path, kind: str) -> xr.Dataset:
    """The dataset ``segments`` of a file of WHISK or WhiskiWrap.

    Parameters
    ----------
    path : path
        The file.
    kind : {"WHISK", "WhiskiWrap"}
        Which program wrote it.

    Returns
    -------
    Dataset
        ``segments``.
    """
    curves = read_whiskers(path) if kind == "WHISK" else read_whiskiwrap(path)[0]
    return segments_of(curves, str(path))
