"""Names, dimensions and units of everything that crosses a room: the one table.

Public model functions return ``dataset(...)``; entry points call ``require(...)``. Whisker, sweep, trial
and parameter dimensions may lead the core dimensions listed here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrissa import __version__
from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


class Quantity(NamedTuple):
    """One variable: its core dimensions, SI unit ("1" if adimensional) and long name."""

    dims: tuple[str, ...]
    unit: str
    long_name: str


QUANTITIES: dict[str, Quantity] = {
    # coordinates
    "time": Quantity(("time",), "s", "time"),
    "node": Quantity(("node",), "1", "node along the shaft, from the skin"),
    "mode": Quantity(("mode",), "1", "mode number"),
    "whisker": Quantity(("whisker",), "1", "whisker"),
    "frequency": Quantity(("frequency",), "Hz", "frequency"),
    "s": Quantity(("s",), "1", "arc length over L, 0 at the cone's tip, 1 at the base"),
    "trial": Quantity(("trial",), "1", "trial"),
    "bin": Quantity(("bin",), "s", "start of the time bin"),
    # tracked and rendered centrelines
    "x": Quantity(("time", "node"), "m", "position of the centreline, x"),
    "y": Quantity(("time", "node"), "m", "position of the centreline, y"),
    "x_sd": Quantity(("time", "node"), "m", "standard deviation of x"),
    "y_sd": Quantity(("time", "node"), "m", "standard deviation of y"),
    "arc_length": Quantity(("node",), "m", "arc length from the skin"),
    "displacement": Quantity(("time", "node"), "m", "transverse displacement about the mean profile"),
    # modes
    "contact": Quantity((), "1", "position ε of the contact along the shaft, over L"),
    "kappa": Quantity(("mode",), "1", "adimensional resonant angular frequency κ"),
    "resonant_frequency": Quantity(("mode",), "Hz", "resonant frequency κ/(2πk)"),
    "mode_shape": Quantity(("mode", "s"), "1", "mode shape V, orthonormal under s²"),
    "mode_curvature": Quantity(("mode", "s"), "1", "second derivative of the mode shape V''"),
    # statics, adimensional
    "angle": Quantity(("s",), "rad", "angle θ of the tangent to the substrate"),
    "base_angle": Quantity((), "rad", "angle θ_b at the base"),
    "contact_force": Quantity((), "1", "contact force Λ over πEα⁴L²/4"),
    "base_distance": Quantity((), "1", "distance H from base to substrate, over L"),
    "contact_distance": Quantity((), "1", "distance D from contact to base along the substrate, over L"),
    "profile_x": Quantity(("s",), "1", "position along the substrate from the contact, over L"),
    "profile_y": Quantity(("s",), "1", "height above the substrate, over L"),
    "unit_response": Quantity(("s",), "1", "quasi-static displacement per unit of excursion Ū"),
    "coupling": Quantity(("mode",), "1", "coupling of a mode to the excursion c"),
    "gap_width": Quantity((), "1", "width λ of the gap, over L"),
    "excursion_at_jump": Quantity((), "1", "excursion d₂ at which the contact jumps, over L"),
    # dynamics
    "excursion": Quantity(("time",), "1", "horizontal excursion d of the contact, over L"),
    "mode_amplitude": Quantity(("mode", "time"), "1", "vibration amplitude q of a mode, over L"),
    "mode_displacement": Quantity(("mode", "time"), "1", "amplitude a movie shows, q + Q(d), over L"),
    "mode_displacement_sd": Quantity(("mode", "time"), "1", "standard deviation of the mode displacement"),
    "variance_explained": Quantity(("mode",), "1", "share of the displacement's variance in this mode"),
    "envelope": Quantity(("mode", "time"), "1", "envelope A of a mode, over L"),
    "phase": Quantity(("mode", "time"), "rad", "phase of a mode"),
    # spectra
    "power": Quantity(("mode", "frequency"), "s", "one-sided power spectral density"),
    "damping": Quantity(("mode",), "1", "damping ratio ζ"),
    # the follicle
    "base_curvature": Quantity(("time",), "1/m", "curvature at the base"),
    "base_moment": Quantity(("time",), "N m", "bending moment at the base"),
    # geometry
    "distance": Quantity(("point",), "m", "distance from the base along the shaft"),
    "diameter": Quantity(("point",), "m", "diameter of the shaft"),
    # neurons
    "spike_time": Quantity(("spike",), "s", "time of a spike in its trial"),
    "spike_trial": Quantity(("spike",), "1", "trial of a spike"),
    "firing_rate": Quantity(("bin",), "Hz", "firing rate averaged over trials"),
    "bin_envelope": Quantity(("bin",), "m", "envelope averaged over the bin"),
}


def _dims(name: str, values: np.ndarray, lead: tuple[str, ...]) -> tuple[str, ...]:
    if name not in QUANTITIES:
        raise InputError(name, "must stand in quantities.QUANTITIES")
    core = QUANTITIES[name].dims
    if values.ndim == len(core):
        return core
    if values.ndim == len(core) + len(lead):
        return lead + core
    raise InputError(name, f"must have dimensions {core} or {lead + core}", f"shape {values.shape}")


def dataset(
    attrs: Mapping[str, Any] | None = None, *, lead: tuple[str, ...] = (), **variables: Any
) -> xr.Dataset:
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
            raise InputError(
                f"variable {name!r}",
                "is missing from the dataset",
                f"only {sorted(map(str, data.variables))}",
            )
        found = data[name]
        if not set(quantity.dims) <= set(found.dims):
            raise InputError(f"variable {name!r}", f"must have dimensions {quantity.dims}", str(found.dims))
        if found.attrs.get("units", quantity.unit) != quantity.unit:
            raise InputError(
                f"variable {name!r}", f"must be in {quantity.unit!r}", repr(found.attrs["units"])
            )
