"""Numbers as the report prints them: with the digits of their interval, in brackets, and no sign before a zero."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from vibrissa.figures.words import decimals

_LEAST = 1e-9  # of a number: below it an interval is one of rounding
_MOST = 6  # digits of a number without an interval: a correlation of 0.99999 is not 1
_ZERO = re.compile(r"[+-](?=[0.]+$)")


class Printed(NamedTuple):
    """Truth, number found and the ends of its 95 % interval as text; empty where not known."""

    truth: str
    found: str
    low: str
    high: str

    @property
    def interval(self) -> str:
        """In the brackets that the report prints: ``[3.41, 4.12]``."""
        return f"[{self.low}, {self.high}]" if self.low else ""

    @property
    def with_interval(self) -> str:
        """Number and interval: ``3.75 [3.41, 4.12]``."""
        return f"{self.found} {self.interval}".rstrip()


def plain(value: float, form: str) -> str:
    """A number in a format, with a minus that is one, and no sign before a zero.

    Parameters
    ----------
    value : float
        Finite.
    form : str
        As ``format`` takes it.

    Returns
    -------
    str
        ``−0.3``; ``0.00`` of −0.001.
    """
    return _ZERO.sub("", f"{value:{form}}").replace("-", "−")


def printed(truth: float, found: float, low: float = np.nan, high: float = np.nan) -> Printed:
    """Truth, number found and interval, all with the decimals that give half the interval two digits.

    Parameters
    ----------
    truth, found, low, high : float
        NaN where not known. Without an interval, the difference of truth and found has two digits.

    Returns
    -------
    Printed
        Texts; that of a number that was not found is ``no fit``.
    """
    half, error = (high - low) / 2, abs(found - truth)
    if half > _LEAST * abs(found):
        form = f".{decimals(half)}f"
    elif error > 0 and found:
        most = _MOST - 1 - int(np.floor(np.log10(abs(found))))
        form = f".{max(0, min(decimals(error), most))}f"
    else:
        form = f".{_MOST}g"
    exact = not half > 0 and truth == round(truth, 0)  # as of a correlation
    first = "" if np.isnan(truth) else plain(truth, "g" if exact else form)
    second, *ends = (plain(one, form) if np.isfinite(one) else "" for one in (found, low, high))
    return Printed(first, second or "no fit", *ends)
