"""Sorted units from a folder of SpikeInterface, without it: a sorting, what a sorter left, or an analyzer."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.errors import FormatError, MissingError, ShapeError, TooFewError
from vibrissa.neural.io.formats.foreign import one_line
from vibrissa.neural.io.formats.phy import ALL, GOOD, QUALITY, is_phy, read_phy
from vibrissa.neural.io.formats.saved_sorting import (
    NPZ,
    NUMPY,
    ZARR,
    SavedSorting,
    read_json,
    read_npz,
    read_numpy_folder,
    read_zarr,
)
from vibrissa.neural.io.tables.spikes import table_of_trains

SORTER, ANALYZER, SAVED = "spikeinterface_log.json", "spikeinterface_info.json", "si_folder.json"
SIGNS = (NUMPY, NPZ, SORTER, ANALYZER, SAVED, *ZARR)
FIRINGS = "firings.npz"  # of MountainSort 5
SAVE_AS = "in SpikeInterface: load(FOLDER).save(folder=NEW); of a sorter, read_sorter_folder(FOLDER).save(folder=NEW)"


def is_sorted_folder(path: str | Path) -> bool:
    """Whether SpikeInterface made this folder.

    Parameters
    ----------
    path : path
        A folder.

    Returns
    -------
    bool
        True where it has its marks.
    """
    return any((Path(path) / name).is_file() for name in SIGNS)


def read_sorted_folder(path: str | Path, *, groups: Collection[str] = GOOD) -> xr.Dataset:
    """Spikes of the units of a folder of SpikeInterface, on the session's clock.

    Parameters
    ----------
    path : path
        What ``sorting.save(folder=…)``, ``run_sorter(folder=…)`` or ``create_sorting_analyzer(folder=…)`` wrote. Of
        sorters: those whose output is a saved sorting, a folder of phy (Kilosort) or ``firings.npz`` (MountainSort 5).
    groups : collection of str
        Where the units have the property ``quality``, those of these groups are taken, or ``all``; without it all are.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`. The attribute ``remark`` names what is left out.

    Raises
    ------
    InputError
        If the folder holds no sorting, several stretches of time, or no unit of these groups; for a folder of Zarr, if
        zarr is not installed.
    """
    path = Path(path)
    with one_line(str(path), "holds no sorting of SpikeInterface that can be read"):
        inner = _inner(path)
        if is_phy(inner):
            return read_phy(inner, groups=groups).assign_attrs(source=path.name)
        found = _sorting(inner)
    if found.segments != 1:
        raise ShapeError(str(path), "must be one stretch of recording", found.segments, "export one of them")
    units, remark = _chosen(path, found, groups)
    trains = [found.sample[found.unit == unit] / found.sampling_rate for unit in units]
    labels = None if found.quality is None else [found.quality[unit] for unit in units]
    attrs = {"source": path.name, "sampling_rate": found.sampling_rate, "remark": remark, "snr_source": "property snr"}
    about = quality_of(labels) | ({} if labels is None else {"unit_label": np.array(labels, str)})
    if found.snr is not None:
        about["unit_snr"] = found.snr[units]
    return table_of_trains(trains, [found.unit_ids[unit] for unit in units], attrs, **about)


def _inner(path: Path) -> Path:
    """Folder of the sorting: this one, that in an analyzer, or the one that a sorter left."""
    if (path / ANALYZER).is_file() and (path / "sorting").is_dir():
        return path / "sorting"
    if not (path / SORTER).is_file():
        return path
    if read_json(path / SORTER).get("error"):
        raise MissingError(str(path), "must be of a sorter that ended well", "error in its log")
    output = path / "sorter_output" if (path / "sorter_output").is_dir() else path
    known = [one for one in (output, *sorted(output.iterdir())) if _is_known(one)]
    if len(known) != 1:
        found = f"{len(known)} folders" if known else None
        raise MissingError(str(path), "must hold one sorting of a known format", found, SAVE_AS)
    return known[0]


def _is_known(path: Path) -> bool:
    return is_phy(path) or any((path / name).is_file() for name in (NUMPY, FIRINGS))


def _sorting(path: Path) -> SavedSorting:
    """The sorting in a folder, by what lies in it."""
    if (path / NUMPY).is_file():
        return read_numpy_folder(path)
    for name in (NPZ, FIRINGS):
        if (path / name).is_file():
            return read_npz(path / name)
    if any((path / name).is_file() for name in ZARR):
        return read_zarr(path)
    kind = str(read_json(path / SAVED).get("class", "")) if (path / SAVED).is_file() else ""
    if "Recording" in kind:
        raise TooFewError(str(path), "must hold sorted units", remedy="this one holds a recording: vibrissa sort")
    raise FormatError(str(path), "must hold a saved sorting", kind or None, SAVE_AS)


def _chosen(path: Path, found: SavedSorting, groups: Collection[str]) -> tuple[list[int], str]:
    """Units of the groups wanted, and what a reader should know of the others."""
    count = len(found.unit_ids)
    if not count:
        raise TooFewError(str(path), "must hold at least one unit", 0)
    if found.quality is None and tuple(groups) not in (GOOD, (ALL,)):
        remedy = "leave `group` out to take all of them"
        raise MissingError(str(path), f"must state which units are {', '.join(groups)}: it does not", None, remedy)
    if found.quality is None:
        return list(range(count)), f"all {count} units are taken: the folder does not state which are good"
    kept = [unit for unit, label in enumerate(found.quality) if label in groups or ALL in groups]
    if not kept:
        there = ", ".join(sorted(set(found.quality)))
        raise TooFewError(str(path), f"must have units in the groups {', '.join(groups)}", None, f"there are {there}")
    left = count - len(kept)
    return kept, f"{len(kept)} units are {', '.join(groups)}" + (f"; {left} others are left out" if left else "")


def quality_of(labels: Sequence[str] | None) -> dict[str, Any]:
    """SU or MU of each unit, where the labels are phy's.

    Parameters
    ----------
    labels : sequence of str, optional
        Label of each unit; None where there are none.

    Returns
    -------
    dict
        ``unit_quality`` (unit), or nothing.
    """
    quality = [QUALITY.get(label, "") for label in labels or ()]
    return {"unit_quality": np.array(quality)} if quality and all(quality) else {}
