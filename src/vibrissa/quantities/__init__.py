"""Names, dimensions and units of everything that crosses a room: the one table.

Public model functions return ``dataset(...)``; entry points call ``require(...)``. Whisker, sweep, trial
and parameter dimensions may lead the core dimensions listed here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa import __version__
from vibrissa.errors import InputError
from vibrissa.quantities.coding import CODING
from vibrissa.quantities.discrimination import DISCRIMINATION
from vibrissa.quantities.figures import FIGURES
from vibrissa.quantities.mechanics import MECHANICS
from vibrissa.quantities.neural import NEURAL
from vibrissa.quantities.plans import PLANS
from vibrissa.quantities.quantity import Quantity as Quantity
from vibrissa.quantities.sorting import SORTING
from vibrissa.quantities.sweeps import SWEEPS
from vibrissa.quantities.tracks import TRACKS

if TYPE_CHECKING:
    import xarray as xr

QUANTITIES = TRACKS | MECHANICS | SWEEPS | NEURAL | CODING | FIGURES | DISCRIMINATION | SORTING | PLANS


def _dims(name: str, values: np.ndarray, lead: tuple[str, ...]) -> tuple[str, ...]:
    if name not in QUANTITIES:
        raise InputError(name, "must stand in quantities.QUANTITIES")
    core = QUANTITIES[name].dims
    if values.ndim == len(core):
        return core
    if values.ndim == len(core) + len(lead):
        return lead + core
    raise InputError(name, f"must have dimensions {core} or {lead + core}", f"shape {values.shape}")


def dataset(attrs: Mapping[str, Any] | None = None, *, lead: tuple[str, ...] = (), **variables: Any) -> xr.Dataset:
    """Label arrays with the dimensions, units and long names of the one table.

    Parameters
    ----------
    attrs : mapping, optional
        Parameters that made the data: numbers and strings (no clock: equal inputs give equal files).
    lead : tuple of str
        Dimensions that lead the core dimensions where an array has that many more.
    **variables
        Arrays by name; every name stands in ``QUANTITIES``.

    Raises
    ------
    InputError
        If a name is not in the table, or an array has another number of dimensions.
    """
    import xarray as xr

    arrays = {}
    for name, values in variables.items():
        array = np.asarray(values)
        dims = _dims(name, array, lead)
        arrays[name] = (
            dims,
            array,
            {"units": QUANTITIES[name].unit, "long_name": QUANTITIES[name].long_name},
        )
    coordinates = {name: arrays.pop(name) for name in list(arrays) if arrays[name][0] == (name,)}
    return xr.Dataset(arrays, coordinates, {**(attrs or {}), "vibrissa_version": __version__})


def require(data: xr.Dataset, *names: str) -> None:
    """Check that a dataset holds these variables, with their dimensions and units.

    Raises
    ------
    InputError
        Names the first variable that is missing, or has other dimensions or another unit.
    """
    for name in names:
        quantity = QUANTITIES[name]
        if name not in data.variables:
            others = sorted(map(str, data.variables))
            more = f" and {len(others) - 8} more" if others[8:] else ""
            raise InputError(f"variable {name!r}", "is missing from the dataset", f"only {', '.join(others[:8])}{more}")
        found = data[name]
        if not set(quantity.dims) <= set(found.dims):
            raise InputError(f"variable {name!r}", f"must have dimensions {quantity.dims}", str(found.dims))
        if found.attrs.get("units", quantity.unit) != quantity.unit:
            raise InputError(f"variable {name!r}", f"must be in {quantity.unit!r}", repr(found.attrs["units"]))


def measured(profile: xr.Dataset) -> NDArray[np.bool_]:
    """Whether each node was measured, and not extrapolated or lost, in the shape of ``x``.

    Profiles of other programs tell no standard deviation: what has a position there was measured.
    """
    sd = next((name for name in ("y_sd", "x_sd") if name in profile), "x")
    return np.asarray(np.isfinite(profile[sd].values))


def measured_sd(profile: xr.Dataset) -> xr.DataArray:
    """Standard deviation of a tracked profile in the direction it was measured in: ``y_sd``, or ``x_sd``.

    Whiskers that run along the rows of the image are measured in y, those along its columns in x. NaN where a node
    was not measured.

    Raises
    ------
    InputError
        If the profile has neither.
    """
    name = "x_sd" if "x_sd" in profile and "y_sd" not in profile else "y_sd"
    require(profile, name)
    return profile[name]
