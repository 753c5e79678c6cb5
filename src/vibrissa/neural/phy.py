"""Sorted units from a folder of phy: whom its user called good, or the groups that are asked for."""

from __future__ import annotations

import ast
import csv
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.files import as_number, text_lines
from vibrissa.neural.spikes import spike_table
from vibrissa.neural.table import LONGEST

if TYPE_CHECKING:
    import xarray as xr

GOOD = ("good",)
QUALITY = {"good": "SU", "mua": "MU"}  # what phy's groups are here; of others nothing is known
LABELS = (("cluster_group.tsv", "group"), ("cluster_info.tsv", "group"), ("cluster_KSLabel.tsv", "KSLabel"))
UNJUDGED = "unsorted"  # phy's own word
NEEDED = ("spike_times.npy", "params.py")


def is_phy(path: str | Path) -> bool:
    """Whether this is a folder of phy."""
    return (Path(path) / NEEDED[0]).is_file()


def read_phy(path: str | Path, *, groups: Collection[str] = GOOD) -> xr.Dataset:
    """Spikes of the clusters of a folder of phy, on the session's clock.

    Parameters
    ----------
    path : path
        Folder with ``spike_times.npy`` [samples], ``spike_clusters.npy`` (or ``spike_templates.npy``), ``params.py``,
        which tells the sampling rate, and ``cluster_group.tsv``: what its user called each cluster. Where no one has
        judged, the sorter's own labels are taken (``cluster_KSLabel.tsv``). ``params.py`` is read, not run.
    groups : collection of str
        Clusters of these groups are units: ``good``, ``mua``, ``noise``, ``unsorted`` or any that the labels have.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.spikes.spike_table`; ``unit_id`` is the cluster, ``unit_quality`` SU for good, MU for
        mua, and is absent where there are others. The attribute ``remark`` tells what is left out, and by whose word.

    Raises
    ------
    InputError
        Names the file: not there, damaged, of other lengths than the others; or no cluster is in these groups.
    """
    path = Path(path)
    for name in NEEDED:
        if not (path / name).is_file():
            raise InputError(str(path / name), "must be an existing file", remedy="is this a folder of phy?")
    rate = _rate(path / "params.py")
    time, cluster = _spikes(path)
    found, told_by = _labels(path, np.unique(cluster))
    chosen = np.array([one for one, group in found.items() if group in groups], int)
    if not chosen.size:
        there = ", ".join(f"{group} ({list(found.values()).count(group)})" for group in sorted(set(found.values())))
        raise InputError(str(path), f"must have clusters in the groups {', '.join(groups)}", None, f"there are {there}")
    kept = np.isin(cluster, chosen)
    quality = [QUALITY.get(found[one], "") for one in chosen.tolist()]
    about: dict[str, Any] = {"unit_quality": np.array(quality)} if all(quality) else {}
    others = len(found) - chosen.size
    remark = f"{chosen.size} clusters are units, {', '.join(groups)} by {told_by}"
    if others:
        remark += f"; {others} clusters with {int((~kept).sum())} spikes are left out"
    return spike_table(
        time[kept] / rate,
        np.searchsorted(chosen, cluster[kept]),
        [str(one) for one in chosen],
        attrs={"source": path.name, "sampling_rate": rate, "remark": remark},
        unit_id=chosen,
        **about,
    )


def _rate(path: Path) -> float:
    """Sampling rate [Hz] from a file of assignments, which is not run."""
    try:
        lines = ast.parse("\n".join(line for _, line in text_lines(path))).body
    except (SyntaxError, ValueError) as error:
        raise InputError(str(path), f"must be lines like sample_rate = 30000.0 ({error.args[0]})") from error
    for line in lines:
        if isinstance(line, ast.Assign) and any(getattr(one, "id", "") == "sample_rate" for one in line.targets):
            rate = as_number(ast.unparse(line.value))
            if 0 < rate < np.inf:
                return rate
            raise InputError(f"{path}, sample_rate", "must be a positive number (Hz)", ast.unparse(line.value)[:40])
    raise InputError(str(path), "must have a line sample_rate = …")


def _spikes(path: Path) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sample and cluster of each spike."""
    of = path / "spike_clusters.npy"
    time, cluster = _whole(path / NEEDED[0]), _whole(of if of.is_file() else path / "spike_templates.npy")
    if time.size != cluster.size:
        raise InputError(
            str(path), "must have a cluster for each spike", f"{time.size} spikes, {cluster.size} clusters"
        )
    if not time.size:
        raise InputError(str(path), "must hold at least one spike", 0)
    return time, cluster


def _whole(path: Path) -> NDArray[np.int64]:
    """Whole numbers of a file of NumPy."""
    if not path.is_file():
        raise InputError(str(path), "must be an existing file")
    try:
        values = np.load(path, allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise InputError(str(path), f"is truncated or damaged ({str(error)[:60]})") from error
    values = np.atleast_1d(np.squeeze(np.asarray(values)))
    wrong = values.ndim != 1 or values.dtype.kind not in "iuf" or not np.all(np.isfinite(values))
    if wrong or np.any((values < 0) | (values > LONGEST * 1e6)) or np.any(values != np.floor(values)):
        raise InputError(
            str(path), "must hold one whole number from 0 for each spike", f"{values.dtype} {values.shape}"
        )
    return values.astype(np.int64)


def _labels(path: Path, clusters: NDArray[np.int64]) -> tuple[dict[int, str], str]:
    """Group of each cluster, and the file that tells."""
    for name, column in LABELS:
        rows = _rows(path / name, column) if (path / name).is_file() else None
        if rows is not None:
            return {int(one): rows.get(int(one), UNJUDGED) for one in clusters}, name
    return dict.fromkeys((int(one) for one in clusters), UNJUDGED), "no file of labels"


def _rows(path: Path, column: str) -> dict[int, str] | None:
    """Label of each cluster; None where the file has no such column."""
    rows = [(number, next(csv.reader([line], delimiter="\t"))) for number, line in text_lines(path)]
    head = [cell.strip() for cell in rows[0][1]] if rows else []
    key = next((name for name in ("cluster_id", "id") if name in head), None)
    if key is None:
        raise InputError(f"{path}, line 1", "must name the columns cluster_id and " + column, "\t".join(head)[:60])
    if column not in head:
        return None
    labels: dict[int, str] = {}
    for number, cells in rows[1:]:
        cluster = as_number(cells[head.index(key)]) if len(cells) == len(head) else np.nan
        if not cluster == np.floor(cluster):
            raise InputError(f"{path}, line {number}", "must hold a cluster and its group", "\t".join(cells)[:60])
        labels[int(cluster)] = cells[head.index(column)].strip() or UNJUDGED
    return labels
