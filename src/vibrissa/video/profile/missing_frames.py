"""Frames that a movie lost before it was read: not measured in the profile."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.signals.frame_numbers import frame_numbers

if TYPE_CHECKING:
    import xarray as xr

REASON = "not in the movie"


def without_frames(profile: xr.Dataset, missing: Integers) -> xr.Dataset:
    """A profile in which some frames are not measured.

    Parameters
    ----------
    profile : Dataset
        With ``time``, and the attribute ``lost``.
    missing : (N,) array of int
        Numbers of the frames in the movie, ascending, from 0.

    Returns
    -------
    Dataset
        NaN in these frames, which ``lost`` lists, besides what it had; ``drop_frames`` and ``missing_frames``, their
        number.
    """
    count = profile.sizes["time"]
    here = missing - int(frame_numbers(profile)[0])
    here = here[(here >= 0) & (here < count)]
    there = np.ones(count, bool)
    there[here] = False
    mask = profile.time.copy(data=there)
    blank = {
        name: one.where(mask) for name, one in profile.data_vars.items() if "time" in one.dims and one.dtype.kind == "f"
    }
    lost = [_with_runs(runs, there) for runs in json.loads(profile.attrs.get("lost", "[]"))]
    attrs = {"lost": json.dumps(lost), "drop_frames": "nan", "missing_frames": len(here)}
    return profile.assign(blank).assign_attrs(attrs)


def _with_runs(runs: list[list[Any]], there: np.ndarray[Any, np.dtype[np.bool_]]) -> list[list[Any]]:
    """Runs of lost frames [first, last, reason], those of the missing frames in place of any other reason."""
    reason: list[str | None] = [None] * len(there)
    for first, last, why in runs:
        reason[first : last + 1] = [why] * (last + 1 - first)
    reason = [one if present else REASON for one, present in zip(reason, there, strict=True)]
    edges = [0, *(i for i in range(1, len(reason)) if reason[i] != reason[i - 1]), len(reason)]
    return [[first, end - 1, reason[first]] for first, end in pairwise(edges) if reason[first] is not None]
