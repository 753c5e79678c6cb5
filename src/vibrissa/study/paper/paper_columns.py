"""The columns of *paper | here | same?*: the paper's model against itself and against the rod, and the rod's own."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.quantities.kinds import Datasets

if TYPE_CHECKING:
    import xarray as xr

HERE = "here"
MODEL, ROD, OWN = "the paper's model", "the rod, analysed", "the rod itself"
MODELLED, OWNED = "_modes", "_own"  # ends of the names of results: of sweeps of the model, of the rod without a movie
MOTION = ("sweeps", "comparison", "repeats")  # results that differ from column to column
_SAME_NAME = ("mode_rms", "variance_explained", "contact", "base_angle", "friction")
_FITTED = ("resonant_frequency", "damping")
_OF_ANALYSIS = ("profile_r2", "fit_r2", "fit_r2_white", "contact_travel")


def truth_of(sweeps: xr.Dataset) -> str:
    """Whose motion virtual sweeps show: ``rod`` or ``modes``; empty where they are recorded.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    str
        As the laboratory has it.
    """
    return str(json.loads(sweeps.attrs.get("laboratory", "{}")).get("truth", ""))


def columns_of(results: Mapping[str, xr.Dataset]) -> dict[str, Datasets]:
    """Results that each column of ours is made of, by its heading.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    dict
        ``here`` alone; where the truth of the sweeps is the rod ``the paper's model`` (if its sweeps were made too),
        ``the rod, analysed`` and ``the rod itself``.
    """
    if "sweeps" not in results or truth_of(results["sweeps"]) != "rod":
        return {HERE: dict(results)}
    found = {ROD: dict(results), OWN: _of(results, OWNED) | {"sweeps": own_sweeps(results["sweeps"])}}
    return {MODEL: _of(results, MODELLED), **found} if f"sweeps{MODELLED}" in results else found


def main_column(columns: Mapping[str, Datasets]) -> str:
    """Heading of the column that the verdict of a row is of.

    Parameters
    ----------
    columns : mapping
        From :func:`columns_of`.

    Returns
    -------
    str
        What was analysed.
    """
    return ROD if ROD in columns else HERE


def _of(results: Mapping[str, xr.Dataset], end: str) -> Datasets:
    """Results with those of the motion replaced by others, or absent."""
    rest = {name: data for name, data in results.items() if name not in (*MOTION, "profile")}
    return rest | {name: results[name + end] for name in MOTION if name + end in results}


def own_sweeps(sweeps: xr.Dataset) -> xr.Dataset:
    """The table of sweeps with the truth in the place of what was found; what belongs to an analysis is left out.

    Parameters
    ----------
    sweeps : Dataset
        Of a virtual laboratory.

    Returns
    -------
    Dataset
        With the columns of ``sweeps`` that a motion without a movie has.
    """
    names = {name: f"{name}_true" for name in (*_SAME_NAME, *_FITTED)}
    own = sweeps.drop_vars([name for name in _OF_ANALYSIS if name in sweeps])
    own = own.assign({name: sweeps[true] for name, true in names.items()})
    own = own.assign({f"{name}_white": sweeps[f"{name}_true"] for name in _FITTED})
    ends = [f"{name}{forcing}{end}" for name in _FITTED for forcing in ("", "_white") for end in ("_low", "_high")]
    return own.assign({name: np.nan * sweeps[name] for name in ends if name in sweeps})
