"""How well whiskers are followed by how often they lie apart from all others, as they must for an eye to follow them.

Used by ``identity_scores.py``. A whisker lies apart in a frame if half of what is visible of it is farther than 4 px
from what is visible of every other whisker: two blurred lines that are nearer look like one.
"""

import numpy as np
from scipy.spatial import cKDTree

FAR, HALF = 4.0, 0.5  # [px], and share of the visible points
CLASSES = np.array([0.0, 0.5, 0.8, 0.95])  # lower edges of the share of its frames in which a whisker lies apart
MOST = 0.9  # share of its frames in which a followed whisker has its name
COUNTS = "whiskers", "shares", "most", "named", "wrong"  # what is counted in each class


def apart(points: np.ndarray, frame: np.ndarray, whisker: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Whether each whisker lies apart in each frame (whisker, frame).

    ``points`` (P, 2), ``frame`` and ``whisker`` (P,) are those of all visible points, ``seen`` how many there are of
    each whisker in each frame.
    """
    far = np.zeros_like(seen)
    for now in np.unique(frame):
        here = np.flatnonzero(frame == now)
        for one in np.unique(whisker[here]):
            own = whisker[here] == one
            others = points[here[~own]]
            off = cKDTree(others).query(points[here[own]])[0] if len(others) else np.full(own.sum(), np.inf)
            far[one, now] = np.count_nonzero(off > FAR)
    return (far >= HALF * seen) & (seen > 0)


def counts(lies: np.ndarray, can: np.ndarray, own: np.ndarray, given: np.ndarray) -> dict[str, float]:
    """What is counted of the whiskers of each class, to be added up over movies.

    Parameters
    ----------
    lies, can, own, given : (whisker, frame) arrays
        Whether each whisker lies apart, can be followed, has its own name, and whether that name is given at all.

    Returns
    -------
    dict
        ``apart_<count>_<class>``: number of whiskers, sum of the shares of their frames in which they have their names,
        number of those in which this is at least 0.9, frames in which their names are given, and in which these are
        wrong.
    """
    out = {f"apart_{name}_{100 * low:.0f}": 0.0 for low in CLASSES for name in COUNTS}
    for one in np.flatnonzero(can.any(axis=1)):
        low = CLASSES[np.searchsorted(CLASSES, lies[one, can[one]].mean(), side="right") - 1]
        share, wrong = own[one, can[one]].mean(), given[one] & ~own[one]
        for name, value in zip(COUNTS, (1, share, share >= MOST, given[one].sum(), wrong.sum()), strict=True):
            out[f"apart_{name}_{100 * low:.0f}"] += float(value)
    return out


def table_row(rows: list[dict[str, str]], low: float) -> list[str]:
    """Of the whiskers of a class in several movies: number, followed, share of those that are in 0.9 of their frames,
    wrong names per 1,000."""
    total = {name: sum(float(row[f"apart_{name}_{100 * low:.0f}"]) for row in rows) for name in COUNTS}
    whiskers, named = max(total["whiskers"], 1), max(total["named"], 1)
    shares = [f"{total[name] / whiskers:.3f}" for name in ("shares", "most")]
    return [f"{total['whiskers']:.0f}", *shares, f"{1000 * total['wrong'] / named:.1f}"]
