"""Figures 6C and 7A: courses of a few sweeps over one texture by the distance scanned."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.mechanics.across.gain import STEP, by_distance, whisker_of_animal
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Series

if TYPE_CHECKING:
    import xarray as xr

EXAMPLES = 3
Course = Callable[["xr.Dataset", float], Array]


def alike(sweeps: xr.Dataset, usable: Mask) -> tuple[Integers, str]:
    """Sweeps of the whisker and texture that have most of them, as places in the table, and what they share.

    Where no whisker has three over one texture, as many as there are of that whisker's name in all animals, or else of
    all whiskers, over one texture.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.
    usable : (S,) array of bool
        Sweeps that count.

    Returns
    -------
    places : (N,) array of int
        Rising.
    shared : str
        For the caption.
    """
    texture = sweeps.texture.values.astype(str)
    owners = {
        "one whisker, one texture": whisker_of_animal(sweeps),
        "whiskers of one name in several animals, one texture": sweeps.whisker_name.values.astype(str),
        "several whiskers, one texture": np.full(len(texture), ""),
    }
    groups = {
        shared: _largest(np.char.add(owner, np.char.add(" ", texture)), usable) for shared, owner in owners.items()
    }
    enough = [shared for shared, places in groups.items() if len(places) >= EXAMPLES]
    shared = enough[0] if enough else list(groups)[-1]
    return groups[shared], shared if len(groups[shared]) > 1 else "one sweep"


def _largest(key: NDArray[np.str_], usable: Mask) -> Integers:
    """Places of the key that most usable sweeps have."""
    names, counts = np.unique(key[usable], return_counts=True)
    return np.flatnonzero(usable & (key == names[counts.argmax()]))


def drawn_by_distance(
    sweeps: xr.Dataset,
    chosen: Integers,
    series: Series,
    shown: float,
    lines: Mapping[str, Course],
    more: Mapping[str, Any],
) -> xr.Dataset:
    """Courses of some sweeps in time, over the distance scanned, and the texture there.

    Parameters
    ----------
    sweeps : Dataset
        The table.
    chosen : (K,) array of int
        Places in it.
    series : callable
        Number of a sweep → its time series.
    shown : float
        Distance [m], from where all have begun.
    lines : mapping
        Name of a variable → its course (T,) of one sweep's series and length L [m].
    more : mapping
        Further columns (K,).

    Returns
    -------
    Dataset
        ``lines`` (example, distance_scanned), ``example_speed`` [m/s], ``example_contact``, ``example_whisker`` and
        ``more`` (example); ``trough_start``, ``trough_width`` (trough) [m] where the series have the texture.
    """
    each = [series(int(sweeps.sweep[i])) for i in chosen]
    speed, length = sweeps.scan_speed.values[chosen], sweeps.length.values[chosen]
    known = list(zip(speed, length, each, strict=True))
    x = max(v * float(one.time[0]) for v, _, one in known) + np.arange(0, shown, STEP)
    columns: dict[str, Any] = {
        name: np.array([by_distance(course(one, size), one.time.values, v, x) for v, size, one in known])
        for name, course in lines.items()
    }
    if "trough_start" in each[0]:
        start, width = each[0].trough_start.values, each[0].trough_width.values
        inside = (start + width > x[0]) & (start < x[-1])
        columns |= {"trough_start": start[inside], "trough_width": width[inside]}
    return dataset(
        example=sweeps.sweep.values[chosen],
        distance_scanned=x,
        example_speed=speed,
        example_contact=sweeps.contact.values[chosen],
        example_whisker=whisker_of_animal(sweeps)[chosen],
        **more,
        **columns,
    )
