"""Shares of the variance that the modes explain: the paper's beside those of many sweeps, with noise and without."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.quantities import dataset
from vibrissa.study.paper.paper_numbers import paper_number
from vibrissa.study.paper.sweep_measures import is_virtual

if TYPE_CHECKING:
    import xarray as xr

RUNS = 5  # of the paper's repeated sweeps


def mode_shares(sweeps: xr.Dataset) -> xr.Dataset:
    """Shares of the variance that modes 1 to 3 explain: the paper's, found, without noise, and with noise.

    Noise that every node has by itself lowers all shares alike, for a mode takes of it no more than its part of the
    nodes: with enough to bring mode 1 down to the paper's share the others come to ``share_noisy``, and no noise of
    that kind makes their ratios to mode 1 larger. It would also differ from run to run, and let a run correlate with
    the mean of five by no more than :func:`repeat_with_noise`. Noise can give a share of the paper only where both
    agree: ``share_noisy`` is as large as the share, and repeated runs are as alike as the paper's.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    Dataset
        By ``mode``: ``share_paper``, its ``share_paper_sd`` over 582 sweeps; ``share_found``, ``share_found_sd``,
        NaN of one sweep; ``share_true``, of a perfect tracker, NaN where the sweeps are recorded; ``share_noisy``;
        ``share_possible``. ``noise_share``, the share of the variance that this noise has; ``noise_repeat``, the
        correlation of a run with the mean of five with it.
    """
    kept = sweeps.isel(sweep=np.flatnonzero(sweeps.accepted.values))
    printed = [paper_number(f"variance_{mode}") for mode in (1, 2, 3)]
    found = kept.variance_explained.sel(mode=[1, 2, 3]).values
    true = kept.variance_explained_true.sel(mode=[1, 2, 3]).values if is_virtual(kept) else np.full(found.shape, np.nan)
    whole = np.where(np.isfinite(true), true, found).mean(axis=0)
    share = np.array([number.value for number in printed])
    noise = max(0.0, 1 - share[0] / whole[0])
    noisy, repeat = whole * (1 - noise), repeat_with_noise(noise)
    return dataset(
        lead=("mode",),
        mode=[1, 2, 3],
        share_paper=share,
        share_paper_sd=[number.sd for number in printed],
        share_found=found.mean(axis=0),
        share_found_sd=found.std(axis=0) if len(found) > 1 else np.full(3, np.nan),
        share_true=true.mean(axis=0),
        share_noisy=noisy,
        share_possible=(noisy >= share * (1 - 1e-9)) & (repeat >= paper_number("repeats").interval[0]),
        noise_share=noise,
        noise_repeat=repeat,
    )


def repeat_with_noise(noise: float, runs: int = RUNS) -> float:
    """Correlation of one run with the mean of several that differ by independent noise alone.

    With signal S and noise N = 1 − S of the variance, the mean of n runs has S + N/n, which is also its covariance with
    each: ρ = √(S + N/n).

    Parameters
    ----------
    noise : float
        N, share of the variance of one run.
    runs : int
        Runs n in the mean, the one among them.

    Returns
    -------
    float
        ρ.

    Examples
    --------
    >>> round(repeat_with_noise(0.094), 2)  # what three modes leave in the paper
    0.96
    """
    return float(np.sqrt(1 - noise + noise / runs))
