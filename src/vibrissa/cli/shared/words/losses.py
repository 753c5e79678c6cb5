"""Frames in which a tracked whisker is lost, counted by their reasons."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable


def lost_by_reason(runs: Iterable[tuple[int, int, str]]) -> Counter[str]:
    """Count the frames of runs of lost frames.

    Parameters
    ----------
    runs : iterable of (int, int, str)
        First and last frame of each run, and why, as in a profile's attribute ``lost``.

    Returns
    -------
    Counter
        Frames by reason.
    """
    lost: Counter[str] = Counter()
    for first, last, reason in runs:
        lost[reason] += last - first + 1
    return lost
