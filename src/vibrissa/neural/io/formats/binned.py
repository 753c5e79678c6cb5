"""Dense responses, counts of spikes by bin, trial and unit, from files of NumPy and MATLAB."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from vibrissa.arrays import Mask
from vibrissa.binary import read_npy
from vibrissa.errors import FormatError, MissingError, ShapeError, TooFewError, require_positive
from vibrissa.files import existing
from vibrissa.neural.io.formats import matlab_tables
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.reader_process import tables_read_by

DENSE = (".npy", ".mat")
MOST = 1000.0  # spikes in one bin: beyond it the numbers are no counts
BLOCK = 2**24  # numbers that are checked at a time


def read_binned(path: str | Path, bin_width: float | None) -> xr.Dataset:
    """Spikes from counts in even bins, each bin's spikes evenly within it.

    Counts in bins that are whole numbers of these bins are exact; finer times are not known.

    Parameters
    ----------
    path : path
        NumPy (``.npy``) or MATLAB (``.mat``, one array of numbers in it; also version 7.3): counts by bin, trial and
        unit, (B, R, U), or (B, R) of one unit. The first bin starts at the onset. NaN throughout a trial says that the
        unit was not observed in it.
    bin_width : float or None
        Width of a bin [s]; must be given.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`: in trials, units named by their place from 0.
        ``counted_bin`` [s] is the width.

    Raises
    ------
    InputError
        If there is no such array or several; if a number is no count; if the width is not given.
    """
    if bin_width is None:
        rule = "must be given: which width the bins of counts have"
        raise MissingError("counted_bin", rule, remedy="`counted_bin`, such as 10 ms, with bins x trials x units")
    require_positive("counted_bin", bin_width, "s")
    counts = _counts(Path(path))
    if counts.ndim == 2:
        counts = counts[:, :, None]
    if counts.ndim != 3 or not counts.size:
        raise ShapeError(str(path), "must be bins x trials x units", counts.shape)
    (bins, trials, units), (column, trial, unit, number), lost = counts.shape, *_fired(counts, str(path))
    if not number.size:
        raise TooFewError(str(path), "must hold at least one spike", 0)
    each = np.repeat(np.arange(number.size), number)
    place = np.arange(each.size) - np.repeat(np.cumsum(number) - number, number)
    time = bin_width * (column[each] + (place + 0.5) / number[each])
    about: dict[str, Any] = {"unit_observed": ~lost.T} if lost.any() else {}
    attrs = {"source": Path(path).name, "n_trials": trials, "counted_bin": bin_width, "counted_bins": bins}
    return spike_table(time, unit[each], [str(k) for k in range(units)], trial=trial[each], attrs=attrs, **about)


def _fired(counts: NDArray[Any], path: str) -> tuple[tuple[NDArray[np.int64], ...], Mask]:
    """Bin, trial, unit and number of spikes where there are any; which trials (R, U) of which units are NaN."""
    rows = max(1, BLOCK // (counts.shape[1] * counts.shape[2]))
    parts, unknown = [], np.zeros(counts.shape[1:], int)
    for start in range(0, len(counts), rows):
        block = np.asarray(counts[start : start + rows])
        gone = np.isnan(block) if block.dtype.kind == "f" else np.zeros((), bool)
        unknown += gone.sum(0) if gone.ndim else 0
        with np.errstate(invalid="ignore"):
            wrong = ~gone & ((block < 0) | (block > MOST) | (block != np.floor(block)))
        if wrong.any():
            where = tuple(int(k) for k in np.argwhere(wrong)[0] + np.array([start, 0, 0]))
            found = f"{block[wrong][0]:g} in bin {where[0]} of trial {where[1]}, unit {where[2]}"
            raise FormatError(path, "must hold counts of spikes, whole numbers from 0", found)
        fired = np.nonzero(np.where(gone, 0, block) if gone.ndim else block)
        parts.append((fired[0] + start, fired[1], fired[2], block[fired].astype(np.int64)))
    if ((unknown > 0) & (unknown < len(counts))).any():
        trial, unit = np.argwhere((unknown > 0) & (unknown < len(counts)))[0]
        rule = "must be NaN throughout a trial that a unit was not observed in, or nowhere in it"
        raise FormatError(path, rule, f"trial {trial} of unit {unit}")
    joined = tuple(np.concatenate([part[k] for part in parts]) for k in range(4))
    return joined, unknown > 0


def _counts(path: Path) -> NDArray[Any]:
    """The array of a file, not read into memory where that can be had."""
    existing(path)
    if path.suffix.lower() == ".npy":
        array = read_npy(path)
    else:
        arrays = tables_read_by(matlab_tables.__name__, path, "must be a whole file of MATLAB")
        array = arrays[_only({name: arrays[name].shape for name in arrays}, path)]
    if array.dtype.kind not in "fiub":
        raise FormatError(str(path), "must hold numbers", str(array.dtype))
    return array.astype(np.uint8) if array.dtype.kind == "b" else array


def _only(shapes: dict[str, tuple[int, ...]], path: Path) -> str:
    many = [name for name, shape in shapes.items() if sum(size > 1 for size in shape) >= 2]
    if len(many) != 1:
        there = ", ".join(f"{name} {'x'.join(map(str, shape))}" for name, shape in shapes.items()) or "none"
        raise FormatError(str(path), "must hold one array, bins x trials x units", there, "save it alone")
    return many[0]
