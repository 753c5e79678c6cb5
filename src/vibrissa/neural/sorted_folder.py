"""Sorted units from a folder of SpikeInterface: a sorting, what a sorter left, or an analyzer."""

from __future__ import annotations

import warnings
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.errors import InputError
from vibrissa.neural.phy import GOOD, QUALITY
from vibrissa.neural.spikes import spike_table
from vibrissa.neural.traces import one_line, part

if TYPE_CHECKING:
    import xarray as xr

SIGNS = ("si_folder.json", "spikeinterface_log.json", "spikeinterface_info.json", ".zattrs", "zarr.json")


def is_sorted_folder(path: str | Path) -> bool:
    """Whether SpikeInterface made this folder."""
    return any((Path(path) / name).is_file() for name in SIGNS)


def read_sorted_folder(path: str | Path, *, groups: Collection[str] = GOOD) -> xr.Dataset:
    """Spikes of the units of a folder of SpikeInterface, on the session's clock.

    Parameters
    ----------
    path : path
        What ``sorting.save(folder=…)``, ``run_sorter(folder=…)`` or ``create_sorting_analyzer(folder=…)`` wrote.
    groups : collection of str
        Where the units have the property ``quality``, those of these groups are taken; without it all are.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.spikes.spike_table`. The attribute ``remark`` tells what is left out.

    Raises
    ------
    InputError
        If SpikeInterface is not installed; if the folder holds no sorting, several stretches of time, or no unit of
        these groups.
    """
    path = Path(path)
    with one_line(str(path), "holds no sorting that SpikeInterface reads"), warnings.catch_warnings():
        found = _sorting(path)
        if found.get_num_segments() != 1:
            raise InputError(
                str(path), "must be one stretch of recording", found.get_num_segments(), "export one of them"
            )
        units, remark = _chosen(path, found, groups)
        rate = float(found.get_sampling_frequency())
        trains = [np.asarray(found.get_unit_spike_train(unit), float) / rate for unit in units]
    return spike_table(
        np.concatenate([*trains, np.empty(0)]),
        np.repeat(np.arange(len(trains)), [train.size for train in trains]),
        [str(unit) for unit in units],
        attrs={"source": path.name, "sampling_rate": rate, "remark": remark},
        **_quality(found, units),
    )


def _sorting(path: Path) -> Any:
    """The sorting in a folder, whatever wrote it."""
    if (path / "spikeinterface_log.json").is_file():
        return part("sorters").read_sorter_folder(path, register_recording=False)
    found = part("core").load(path)
    found = getattr(found, "sorting", found)
    if not hasattr(found, "unit_ids"):
        raise InputError(str(path), "must hold sorted units", remedy="this one holds a recording: vibrissa sort")
    return found


def _labels(found: Any) -> np.ndarray | None:
    quality = found.get_property("quality")
    return None if quality is None else np.asarray(quality, str)


def _chosen(path: Path, found: Any, groups: Collection[str]) -> tuple[list[Any], str]:
    """Units of the groups wanted, and what a reader should know of the others."""
    units, labels = list(found.unit_ids), _labels(found)
    if not units:
        raise InputError(str(path), "must hold at least one unit", 0)
    if labels is None and tuple(groups) != GOOD:
        remedy = "leave --group out to take all of them"
        raise InputError(str(path), f"must tell which units are {', '.join(groups)}: it does not", None, remedy)
    if labels is None:
        return units, f"all {len(units)} units are taken: the folder does not tell which are good"
    kept = [unit for unit, label in zip(units, labels, strict=True) if label in groups]
    if not kept:
        there = ", ".join(sorted(set(labels.tolist())))
        raise InputError(str(path), f"must have units in the groups {', '.join(groups)}", None, f"there are {there}")
    left = len(units) - len(kept)
    return kept, f"{len(kept)} units are {', '.join(groups)}" + (f"; {left} others are left out" if left else "")


def _quality(found: Any, units: list[Any]) -> dict[str, Any]:
    """SU or MU of each unit, where the labels are phy's."""
    labels = _labels(found)
    if labels is None:
        return {}
    of = dict(zip(found.unit_ids, labels, strict=True))
    quality = [QUALITY.get(str(of[unit]), "") for unit in units]
    return {"unit_quality": np.array(quality)} if all(quality) else {}
