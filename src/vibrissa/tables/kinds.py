"""Whose object a thing is, without importing the package that defines it."""

from __future__ import annotations

from typing import Any


def is_a(thing: Any, package: str, *names: str) -> bool:
    """Whether a thing is of a class of a package, or of one derived from it.

    Parameters
    ----------
    thing : object
        Any object.
    package : str
        Name of the package, such as ``neo``.
    *names : str
        Names of the classes.

    Returns
    -------
    bool
        True if it is.

    Examples
    --------
    >>> from collections import OrderedDict
    >>> is_a(OrderedDict(), "collections", "OrderedDict"), is_a(3, "neo", "SpikeTrain")
    (True, False)
    """
    return any(one.__module__.partition(".")[0] == package and one.__name__ in names for one in type(thing).__mro__)


def described(thing: Any) -> str:
    """Package and class of a thing, for messages and attributes.

    Parameters
    ----------
    thing : object
        Any object.

    Returns
    -------
    str
        Such as ``neo SpikeTrain``.

    Examples
    --------
    >>> described([1, 2])
    'list'
    """
    package = type(thing).__module__.partition(".")[0]
    return type(thing).__name__ if package == "builtins" else f"{package} {type(thing).__name__}"


def is_quantity(thing: Any) -> bool:
    """Whether a thing is an array or a number with a unit, of quantities (and so of neo), pint or astropy.

    Parameters
    ----------
    thing : object
        Any object.

    Returns
    -------
    bool
        True if it is.
    """
    return any(is_a(thing, package, "Quantity") for package in ("quantities", "pint", "astropy"))
