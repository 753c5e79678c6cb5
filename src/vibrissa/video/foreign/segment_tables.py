"""Curves traced by other programs as the dataset ``segments``, and linked segments as a profile."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.errors import FormatError
from vibrissa.quantities import dataset
from vibrissa.video.foreign.traces import Trace, profile_of
from vibrissa.video.foreign.whisk_files import Segment, read_whiskers
from vibrissa.video.foreign.whiskiwrap import read_whiskiwrap
from vibrissa.video.link.identities import SURE
from vibrissa.video.link.whisker_linking import Linking
from vibrissa.video.tracking import Calibration

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


def profile_from_linking(
    linking: Linking,
    calibration: Calibration,
    *,
    source: str,
    node_spacing: float | None = None,
    skin: Sequence[tuple[float, float]] | None = None,
    least_probability: float = SURE,
    attrs: dict[str, Any] | None = None,
) -> xr.Dataset:
    """Profile of the whiskers that segments were linked to.

    The pieces of a whisker in a frame are joined. Lines that two whiskers share are left out for both.

    Parameters
    ----------
    linking : Linking
        Of the segments.
    calibration : Calibration
        Frame rate and pixel size.
    source : str
        Name of the movie or file, for errors.
    node_spacing, skin
        See :func:`vibrissa.video.foreign.traces.profile_of`.
    least_probability : float
        Segments less probable are left out.
    attrs : dict, optional
        Further attributes.

    Returns
    -------
    Dataset
        ``profile``; the attribute ``identity_probability`` is JSON: of each whisker.
    """
    identity = linking.identity()
    whisker, sure = identity.segment_whisker.values, identity.segment_probability.values
    use = (whisker >= 0) & (sure >= least_probability) & (identity.segment_other.values < 0)
    kept = np.unique(whisker[use])
    order = np.lexsort((linking.lines.reach[:, 0], linking.pieces.frame, whisker))
    order = order[use[order]]
    key = whisker[order] * linking.pieces.frames + linking.pieces.frame[order]
    groups = np.split(order, np.flatnonzero(np.diff(key)) + 1)
    traces = [_trace(linking, group, int(np.searchsorted(kept, whisker[group[0]]))) for group in groups if group.size]
    found = {
        "identity_from": "link",
        "identities": json.dumps(kept.tolist()),
        "identity_probability": json.dumps(np.round(identity.identity_probability.values[kept], 4).tolist()),
    }
    frames = linking.pieces.frames
    return profile_of(
        source, traces, frames, calibration, node_spacing=node_spacing, skin=skin, attrs={**(attrs or {}), **found}
    )


def _trace(linking: Linking, group: np.ndarray, whisker: int) -> Trace:
    """Pieces of one whisker in one frame, from the base on."""
    pieces, parts = linking.pieces, []
    for s in group:
        points = np.arange(pieces.start[s], pieces.stop[s])
        parts.append(points[::-1] if linking.lines.turned[s] else points)
    points = np.concatenate(parts)
    x, y = pieces.column[points], pieces.row[points]
    return Trace(int(pieces.frame[group[0]]), whisker, x, y, (float(x[0]), float(y[0])))
