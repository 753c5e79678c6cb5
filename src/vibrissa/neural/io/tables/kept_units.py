"""Units that a table of quality keeps."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from vibrissa.errors import ShapeError, TooFewError
from vibrissa.netcdf import load
from vibrissa.neural.io.tables.spikes import of_units
from vibrissa.quantities import require


def of_kept_units(spikes: xr.Dataset, path: str | Path) -> xr.Dataset:
    """Spikes of the units that a table of quality keeps.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`.
    path : path
        Dataset that ``vibrissa quality`` or ``vibrissa sort`` wrote: ``unit_name`` and ``kept`` (unit).

    Returns
    -------
    Dataset
        The same variables, for these units alone; ``remark`` counts the others.

    Raises
    ------
    InputError
        If the table does not list a unit of the spikes, or keeps none of them.
    """
    quality = load(path)
    require(quality, "unit_name", "kept")
    kept = dict(zip(quality.unit_name.values.astype(str), quality.kept.values.astype(bool), strict=True))
    names = [str(name) for name in spikes.unit_name.values]
    if strangers := [name for name in names if name not in kept]:
        raise ShapeError(str(path), "must list every unit of the spikes", f"no unit {strangers[0]}", "measure it again")
    places = [k for k, name in enumerate(names) if kept[name]]
    if not places:
        raise TooFewError(str(path), "must keep at least one unit of the spikes", 0)
    said = spikes.attrs.get("remark")
    line = f"{len(places)} of {len(names)} units are kept by {Path(path).name}"
    return of_units(spikes, places).assign_attrs(remark=f"{said}; {line}" if said else line)
