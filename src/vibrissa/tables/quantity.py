"""A number with its unit, as people type it: ``40mm``, ``70deg``, ``100 mm/s``.

Pint, with a registry of the few units here, is imported where it is needed.
"""

from __future__ import annotations

import re
from decimal import Decimal
from functools import cache
from typing import Any

UNITS = """
    metre = [length] = m = meter
    second = [time] = s
    gram = [mass] = g
    volt = [voltage] = V
    radian = [angle] = rad
    degree = 0.017453292519943295 radian = deg = °
    minute = 60 second = min
    hertz = 1 / second = Hz
    newton = 1000 gram * metre / second ** 2 = N
    pascal = newton / metre ** 2 = Pa
    nano- = 1e-9 = n-
    micro- = 1e-6 = µ- = μ- = u-
    milli- = 1e-3 = m-
    centi- = 1e-2 = c-
    kilo- = 1e3 = k-
    mega- = 1e6 = M-
    giga- = 1e9 = G-
"""
QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-zµμ°/][\w°²³/*^()· -]*?)\s*")


def number(text: str) -> float | None:
    """The number of a text that has no unit; None of any other text.

    Parameters
    ----------
    text : str
        As typed.

    Returns
    -------
    float or None
        0.04 of ``0.04``, None of ``40mm``.
    """
    try:
        return None if "_" in text else float(text)  # 1_0, which Python would read as ten
    except ValueError:
        return None


def converted(text: str, unit: str) -> float | None:
    """A number with its unit, in another unit.

    Parameters
    ----------
    text : str
        As typed: ``95um``, ``100 mm/s``.
    unit : str
        SI unit: ``m``, ``m/s``, ``kg/m³``.

    Returns
    -------
    float or None
        None if the text is no quantity, or of another dimension.

    Examples
    --------
    >>> converted("95um", "m"), converted("2 kHz", "m"), converted("1150kg/m3", "kg/m³")
    (9.5e-05, None, 1150.0)
    """
    if (parts := QUANTITY.fullmatch(text)) is None:
        return None
    try:
        given, wanted = (_registry().parse_expression(_plain(one)) for one in (parts[2], unit))
        return float(Decimal(parts[1]) * given.to(wanted.units).magnitude)
    except Exception:  # pint's parser fails in a dozen ways
        return None


def _plain(unit: str) -> str:
    unit = re.sub(r"m([23])\b", r"m**\1", unit)  # of m3, cm2
    unit = unit.replace("²", "**2").replace("³", "**3").replace("^", "**").replace("·", "*")
    return f"1{unit}" if unit.startswith("/") else unit.replace("(s m)", "s/m")


@cache
def _registry() -> Any:
    from pint import UnitRegistry

    registry: Any = UnitRegistry(None, non_int_type=Decimal)  # 95um is 95e-6 to the last bit
    for line in UNITS.strip().splitlines():
        registry.define(line.strip())
    return registry
