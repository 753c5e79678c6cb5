"""How well lines of a movie were found and named, against the known whiskers.

Used by ``benchmarks/whisking_truth.py``, which says how to run it. Both sides are the dataset ``segments``; the truth's
``segment_whisker`` is the whisker, that of a tracker the name it gave.

A found point is at a whisker if it lies within 2 px across its line. What has one name in one frame is a whisker's if
70 % of its points are at it, so where whiskers lie on one another either name is right, and a line that goes over from
one whisker to another is neither's. Names are given to whiskers so that as many frames as possible are right. A name
that is mostly at no whisker is that of a hair: it is counted, and left out of what is wrong.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from whiskers_apart import apart, counts

NEAR = 2.0  # [px] across the line
SHARE = 0.7  # of the points
SEEN = 20  # visible points that a whisker has in the frames in which it can be followed
LEASTS = (0.7, 0.9)  # probabilities below which a profile may leave names out
BINS = np.array([0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99])  # lower edges of the probabilities whose calibration is counted


class Lines(NamedTuple):
    """Segments as arrays: frame (S,), ends (S + 1,), points (P, 2), whisker (S,) and a second one, probability (S,)."""

    frame: np.ndarray
    ends: np.ndarray
    points: np.ndarray
    whisker: np.ndarray
    other: np.ndarray
    probability: np.ndarray


class Match(NamedTuple):
    """Found lines against true ones.

    ``at`` (S, W) points of each found segment at each whisker, ``anywhere`` (S,) at any; ``offset`` (S,) lists of
    distances across the line to the whisker that most of the segment is at; ``covered`` (P,) whether a found point lies
    at each true point.
    """

    at: np.ndarray
    anywhere: np.ndarray
    offset: list[np.ndarray]
    covered: np.ndarray


def lines_of(segments: xr.Dataset, identity: xr.Dataset | None = None) -> Lines:
    """Arrays of segments, with the names of ``identity``, or their own; no probability is NaN."""
    named = segments if identity is None else identity
    count = segments.sizes["segment"]
    values = [
        named[name].values if name in named else np.full(count, empty)
        for name, empty in (("segment_whisker", -1), ("segment_other", -1), ("segment_probability", np.nan))
    ]
    points = np.stack([segments["column"].values, segments["row"].values], axis=1).astype(float)
    ends = np.append(segments["segment_start"].values, len(points))
    return Lines(segments["segment_frame"].values, ends, points, *values)


def matched(found: Lines, truth: Lines, whiskers: int) -> Match:
    """Compare the lines of every frame."""
    at = np.zeros((len(found.frame), whiskers), int)
    anywhere, offset = np.zeros(len(found.frame), int), [np.empty(0)] * len(found.frame)
    covered = np.zeros(len(truth.points), bool)
    for frame in np.unique(truth.frame):
        mine, true = np.flatnonzero(found.frame == frame), np.flatnonzero(truth.frame == frame)
        if not mine.size:
            continue
        points = found.points[found.ends[mine[0]] : found.ends[mine[-1] + 1]]
        starts = found.ends[mine] - found.ends[mine[0]]
        reached = slice(truth.ends[true[0]], truth.ends[true[-1] + 1])
        covered[reached] = cKDTree(points).query(truth.points[reached], distance_upper_bound=2 * NEAR)[0] <= NEAR
        off = np.full((whiskers, len(points)), np.inf)
        for segment in true:
            line = truth.points[truth.ends[segment] : truth.ends[segment + 1]]
            who = truth.whisker[segment]
            off[who] = np.minimum(off[who], across(points, line))
        at[mine] = np.add.reduceat(off <= NEAR, starts, axis=1).T
        anywhere[mine] = np.add.reduceat((off <= NEAR).any(axis=0), starts)
        owner = at[mine].argmax(axis=1)
        for k, segment in enumerate(mine):
            one = off[owner[k], starts[k] : starts[k] + found.ends[segment + 1] - found.ends[segment]]
            offset[segment] = one[one <= NEAR]
    return Match(at, anywhere, offset, covered)


def across(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Distance of points across a line whose points are a pixel apart; infinite beyond its ends."""
    tangent = np.gradient(line, axis=0)
    tangent /= np.hypot(*tangent.T)[:, None]
    far, nearest = cKDTree(line).query(points, distance_upper_bound=2 * NEAR)
    out = np.full(len(points), np.inf)
    here = np.isfinite(far)
    off, along = points[here] - line[nearest[here]], tangent[nearest[here]]
    beyond = np.abs((off * along).sum(axis=1)) > 1.0
    out[here] = np.where(beyond, np.inf, np.abs(off[:, 1] * along[:, 0] - off[:, 0] * along[:, 1]))
    return out


def named_table(found: Lines, match: Match, frames: int, names: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Whether each name is each whisker's (name, frame, whisker), and whether it is given (name, frame)."""
    if names is None:
        names = int(max(found.whisker.max(initial=-1), found.other.max(initial=-1))) + 1
    at, size = np.zeros((names, frames, match.at.shape[1])), np.zeros((names, frames))
    points = np.diff(found.ends)
    for name in (found.whisker, found.other):
        claimed = np.flatnonzero(name >= 0)
        np.add.at(at, (name[claimed], found.frame[claimed]), match.at[claimed])
        np.add.at(size, (name[claimed], found.frame[claimed]), points[claimed])
    return (at >= SHARE * size[..., None]) & (size > 0)[..., None], size > 0


def hairs(found: Lines, match: Match, names: int) -> np.ndarray:
    """Whether each name is that of a hair: less than half of its points are at whiskers."""
    some = found.whisker >= 0
    at, size = (np.bincount(found.whisker[some], v[some], names) for v in (match.anywhere, np.diff(found.ends)))
    return np.asarray(at < size / 2)


def whisker_of(right: np.ndarray) -> np.ndarray:
    """Whisker of each name, −1 of none: as many frames as possible are right."""
    count = right.sum(axis=1)
    out = np.full(len(count), -1)
    for name, whisker in zip(*linear_sum_assignment(-count), strict=True):
        out[name] = whisker if count[name, whisker] else -1
    return out


def of_owners(right: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """Whether each whisker has its own name in each frame (whisker, frame)."""
    own = np.zeros((right.shape[2], right.shape[1]), bool)
    for name, whisker in enumerate(owner):
        if whisker >= 0:
            own[whisker] = right[name, :, whisker]
    return own


def best_names(found: Lines, match: Match, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """What :func:`named_table` and :func:`whisker_of` give if each line that is at a whisker has its name."""
    order = np.argsort(-match.at, axis=1)[:, :2]
    at = np.take_along_axis(match.at, order, axis=1) >= SHARE * np.diff(found.ends)[:, None]
    first, *second = np.where(at, order, -1).T
    other = second[0] if second else np.full_like(first, -1)
    right, _ = named_table(found._replace(whisker=first, other=other), match, frames)
    return right, np.arange(len(right))


def surely_named(found: Lines, match: Match, owner: np.ndarray, hair: np.ndarray, can: np.ndarray) -> dict[str, float]:
    """Followed, and wrong per 1,000, of names that a profile has: those so sure, of lines of one whisker alone."""
    out = {}
    for least in LEASTS:
        kept = (found.probability >= least) & (found.other < 0)
        some = found._replace(whisker=np.where(kept, found.whisker, -1), other=np.full_like(found.other, -1))
        right, given = named_table(some, match, can.shape[1], len(owner))
        own, claimed = of_owners(right, owner), given[~hair].sum()
        out[f"profile_followed_{100 * least:.0f}"] = float(shares(own, can).mean()) if claimed else np.nan
        out[f"profile_wrong_{100 * least:.0f}"] = 1000 * float(1 - own.sum() / claimed) if claimed else np.nan
    return out


def shares(own: np.ndarray, can: np.ndarray) -> np.ndarray:
    """Share of the frames in which each whisker can be followed that it is."""
    return np.array([mine[seen].mean() for mine, seen in zip(own, can, strict=True) if seen.any()])


def switches(right: np.ndarray) -> int:
    """How often a whisker goes on under another name than before."""
    total, found = right.sum(axis=1), 0
    for whisker in range(right.shape[2]):
        now = -1
        for frame in np.flatnonzero(right[:, :, whisker].any(axis=0)):
            names = np.flatnonzero(right[:, frame, whisker])
            if now not in names:
                found += now >= 0
                now = names[np.argmax(total[names, whisker])]
    return found


def calibration(found: Lines, match: Match, owner: np.ndarray, hair: np.ndarray) -> dict[str, float]:
    """Of the named segments with a probability in each bin: number, sum of the probabilities, number that is right."""
    some = np.flatnonzero((found.whisker >= 0) & np.isfinite(found.probability))
    some = some[~hair[found.whisker[some]]]
    mine = owner[found.whisker[some]]
    right = (match.at[some, mine] >= SHARE * np.diff(found.ends)[some]) & (mine >= 0)
    place = np.searchsorted(BINS, found.probability[some], side="right") - 1
    out = {}
    for k, low in enumerate(BINS):
        inside = place == k
        out |= {f"claims_{100 * low:.0f}": int(inside.sum()), f"right_{100 * low:.0f}": int(right[inside].sum())}
        out[f"sure_{100 * low:.0f}"] = float(found.probability[some][inside].sum())
    return out


def score(found: Lines, truth: xr.Dataset, least: float) -> dict[str, float]:
    """Scores of a tracker.

    Parameters
    ----------
    found : Lines
        Its segments, with names or without.
    truth : Dataset
        ``segments`` of a scene, down to the faintest tips.
    least : float
        Depth of a line at least that must be found [grey levels].

    Returns
    -------
    dict
        ``recall`` share of the visible length with a found point within 2 px; ``astray`` share of the found points at
        no whisker; ``error``, ``error_95`` median and 95 % of the distances across the line [px]; ``names`` that are
        given, and how many of them are ``hairs``; ``followed`` mean over whiskers of the share of the frames in which
        it is seen that it has its own name, ``worst``, the least one, and ``allowed``, the mean if each line that is
        at a whisker had its name; ``switches`` per 1,000 frames; ``wrong`` whisker-frames per 1,000 named; the same of
        what :func:`surely_named` keeps; calibration; counts of ``whiskers_apart.py``.
    """
    true, frames = lines_of(truth), int(truth.attrs["frames"])
    whiskers = int(true.whisker.max()) + 1
    visible = truth["line_contrast"].values >= least
    match = matched(found, true, whiskers)
    offset = np.concatenate(match.offset) if match.offset else np.empty(0)
    right, given = named_table(found, match, frames)
    hair = hairs(found, match, len(given))
    right[hair] = False
    owner = whisker_of(right)
    own = of_owners(right, owner)
    seen = np.zeros((whiskers, frames), int)
    where = np.repeat(np.arange(len(true.frame)), np.diff(true.ends))
    np.add.at(seen, (true.whisker[where], true.frame[where]), visible)
    can = seen >= SEEN
    lies = apart(true.points[visible], true.frame[where[visible]], true.whisker[where[visible]], seen)
    share, allowed = (shares(one, can) for one in (own, of_owners(*best_names(found, match, frames))))
    near = sum(one.size for one in match.offset)
    return {
        "recall": float(match.covered[visible].mean()),
        "astray": 1 - near / max(len(found.points), 1),
        "error": float(np.median(offset)) if offset.size else np.nan,
        "error_95": float(np.quantile(offset, 0.95)) if offset.size else np.nan,
        "names": int(given.any(axis=1).sum()),
        "hairs": int((hair & given.any(axis=1)).sum()),
        "followed": float(share.mean()),
        "worst": float(share.min()),
        "allowed": float(allowed.mean()),
        "switches": 1000 * switches(right) / frames,
        "wrong": 1000 * (1 - own.sum() / given[~hair].sum()) if given[~hair].any() else np.nan,
        **surely_named(found, match, owner, hair, can),
        **calibration(found, match, owner, hair),
        **counts(lies, can, own, of_owners(np.repeat(given[..., None], whiskers, axis=2), owner)),
    }
