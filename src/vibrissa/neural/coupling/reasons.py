"""What the test of a unit cannot tell, in words."""

from __future__ import annotations

import numpy as np

from vibrissa.neural.coupling.carrier import ELSEWHERE
from vibrissa.neural.coupling.envelope_coupling import Coupling, Null
from vibrissa.neural.coupling.nulls import Circular, Lags, Record, circular_correlogram

REPEATED = 0.9  # correlation of the envelope with itself, shifted, above which the shift is no chance


def repeats(record: Record, chance: Null, lags: Lags, width: float) -> str:
    """Say that circular shifts of the envelope are no chance, since it is like itself after one of them.

    Parameters
    ----------
    record : Record
        Gives the envelope in bins.
    chance : Null
        What is taken for chance.
    lags : (int, int)
        First and last lag tried [bins].
    width : float
        Of the bins [s].

    Returns
    -------
    str
        Empty where it is not so, and of other nulls.
    """
    if not isinstance(chance, Circular):
        return ""
    shift = chance.shifts(len(record.envelope), lags)
    of = record.envelope, record.envelope_valid
    likeness = circular_correlogram(*of, *of)[shift]
    like = np.flatnonzero(likeness > REPEATED)
    if not like.size:
        return ""
    first = like[np.arange(like.size) == like - like[0]]  # the first run of them
    after = shift[first[np.argmax(likeness[first])]] * width
    return f"cannot tell: the envelope repeats after {after:g} s, and a shift by that is no chance"


def elsewhere(coupling: Coupling, unit: int, lags: Lags, width: float, *, beyond: bool) -> str:
    """Say that the correlation peaks within ±50 ms, but at none of the lags that were tested.

    Parameters
    ----------
    coupling : Coupling
        Of all units.
    unit : int
        Which.
    lags : (int, int)
        First and last lag tried [bins].
    width : float
        Of the bins [s].
    beyond : bool
        Whether the peak, or that of the lags tried, is beyond chance.

    Returns
    -------
    str
        Empty where it is not so.
    """
    peak, (first, last) = int(coupling.peak_lag[unit]), lags
    if first <= peak <= last or not beyond:
        return ""
    at, tested = 1e3 * peak * width, f"{1e3 * first * width:g} to {1e3 * last * width:g} ms"
    return f"{ELSEWHERE} {at:g} ms, outside the lags tested ({tested})"
