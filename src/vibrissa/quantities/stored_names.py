"""Names of whiskers that a profile keeps in its attributes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def stored_names(profile: xr.Dataset) -> list[str]:
    """Names of the whiskers of a profile, or of some of them, which have theirs by number.

    Parameters
    ----------
    profile : Dataset
        Nodes by ``whisker``; its attribute ``names`` (JSON) is read.

    Returns
    -------
    list of str
        One for each whisker; none where no names are kept, or it is not known whose they are. Where whiskers are not
        numbered from 0, names are in order.
    """
    stored: list[str] = json.loads(profile.attrs.get("names", "[]"))
    numbers = profile["whisker"].values.tolist()
    if "whisker" not in profile.coords and len(stored) != len(numbers):
        return []
    if all(number in range(len(stored)) for number in numbers):
        return [stored[number] for number in numbers]
    return stored if len(stored) == len(numbers) else []
