"""What the test of a unit cannot tell, in words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vibrissa.arrays import Mask
from vibrissa.neural.coupling.carrier import ELSEWHERE
from vibrissa.neural.coupling.envelope_coupling import Coupling, Null, envelope_coupling
from vibrissa.neural.coupling.nulls import BinnedRecord, Circular, Lags, circular_correlogram
from vibrissa.stats import adjusted_p_values

REPEATED = 0.9  # correlation of the envelope with itself, shifted, above which the shift is no chance


def repeats(record: BinnedRecord, chance: Null, lags: Lags, width: float) -> str:
    """Say that circular shifts of the envelope are no chance, since it is like itself after one of them.

    Parameters
    ----------
    record : BinnedRecord
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


def uncoupled(
    record: BinnedRecord, coupling: Coupling, chance: Null, lags: Lags, width: float, *, significant: Mask, level: float
) -> dict[int, str]:
    """Say of each unit that did not pass why not.

    The envelope repeats, the rate falls with it, shifts are too few, or there is no coupling.

    Parameters
    ----------
    record, chance, lags, width
        As in :func:`repeats`, of all units.
    coupling : Coupling
        Of all units.
    significant : (U,) array of bool
        Units that passed.
    level : float
        Largest p-value of a fall, by the same test with the sign turned, adjusted over the units that did not pass.

    Returns
    -------
    dict of str
        By the place of the unit.
    """
    others = np.flatnonzero(~significant)
    plain = repeats(record, chance, lags, width) or "no significant coupling to the envelope"
    reasons = dict.fromkeys(others.tolist(), plain)
    if not others.size or not isinstance(chance, Circular) or plain.startswith("cannot tell"):
        return reasons
    for place in others[(coupling.p_value[others] <= level) & (coupling.tail_p_value[others] > level)].tolist():
        reasons[place] = (
            "no shift of the envelope correlates as well, but so few independent ones show no more than "
            f"p = {coupling.tail_p_value[place]:.2g}; a longer stimulus shows more"
        )
    turned = envelope_coupling(replace(record, rates=-record.rates[others]), chance, lags=lags, reach=0)
    falls = np.nan_to_num(adjusted_p_values(turned.tail_p_value), nan=1.0) <= level
    for place in np.flatnonzero(falls):
        r = -turned.correlation[place]
        reasons[int(others[place])] = f"the rate falls with the envelope (r = {r:.2f}): only rises are fitted"
    return reasons


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
