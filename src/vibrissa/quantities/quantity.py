"""One variable: its dimensions, unit and long name."""

from __future__ import annotations

from typing import Any, NamedTuple


class Quantity(NamedTuple):
    """One variable: its core dimensions, SI unit ("1" if adimensional) and long name."""

    dims: tuple[str, ...]
    unit: str
    long_name: str


SUFFIXES = ("", "_low", "_high")  # of the names of an estimate and of the ends of its interval


def estimate(name: str, value: Any, low: Any, high: Any) -> dict[str, Any]:
    """Estimate and the ends of its interval, by the names that the table has for them.

    Parameters
    ----------
    name : str
        The variable.
    value, low, high
        The estimate, and the lower and the upper end of its interval.

    Returns
    -------
    dict
        ``name``, ``name_low`` and ``name_high``.
    """
    return dict(zip((name + end for end in SUFFIXES), (value, low, high), strict=True))


def ranged(
    name: str, dims: tuple[str, ...], unit: str, long_name: str, of: str = "", interval: str = "interval"
) -> dict[str, Quantity]:
    """Variable and the ends of its 95 % interval.

    Parameters
    ----------
    name : str
        The variable.
    dims, unit, long_name
        As in :class:`Quantity`.
    of : str
        The variable in words in the names of its ends; by default its long name.
    interval : str
        As in :func:`ends`.

    Returns
    -------
    dict of Quantity
        ``name``, ``name_low`` and ``name_high``.
    """
    return {name: Quantity(dims, unit, long_name)} | ends(name, dims, unit, of or long_name, interval)


def ends(
    name: str, dims: tuple[str, ...], unit: str, long_name: str, interval: str = "interval"
) -> dict[str, Quantity]:
    """Ends of the 95 % interval of a variable.

    Parameters
    ----------
    name : str
        The variable.
    dims, unit
        As of the variable.
    long_name : str
        The variable in words; empty where its own long name says it.
    interval : str
        The interval in words, such as "interval by whisker".

    Returns
    -------
    dict of Quantity
        ``name_low`` and ``name_high``.
    """
    of = f"{long_name}, " if long_name else ""
    return {
        f"{name}_{end}": Quantity(dims, unit, f"{of}{side} end of the 95 % {interval}")
        for end, side in (("low", "lower"), ("high", "upper"))
    }
