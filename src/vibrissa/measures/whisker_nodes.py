"""Nodes of the whiskers of a profile: where they are usually seen, and frames in which their names are sure enough."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import MissingError, RangeError, TooFewError
from vibrissa.head_pose import HeadPose, profile_in_head

if TYPE_CHECKING:
    import xarray as xr

Nodes = Mapping[str, Array]


def nodes_of(one: xr.Dataset, head: HeadPose | None) -> dict[str, Array]:
    """Nodes of a whisker from the skin on, in head coordinates where the head is known, and in the image.

    Parameters
    ----------
    one : Dataset
        ``x``, ``y`` (time, node), ``arc_length`` (node); ``x_sd``, ``y_sd`` where it has them.
    head : HeadPose or None
        The head.

    Returns
    -------
    dict
        The same arrays by name, and ``image_x``, ``image_y``.
    """
    one = one.transpose(..., "time", "node").isel(node=np.argsort(one.arc_length.values))
    found = {name: one[name].values for name in ("x", "y", "x_sd", "y_sd") if name in one}
    found |= {"image_x": found["x"], "image_y": found["y"], "arc_length": one.arc_length.values}
    if head is not None:
        found["x"], found["y"] = profile_in_head(one, head)
    return found


def usual_length(nodes: Nodes) -> float:
    """Arc length up to which a whisker is usually seen [m]: single frames may be of something else.

    Parameters
    ----------
    nodes : dict
        From :func:`nodes_of`.

    Returns
    -------
    float
        Median over the frames; 0 if it is never seen.
    """
    seen = _seen(nodes)
    reach = np.where(seen, nodes["arc_length"], 0.0).max(axis=1)[seen.any(axis=1)]
    return float(np.median(reach)) if reach.size else 0.0


def mean_base(nodes: Nodes) -> tuple[float, float]:
    """Mean of the first node that was seen in at least half of the frames in which any was.

    Parameters
    ----------
    nodes : dict
        From :func:`nodes_of`.

    Returns
    -------
    (float, float)
        x and y [m]; NaN if it is never seen.
    """
    seen = _seen(nodes)
    frames = seen.any(axis=1).sum()
    if not frames:
        return np.nan, np.nan
    k = int(np.argmax(seen.sum(axis=0) >= frames / 2))
    k = k if seen[:, k].any() else int(seen.any(axis=0).argmax())
    return float(nodes["x"][seen[:, k], k].mean()), float(nodes["y"][seen[:, k], k].mean())


def mean_way(nodes: Nodes) -> tuple[float, float]:
    """Mean direction from the first node seen to the middle one, over the frames in which there are three or more.

    Parameters
    ----------
    nodes : dict
        From :func:`nodes_of`.

    Returns
    -------
    (float, float)
        x and y of a vector no longer than 1; NaN if it is never seen.
    """
    seen = _seen(nodes)
    count = seen.sum(axis=1)
    frames = np.flatnonzero(count >= 3)
    if not frames.size:
        return np.nan, np.nan
    rank = np.cumsum(seen[frames], axis=1)
    first, middle = (np.argmax(rank == at[:, None], axis=1) for at in (np.ones(frames.size), (count[frames] + 1) // 2))
    off = np.array([nodes[name][frames, middle] - nodes[name][frames, first] for name in ("x", "y")])
    way = (off / np.hypot(*off)).mean(axis=1)
    return float(way[0]), float(way[1])


def seen_frames(nodes: Nodes) -> Mask:
    """Frames in which any node is seen.

    Parameters
    ----------
    nodes : dict
        From :func:`nodes_of`.

    Returns
    -------
    (T,) array of bool
        Whether one is.
    """
    return np.asarray(_seen(nodes).any(axis=1))


def _seen(nodes: Nodes) -> Mask:
    """Nodes that are seen (T, N)."""
    return np.asarray(np.isfinite(nodes["x"]) & np.isfinite(nodes["y"]))


def surely_named(whiskers: list[dict[str, Array]], profile: xr.Dataset, least: float | None) -> list[dict[str, Array]]:
    """Nodes without those of the frames in which a whisker's name is less probable than asked.

    Parameters
    ----------
    whiskers : list of dict
        Nodes of each whisker, from :func:`nodes_of`.
    profile : Dataset
        With ``whisker_probability`` (whisker, time).
    least : float, optional
        Probability of a name, not below that of the tracking, and at most 1; nothing changes without it.

    Returns
    -------
    list of dict
        The same with NaN there.

    Raises
    ------
    InputError
        If it is out of range, the profile has no probabilities, or no name is so probable.
    """
    if least is None:
        return whiskers
    if "whisker_probability" not in profile:
        rule = "must be left out of a profile without `whisker_probability`"
        raise MissingError("least_probability", rule, remedy="whiskers that were linked have it")
    before = float(profile.attrs.get("least_probability", 0.0))
    if not before <= least <= 1:
        rule = f"must be from {before:g}, from which on the tracking has kept names, to 1"
        raise RangeError("least_probability", rule, least)
    sure = profile.whisker_probability.transpose("whisker", "time").values >= least
    if not sure.any():
        most = float(profile.whisker_probability.max())
        raise TooFewError("least_probability", "must leave some names", least, f"the largest is {most:.3f}")
    measured = ("x", "y", "x_sd", "y_sd", "image_x", "image_y")
    return [
        {name: np.where(of[:, None], values, np.nan) if name in measured else values for name, values in one.items()}
        for one, of in zip(whiskers, sure, strict=True)
    ]
