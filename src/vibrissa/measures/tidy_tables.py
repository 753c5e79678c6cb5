"""Kinematics as tables of comma-separated values: a row for each whisker and frame, and one for each touch."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.signals.frame_numbers import frame_numbers
from vibrissa.tables.writer import write_table

if TYPE_CHECKING:
    import xarray as xr

DIGITS = 9
SHOWN = {"rad": ("deg", 180 / np.pi), "m": ("mm", 1e3), "1/m": ("per_mm", 1e-3), "s": ("s", 1.0), "Hz": ("Hz", 1.0)}


def write_kinematics(data: xr.Dataset, path: Path) -> list[Path]:
    """Write the tables: ``NAME.csv``, and ``NAME-touches.csv`` where touches were sought.

    Parameters
    ----------
    data : Dataset
        From :func:`vibrissa.measures.kinematics.kinematics_of`.
    path : Path
        Name of the first.

    Returns
    -------
    list of Path
        Files that were written.
    """
    written = [path]
    write_table(path, frame_columns(data), digits=DIGITS)
    if "touch_onset" in data:
        written.append(path.with_name(f"{path.stem}-touches{path.suffix}"))
        write_table(written[1], touch_columns(data), digits=DIGITS)
    return written


def frame_columns(data: xr.Dataset) -> dict[str, Any]:
    """Columns of the table by whisker and frame, the frames of the first whisker first.

    Parameters
    ----------
    data : Dataset
        From :func:`vibrissa.measures.kinematics.kinematics_of`.

    Returns
    -------
    dict of arrays
        ``whisker`` (its number among the tracks), ``label`` (its name), ``frame`` (of the movie), ``time_s``, then
        angles and phases in degrees, curvatures in 1/mm, lengths in mm; the unit ends the name.
    """
    whiskers, frames = data.sizes["whisker"], data.sizes["time"]
    series = [str(name) for name in data.data_vars if data[name].dims == ("whisker", "time")]
    return {
        "whisker": np.repeat(data.whisker.values, frames),
        "label": np.repeat(data.whisker_label.values, frames),
        "frame": np.tile(frame_numbers(data), whiskers),
        "time_s": np.tile(data.time.values, whiskers),
        **dict(_column(data, name) for name in series),
    }


def touch_columns(data: xr.Dataset) -> dict[str, Any]:
    """Columns of the table of touches, by onset.

    Parameters
    ----------
    data : Dataset
        From :func:`vibrissa.measures.kinematics.kinematics_of`, with touches.

    Returns
    -------
    dict of arrays
        ``whisker`` and ``label`` as in :func:`frame_columns`, and all else in its units.
    """
    whose = {"whisker": data.touch_whisker_number.values, "label": data.touch_whisker.values}
    names = [str(name) for name in data.data_vars if data[name].dims == ("touch",)]
    return whose | dict(_column(data, name) for name in names if not name.startswith("touch_whisker"))


def _column(data: xr.Dataset, name: str) -> tuple[str, Any]:
    unit, values = str(data[name].attrs.get("units", "1")), data[name].values.ravel()
    if unit not in SHOWN:
        return name, values
    shown, factor = SHOWN[unit]
    return f"{name}_{shown}", values * factor
