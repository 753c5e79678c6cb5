"""Whisker geometry as datasets: a fit to measured diameters, the atlas with its resonances."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.exact import cone_kappa
from vibrissa.mechanics.across.collapse import modulus_in_air
from vibrissa.quantities import dataset
from vibrissa.whisker import (
    AtlasEntry,
    Whisker,
    atlas,
    atlas_whisker,
    from_diameters,
    isolated_whiskers,
    read_diameters,
)

if TYPE_CHECKING:
    import xarray as xr


def fit_dataset(path: Path, physical_length: float | None = None) -> xr.Dataset:
    """Cone fitted to a CSV of diameters.

    Parameters
    ----------
    path : Path
        See ``vibrissa.whisker.read_diameters``.
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


def measured_resonances() -> xr.Dataset:
    """Measured resonances of isolated rat whiskers beside what each one's own geometry predicts.

    Returns
    -------
    Dataset
        ``measured_first``, ``_second``, ``_third`` (under vibration of the base) and ``measured_first_impulse`` [Hz];
        ``predicted_first``, ``_second``, ``_third`` [Hz] of the free cone cut at its measured tip, E = 3.74 GPa,
        ρ = 1140 kg/m³, nothing fitted; ``measured_damping``; ``air_modulus`` [Pa], the E that would bring one on the
        other (position). NaN where not measured. Attributes ``youngs_modulus`` [Pa], the geometric mean over whiskers,
        with ``_low`` and ``_high`` (95 %, whiskers the draws).
    """
    measured = [one for one in isolated_whiskers() if np.isfinite(one.frequency_1)]
    table = np.array([(one.frequency_1, one.frequency_2, one.frequency_3) for one in measured])
    scale = [2 * np.pi * one.whisker.timescale for one in measured]
    predicted = [cone_kappa(one.tip, 3, "free") / k for one, k in zip(measured, scale, strict=True)]
    modulus, whole = modulus_in_air(table, np.array(predicted))
    attrs = dict(zip(("youngs_modulus", "youngs_modulus_low", "youngs_modulus_high"), whole, strict=True))
    columns: list[dict[str, Any]] = [
        {f"predicted_{name}": np.array(predicted)[:, i], f"measured_{name}": table[:, i]}
        for i, name in enumerate(("first", "second", "third"))
    ]
    return dataset(
        {"source": "Hartmann et al. 2003, doi 10.1523/JNEUROSCI.23-16-06510.2003", **attrs},
        position=np.array([one.name for one in measured]),
        **columns[0],
        measured_first_impulse=np.array([one.frequency_impulse for one in measured]),
        **columns[1],
        **columns[2],
        measured_damping=np.array([one.damping for one in measured]),
        air_modulus=modulus,
    )


def _in_air(entry: AtlasEntry) -> float:
    if not entry.n_cone:
        return np.nan
    cone = Whisker(length=entry.length, cone_angle=entry.cone_angle, tip=entry.tip)
    return float(cone_kappa(cone.tip, 1, "free")[0] / (2 * np.pi * cone.timescale))
