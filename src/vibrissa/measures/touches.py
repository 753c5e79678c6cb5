"""Touches of a whisker as events."""

from __future__ import annotations

from typing import Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.measures.whisk_cycle import stretches
from vibrissa.quantities import stacked

COLUMNS = (
    "touch_onset",
    "touch_offset",
    "touch_duration",
    "touch_angle",
    "touch_phase",
    "touch_curvature_change",
    "touch_onset_seen",
    "touch_offset_seen",
)


def long_touches(touching: Array, least_frames: int, bridged: int) -> Array:
    """Whether a whisker touches, where touches that are too short count as free.

    Parameters
    ----------
    touching : (T,) array
        1 where it touches, 0 where it does not, NaN where it was not seen.
    least_frames : int
        Frames below which a touch is left out.
    bridged : int
        Longest gap of unseen frames that does not end a touch.

    Returns
    -------
    (T,) array
        0 in the frames of touches that are left out.
    """
    kept = touching.copy()
    for start, stop in _runs(touching, bridged):
        if stop - start < least_frames:
            kept[start:stop] *= 0.0  # frames that were not seen stay NaN
    return kept


def touch_events(
    time: Array, touching: Array, *, angle: Array, phase: Array, change: Array, bridged: int
) -> list[dict[str, Any]]:
    """Touches of one whisker, in the order of their onsets.

    Parameters
    ----------
    time : (T,) array
        Even [s].
    touching : (T,) array
        1 where it touches, 0 where it does not, NaN where it was not seen.
    angle, phase, change : (T,) arrays
        Angle and phase [rad] and Δκ [1/m]; NaN where not measured.
    bridged : int
        Longest gap of unseen frames that does not end a touch; frames in which it is seen free always do.

    Returns
    -------
    list of dict
        A row for each, by the names of ``COLUMNS``. Angle and phase are of the first frame. Where the whisker was not
        seen free just before or after, the touch may have begun earlier or ended later.
    """
    frame = float(time[-1] - time[0]) / (time.size - 1)
    rows = []
    for start, stop in _runs(touching, bridged):
        part = change[start:stop]
        largest = part[np.nanargmax(np.abs(part))] if np.isfinite(part).any() else np.nan
        values = (
            time[start],
            time[stop - 1],
            (stop - start) * frame,
            angle[start],
            phase[start],
            largest,
            float(start > 0 and touching[start - 1] == 0),
            float(stop < time.size and touching[stop] == 0),
        )
        rows.append(dict(zip(COLUMNS, map(float, values), strict=True)))
    return rows


def touch_table(events: list[dict[str, Any]]) -> dict[str, Array]:
    """Columns of the touches of all whiskers, by onset; empty where there are none.

    Parameters
    ----------
    events : list of dict
        From :func:`touch_events`, each with its ``touch_whisker`` and ``touch_whisker_number``.

    Returns
    -------
    dict
        Arrays of equal length by name.
    """
    ordered = sorted(events, key=lambda event: event["touch_onset"])
    if ordered:
        return stacked(ordered)
    whose = {"touch_whisker": np.array([], str), "touch_whisker_number": np.array([], np.int64)}
    return whose | {name: np.array([], float) for name in COLUMNS}


def _runs(touching: Array, bridged: int) -> list[tuple[int, int]]:
    """Runs of touching frames; those with only a few unseen frames between them are one."""
    joined: list[tuple[int, int]] = []
    for start, stop in stretches(touching == 1):
        if joined and start - joined[-1][1] <= bridged and np.isnan(touching[joined[-1][1] : start]).all():
            joined[-1] = joined[-1][0], stop
        else:
            joined.append((start, stop))
    return joined
