"""Sorted units from a folder of phy: the clusters labelled good, or the groups that are requested."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from vibrissa.arrays import Array, Integers
from vibrissa.binary import read_npy
from vibrissa.errors import FormatError, MissingError, RangeError, ShapeError, TooFewError
from vibrissa.neural.io.formats.unit_tables import stated_snr
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.tables.reader import read_table
from vibrissa.tables.table import LONGEST
from vibrissa.tables.text import as_number, each_line
from vibrissa.tables.units import PURE, TEXT

GOOD = ("good",)
QUALITY = {"good": "SU", "mua": "MU"}  # what phy's groups are here; of others nothing is known
LABELS = (("cluster_group.tsv", "group"), ("cluster_info.tsv", "group"), ("cluster_KSLabel.tsv", "KSLabel"))
UNJUDGED = "unsorted"  # phy's own word
ALL = "all"  # in place of the groups: whatever their labels
AMPLITUDES = "amplitudes.npy"
NEEDED = ("spike_times.npy", "params.py")


def is_phy(path: str | Path) -> bool:
    """Whether this is a folder of phy.

    Parameters
    ----------
    path : path
        A folder.

    Returns
    -------
    bool
        True where it has spike times.
    """
    return (Path(path) / NEEDED[0]).is_file()


def read_phy(path: str | Path, *, groups: Collection[str] = GOOD) -> xr.Dataset:
    """Spikes of the clusters of a folder of phy, on the session's clock.

    Parameters
    ----------
    path : path
        Folder with ``spike_times.npy`` [samples], ``spike_clusters.npy`` (or ``spike_templates.npy``), ``params.py``,
        which has the sampling rate, and ``cluster_group.tsv``: what its user called each cluster. Where no one has
        judged, the sorter's own labels are taken (``cluster_KSLabel.tsv``). ``params.py`` is read, not run.
    groups : collection of str
        Clusters of these groups are units: ``good``, ``mua``, ``noise``, ``unsorted``, any that the labels have, or
        ``all``.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`; ``unit_id`` is the cluster, ``unit_quality`` SU for
        good, MU for mua, and is absent where there are others; ``unit_label`` is the group of each, ``unit_snr`` that
        of a table of the folder, and ``spike_amplitude`` what the sorter gave (``amplitudes.npy``). The attribute
        ``remark`` names what is left out, and by whose word.

    Raises
    ------
    InputError
        Names the file: not there, damaged, of other lengths than the others; or no cluster is in these groups.
    """
    path = Path(path)
    for name in NEEDED:
        if not (path / name).is_file():
            raise MissingError(str(path / name), "must be an existing file", remedy="is this a folder of phy?")
    rate = stated_rate(path / "params.py")
    time, cluster = _spikes(path)
    found, source = _labels(path, np.unique(cluster))
    chosen = np.array([one for one, group in found.items() if group in groups or ALL in groups], int)
    if not chosen.size:
        there = ", ".join(f"{group} ({list(found.values()).count(group)})" for group in sorted(set(found.values())))
        rule = f"must have clusters in the groups {', '.join(groups)}"
        raise FormatError(str(path), rule, None, f"there are {there}")
    kept = np.isin(cluster, chosen)
    quality = [QUALITY.get(found[one], "") for one in chosen.tolist()]
    about: dict[str, Any] = {"unit_quality": np.array(quality)} if all(quality) else {}
    others = len(found) - chosen.size
    counts = Counter(found[one] for one in chosen.tolist())
    kinds = "all: " + ", ".join(f"{n} {one}" for one, n in counts.items()) if ALL in groups else ", ".join(groups)
    remark = f"{chosen.size} clusters are units, {kinds} by {source}"
    if others:
        remark += f"; {others} clusters with {int((~kept).sum())} spikes are left out"
    names = [str(one) for one in chosen]
    snr, table = stated_snr(path, names)
    amplitude = _amplitudes(path / AMPLITUDES, time.size)
    return spike_table(
        time[kept] / rate,
        np.searchsorted(chosen, cluster[kept]),
        names,
        amplitude=None if amplitude is None else amplitude[kept],
        attrs={"source": path.name, "sampling_rate": rate, "remark": remark, "snr_source": table},
        unit_id=chosen,
        unit_label=np.array([found[one] for one in chosen.tolist()], str),
        **about,
        **snr,
    )


def stated_rate(path: Path) -> float:
    """Sampling rate from a file of assignments, which is not run.

    Parameters
    ----------
    path : path
        ``params.py``.

    Returns
    -------
    float
        [Hz].

    Raises
    ------
    InputError
        If it has none, or none that is positive.
    """
    text = "\n".join(line for _, line in each_line(path))
    try:
        lines = ast.parse(text).body
    except (SyntaxError, ValueError) as error:
        raise FormatError(str(path), f"must be lines like sample_rate = 30000.0 ({error.args[0]})") from error
    for line in lines:
        if isinstance(line, ast.Assign) and any(getattr(one, "id", "") == "sample_rate" for one in line.targets):
            rate = as_number(ast.unparse(line.value))
            if 0 < rate < np.inf:
                return rate
            raise RangeError(f"{path}, sample_rate", "must be a positive number (Hz)", ast.unparse(line.value)[:40])
    raise FormatError(str(path), "must have a line sample_rate = …")


def _spikes(path: Path) -> tuple[Integers, Integers]:
    """Sample and cluster of each spike."""
    of = path / "spike_clusters.npy"
    time, cluster = _whole(path / NEEDED[0]), _whole(of if of.is_file() else path / "spike_templates.npy")
    if time.size != cluster.size:
        sizes = f"{time.size} spikes, {cluster.size} clusters"
        raise ShapeError(str(path), "must have a cluster for each spike", sizes)
    if not time.size:
        raise TooFewError(str(path), "must hold at least one spike", 0)
    return time, cluster


def _amplitudes(path: Path, spikes: int) -> Array | None:
    """Amplitude of each spike; None where the folder has none."""
    if not path.is_file():
        return None
    values = _flat(path)
    if values.dtype.kind not in "iuf" or values.shape != (spikes,):
        raise ShapeError(str(path), f"must hold a number for each of {spikes} spikes", f"{values.dtype} {values.shape}")
    return values.astype(float)


def _flat(path: Path) -> NDArray[Any]:
    """Values of a file of NumPy."""
    return np.atleast_1d(np.squeeze(np.asarray(read_npy(path))))


def _whole(path: Path) -> Integers:
    """Whole numbers of a file of NumPy."""
    values = _flat(path)
    wrong = values.ndim != 1 or values.dtype.kind not in "iuf" or not np.all(np.isfinite(values))
    if wrong or np.any((values < 0) | (values > LONGEST * 1e6)) or np.any(values != np.floor(values)):
        rule = "must hold one whole number from 0 for each spike"
        raise TooFewError(str(path), rule, f"{values.dtype} {values.shape}")
    return values.astype(np.int64)


def _labels(path: Path, clusters: Integers) -> tuple[dict[int, str], str]:
    """Group of each cluster, and the file that says so."""
    for name, column in LABELS:
        rows = _rows(path / name, column) if (path / name).is_file() else None
        if rows is not None:
            return {int(one): rows.get(int(one), UNJUDGED) for one in clusters}, name
    return dict.fromkeys((int(one) for one in clusters), UNJUDGED), "no file of labels"


def _rows(path: Path, column: str) -> dict[int, str] | None:
    """Label of each cluster; None where the file has no such column."""
    table = read_table(path, {}, {"cluster_id": PURE, "id": PURE, column: TEXT}, delimiter="\t")
    key = next((name for name in ("cluster_id", "id") if name in table), None)
    if key is None:
        raise FormatError(f"{path}, line 1", f"must name the columns cluster_id and {column}", table.header)
    if column not in table:
        return None
    cluster = table.whole_numbers(key, "must be the number of a cluster", -np.inf)
    return {int(one): label or UNJUDGED for one, label in zip(cluster, table.text(column), strict=True)}
