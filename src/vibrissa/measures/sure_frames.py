"""Frames of a profile in which the names of whiskers are sure enough."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibrissa.errors import MissingError, RangeError

if TYPE_CHECKING:
    import xarray as xr


def sure_frames(profile: xr.Dataset, least: float | None) -> xr.Dataset:
    """A profile without the frames in which a whisker's name is less probable.

    Parameters
    ----------
    profile : Dataset
        ``x``, ``y`` (whisker, time, node), and ``whisker_probability`` (whisker, time).
    least : float, optional
        Probability of a name, from 0 to 1, below which a whisker counts as not seen; nothing changes without it.

    Returns
    -------
    Dataset
        The same with NaN there. Names that tracking itself left out do not come back.

    Raises
    ------
    InputError
        If it is out of range, or the profile has no probabilities.
    """
    if least is None:
        return profile
    if not 0 <= least <= 1:
        raise RangeError("least_probability", "must be from 0 to 1", least)
    if "whisker_probability" not in profile:
        rule = "must be left out of a profile without `whisker_probability`"
        raise MissingError("least_probability", rule, remedy="whiskers that were linked have it")
    sure = profile.whisker_probability >= least
    nodes = [name for name in ("x", "y", "x_sd", "y_sd") if name in profile]
    return profile.assign({name: profile[name].where(sure).transpose(*profile[name].dims) for name in nodes})
