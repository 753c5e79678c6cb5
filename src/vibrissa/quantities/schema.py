"""What a dataset must be before anything is computed from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import FormatError, MissingError, RangeError
from vibrissa.rounded_times import refuse_rounded

if TYPE_CHECKING:
    import xarray as xr

PLACES = ("x", "y", "arc_length")  # a place is finite, or was not measured


def conforming(data: xr.Dataset) -> xr.Dataset:
    """A dataset whose variables follow the table of quantities, their dimensions in its order.

    Parameters
    ----------
    data : Dataset
        As it was read. Variables that the table does not know are left alone.

    Returns
    -------
    Dataset
        The same; a variable whose dimensions come in another order is transposed.

    Raises
    ------
    InputError
        If a variable holds what is neither number nor text, or text where its unit asks for numbers; if ``time`` is
        absent beside a dimension ``time``, or does not ascend; if a place is infinite.
    """
    from vibrissa.quantities import QUANTITIES

    if "time" in data.dims and "time" not in data.variables:
        raise MissingError("variable 'time'", "is missing from a dataset with a dimension of this name")
    turned = {}
    for name in map(str, data.variables):
        quantity = QUANTITIES.get(name)
        if quantity is None:
            continue
        refuse_unsound(name, data.variables[name], numeric=quantity.unit != "1")
        dims, core = data.variables[name].dims, quantity.dims
        if set(core) <= set(dims) and dims[len(dims) - len(core) :] != core:
            turned[name] = data[name].transpose(..., *core)
    return data.assign(turned) if turned else data


def refuse_unsound(name: str, variable: xr.Variable | xr.DataArray, *, numeric: bool) -> None:
    """Refuse a variable that holds what cannot be computed with.

    Parameters
    ----------
    name : str
        Its name.
    variable : Variable
        Its values.
    numeric : bool
        Whether it must hold numbers.

    Raises
    ------
    InputError
        Names the variable, and the first value that breaks the rule.
    """
    values, kind = variable.values, variable.dtype.kind
    text = kind in "US" or (kind == "O" and all(isinstance(one, str) for one in values.flat))
    if kind not in "biuf" and (numeric or not text):
        first = repr(values.flat[0]) if values.size else str(variable.dtype)
        raise FormatError(f"variable {name!r}", "must hold numbers" if numeric else "must hold numbers or text", first)
    if name == "time":
        _refuse_unordered(np.atleast_1d(values))
    elif name in PLACES and kind == "f" and np.isinf(values).any():
        place = ", ".join(map(str, np.argwhere(np.isinf(values))[0]))
        raise RangeError(f"variable {name!r}", "must be finite, or NaN where it was not measured", f"inf at [{place}]")


def _refuse_unordered(time: np.ndarray) -> None:
    if not np.isfinite(time).all():
        at = int(np.flatnonzero(~np.isfinite(time))[0])
        raise RangeError("variable 'time'", "must be finite", f"{time[at]} at sample {at}")
    if (back := np.flatnonzero(np.diff(time) <= 0)).size:
        at = int(back[0])
        found = f"{time[at + 1]:.9g} after {time[at]:.9g} at sample {at + 1}"
        refuse_rounded(time, "variable 'time'")
        raise RangeError("variable 'time'", "must ascend", found, "sort the samples, and leave out doubled ones")
