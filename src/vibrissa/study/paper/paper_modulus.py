"""E and the collapse of resonances that the sweeps give for the paper's, by Eq. 5 and with the texture's forcing."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.exact import cone_kappa
from vibrissa.stats import jackknife_interval
from vibrissa.study.paper.sweep_measures import WHITE, MeasuredNumber, column, mean, whiskers_of
from vibrissa.whisker import YOUNGS_MODULUS

if TYPE_CHECKING:
    import xarray as xr


def measured_kappa(sweeps: xr.Dataset, mode: int, forcing: str = WHITE) -> tuple[Array, Array]:
    """κ measured with the nominal E, kω, and κ(ε) of the straight pinned cone, (sweep,) each.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.
    mode : int
        Counted from 1.
    forcing : str
        End of the columns: ``_white``, or "".

    Returns
    -------
    found, model : (S,) arrays
        NaN where not measured, or no contact.
    """
    contact, timescale = column(sweeps, "contact"), column(sweeps, "timescale")
    found = 2 * np.pi * timescale * column(sweeps, f"resonant_frequency{forcing}", mode)
    inside = (contact > 0) & (contact < 1)
    model = [_pinned(float(e))[mode - 1] if ok else np.nan for e, ok in zip(contact, inside, strict=True)]
    return found, np.array(model)


@lru_cache(maxsize=10_000)
def _pinned(contact: float) -> Array:
    return cone_kappa(contact, 2)


def _modulus_ratio(sweeps: xr.Dataset, forcing: str) -> Array:
    """E over its nominal value that brings each sweep's modes 1 and 2 onto κ(ε), (sweep,)."""
    ratios = np.log([found / model for found, model in (measured_kappa(sweeps, mode, forcing) for mode in (1, 2))])
    made = np.isfinite(ratios)
    total = np.where(made, ratios, 0).sum(axis=0)
    return np.exp(2 * np.where(made.any(axis=0), total / np.maximum(made.sum(axis=0), 1), np.nan))


def modulus_here(sweeps: xr.Dataset) -> MeasuredNumber:
    """E by Eq. 5, and with the texture's forcing where that is known.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    MeasuredNumber
        The number and its interval, or a note why there is none.
    """
    known = "resonant_frequency" in sweeps
    informed = _modulus(sweeps, "") if known else None
    note = "modes 1 and 2 on κ(ε) of straight modes, ρ as printed"
    return _modulus(sweeps, WHITE)._replace(note=note, informed=informed)


def _modulus(sweeps: xr.Dataset, forcing: str) -> MeasuredNumber:
    whole = mean(np.log(_modulus_ratio(sweeps, forcing)), whiskers_of(sweeps))
    value, low, high = (YOUNGS_MODULUS * float(np.exp(one)) for one in whole[:3])
    return MeasuredNumber(value, low, high, whole.n, draws=whole.draws)


def collapse_here(mode: int, sweeps: xr.Dataset) -> MeasuredNumber:
    """Share of the variance of κ that κ(ε) explains, one E for all sweeps.

    Parameters
    ----------
    mode : int
        Counted from 1.
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    MeasuredNumber
        The number and its interval, or a note why there is none.
    """
    found, model = measured_kappa(sweeps, mode)
    made = np.isfinite(found) & np.isfinite(model)
    if made.sum() < 3:
        return MeasuredNumber(note="fewer than 3 sweeps")
    found = found / np.exp(np.nanmean(np.log(_modulus_ratio(sweeps, WHITE))) / 2)
    index, whisker = np.flatnonzero(made).astype(float), whiskers_of(sweeps)[made]

    def r2(chosen: Array) -> float:
        k = chosen.astype(int)
        return float(1 - np.sum((found[k] - model[k]) ** 2) / np.sum((found[k] - found[k].mean()) ** 2))

    ends = jackknife_interval(index, r2, clusters=whisker, scale="r2")
    return MeasuredNumber(r2(index), *ends, float(made.sum()), draws=float(len(np.unique(whisker))))


def least_collapse(sweeps: xr.Dataset) -> MeasuredNumber:
    """The smaller of the first two modes' R².

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    MeasuredNumber
        The number and its interval, or a note why there is none.
    """
    return min((collapse_here(mode, sweeps) for mode in (1, 2)), key=lambda one: one.value)
