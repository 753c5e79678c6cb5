"""Whisker geometry as datasets: a fit to measured diameters, the atlas with its resonances."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.exact import cone_kappa
from vibrissa.quantities import dataset
from vibrissa.whisker import AtlasEntry, Whisker, atlas, atlas_whisker, from_diameters, read_diameters

if TYPE_CHECKING:
    import xarray as xr


def fit_dataset(path: Path, physical_length: float | None = None) -> xr.Dataset:
    """Cone fitted to a CSV of diameters.

    Parameters
    ----------
    path : Path
        See :func:`vibrissa.whisker.read_diameters`.
    physical_length : float, optional
        Length of the whisker itself [m].

    Returns
    -------
    Dataset
        ``length``, ``cone_angle``, ``base_radius``, ``tip``, ``timescale`` and their standard errors (``_se``).
    """
    points = read_diameters(path)
    fit = from_diameters(points.distance.values, points.diameter.values, physical_length=physical_length)
    cone = fit.whisker
    own = {name: getattr(cone, name) for name in ("length", "cone_angle", "base_radius", "tip", "timescale")}
    errors = {field.name: getattr(fit, field.name) for field in dataclasses.fields(fit) if field.name != "whisker"}
    return dataset({"source": path.name}, **own, **errors)


def atlas_dataset(name: str | None = None) -> xr.Dataset:
    """The measured rat whiskers by position, or one of them.

    Parameters
    ----------
    name : str, optional
        One position: ``C2``, ``beta``; all by default.

    Returns
    -------
    Dataset
        One entry per position; NaN where too few whiskers were measured. ``first_resonance_in_air`` [Hz] is that of
        the mean cone cut at its mean tip, of default keratin.
    """
    entries = list(atlas())
    if name is not None:
        wanted = atlas_whisker(name)
        entries = [entry for entry in entries if entry.length == wanted.length]
    taken = {
        "n_whiskers": "n",
        "n_cones": "n_cone",
        "mean_arc_length": "arc_length",
        "mean_length": "length",
        "sd_length": "length_sd",
        "mean_base_diameter": "base_diameter",
        "mean_cone_angle": "cone_angle",
        "sd_cone_angle": "cone_angle_sd",
        "mean_tip": "tip",
    }
    columns: dict[str, Any] = {to: np.array([getattr(entry, of) for entry in entries]) for to, of in taken.items()}
    return dataset(
        {"source": entries[0].source},
        position=np.array([entry.name for entry in entries]),
        first_resonance_in_air=np.array([_in_air(entry) for entry in entries]),
        **columns,
    )


def _in_air(entry: AtlasEntry) -> float:
    if not entry.n_cone:
        return np.nan
    cone = Whisker(length=entry.length, cone_angle=entry.cone_angle, tip=entry.tip)
    return float(cone_kappa(cone.tip, 1, "free")[0] / (2 * np.pi * cone.timescale))
