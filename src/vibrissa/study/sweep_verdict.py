"""Truth against found over many virtual sweeps, and the modes' shares of the variance with noise and without."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.quantities import dataset
from vibrissa.stats import wilson_interval
from vibrissa.study.paper_numbers import paper_numbers
from vibrissa.study.sweep_measures import is_virtual

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

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
        By ``entry``: ``quantity``; ``error_unit``, ``1`` where errors are relative to the truth; ``error_median``,
        ``error_spread`` (standard deviation over sweeps); ``covered``, the share of 95 % intervals that hold the
        truth, ``covered_low``, ``covered_high`` (Wilson, sweeps taken for independent); ``entry_count``.
    """
    kept = sweeps.isel(sweep=np.flatnonzero(sweeps.accepted.values))
    rows = [_posture(kept, name, unit) for name, unit in (("contact", "L"), ("base_angle", "rad"))]
    for mode in kept.mode.values.tolist():
        one = kept.sel(mode=mode)
        for name, words in (("resonant_frequency", "resonant frequency"), ("damping", "damping ratio")):
            rows += [_fitted(one, name, f"{words}, mode {mode}, {label}", end) for end, label in _FITS]
    columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return dataset(**columns)


def _posture(table: xr.Dataset, name: str, unit: str) -> dict[str, Any]:
    error = (table[name] - table[f"{name}_true"]).values
    held = np.abs(error) <= _WIDE * table[f"{name}_se"].values
    words = {"contact": "contact ε", "base_angle": "base angle θ_b"}[name]
    return _row(words, unit, error, held, np.isfinite(table[f"{name}_se"].values))


def _fitted(one: xr.Dataset, name: str, words: str, end: str) -> dict[str, Any]:
    found, truth = one[f"{name}{end}"].values, one[f"{name}_true"].values
    low, high = one[f"{name}{end}_low"].values, one[f"{name}{end}_high"].values
    return _row(words, "1", found / truth - 1, (low <= truth) & (truth <= high), np.isfinite(low))


def _row(words: str, unit: str, error: Array, held: NDArray[np.bool_], told: NDArray[np.bool_]) -> dict[str, Any]:
    made = np.isfinite(error)
    n, inside = int((made & told).sum()), int((held & made & told).sum())
    low, high = wilson_interval(inside, n) if n else (np.nan, np.nan)
    return {
        "quantity": words,
        "error_unit": unit,
        "error_median": float(np.median(error[made])) if made.any() else np.nan,
        "error_spread": float(error[made].std()) if made.any() else np.nan,
        "covered": inside / n if n else np.nan,
        "covered_low": low,
        "covered_high": high,
        "entry_count": int(made.sum()),
    }


def mode_shares(sweeps: xr.Dataset) -> xr.Dataset:
    """Shares of the variance that modes 1 to 3 explain: the paper's, found, without noise, and with noise.

    Noise that every node has by itself lowers all shares alike, for a mode takes of it no more than its part of the
    nodes: with enough to bring mode 1 down to the paper's share the others come to ``share_noisy``, and no noise of
    that kind makes their ratios to mode 1 larger. Where a share of the paper is above that, the model, filmed by a
    camera with any noise of its pixels, cannot give it.

    Returns
    -------
    Dataset
        By ``mode``: ``share_paper``, its ``share_paper_sd`` over 582 sweeps; ``share_found``, ``share_found_sd``,
        NaN of one sweep; ``share_true``, of a perfect tracker, NaN where the sweeps are recorded; ``share_noisy``;
        ``share_possible``.
    """
    kept = sweeps.isel(sweep=np.flatnonzero(sweeps.accepted.values))
    paper = {number.id: number for number in paper_numbers()}
    printed = [paper[f"variance_{mode}"] for mode in (1, 2, 3)]
    found = kept.variance_explained.sel(mode=[1, 2, 3]).values
    true = kept.variance_explained_true.sel(mode=[1, 2, 3]).values if is_virtual(kept) else np.full(found.shape, np.nan)
    whole = np.where(np.isfinite(true), true, found).mean(axis=0)
    share = np.array([number.value for number in printed])
    noisy = whole * min(1.0, share[0] / whole[0])
    return dataset(
        mode=[1, 2, 3],
        share_paper=share,
        share_paper_sd=[number.sd for number in printed],
        share_found=found.mean(axis=0),
        share_found_sd=found.std(axis=0) if len(found) > 1 else np.full(3, np.nan),
        share_true=true.mean(axis=0),
        share_noisy=noisy,
        share_possible=noisy >= share * (1 - 1e-9),
    )
