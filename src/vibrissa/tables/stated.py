"""Numbers in SI, also of objects of other packages that state another unit."""

from __future__ import annotations

from numbers import Real
from reprlib import repr as short
from typing import Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import FormatError, InputError, UnknownError
from vibrissa.tables.kinds import described, is_a, is_quantity
from vibrissa.tables.units import PURE, UNITS, in_si

SAY_SI = "without a unit, in SI: 0.04 for 40 mm"
UNMASK = "leave the masked entries out: values.compressed()"


def bare(thing: Any, unit: str | None) -> Any:
    """Numbers in a unit, of a thing that states one; any other thing as it is.

    Parameters
    ----------
    thing : object
        Such as an array of quantities, an xarray ``DataArray`` with the attribute ``units``, an array of
        ``timedelta64``, or a list of quantities.
    unit : str or None
        The SI unit wanted; None for that of the thing, which an xarray object alone can state.

    Returns
    -------
    object
        Numbers in that unit, or the thing.

    Raises
    ------
    InputError
        If its unit is of another kind or unknown, or entries are masked.
    """
    if isinstance(thing, list | tuple) and any(map(_states, {type(one): one for one in thing}.values())):
        return [bare(one, unit) for one in thing]
    if is_a(thing, "xarray", "DataArray"):
        return _of_data_array(thing, unit)
    if is_quantity(thing):
        return bare(_magnitude(thing, unit), unit)
    refuse_masked(thing)
    kind = getattr(getattr(thing, "dtype", None), "kind", "")
    if kind == "m" and unit == "s":
        return np.asarray(thing, "timedelta64[ns]") / np.timedelta64(1, "s")
    if kind in ("m", "M"):
        raise UnknownError(described(thing), f"must be numbers in {unit or 'SI'}", thing.dtype)
    return thing


def refuse_masked(thing: Any, name: str = "masked array", remedy: str = UNMASK) -> None:
    """Refuse an array of which entries are masked.

    Parameters
    ----------
    thing : object
        Any; only a masked array can have such entries.
    name, remedy : str
        For messages.

    Raises
    ------
    InputError
        Says how many.
    """
    if isinstance(thing, np.ma.MaskedArray) and (masked := int(np.ma.getmaskarray(thing).sum())):
        raise FormatError(name, "must have no masked entries", masked, remedy)


def numbers(name: str, thing: Any, unit: str | None) -> Array:
    """Numbers in SI as a new array, which does not change with the object given.

    Parameters
    ----------
    name : str
        Its name in messages.
    thing : array_like
        Numbers in the unit, or with one: see :func:`bare`.
    unit : str or None
        SI unit.

    Returns
    -------
    array
        In that unit.

    Raises
    ------
    InputError
        If they are no numbers, or in another kind of unit.
    """
    try:
        return _floats(bare(thing, unit))
    except InputError as error:
        raise error.renamed(name) from None
    except (TypeError, ValueError):
        raise FormatError(name, f"must be numbers in {unit or 'SI'}", short(thing)) from None


def _floats(plain: Any) -> Array:
    """A new array, also where it is one already; no text, though it read as numbers."""
    if np.asarray(plain).dtype.kind in "US":
        raise TypeError
    return np.array(plain, float)


def number(name: str, value: Any, unit: str | None, form: str = SAY_SI) -> float:
    """One number in SI; a text with a unit or an array of several is refused.

    Parameters
    ----------
    name : str
        Its name in messages.
    value : object
        A number in the unit, or with one: see :func:`bare`; also an array of no dimension.
    unit : str or None
        SI unit.
    form : str
        Remedy.

    Returns
    -------
    float
        In that unit; a plain ``int`` or ``float`` as it is.

    Raises
    ------
    InputError
        Shows the right form.
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value
    try:
        plain = bare(value, unit)
    except InputError as error:
        raise type(error)(name, error.rule, error.value, error.remedy or form) from None
    real = plain.dtype.kind in "iuf" if hasattr(plain, "dtype") else isinstance(plain, Real)
    if isinstance(plain, bool) or not real or np.ndim(plain):
        found = repr(value) if isinstance(value, str) else f"a {type(value).__name__}"
        raise FormatError(name, "must be a number", found, form)
    return float(plain)


def _states(one: Any) -> bool:
    """Whether an entry of a list, by its class, may state a unit, or holds entries that do."""
    plain = isinstance(one, np.number) and not isinstance(one, np.timedelta64)
    return isinstance(one, list | tuple) or is_quantity(one) or (hasattr(one, "dtype") and not plain)


def _of_data_array(array: Any, unit: str | None) -> Any:
    """Numbers of an xarray object, whose values or attributes state the unit."""
    if is_quantity(array.data):
        return bare(array.data, unit)
    stated = array.attrs.get("units")
    if stated is None or array.dtype.kind in "mM":
        return bare(array.to_numpy(), unit)
    values, found = in_si(array.to_numpy(), str(stated))
    if found != unit and (unit is not None or not _is_si(found)):
        rule = f"must be in {unit}, or a unit of columns that is a multiple of it" if unit else "must have a unit of SI"
        raise UnknownError("xarray DataArray", rule, stated)
    return values


def _is_si(unit: str) -> bool:
    """Whether it is an SI unit of columns, or of one of the quantities."""
    from vibrissa.quantities import QUANTITIES

    return unit in (*UNITS, PURE) or any(unit == quantity.unit for quantity in QUANTITIES.values())


def _magnitude(thing: Any, unit: str | None) -> Any:
    """Numbers in a unit of what quantities, pint or astropy holds."""
    if unit is None:
        raise UnknownError(described(thing), "must be numbers in SI", thing, SAY_SI)
    wanted = "" if unit == PURE else unit.replace("³", "**3")
    try:
        if is_a(thing, "quantities", "Quantity"):
            return thing.rescale(wanted or "dimensionless").magnitude
        return thing.m_as(wanted) if is_a(thing, "pint", "Quantity") else thing.to_value(wanted)
    except Exception as error:  # each package has its own
        raise UnknownError(described(thing), f"must be in {unit} or a multiple of it", str(error)) from error
