"""What commands print: JSON or tables on stdout, progress on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.backward import Progress


@contextmanager
def progress_bars() -> Iterator[Progress]:
    """Progress bars on stderr, one per stage; none when stderr is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:<26}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, disable=not console.is_terminal) as bars:
        stages: dict[str, Any] = {}

        def tell(stage: str, done: int, total: int) -> None:
            if stage not in stages:
                for task in stages.values():
                    bars.update(task, total=bars.tasks[task].completed or 1, completed=bars.tasks[task].completed or 1)
                stages[stage] = bars.add_task(stage, total=total or None)
            bars.update(stages[stage], completed=done)

        yield tell


@contextmanager
def stoppable(out: Path) -> Iterator[None]:
    """On Ctrl-C, or what a batch system sends when time is up, stop cleanly and say how to go on."""
    import signal

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    except KeyboardInterrupt:
        tell(f"stopped; what is done is kept in {out}, and the same command goes on from there")
        raise
    finally:
        signal.signal(signal.SIGTERM, before)


def show(data: xr.Dataset, names: Sequence[str] | None, json: bool, out: Path | None) -> None:
    """Write the dataset if asked, then print the named variables as JSON or as a table."""
    from vibrissa.files import save

    refuse_out(out)
    if out is not None:
        save(data, out)
    wanted = list(names) if names is not None else [str(name) for name in (*data.coords, *data.data_vars)]
    if json:
        _print_json({name: data[name].values for name in wanted})
    else:
        _print_tables(data, wanted)


def tell(line: str) -> None:
    """Say something on stderr; stdout is for data."""
    print(f"vibrissa: {line}", file=sys.stderr)


def refuse_out(out: Path | None) -> None:
    """Refuse, before any work, a file of results that is not named as a dataset or cannot be written."""
    if out is None:
        return
    if out.suffix != ".nc":
        raise InputError("--out", "must end in .nc, a NetCDF dataset", str(out))
    if not out.absolute().parent.is_dir():
        raise InputError("--out", "must lie in an existing folder", str(out), "make it, or choose another")
    if out.is_dir() or not os.access(out.absolute().parent, os.W_OK):
        raise InputError("--out", "must name a file that can be written", str(out), "choose another")


def _print_json(values: dict[str, Any]) -> None:
    """One JSON object; NaN becomes null, "not measured"."""
    import json

    import numpy as np

    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray | np.generic):
            return plain(value.tolist())
        if isinstance(value, list):
            return [plain(one) for one in value]
        return None if isinstance(value, float) and not np.isfinite(value) else value

    print(json.dumps({name: plain(value) for name, value in values.items()}))


def _print_tables(data: xr.Dataset, names: Sequence[str]) -> None:
    """Scalars one by one, then one table for each dimension."""
    columns: dict[str, list[str]] = {}
    for name in names:
        dims = data[name].dims
        if not dims:
            print(f"{data[name].attrs.get('long_name', name)}: {_cell(data[name].item())} {_unit(data, name)}".rstrip())
        elif len(dims) == 1:
            columns.setdefault(str(dims[0]), []).append(name)
    for dim, group in columns.items():
        heads = [dim, *(f"{name} {_unit(data, name)}".strip() for name in group if name != dim)]
        cells = [data[dim].values if dim in data.coords else range(data.sizes[dim])]
        cells += [data[name].values for name in group if name != dim]
        rows = [heads, *([_cell(value) for value in row] for row in zip(*cells, strict=True))]
        widths = [max(len(row[i]) for row in rows) for i in range(len(heads))]
        print("\n".join("  ".join(c.rjust(w) for c, w in zip(row, widths, strict=True)) for row in rows))


def _unit(data: xr.Dataset, name: str) -> str:
    unit = data[name].attrs.get("units", "1")
    return "" if unit == "1" else f"[{unit}]"


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "–" if value != value else f"{value:.6g}"
    return str(value.item() if hasattr(value, "item") else value) if not isinstance(value, str) else value
