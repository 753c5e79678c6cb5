"""Units of columns and options: one table, and what the end of a column's name means."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import TypeVar

from vibrissa.arrays import Array

Numbers = TypeVar("Numbers", float, Array)

TEXT, PURE = "text", "1"  # in place of an SI unit: words, and numbers without a unit


UNITS: dict[str, dict[str, int]] = {  # of each SI unit, and the power of ten that one of them is of it
    "m": {"m": 0, "mm": -3, "um": -6, "µm": -6, "nm": -9, "Å": -10, "pm": -12},
    "s": {"s": 0, "ms": -3, "us": -6},
    "m/s": {"m_s": 0, "mm_s": -3},
    "rad": {"rad": 0, "mrad": -3, "deg": 0},
    "1/m": {"1/m": 0, "1/mm": 3, "per_m": 0, "per_mm": 3},
    "1/(s m)": {"per_um": 6},
    "N": {"N": 0, "mN": -3, "uN": -6},
    "N m": {"N m": 0, "mN m": -3, "uN m": -6, "nN m": -9},
    "Pa": {"Pa": 0, "kPa": 3, "MPa": 6, "GPa": 9},
    "kg/m³": {"kg/m³": 0},
    "V": {"V": 0, "mV": -3, "uV": -6},
    "strain": {"1": 0, "mstrain": -3, "ustrain": -6},
    "dB": {"dB": 0},
    "a.u.": {"a.u.": 0, "au": 0},
}
FACTORS = {"deg": math.pi / 180}  # of units that are no power of ten of the SI unit
OTHER_SPELLINGS = {  # of other programs, without the s of the plural and the sign of a power
    "meter": "m",
    "millimeter": "mm",
    "micrometer": "um",
    "micron": "um",
    "μm": "um",
    "nanometer": "nm",
    "metre": "m",
    "millimetre": "mm",
    "micrometre": "um",
    "nanometre": "nm",
    "second": "s",
    "sec": "s",
    "millisecond": "ms",
    "microsecond": "us",
    "µs": "us",
    "μs": "us",
    "volt": "V",
    "millivolt": "mV",
    "microvolt": "uV",
    "µV": "uV",
    "μV": "uV",
    "m/s": "m_s",
    "mm/s": "mm_s",
    "m-1": "1/m",
    "mm-1": "1/mm",
    "1/meter": "1/m",
    "1/millimeter": "1/mm",
    "pascal": "Pa",
    "gigapascal": "GPa",
    "kg/m3": "kg/m³",
    "kg m-3": "kg/m³",
    "kilogram/meter3": "kg/m³",
    "degree": "deg",
    "°": "deg",
    "radian": "rad",
    "decibel": "dB",
    "db": "dB",
    "arb. unit": "a.u.",
    "arbitrary unit": "a.u.",
    "a.u": "a.u.",
    "": PURE,
    "dimensionless": PURE,
}
POWERS = {name: power for units in UNITS.values() for name, power in units.items()}


def to_si(values: Numbers, unit: str) -> Numbers:
    """Give numbers in their SI unit.

    Parameters
    ----------
    values : float or array
        In the unit.
    unit : str
        One of those in ``UNITS``; of another the numbers are in SI already.

    Returns
    -------
    float or array
        In SI: the numbers nearest to the decimals written, as a power of ten below one divides.
    """
    if unit in FACTORS:
        return values * FACTORS[unit]
    power = POWERS.get(unit, 0)
    return values / 10.0**-power if power < 0 else values * 10.0**power


def in_si(values: Numbers, unit: str) -> tuple[Numbers, str]:
    """Give numbers in the SI unit of theirs, and that unit; in one that is not in the table they stay as they are.

    Parameters
    ----------
    values : float or array
        In the unit.
    unit : str
        In any spelling, as other programs state it: ``um``, ``µm``, ``micrometers``.

    Returns
    -------
    values : float or array
        In SI.
    unit : str
        Its SI unit, or the unit as given.

    Examples
    --------
    >>> in_si(250.0, "micrometers"), in_si(3.0, "degC")
    ((0.00025, 'm'), (3.0, 'degC'))
    """
    plain = _plain(unit)
    si = next((si for si, units in UNITS.items() if plain in units and plain != PURE), None)
    return (values, plain) if si is None else (to_si(values, plain), si)


def units_of(si: str) -> list[str]:
    """Give the units that have the SI unit ``si``, such as m, mm, um, nm of ``m``.

    Parameters
    ----------
    si : str
        SI unit.

    Returns
    -------
    list of str
        Ends of names.
    """
    return list(UNITS.get(si, ()))


def unit_of(column: str, quantity: str, si: str) -> str | None:
    """Give the unit in which a column holds a quantity.

    Parameters
    ----------
    column : str
        Name of the column: the quantity's own, in SI, or ending in its unit, as ``width_um``.
    quantity : str
        What is looked for, as ``width``.
    si : str
        Its SI unit.

    Returns
    -------
    str or None
        The unit; None where the column holds something else.
    """
    if column == quantity:
        return si
    end = column.removeprefix(f"{quantity}_")
    return end if end != column and end in units_of(si) else None


def channel_and_unit(column: str) -> tuple[str, str | None]:
    """Give the name of a channel, and the unit that the name of its column ends in, the longest one that is known.

    Parameters
    ----------
    column : str
        Such as ``contra_um``.

    Returns
    -------
    name : str
        The column's name without its unit.
    unit : str or None
        None where it ends in no unit.

    Examples
    --------
    >>> channel_and_unit("contra_um"), channel_and_unit("velocity_mm_s"), channel_and_unit("left_paw")
    (('contra', 'um'), ('velocity', 'mm_s'), ('left_paw', None))
    """
    cuts = [place for place, letter in enumerate(column) if letter == "_" and place > 0]
    return next(((column[:at], column[at + 1 :]) for at in cuts if is_unit(column[at + 1 :])), (column, None))


def is_unit(text: str) -> bool:
    """Whether a text is a unit of the table, in any spelling.

    Parameters
    ----------
    text : str
        Such as ``um`` or ``micrometers``.

    Returns
    -------
    bool
        True if it is; a pure number has none.
    """
    plain = _plain(text)
    return plain != PURE and plain in POWERS


def _plain(unit: str) -> str:
    """The unit by its name in the table, if another program's spelling, singular or plural, is known."""
    written = re.sub(r" *(\*\*|\^) *", "", unit).replace(" / ", "/")  # m**-1 and m^-1 as m-1
    found = OTHER_SPELLINGS.get(written, OTHER_SPELLINGS.get(written.removesuffix("s") or written, written))
    return found if found in POWERS else unit


def spellings(quantities: Iterable[tuple[str, str]]) -> list[str]:
    """List the names that columns of these quantities, each with its SI unit, may have.

    Parameters
    ----------
    quantities : iterable of (str, str)
        Name and SI unit of each.

    Returns
    -------
    list of str
        With and without a unit.
    """
    return [name for kind, si in quantities for name in (kind, *(f"{kind}_{unit}" for unit in units_of(si)))]
