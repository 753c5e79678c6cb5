"""Lines that a run of many sweeps, or of base signals, prints: one for each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr


def sweep_lines(sweeps: xr.Dataset, comparison: xr.Dataset | None = None) -> xr.Dataset:
    """The table of sweeps cut down to one value a column: posture, mode 1 and what was wrong.

    Resonance and damping are those of the texture's forcing, where it is known; else of white forcing.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.
    comparison : Dataset, optional
        Prediction against measurement.

    Returns
    -------
    Dataset
        By ``sweep``: ``animal``, ``whisker_name``, ``scan_speed``, ``contact``, ``base_angle``, ``first_resonance``,
        ``first_damping``, ``first_rms``, ``first_correlation``, ``accepted``, ``rejected``.
    """
    columns: dict[str, Any] = {
        name: sweeps[name].values
        for name in ("animal", "whisker_name", "scan_speed", "contact", "base_angle", "accepted", "rejected")
    }
    columns["first_resonance"], columns["first_damping"] = (
        _known_else_white(sweeps, name, 0) for name in ("resonant_frequency", "damping")
    )
    none = np.full(sweeps.sizes["sweep"], np.nan)
    columns["first_correlation"] = none if comparison is None else comparison.correlation.values[:, 0]
    return dataset(lead=("sweep",), sweep=sweeps.sweep.values, first_rms=sweeps.mode_rms.values[:, 0], **columns)


def _known_else_white(data: xr.Dataset, name: str, mode: int) -> Array:
    known, white = data[name].values[..., mode], data[f"{name}_white"].values[..., mode]
    return np.where(np.isfinite(known), known, white)


def base_lines(results: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """First resonance and damping of each base signal.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    Dataset
        By ``signal_name``: ``first_resonance`` [Hz], ``first_damping`` and ``first_correlation`` with the prediction.
        Nothing where there is none.
    """
    some = [data for name, data in results.items() if name.startswith("base_signal_")]
    if not some:
        return dataset()
    rows: list[list[float]] = []
    for one in some:
        end = "" if "resonant_frequency" in one else "_white"
        rows.append([float(one[f"{name}{end}"][0]) for name in ("resonant_frequency", "damping")])
        rows[-1].append(float(one.correlation[0]) if "correlation" in one else np.nan)
    names = ("first_resonance", "first_damping", "first_correlation")
    columns: dict[str, Any] = dict(zip(names, np.array(rows).T, strict=True))
    return dataset(lead=("signal_name",), signal_name=[one.attrs["label"] for one in some], **columns)
