"""Whiskers: those of the atlas, cones fitted to measured diameters, and curvature in air."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa.api.shared.arguments import names_arguments
from vibrissa.errors import FormatError, MissingError, RangeError, give_in
from vibrissa.tables.frame import table_of_frame
from vibrissa.tables.kinds import described, is_a
from vibrissa.whisker import (
    IntrinsicCurvature,
    Whisker,
    WhiskerFit,
    atlas_curvature,
    atlas_whisker,
    curvature_of,
    curvature_of_shape,
    diameters_of,
    from_diameters,
    read_curvature,
    read_diameters,
)
from vibrissa.whisker.curvature import COLUMNS as CURVATURE_COLUMNS
from vibrissa.whisker.diameters import COLUMNS as DIAMETER_COLUMNS

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


@names_arguments
def atlas(name: str) -> Whisker:
    """The mean rat whisker of one position of the pad.

    Parameters
    ----------
    name : str
        Row and column, ``"C2"``, or a Greek letter of the caudal arc, ``"beta"``.

    Returns
    -------
    Whisker
        Mean length, cone angle and tip of those measured, of default keratin.

    Raises
    ------
    InputError
        If no position has that name (the nearest are suggested), or no cone was measured there.

    Examples
    --------
    >>> import vibrissa as vb
    >>> whisker = vb.atlas("C2")
    >>> round(1e3 * whisker.length, 1)  # [mm]
    35.5
    """
    return atlas_whisker(name)


@names_arguments
def curvature(
    source: str | Path | pd.DataFrame | xr.Dataset | dict[str, Any], *, flipped: bool = False
) -> IntrinsicCurvature:
    """The curvature that a whisker has in air, for :class:`vibrissa.Rod`.

    Parameters
    ----------
    source : str, path, DataFrame, Dataset or dict
        A whisker of the atlas by its name, ``"C2"``, whose curvature is a published regression; or a file, or columns
        (variables), ``distance`` from the base [m] and ``curvature`` [1/m], or ``x`` and ``y`` of points of a whisker
        in air [m], from its base to its tip, y away from the ground. Names of columns may end in a unit, as ``x_mm``;
        variables may state theirs.
    flipped : bool
        The whisker is turned about its shaft. The regression is positive, which side faces the ground is not known.

    Returns
    -------
    IntrinsicCurvature
        Positive where the free end bends away from the ground.

    Raises
    ------
    InputError
        If no position has that name, or a table or shape is bad.

    Examples
    --------
    >>> import vibrissa as vb
    >>> print(f"{vb.curvature('C2').at(0.0):.1f} /m at the base")
    25.6 /m at the base
    """
    if isinstance(source, str) and not Path(source).suffix:
        found = atlas_curvature(source, atlas_whisker(source))
    elif isinstance(source, str | Path):
        found = read_curvature(source)
    elif is_a(source, "pandas", "DataFrame"):
        found = curvature_of(table_of_frame(source, {}, CURVATURE_COLUMNS, {}))
    elif (isinstance(source, dict) or is_a(source, "xarray", "Dataset")) and "curvature" in source:
        distance, curved = _variables("source", source, "distance", "curvature")
        found = IntrinsicCurvature(distance=distance, curvature=curved)
    else:
        found = curvature_of_shape(*_variables("source", source, "x", "y"))
    return found.flipped() if flipped else found


@names_arguments
def fit_cone(diameters: str | Path | pd.DataFrame | xr.Dataset, *, physical_length: float | None = None) -> WhiskerFit:
    """The cone through diameters measured along a whisker, with standard errors.

    Parameters
    ----------
    diameters : path, DataFrame or Dataset
        Columns (variables) ``distance`` from the base and ``diameter``, both [m]; columns also as ``distance_mm`` and
        ``diameter_um``, and variables may state their unit.
    physical_length : float, optional
        Length from base to physical tip [m]; the largest distance by default.

    Returns
    -------
    WhiskerFit
        ``whisker``, and the standard errors of its length, angle and tip.

    Raises
    ------
    InputError
        If there are too few points, or they are not those of a cone.

    Examples
    --------
    >>> import pandas as pd
    >>> import vibrissa as vb
    >>> table = pd.DataFrame({"distance": [0.0, 0.01, 0.02, 0.03], "diameter": [121e-6, 89e-6, 61e-6, 30e-6]})
    >>> fit = vb.fit_cone(table)
    >>> print(f"{1e3 * fit.whisker.length:.1f} mm, standard error {1e3 * fit.length_se:.1f} mm")
    40.0 mm, standard error 0.5 mm
    """
    if physical_length is not None and 1 < physical_length < inf:
        remedy = give_in("m", physical_length, "mm", 1e-3)
        raise RangeError("physical_length", "must be at most 1 m", physical_length, remedy)
    if isinstance(diameters, str | Path):
        diameters = read_diameters(diameters)
    elif is_a(diameters, "pandas", "DataFrame"):
        diameters = diameters_of(table_of_frame(diameters, DIAMETER_COLUMNS, {}, {}))
    distance, diameter = _variables("diameters", diameters, *DIAMETER_COLUMNS)
    return from_diameters(distance, diameter, physical_length=physical_length)


def _variables(name: str, data: Any, *needed: str) -> list[Any]:
    """Variables of a dataset or a dict, which may state their units."""
    if not (is_a(data, "xarray", "Dataset") or isinstance(data, dict)):
        raise FormatError(name, "must be a file, a DataFrame, a Dataset or a dict", described(data))
    known = data if isinstance(data, dict) else data.variables
    if not set(needed) <= set(known):
        raise MissingError(name, f"must have {' and '.join(needed)}", ", ".join(map(str, known)) or "none")
    return [data[one] for one in needed]
