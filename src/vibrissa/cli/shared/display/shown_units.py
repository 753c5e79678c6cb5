"""Units in which tables for a reader show quantities: mm, µm, ms, degrees; files and JSON stay SI."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


class Shown(NamedTuple):
    """A unit for a reader: from which magnitude it is taken [SI], its size [SI] and its name."""

    least: float
    size: float
    name: str


_NEWTONS = ((1.0, 1.0, ""), (1e-3, 1e-3, "m"), (1e-6, 1e-6, "µ"), (0.0, 1e-9, "n"))
UNITS = {  # by SI unit, the largest first
    "m": (Shown(1, 1, "m"), Shown(1e-3, 1e-3, "mm"), Shown(1e-7, 1e-6, "µm"), Shown(0, 1e-9, "nm")),
    "m/s": (Shown(10, 1, "m/s"), Shown(1e-4, 1e-3, "mm/s"), Shown(0, 1e-6, "µm/s")),
    "s": (Shown(1, 1, "s"), Shown(1e-4, 1e-3, "ms"), Shown(0, 1e-6, "µs")),
    "rad": (Shown(0.02, np.pi / 180, "°"), Shown(0, 1e-3, "mrad")),
    "Pa": (Shown(1e8, 1e9, "GPa"), Shown(1e5, 1e6, "MPa"), Shown(0, 1, "Pa")),
    "V": (Shown(1, 1, "V"), Shown(1e-3, 1e-3, "mV"), Shown(0, 1e-6, "µV")),
    "1/(s m)": (Shown(1e3, 1e6, "1/(s µm)"), Shown(0, 1, "1/(s m)")),
    **{
        unit: tuple(Shown(least, size, prefix + unit) for least, size, prefix in _NEWTONS)
        for unit in ("N", "N m", "N/s", "N m/s")
    },
}
_ENDS = re.compile(r"_(low|high|se|sd)$")


def shown_units(data: xr.Dataset, names: Sequence[str]) -> dict[str, Shown]:
    """The unit in which each variable is shown; a quantity and its interval have one.

    Parameters
    ----------
    data : Dataset
        Of the variables, in SI units.
    names : sequence of str
        Variables of a table.

    Returns
    -------
    dict
        By name; SI where there is no other; the largest where all is zero or not known.
    """
    largest: dict[str, float] = defaultdict(float)
    for name in names:
        if _unit(data, name) in UNITS:
            values = np.abs(np.asarray(data[name].values, float))
            largest[_stem(name)] = max(largest[_stem(name)], values[np.isfinite(values)].max(initial=0.0))
    return {name: _chosen(_unit(data, name), largest[_stem(name)]) for name in names}


def _chosen(unit: str, largest: float) -> Shown:
    if unit not in UNITS:
        return Shown(0, 1, "" if unit == "1" else unit)
    return next((one for one in UNITS[unit] if largest >= one.least and largest), UNITS[unit][0])


def _stem(name: str) -> str:
    return _ENDS.sub("", name)


def _unit(data: xr.Dataset, name: str) -> str:
    return str(data[name].attrs.get("units", "1"))
