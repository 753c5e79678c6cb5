"""What is known of one variable."""

from __future__ import annotations

from typing import NamedTuple


class Quantity(NamedTuple):
    """One variable: its core dimensions, SI unit ("1" if adimensional) and long name."""

    dims: tuple[str, ...]
    unit: str
    long_name: str
