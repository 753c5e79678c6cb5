"""The table of sweeps: one row for each whisker drawn once over one texture, real or virtual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa import __version__
from vibrissa.quantities import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr

WHAT = ("animal", "whisker_name", "texture", "condition", "run")  # what identifies a sweep
SET = ("scan_speed", "base_height", "length", "cone_angle", "timescale")  # what the experimenter set or measured
COORDINATES = WHAT + SET
N_MODES = 3
FITTED = tuple(f"{name}{forcing}{end}" for name, forcing, end in
               product(("resonant_frequency", "damping"), ("", "_white"), ("", "_low", "_high")))  # fmt: skip
BY_MODE = (*FITTED, "fit_r2", "fit_r2_white", "mode_rms", "variance_explained", "mode_rms_model")
FOUND = ("contact", "contact_se", "base_angle", "base_angle_se", "friction", "friction_se", "profile_r2",
         "contact_travel")  # fmt: skip
JUMPS = ("jump_count", "jumps_allowed")  # of the prediction
TRUE = ("contact_true", "base_angle_true", "friction_true", "youngs_modulus_true", "phase_jitter")
END = ("accepted", "rejected", "address")  # what became of it
NO_COLUMN = ("posture_correlation",)  # of a row, needed for its other values
TRUE_BY_MODE = ("resonant_frequency_true", "damping_true", "mode_rms_true", "variance_explained_true")


def sweep_table(rows: Sequence[Mapping[str, Any]], attrs: Mapping[str, Any] | None = None) -> xr.Dataset:
    """Table of sweeps from one mapping of names to values per sweep.

    Parameters
    ----------
    rows : sequence of mappings
        Numbers and words, and (M,) arrays of the variables that go by mode. What a row lacks was not measured: NaN.
        ``accepted`` says whether the sweep was analysed, ``rejected`` why not.
    attrs : mapping, optional
        Parameters that made the sweeps.

    Returns
    -------
    Dataset
        Coordinates (sweep): ``animal``, ``whisker_name``, ``texture`` (−1: unknown), ``condition``, ``run``,
        ``scan_speed`` v [m/s], ``base_height`` H [m], ``length`` L [m], ``cone_angle`` α [rad], ``timescale`` k [s]
        with the nominal E and ρ.

        Found (sweep): ``contact`` ε, ``base_angle`` θ_b [rad] and ``friction`` (NaN if not asked for), each with
        ``_se``; ``profile_r2``; ``contact_travel``, of the contact along the shaft in a gap, median over the texture's
        gaps; ``jump_count`` of the prediction and ``jumps_allowed`` by the free end. Found (sweep, mode):
        ``resonant_frequency`` [Hz] and ``damping`` with the forcing of
        the texture, each with ``_low`` and ``_high``, and ``fit_r2``; the same of white forcing, Eq. 5:
        ``resonant_frequency_white``, ``damping_white``, each with ``_low`` and ``_high``, ``fit_r2_white``;
        ``mode_rms`` over L; ``variance_explained``; ``mode_rms_model``, what the model predicts from what was found.

        Truth where the sweep is virtual: ``contact_true``, ``base_angle_true``, ``friction_true``,
        ``youngs_modulus_true``, ``phase_jitter`` (sweep); ``resonant_frequency_true``, ``damping_true``,
        ``mode_rms_true``, ``variance_explained_true`` (sweep, mode).

        ``accepted`` and ``rejected`` (sweep); ``address``, the file of each sweep's time series. Then whatever else
        the rows hold, by sweep or by sweep and mode.
    """
    import xarray as xr

    given = {name: np.ndim(value) for row in rows for name, value in row.items()}
    listed = {*COORDINATES, *FOUND, *JUMPS, *TRUE, *BY_MODE, *TRUE_BY_MODE, *END, *NO_COLUMN}
    others = [name for name in given if name not in listed]
    own = [*FOUND, *JUMPS, *(name for name in TRUE if name in given), *(name for name in others if not given[name])]
    by_mode = [*BY_MODE, *(name for name in (*TRUE_BY_MODE, *others) if given.get(name))]
    table: dict[str, Any] = {name: _labelled(name, [row[name] for row in rows]) for name in WHAT}
    table |= {name: _labelled(name, [row.get(name, np.nan) for row in rows]) for name in (*SET, *own)}
    lost = np.full(N_MODES, np.nan)
    table |= {name: _labelled(name, [row.get(name, lost) for row in rows]) for name in by_mode}
    outcome = [name for name in END if name in rows[0]]
    table |= {name: _labelled(name, [row[name] for row in rows]) for name in outcome}
    numbers = {"sweep": np.arange(len(rows)), "mode": np.arange(1, N_MODES + 1)}
    coordinates = {name: ((name,), values, _words(name)) for name, values in numbers.items()}
    whole = xr.Dataset(table, coordinates, {**(attrs or {}), "vibrissa_version": __version__})
    return whole.set_coords(list(COORDINATES))


def _labelled(name: str, values: list[Any]) -> tuple[tuple[str, ...], np.ndarray, dict[str, str]]:
    array = np.asarray(values)
    return ("sweep", "mode")[: array.ndim], array, _words(name)


def _words(name: str) -> dict[str, str]:
    return {"units": QUANTITIES[name].unit, "long_name": QUANTITIES[name].long_name}
