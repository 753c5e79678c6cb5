"""Truth against found over many virtual sweeps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.quantities import dataset
from vibrissa.stats import wilson_interval

if TYPE_CHECKING:
    import xarray as xr

_WIDE = 1.96  # standard errors of a posture's 95 %
_FITS = (("", "texture known"), ("_white", "white, Eq. 5"))


def sweep_verdict(sweeps: xr.Dataset) -> xr.Dataset:
    """How near the sweeps' analysis comes to what was put in.

    Parameters
    ----------
    sweeps : Dataset
        A virtual laboratory's table.

    Returns
    -------
    Dataset
        By ``entry``: ``row_key``, by which a row is chosen; ``quantity``, in words; ``error_unit``, ``1`` where errors
        are relative to the truth; ``error_median``, ``error_spread`` (standard deviation over sweeps); ``covered``, the
        share of 95 % intervals that hold the truth, ``covered_low``, ``covered_high`` (Wilson, sweeps taken for
        independent); ``entry_count``.
    """
    kept = sweeps.isel(sweep=np.flatnonzero(sweeps.accepted.values))
    rows = [_posture(kept, name, unit) for name, unit in (("contact", "L"), ("base_angle", "rad"))]
    for mode in kept.mode.values.tolist():
        one = kept.sel(mode=mode)
        for name, words in (("resonant_frequency", "resonant frequency"), ("damping", "damping ratio")):
            rows += [_fitted(one, name, f"{words}, mode {mode}, {label}", end, mode) for end, label in _FITS]
    columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return dataset(**columns)


def _posture(table: xr.Dataset, name: str, unit: str) -> dict[str, Any]:
    error = (table[name] - table[f"{name}_true"]).values
    held = np.abs(error) <= _WIDE * table[f"{name}_se"].values
    words = {"contact": "contact ε", "base_angle": "base angle θ_b"}[name]
    return _row(name, words, unit, error, held, np.isfinite(table[f"{name}_se"].values))


def _fitted(one: xr.Dataset, name: str, words: str, end: str, mode: int) -> dict[str, Any]:
    found, low, high, truth = (one[f"{name}{x}"].values for x in (end, f"{end}_low", f"{end}_high", "_true"))
    held = (low <= truth) & (truth <= high)
    return _row(f"{name}_{mode}{end}", words, "1", found / truth - 1, held, np.isfinite(low))


def _row(key: str, words: str, unit: str, error: Array, held: Mask, known: Mask) -> dict[str, Any]:
    made = np.isfinite(error)
    n, inside = int((made & known).sum()), int((held & made & known).sum())
    low, high = wilson_interval(inside, n) if n else (np.nan, np.nan)
    return {
        "row_key": key,
        "quantity": words,
        "error_unit": unit,
        "error_median": float(np.median(error[made])) if made.any() else np.nan,
        "error_spread": float(error[made].std()) if made.any() else np.nan,
        "covered": inside / n if n else np.nan,
        "covered_low": low,
        "covered_high": high,
        "entry_count": int(made.sum()),
    }
