"""Names, dimensions and units of everything that crosses a room: the one table.

Public model functions return ``dataset(...)``; entry points call ``require(...)``. Whisker, sweep, trial
and parameter dimensions may lead the core dimensions listed here.

Internal: the public names are those of ``vibrissa`` itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa import __version__
from vibrissa.arrays import Mask
from vibrissa.errors import MissingError, ShapeError, UnknownError
from vibrissa.quantities.coding import CODING
from vibrissa.quantities.discrimination import DISCRIMINATION
from vibrissa.quantities.figures import FIGURES
from vibrissa.quantities.identity import IDENTITY
from vibrissa.quantities.kinematics import KINEMATICS
from vibrissa.quantities.mechanics import MECHANICS
from vibrissa.quantities.neural import NEURAL
from vibrissa.quantities.plans import PLANS
from vibrissa.quantities.quantity import Quantity as Quantity
from vibrissa.quantities.schema import conforming, refuse_unsound
from vibrissa.quantities.segments import SEGMENTS
from vibrissa.quantities.sorting import SORTING
from vibrissa.quantities.sweeps import SWEEPS
from vibrissa.quantities.tracks import TRACKS

if TYPE_CHECKING:
    import xarray as xr

QUANTITIES = TRACKS | SEGMENTS | MECHANICS | SWEEPS | NEURAL | CODING | FIGURES | DISCRIMINATION | SORTING | PLANS
QUANTITIES |= KINEMATICS | IDENTITY


def _dims(name: str, values: np.ndarray, lead: tuple[str, ...]) -> tuple[str, ...]:
    if name not in QUANTITIES:
        raise UnknownError(name, "must be in quantities.QUANTITIES")
    core = QUANTITIES[name].dims
    if values.ndim == len(core):
        return core
    if values.ndim == len(core) + len(lead):
        return lead + core
    raise ShapeError(name, f"must have dimensions {core} or {lead + core}", f"shape {values.shape}")


def dataset(attrs: Mapping[str, Any] | None = None, *, lead: tuple[str, ...] = (), **variables: Any) -> xr.Dataset:
    """Label arrays with the dimensions, units and long names of the one table.

    Parameters
    ----------
    attrs : mapping, optional
        Parameters that made the data: numbers and strings (no clock: equal inputs give equal files).
    lead : tuple of str
        Dimensions that lead the core dimensions where an array has that many more.
    **variables
        Arrays by name, each of a name in ``QUANTITIES``.

    Returns
    -------
    Dataset
        Variables; those named as their own dimension are coordinates.

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
        attributes = {"units": QUANTITIES[name].unit, "long_name": QUANTITIES[name].long_name}
        # the short way for plain arrays: on the long one xarray imports Dask, where it is installed, to compare types
        arrays[name] = xr.Variable(dims, array, attributes, fastpath=array.dtype.kind not in "OMm")
    coordinates = {name: arrays.pop(name) for name in list(arrays) if arrays[name].dims == (name,)}
    return xr.Dataset(arrays, coordinates, {**(attrs or {}), "vibrissa_version": __version__})


def stacked(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Columns of a table from its rows.

    Parameters
    ----------
    rows : sequence of mapping
        At least one; all have the names of the first.

    Returns
    -------
    dict of arrays
        By name, the rows along the first axis.
    """
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def require(data: xr.Dataset, *names: str) -> None:
    """Check that a dataset holds these variables, with their dimensions and units.

    Parameters
    ----------
    data : Dataset
        Input of a function.
    *names : str
        What it must hold.

    Raises
    ------
    InputError
        Names the first variable that is missing, or has other dimensions or another unit.
    """
    for name in names:
        quantity = QUANTITIES[name]
        if name not in data.variables:
            others = sorted(map(str, data.variables))
            there = ", ".join(others[:8]) + (f" and {len(others) - 8} more" if others[8:] else "")
            raise MissingError(f"variable {name!r}", "is missing from the dataset", f"only {there}")
        found = data[name]
        if not set(quantity.dims) <= set(found.dims):
            raise ShapeError(f"variable {name!r}", f"must have dimensions {quantity.dims}", str(found.dims))
        if found.attrs.get("units", quantity.unit) != quantity.unit:
            raise UnknownError(f"variable {name!r}", f"must be in {quantity.unit!r}", repr(found.attrs["units"]))
        refuse_unsound(name, found, numeric=quantity.unit != "1")


def measured(profile: xr.Dataset) -> Mask:
    """Whether each node was measured, and not extrapolated or lost, in the shape of ``x``.

    Profiles of other programs have no standard deviation: a node with a position there was measured.

    Parameters
    ----------
    profile : Dataset
        With ``x`` (time, node), maybe ``x_sd`` or ``y_sd``.

    Returns
    -------
    (..., time, node) array of bool
        True where it was.
    """
    sd = next((name for name in ("y_sd", "x_sd") if name in profile), "x")
    return np.asarray(np.isfinite(profile[sd].values))


def measured_sd(profile: xr.Dataset) -> xr.DataArray:
    """Standard deviation of a tracked profile in the direction it was measured in: ``y_sd``, or ``x_sd``.

    Whiskers that run along the rows of the image are measured in y, those along its columns in x. NaN where a node
    was not measured.

    Parameters
    ----------
    profile : Dataset
        With ``x_sd`` or ``y_sd`` (time, node).

    Returns
    -------
    DataArray
        Standard deviation [m].

    Raises
    ------
    InputError
        If the profile has neither.
    """
    name = "x_sd" if "x_sd" in profile and "y_sd" not in profile else "y_sd"
    require(profile, name)
    return profile[name]


def one_whisker(profile: xr.Dataset) -> xr.Dataset:
    """The only whisker of tracks, dimensions in the order of the table.

    Parameters
    ----------
    profile : Dataset
        With ``x`` on whisker, time and node, or time and node, in any order.

    Returns
    -------
    Dataset
        Without a dimension for it, in double precision: fits of single precision do not converge.

    Raises
    ------
    InputError
        If there are several.
    """
    require(profile, "x", "y", "arc_length")
    profile = conforming(profile)
    profile = profile.assign({name: profile[name].astype(float, copy=False) for name in ("x", "y", "arc_length")})
    if "whisker" not in profile.dims:
        return profile
    if profile.sizes["whisker"] != 1:
        remedy = "choose one: profile.isel(whisker=0)"
        raise UnknownError("profile", "must be of one whisker", profile.sizes["whisker"], remedy)
    return profile.isel(whisker=0)
