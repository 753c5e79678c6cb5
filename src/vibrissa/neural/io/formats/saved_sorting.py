"""Sortings as SpikeInterface saves them, read without it: its folders of NumPy, its npz files, and Zarr."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.binary import read_npy, refuse_bomb
from vibrissa.errors import FormatError, MissingError, RangeError, ShapeError
from vibrissa.neural.io.formats.foreign import optional_module

NUMPY = "numpysorting_info.json"  # in each folder of sorting.save(folder=…), since SpikeInterface 0.99
NPZ = "sorting_cached.npz"  # in those of older versions
PROPERTIES = ("quality", "snr")  # of units
ZARR = (".zgroup", "zarr.json")  # of format 2 and 3


@dataclass(frozen=True, kw_only=True)
class SavedSorting:
    """Spikes of sorted units in samples of the recording.

    Attributes
    ----------
    sampling_rate : float
        Samples per second [Hz].
    unit_ids : list of str
        Names of the units.
    sample : (N,) array of int
        Sample of each spike, from 0 at the start of its stretch.
    unit : (N,) array of int
        Index of each spike's unit.
    segments : int
        Stretches of recording, each with its own clock.
    quality : list of str, optional
        Label of each unit (``good``, ``mua``, ``noise``, …) where the units have the property ``quality``.
    snr : (U,) array, optional
        Signal to noise of each unit where the units have the property ``snr``.
    """

    sampling_rate: float
    unit_ids: list[str]
    sample: Integers
    unit: Integers
    segments: int
    quality: list[str] | None = None
    snr: Array | None = None


def read_numpy_folder(path: Path) -> SavedSorting:
    """Read the folder that ``sorting.save(folder=…)`` writes.

    Parameters
    ----------
    path : Path
        Folder with ``numpysorting_info.json``, ``spikes.npy`` (fields ``sample_index``, ``unit_index``,
        ``segment_index``) and, where the units have these properties, ``properties/quality.npy`` and
        ``properties/snr.npy``.

    Returns
    -------
    SavedSorting
        Its spikes.

    Raises
    ------
    InputError
        Names the file: not there, damaged, or not of these fields.
    """
    about = read_json(path / NUMPY)
    rate, names, segments = (_value(path / NUMPY, about, key) for key in _ABOUT)
    spikes, fields = _array(path / "spikes.npy"), ("sample_index", "unit_index")
    if not set(fields) <= set(spikes.dtype.names or ()):
        raise FormatError(str(path / "spikes.npy"), f"must have the fields {', '.join(fields)}", str(spikes.dtype))
    return _checked(path, rate, names, [spikes[name] for name in fields], segments, _properties(path))


_ABOUT = ("sampling_frequency", "unit_ids", "num_segments")


def read_npz(path: Path) -> SavedSorting:
    """Read the npz file of older folders, and of MountainSort 5.

    Parameters
    ----------
    path : Path
        File with ``unit_ids``, ``num_segment``, ``sampling_frequency``, ``spike_indexes_seg0`` and
        ``spike_labels_seg0``: sample and unit of each spike. ``properties/quality.npy`` may lie beside it.

    Returns
    -------
    SavedSorting
        Its spikes; of several stretches, those of the first.

    Raises
    ------
    InputError
        Names the file: not there, damaged, or without one of these arrays.
    """
    refuse_bomb(path)
    with np.load(path, allow_pickle=False) as arrays:
        names, rate, segments, sample, label = (_value(path, arrays, key) for key in _ARRAYS)
    order = np.argsort(names)
    place = np.searchsorted(names, label, sorter=order)
    index = order[np.minimum(place, len(names) - 1)] if len(names) else np.zeros(label.shape, int)
    if len(names) and not np.array_equal(names[index], label):
        stranger = label[names[index] != label][0]
        raise FormatError(str(path), "must label each spike with one of its unit_ids", str(stranger))
    return _checked(path, rate[0], names.tolist(), [sample, index], segments[0], _properties(path.parent))


_ARRAYS = ("unit_ids", "sampling_frequency", "num_segment", "spike_indexes_seg0", "spike_labels_seg0")


def read_zarr(path: Path) -> SavedSorting:
    """Read a sorting, or that of an analyzer, from a folder of Zarr.

    Parameters
    ----------
    path : Path
        What ``sorting.save(folder=…, format="zarr")`` or ``create_sorting_analyzer(format="zarr")`` wrote.

    Returns
    -------
    SavedSorting
        Its spikes.

    Raises
    ------
    InputError
        If zarr is not installed, or the folder holds no sorting.
    """
    # zarr 3 cannot open an analyzer from its top: elsewhere in it are arrays of Python objects, which it does not know
    within = path / "sorting" if (path / "sorting").is_dir() else path
    group: Any = optional_module("zarr", "a folder of Zarr", "cluster").open_group(str(within), mode="r")
    if "unit_ids" not in group or "spikes" not in group:
        held = "it holds a recording: vibrissa sort" if "channel_ids" in group else ""
        raise MissingError(str(path), "must hold sorted units (unit_ids, spikes)", None, held)
    rate, segments = (_value(path, group.attrs, key) for key in ("sampling_frequency", "num_segments"))
    columns = [np.asarray(group[f"spikes/{name}"][:]) for name in ("sample_index", "unit_index")]
    known = {name: group[f"properties/{name}"][:] for name in PROPERTIES if f"properties/{name}" in group}
    return _checked(path, rate, np.asarray(group["unit_ids"][:]).tolist(), columns, segments, known)


def read_json(path: Path) -> dict[str, Any]:
    """Read the mapping in a file of JSON.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    dict
        Its content.

    Raises
    ------
    InputError
        If it is missing or holds no mapping.
    """
    if not path.is_file():
        raise MissingError(str(path), "must be an existing file")
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise FormatError(str(path), f"is truncated or damaged ({str(error)[:60]})") from error
    if not isinstance(content, dict):
        raise FormatError(str(path), "must hold a mapping of names", type(content).__name__)
    return content


def _value(path: Path, content: Any, key: str) -> Any:
    if key not in content:
        raise FormatError(str(path), f"must have {key}")
    return content[key]


def _array(path: Path) -> Any:
    """Array of a file of NumPy, in memory."""
    return np.array(read_npy(path))


def _properties(folder: Path) -> dict[str, Any]:
    """Properties of the units that are read, where the folder has them."""
    files = {name: folder / "properties" / f"{name}.npy" for name in PROPERTIES}
    return {name: _array(path) for name, path in files.items() if path.is_file()}


def _checked(
    path: Path, rate: Any, names: list[Any], columns: list[Any], segments: Any, known: dict[str, Any]
) -> SavedSorting:
    """Refuse what contradicts itself."""
    if not 0 < float(rate) < np.inf:
        raise RangeError(f"{path}, sampling_frequency", "must be a positive number (Hz)", rate)
    sample, unit = columns
    if sample.shape != unit.shape or sample.ndim != 1:
        raise ShapeError(str(path), "must have a sample and a unit for each spike", f"{sample.shape}, {unit.shape}")
    if sample.dtype.kind not in "iu" or unit.dtype.kind not in "iu":
        raise FormatError(str(path), "must hold whole numbers: samples, units", f"{sample.dtype}, {unit.dtype}")
    if unit.size and not (unit.min() >= 0 and unit.max() < len(names) and sample.min() >= 0):
        found = f"units {unit.min()} to {unit.max()}, samples from {sample.min()}"
        raise RangeError(str(path), f"must count samples from 0, and units from 0 to {len(names) - 1}", found)
    for name, values in known.items():
        if np.shape(values) != (len(names),):
            raise ShapeError(f"{path}, {name}", "must have a value for each unit", f"{np.size(values)} of {len(names)}")
    snr = known.get("snr")
    if snr is not None and np.asarray(snr).dtype.kind not in "iuf":
        raise FormatError(f"{path}, snr", "must hold numbers", str(np.asarray(snr).dtype))
    return SavedSorting(
        sampling_rate=float(rate), unit_ids=[str(name) for name in names], segments=int(segments),
        sample=sample.astype(np.int64), unit=unit.astype(np.int64),
        quality=np.asarray(known["quality"], str).tolist() if "quality" in known else None,
        snr=None if snr is None else np.asarray(snr, float),
    )  # fmt: skip
